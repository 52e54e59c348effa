//! Methods and coordinates that readings choose from.

use super::{CrossValidation, Left, Scores};
use crate::geometry::Symmetry;
use crate::measurement::Measurement;
use crate::parametrization::{self, WarpSpec, Warps};
use crate::reconstruct::{
    Coordinates, Cubic, InverseDistance, KRIGED, Kriging, Multilinear, NearestReading, Reconstruct,
    ReconstructError, Sheets, ThinPlate, default_for, noise,
};
use std::sync::Arc;

/// Every parametrization as it is, and with the square root along its first axis.
pub(crate) fn coordinates(symmetry: Symmetry) -> Vec<Coordinates> {
    let mut all = Vec::new();
    for entry in parametrization::all() {
        let first = entry.axes(symmetry)[0].symbol.to_owned();
        for warp in [Warps::new(), Warps::from([(first, WarpSpec::SquareRoot)])] {
            // An axis that is not radial has no root.
            if entry.warped(symmetry, &warp).is_ok() {
                let kind = entry.kind.to_owned();
                all.push(Coordinates { kind, warp });
            }
        }
    }
    all
}

/// The method that readings choose; where there is nothing to choose by, [`default_for`] them.
pub fn chosen(measurement: &Measurement) -> Arc<dyn Reconstruct> {
    let ranked = || {
        let validation = CrossValidation::new(measurement, None).ok()?;
        let ranked = validation.rank(validation.candidates(), || ()).ok()?;
        Some(ranked.into_iter().next()?.0)
    };
    ranked().unwrap_or_else(|| default_for(measurement))
}

/// A method with its errors.
pub type Ranked = (Arc<dyn Reconstruct>, Scores);

impl CrossValidation<'_> {
    /// The methods that these readings choose from: of a grid those in its own coordinates, of sheets
    /// [`Sheets`], [`Kriging`] of no more readings than it takes seconds for, and the scattered ones in every
    /// parametrization.
    pub fn candidates(&self) -> Vec<Arc<dyn Reconstruct>> {
        let schedule = &self.measurement.schedule;
        let symmetry = schedule.parametrization.symmetry();
        let mut all: Vec<Arc<dyn Reconstruct>> = Vec::new();
        if schedule.lattice.is_some() {
            all.push(Arc::new(Cubic::default()));
            all.push(Arc::new(Multilinear::default()));
        }
        let mut scattered: Vec<Arc<dyn Reconstruct>> = vec![
            Arc::new(InverseDistance::default()),
            Arc::new(NearestReading::default()),
        ];
        // Readings without noise are all the same to it.
        let uncertain = noise(self.measurement).is_some_and(|u| u.iter().any(|&u| u > 0.0));
        let both = [false, true];
        for &noise in &both[..1 + usize::from(uncertain)] {
            if matches!(self.left(), Left::Sheets { .. }) && symmetry.isotropic {
                let rest = Sheets::default();
                all.push(Arc::new(Sheets { noise, ..rest }));
            }
            let rest = ThinPlate::default();
            scattered.push(Arc::new(ThinPlate { noise, ..rest }));
        }
        if self.measurement.readings() <= KRIGED {
            all.push(Arc::new(Kriging::default()));
        }
        let coordinates = coordinates(symmetry);
        for method in scattered {
            all.extend(coordinates.iter().filter_map(|c| method.within(c)));
        }
        all
    }

    /// Methods by their first error of [`Errors::QUANTITIES`](crate::metrics::Errors::QUANTITIES) under the
    /// first measure (`nrmse`, `cosine`), the smallest first, but [`Kriging`] if it is within a standard error of that; those that
    /// cannot take the readings are left out. `done` is called after each task.
    ///
    /// # Errors
    /// That of the first method if none can.
    pub fn rank(
        &self,
        methods: Vec<Arc<dyn Reconstruct>>,
        done: impl Fn() + Sync,
    ) -> Result<Vec<Ranked>, ReconstructError> {
        let scores = self.scores(&methods, done);
        let mut refused = None;
        let mut ranked = Vec::new();
        for (method, scores) in methods.into_iter().zip(scores) {
            match scores {
                Ok(scores) => ranked.push((method, scores)),
                Err(e) => refused = refused.or(Some(e)),
            }
        }
        let place = |(_, scores): &Ranked| {
            let error = scores.ranked_by().and_then(|error| error.value);
            error.unwrap_or(f64::INFINITY)
        };
        ranked.sort_by(|a, b| place(a).total_cmp(&place(b)));
        // Readings that are left out lie where readings are, and kriging errs least of all methods between them: it goes before those
        // within a standard error of it.
        let best = ranked.first().and_then(|(_, scores)| {
            let best = scores.ranked_by()?;
            Some(best.value? + best.standard_error?)
        });
        let label = Kriging::default().label();
        let is_kriging = |(method, _): &Ranked| method.label() == label;
        let kriging = ranked.iter().position(is_kriging);
        if let (Some(best), Some(at)) = (best, kriging)
            && place(&ranked[at]) <= best
        {
            ranked[..=at].rotate_right(1);
        }
        match refused {
            Some(e) if ranked.is_empty() => Err(e),
            _ => Ok(ranked),
        }
    }
}
