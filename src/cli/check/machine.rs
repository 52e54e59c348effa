//! What `gonio check` says of an instrument.

use crate::cli::list::{apertures, limits};
use crate::error::Error;
use crate::geometry::DirectionPair;
use crate::instrument::{InstrumentSpec, Machine, Tag, footprint};
use crate::report::Columns;
use crate::sampling::{Random, cosine_hemisphere};
use crate::schedule::Unreachable;
use serde::Serialize;
use serde_json::{Map, Value as Json};
use std::f64::consts::PI;

/// Pairs that the reachable share is counted on: it is then good to half a percent.
const PAIRS: u64 = 10_000;

/// Elevations of light and sensor, degrees, at which the spots on the sample are stated.
const SPOTS_DEG: [[f64; 2]; 4] = [[0.0, 0.0], [60.0, 0.0], [0.0, 60.0], [60.0, 60.0]];

/// What is known of an instrument without a config.
#[derive(Serialize)]
pub(super) struct Instrument<'s> {
    instrument: &'s InstrumentSpec,
    class_summary: String,
    spots: Vec<Spots>,
    reach: Vec<Reach>,
    /// How many numbers have which provenance.
    numbers: Map<String, Json>,
}

/// The spots on the sample, long axes, at one pair of elevations.
#[derive(Serialize)]
struct Spots {
    theta_i_deg: f64,
    theta_o_deg: f64,
    lit_mm: f64,
    seen_mm: f64,
    filling: &'static str,
}

/// The share of pairs that is reached, and the share that each reason keeps out.
#[derive(Serialize)]
struct Reach {
    material: &'static str,
    percent: f64,
    kept_out_percent: Vec<(&'static str, f64)>,
}

/// Provenances of numbers.
const PROVENANCES: [(&str, Option<Tag>); 4] = [
    ("published", Some(Tag::Published)),
    ("recalled", Some(Tag::Recalled)),
    ("generic", Some(Tag::Generic)),
    ("without_provenance", None),
];

impl<'s> Instrument<'s> {
    pub(super) fn new(spec: &'s InstrumentSpec, seed: u64) -> Result<Self, Error> {
        let machine = Machine::new(spec).map_err(Error::internal)?;
        let class = machine.class();
        let spots = SPOTS_DEG.into_iter().map(|[theta_i_deg, theta_o_deg]| {
            let [i, o] = [theta_i_deg, theta_o_deg].map(f64::to_radians);
            let spot = footprint(spec, &DirectionPair::from_spherical(i, 0.0, o, PI));
            Spots {
                theta_i_deg,
                theta_o_deg,
                lit_mm: spot.lit_mm,
                seen_mm: spot.seen_mm,
                filling: spot.filling.name(),
            }
        });
        let mut reach = vec![Reach::count(&machine, seed, true)];
        if !class.isotropic_only {
            reach.push(Reach::count(&machine, seed, false));
        }
        let tags = spec.origins().into_iter();
        let tags: Vec<Option<Tag>> = tags
            .map(|(_, entry)| entry.map(|entry| entry.tag))
            .collect();
        let count = |(name, tag): (&str, Option<Tag>)| {
            let count = tags.iter().filter(|&&t| t == tag).count();
            (name.to_owned(), count.into())
        };
        Ok(Self {
            instrument: spec,
            class_summary: class.summary.to_owned(),
            spots: spots.collect(),
            reach,
            numbers: PROVENANCES.map(count).into_iter().collect(),
        })
    }

    pub(super) fn text(&self) -> String {
        let spec = self.instrument;
        let mut out = format!(
            "{}: {}\nclass: {}, {}\n\naxes\n",
            spec.name, spec.about, spec.class, self.class_summary,
        );
        let mut axes =
            Columns::new("  name\ton\t>range °\t>°/s\t>°/s²\t>resolution\t>repeatability\t>bias\t");
        for axis in &spec.axis {
            axes.row(&format!(
                "  {}\t{}\t{} to {}\t{}\t{}\t{}\t{}\t{}\t{}",
                axis.name,
                axis.parent,
                axis.min_deg,
                axis.max_deg,
                axis.speed_deg_per_s,
                axis.acceleration_deg_per_s2,
                axis.resolution_deg,
                axis.repeatability_deg,
                axis.bias_deg,
                if axis.wraps { "wraps" } else { "" },
            ));
        }
        out += &axes.to_string();
        let detector = &spec.detector;
        out += &format!(
            "\n{}\n{}\nexposures: {} from {} s to {} s, {} bits\n",
            apertures(spec),
            limits(spec),
            detector.exposures,
            detector.exposure_min_s,
            detector.exposure_max_s,
            detector.bits,
        );
        out += "\nspots on the sample, long axes\n";
        for spot in &self.spots {
            out += &format!(
                "  theta_i {:>2}°, theta_o {:>2}°  lit {:>5.1} mm, seen {:>5.1} mm: {}\n",
                spot.theta_i_deg, spot.theta_o_deg, spot.lit_mm, spot.seen_mm, spot.filling,
            );
        }
        out += &format!("\nof {PAIRS} cosine-distributed pairs\n");
        for reach in &self.reach {
            out += &format!("  {:<12} reachable {:.2} %", reach.material, reach.percent);
            for (name, percent) in &reach.kept_out_percent {
                out += &format!(", {name} {percent:.2} %");
            }
            out += "\n";
        }
        let numbers = self.numbers.iter();
        let numbers = numbers.map(|(name, n)| format!("{n} {}", name.replace('_', " ")));
        let numbers: Vec<String> = numbers.collect();
        out + &format!("\nnumbers: {}\n", numbers.join(", "))
    }
}

impl Reach {
    fn count(machine: &Machine, seed: u64, turn_freely: bool) -> Self {
        let random = Random::new(seed);
        let mut reached = 0;
        let mut kept_out = [0; Unreachable::NAMES.len()];
        for i in 0..PAIRS {
            let [a, b, c, d] = random.point(i);
            let pair = DirectionPair::new(cosine_hemisphere([a, b]), cosine_hemisphere([c, d]));
            match machine.place(&pair, turn_freely) {
                Ok(_) => reached += 1,
                Err(reason) => {
                    for (name, count) in Unreachable::NAMES.into_iter().zip(&mut kept_out) {
                        *count += u64::from(name == reason.name());
                    }
                }
            }
        }
        let percent = |count: u64| 100.0 * count as f64 / PAIRS as f64;
        let kept_out = Unreachable::NAMES.into_iter().zip(kept_out);
        Self {
            material: match turn_freely {
                true => "isotropic",
                false => "anisotropic",
            },
            percent: percent(reached),
            kept_out_percent: kept_out.map(|(name, n)| (name, percent(n))).collect(),
        }
    }
}
