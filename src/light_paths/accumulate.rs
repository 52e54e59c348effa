//! Paths that are averaged.

use crate::brdf::{
    Brdf, CLASSES, ChannelValues, Channels, LightPath, Presence, Split, SplitErrors,
};
use crate::geometry::{Direction, DirectionPair};
use glam::DVec3;
use rayon::prelude::*;
use smallvec::smallvec;

/// Paths that are averaged: what each of them gave to the classes.
#[derive(Clone, Debug)]
pub(crate) struct Bounces {
    sums: [ChannelValues; CLASSES],
    /// Of the path that is followed.
    path: [ChannelValues; CLASSES],
    /// Means and sums of squared deviations of luminance: of the classes, and of their sum.
    moments: [[f64; 2]; CLASSES + 1],
    paths: usize,
}

impl Bounces {
    /// No paths.
    pub(crate) fn new(channels: usize) -> Self {
        let none = || [(); CLASSES].map(|()| smallvec![0.0; channels]);
        Self {
            sums: none(),
            path: none(),
            moments: [[0.0; 2]; CLASSES + 1],
            paths: 0,
        }
    }

    /// Adds what light of scattering order `bounces` (from 1 on) brings, one value a channel, to the path that is followed.
    #[inline]
    pub(crate) fn add(&mut self, bounces: usize, values: impl Iterator<Item = f64>) {
        let class = &mut self.path[bounces.min(CLASSES) - 1];
        for (sum, value) in class.iter_mut().zip(values) {
            *sum += value;
        }
    }

    /// Ends the path; `luminance` is that of the channels. Returns the luminance of each class and of their sum.
    pub(crate) fn end(&mut self, luminance: impl Fn(&[f64]) -> f64) -> [f64; CLASSES + 1] {
        self.paths += 1;
        let n = self.paths as f64;
        let mut whole = 0.0;
        let mut light = [0.0; CLASSES + 1];
        for class in 0..=CLASSES {
            let value = match self.path.get_mut(class) {
                Some(values) => {
                    let value = luminance(values);
                    for (sum, value) in self.sums[class].iter_mut().zip(values.iter_mut()) {
                        *sum += std::mem::take(value);
                    }
                    whole += value;
                    value
                }
                None => whole,
            };
            // Welford's: squares of values cancel where the mean is large.
            let [mean, square] = &mut self.moments[class];
            let step = value - *mean;
            *mean += step / n;
            *square += step * (value - *mean);
            light[class] = value;
        }
        light
    }

    /// Means and standard errors, of paths in the channels `followed`, for a scene in `channels`; an error of one path is
    /// infinite where it brought light.
    pub(crate) fn split(&self, followed: &Channels, channels: &Channels) -> Split {
        let n = self.paths as f64;
        let error = |[mean, square]: [f64; 2]| match self.paths {
            0 | 1 if mean == 0.0 => 0.0,
            0 | 1 => f64::INFINITY,
            _ => (square / (n * (n - 1.0))).sqrt(),
        };
        Split {
            value: self.sums.each_ref().map(|sums| {
                let mean: ChannelValues = sums.iter().map(|s| s / n.max(1.0)).collect();
                seen(mean, followed, channels)
            }),
            transport: SplitErrors(self.moments.map(error)),
            realisation: SplitErrors::default(),
        }
    }
}

/// Channels in which light is followed where a scene is in `channels`: R, G, B for luminance if something has a colour, since
/// the product of luminances is not the luminance of the product.
pub(super) fn followed(channels: &Channels, distinct: usize) -> Channels {
    match channels {
        Channels::Luminance if distinct > 1 => Channels::Rgb,
        other => other.clone(),
    }
}

/// Values in the channels that light was followed in, for a scene in `channels`.
pub(super) fn seen(
    values: ChannelValues,
    followed: &Channels,
    channels: &Channels,
) -> ChannelValues {
    match channels.count() {
        1 => smallvec![followed.luminance(&values)],
        _ => values,
    }
}

/// The path of light that came from a direction, and left, if it did, along a vector after so many facets.
pub(super) fn left_by(
    omega_i: Direction,
    left: Option<(DVec3, usize)>,
    light: impl FnOnce() -> f64,
) -> Option<LightPath> {
    let (omega_o, order) = left?;
    let omega_o = Direction::try_new(omega_o)?;
    Some(LightPath {
        pair: DirectionPair::new(omega_i, omega_o),
        order,
        light: light(),
    })
}

/// Does work in threads of their own, as many as work here. A thread that waits for parallel work takes up other work, which may
/// wait for what is being done; this one only waits.
/// Panics if there can be no threads.
#[cfg(feature = "surfaces")]
pub(super) fn apart<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    let threads = rayon::current_num_threads();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.expect("threads that follow light");
    std::thread::scope(|scope| {
        let done = scope.spawn(|| pool.install(work)).join();
        done.unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}

/// Values of many pairs, in parallel: each takes the time of thousands of formulas.
pub(super) fn batch(
    brdf: &dyn Brdf,
    pairs: &[DirectionPair],
    out: &mut [f64],
    presence: &mut [Presence],
) {
    let n = brdf.channels().count();
    let places = out.par_chunks_mut(n).zip(presence);
    let places = pairs.par_iter().zip(places);
    places.for_each(|(pair, (out, presence))| *presence = brdf.eval(pair, out));
}
