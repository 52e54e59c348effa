//! Materials that are reconstructed together: the neighbours of a pair and their weights depend on
//! the poses alone.

use super::observer::{GoOn, Stop};
use crate::brdf::{Brdf, Channels, SplitBrdf};
use crate::geometry::DirectionPair;
use crate::measurement::Measurement;
use crate::metrics::{self, Values};
use crate::reconstruct::{Interpolant, Readings, Reconstruct, ReconstructError, noise, present};
use rayon::prelude::*;

/// Pairs between two checks for cancellation, a fraction of a second of the slowest reconstruction: a multiple of [`BATCH`].
const SLAB: usize = 1 << 14;

/// Pairs between two checks of a BRDF each of whose values takes paths of its own, milliseconds.
const SLOW_SLAB: usize = 1 << 9;

/// Pairs that an interpolant is given at a time: their values stay in a core's own cache.
const BATCH: usize = 256;

/// Reconstructions of several materials from readings at the same poses.
pub(super) struct MaterialBatch {
    /// One of all materials, or one of each.
    interpolants: Vec<Box<dyn Interpolant>>,
    channels: Channels,
}

impl MaterialBatch {
    /// Reconstructs measurements of one schedule with readings at the same poses.
    pub(crate) fn new(
        method: &dyn Reconstruct,
        measurements: &[&Measurement],
    ) -> Result<Self, ReconstructError> {
        let first = measurements[0];
        let count = first.channels.count();
        let present = present(first);
        let of = |measurements: &[&Measurement], noise: Option<&[f64]>| {
            method.interpolate(&Readings {
                schedule: &first.schedule,
                width: measurements.len() * count,
                values: &interleaved(measurements, count),
                present: &present,
                noise,
                half_angles_deg: first.half_angles_deg,
            })
        };
        let interpolants = if method.weighs_readings() {
            let alone = |m: &&Measurement| of(&[m], noise(m).as_deref());
            measurements
                .par_iter()
                .map(alone)
                .collect::<Result<_, _>>()?
        } else {
            vec![of(measurements, None)?]
        };
        Ok(Self {
            interpolants,
            channels: first.channels.clone(),
        })
    }

    pub(crate) fn interpolants(&self) -> usize {
        self.interpolants.len()
    }

    /// Luminance at some pairs, sr⁻¹, one list per material; an error if the run was cancelled.
    pub(crate) fn evaluate(
        &self,
        pairs: &[DirectionPair],
        go_on: GoOn<'_>,
    ) -> Result<Vec<Values>, Stop> {
        let mut of_materials = Vec::new();
        for interpolant in &self.interpolants {
            let (width, count) = (interpolant.width(), self.channels.count());
            let materials = width / count;
            let mut luminance = vec![Vec::with_capacity(pairs.len()); materials];
            // Of some pairs: material after material.
            let sorted = |values: &mut Vec<f64>, pairs: &[DirectionPair]| {
                values.clear();
                values.resize(pairs.len() * width, 0.0);
                interpolant.eval_batch(pairs, values);
                let of = |i: usize| {
                    let all = values.chunks_exact(width);
                    all.map(move |all| self.channels.luminance(&all[i * count..(i + 1) * count]))
                };
                (0..materials).flat_map(of).collect::<Vec<f64>>()
            };
            for pairs in pairs.chunks(SLAB) {
                go_on()?;
                let parts = pairs.par_chunks(BATCH).map_init(Vec::new, sorted);
                let parts: Vec<Vec<f64>> = parts.collect();
                let all = luminance.par_iter_mut().enumerate();
                all.for_each(|(i, all)| {
                    for part in &parts {
                        let n = part.len() / materials;
                        all.extend_from_slice(&part[i * n..(i + 1) * n]);
                    }
                });
            }
            of_materials.extend(luminance.into_iter().map(Values::from));
        }
        Ok(of_materials)
    }
}

/// Luminance of a BRDF at some pairs, sr⁻¹; an error if the run was cancelled.
pub(super) fn evaluate(
    brdf: &dyn Brdf,
    pairs: &[DirectionPair],
    go_on: GoOn<'_>,
) -> Result<Values, Stop> {
    let mut values = Values::default();
    let slow = brdf.as_split().is_some_and(SplitBrdf::follows_pairs);
    for slab in pairs.chunks(if slow { SLOW_SLAB } else { SLAB }) {
        go_on()?;
        values.append(metrics::evaluate(brdf, slab));
    }
    Ok(values)
}

/// Values in the order pose, material, value (`count` per pose and material).
fn interleaved(measurements: &[&Measurement], count: usize) -> Vec<f64> {
    let width = measurements.len() * count;
    let poses = measurements[0].values.len() / count;
    let mut all = vec![0.0; width * poses];
    for (i, measurement) in measurements.iter().enumerate() {
        let places = all.chunks_exact_mut(width);
        for (out, values) in places.zip(measurement.values.chunks_exact(count)) {
            out[i * count..(i + 1) * count].copy_from_slice(values);
        }
    }
    all
}
