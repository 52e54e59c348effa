//! The kernel that is fitted to readings, and those that all others contradict under it.
//!
//! The search is most of the work of kriging, and one set of readings is looked at several times: for what contradicts it, by cross-validation, for the BRDF,
//! and for its errors. So the results of the last searches are kept, by a hash of all that they depend on.

use super::kernel::Kernel;
use super::{Kriging, MOST_COMPARED, Solver, TRUSTED, fit, in_values, outliers, without};
use crate::measurement::Measurement;
use crate::reconstruct::Suspect;
use crate::reconstruct::interpolant::{Readings, noise, present};
use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};

/// The kernel fitted to all readings but the outliers, and the outliers: readings that contradict all others under it.
pub(super) type Common = (Kernel, Vec<outliers::Suspect>);

/// Searches whose results are kept.
const KEPT: usize = 16;

/// The last searches, the latest first.
static SEARCHES: Mutex<VecDeque<(blake3::Hash, Common)>> = Mutex::new(VecDeque::new());

/// Forgets the searches of kriging, so that the next one takes its time.
pub fn forget_searches() {
    SEARCHES
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .clear();
}

impl Solver<'_> {
    /// What readings have in common.
    pub(super) fn common(&self, r: &Readings<'_>) -> Common {
        let key = self.key(r);
        let searches = || SEARCHES.lock().unwrap_or_else(PoisonError::into_inner);
        let known = searches().iter().find(|(other, _)| *other == key).cloned();
        if let Some((_, common)) = known {
            return common;
        }
        let common = self.search(r);
        let mut searches = searches();
        searches.push_front((key, common.clone()));
        searches.truncate(KEPT);
        common
    }

    /// A hash of the keys, the coordinates, the symmetries and the readings that count.
    fn key(&self, r: &Readings<'_>) -> blake3::Hash {
        let mut hasher = blake3::Hasher::new();
        let keys = &self.keys;
        let words = format!(
            "{} {} {} {:?} {:?} {}",
            keys.fit,
            keys.noise,
            keys.robust,
            keys.coordinates,
            r.schedule.parametrization.symmetry(),
            r.width
        );
        hasher.update(words.as_bytes());
        let mut add = |x: f64| _ = hasher.update(&x.to_bits().to_le_bytes());
        for i in (0..r.present.len()).filter(|&i| r.present[i]) {
            // Suspects have the number of their pose.
            add(i as f64);
            let directions = r.schedule.poses[i].pair.vectors();
            directions
                .into_iter()
                .for_each(|d| d.to_array().into_iter().for_each(&mut add));
            let of = i * r.width..(i + 1) * r.width;
            r.values[of.clone()].iter().copied().for_each(&mut add);
            let noise = r.noise.map(|u| &u[of]);
            noise.into_iter().flatten().copied().for_each(&mut add);
        }
        hasher.finalize()
    }

    fn search(&self, r: &Readings<'_>) -> Common {
        if !self.keys.robust || !(TRUSTED + 1..=MOST_COMPARED).contains(&r.count()) {
            return (self.fitted(r), Vec::new());
        }
        let all = self.data(r, MOST_COMPARED, r.width, None);
        let rows = self.chosen(r, MOST_COMPARED);
        let suspects = |kernel: &Kernel| {
            let data = all.clone().noisier(kernel.unsaid);
            let mut found = outliers::suspects(&data, kernel).unwrap_or_default();
            found.iter_mut().for_each(|s| s.row = rows[s.row]);
            found
        };
        let fitted = |suspects: &[outliers::Suspect]| {
            let present = without(r, suspects);
            self.fitted(&Readings {
                present: &present,
                ..*r
            })
        };
        // A kernel that is fitted to faults explains them.
        let published = Kernel {
            unsaid: if self.unsaid(r) { fit::UNSAID } else { 0.0 },
            ..self.space.kernel()
        };
        let first = suspects(&published);
        let kernel = fitted(&first);
        let found = suspects(&kernel);
        let rows = |all: &[outliers::Suspect]| all.iter().map(|s| s.row).collect::<Vec<_>>();
        match rows(&found) == rows(&first) {
            true => (kernel, found),
            false => (fitted(&found), found),
        }
    }
}

/// The readings of a measurement that all others contradict, in the order of the schedule; none of fewer than 33 or more than 2000.
pub fn suspects(measurement: &Measurement) -> Vec<Suspect> {
    if !(TRUSTED + 1..=MOST_COMPARED).contains(&measurement.readings()) {
        return Vec::new();
    }
    let (present, noise) = (present(measurement), noise(measurement));
    let all = Readings::new(measurement, &present, noise.as_deref());
    let kriging = Kriging::default();
    let Ok(solver) = kriging.solver(measurement.schedule.parametrization.symmetry()) else {
        return Vec::new();
    };
    let (_, suspects) = solver.common(&all);
    let channels = &measurement.channels;
    let values = measurement.values.chunks(channels.count());
    let values: Vec<f64> = values.map(|values| channels.luminance(values)).collect();
    let luminance = Readings {
        width: 1,
        values: &values,
        ..all
    };
    in_values(&luminance, &suspects)
}
