//! One row of results: plain data, the same columns in every file format.

use super::choices::{Allowance, Choice};
use super::key::RowKey;
use super::record::Record;
use crate::metrics::{
    AlbedoProbe, Errors, Expected, Judged, Quantity, TruthErrors, Uncovered, WITHIN, quantities,
};
use crate::moments::MomentErrors;
use serde::ser::SerializeMap;
use serde::{Deserialize, Serialize, Serializer};
use std::collections::BTreeMap;
use std::sync::OnceLock;

/// Declares the plain columns of a row: their names, types and what they mean, once.
macro_rules! row {
    (
        $( $( #[doc = $before:literal] )+ $head:ident: $head_type:ty, )+
        quantities,
        $( $( #[doc = $after:literal] )+ $tail:ident: $tail_type:ty, )+
        times,
        $( $( #[doc = $spent:literal] )+ $time:ident, )+
    ) => {
        /// The comparison of one reconstruction with the truth under one measure.
        ///
        /// The columns of `results.csv` and the keys of `results.jsonl`, but for the wall times.
        #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
        pub struct Row {
            $( $( #[doc = $before] )+ pub $head: $head_type, )+
            /// The numbers the reconstruction is judged by, see [`quantities`].
            #[serde(flatten)]
            pub quantities: Quantities,
            $( $( #[doc = $after] )+ pub $tail: $tail_type, )+
            $( $( #[doc = $spent] )+ pub $time: Option<f64>, )+
        }

        impl Row {
            /// The row without its wall times, which differ between two runs of one config.
            pub fn timeless(mut self) -> Self {
                $( self.$time = None; )+
                self
            }
        }

        const HEAD: &[(&str, &str)] = &[$( (stringify!($head), concat!($( $before ),+).trim_ascii()) ),+];
        const TAIL: &[(&str, &str)] = &[$( (stringify!($tail), concat!($( $after ),+).trim_ascii()) ),+];
        const SPENT: &[(&str, &str)] = &[$( (stringify!($time), concat!($( $spent ),+).trim_ascii()) ),+];
        const TIMES: &[&str] = &[$( stringify!($time) ),+];
    };
}

row! {
    /// hash of everything that determines the row
    key: RowKey,
    /// name of the material
    material: String,
    /// hash of what it is: its keys and the bytes of its files
    material_key: RowKey,
    /// what the truth favours: theta_h or h_bar, if q is below or above one half by two standard errors, else between, each
    /// with `table` of a table over half/difference coordinates; without a lobe what its formula favours: theta_h, h_bar, neither,
    /// half-difference table; and spherical table, reconstruction, anisotropic
    truth: String,
    /// measured alignment q of the lobe, whose width in theta_h goes as (cos theta_d)^-q: 0 is
    /// theta_h, 1 is |h_bar|; empty without a lobe
    alignment: Option<f64>,
    /// coordinates the sample set is uniform in; none: it depends on none
    parametrization: String,
    /// their warps, `axis:warp` joined by `;`, or `none`
    warp: String,
    /// name of the sample set
    sample_set: String,
    /// name of the reconstruction
    reconstruction: String,
    /// coordinates it works in; own: those of the sample set; default: those of a method that does not depend on the sample set's and was
    /// given none
    coordinates: String,
    /// name of the instrument; ideal has no flaws
    instrument: String,
    /// distinct configurations that were allowed, or found for the readings or minutes that were
    budget: usize,
    /// what the schedule was allowed: N poses (the budget itself), N readings or M minutes
    allowed: String,
    /// poses that have a reading
    readings: usize,
    /// seed of the sample set
    seed: u64,
    /// distribution of the test pairs
    measure: String,
    quantities,
    /// configurations visited
    poses: usize,
    /// poses where the material has no data
    no_data: usize,
    /// share of the poses the instrument can take
    reachable: f64,
    /// why it cannot take the others, `reason:count` joined by `;`
    unreachable: String,
    /// readings at full scale: lower bounds
    saturated: usize,
    /// readings below their noise (k = 2)
    below_noise: usize,
    /// stops of the instrument at which these readings are taken: as many as poses it reaches, or fewer of one that takes
    /// pictures; the ideal one has none
    stops: Option<usize>,
    /// time the instrument takes for the schedule: moves, settling, exposures, overhead,
    /// calibrations; the ideal one takes none
    instrument_seconds: Option<f64>,
    /// share of the points of the box that are no physical configuration
    unphysical_share: f64,
    /// test pairs compared, of all measures together
    pairs: usize,
    /// true if every standard error is below `tolerance` of its average; else `max_pairs` was reached
    converged: bool,
    /// test pairs left out because the truth has no data there
    pairs_missing: usize,
    /// test pairs left out because the reconstruction has no value there
    pairs_unreconstructed: usize,
    times,
    /// wall time to make the schedule and, for an instrument, its way through it; made once and
    /// shared by the rows that use it
    plan_seconds,
    /// wall time to measure the material; shared by the reconstructions of a measurement
    measure_seconds,
    /// wall time to reconstruct all materials that share the schedule, over their number; shared by
    /// the measures
    reconstruct_seconds,
    /// wall time to evaluate them at the pairs, over their number, and that of the albedo;
    /// shared by the measures
    evaluate_seconds,
    /// the least these four came to within the run: planning, measuring and reconstructing six times
    /// (`output.repeat_seconds`), evaluating in parts; another run may differ by more; empty if more than a tenth was timed once
    low_seconds,
    /// the most they came to
    high_seconds,
    /// wall time to integrate the moments of the reconstruction; shared by the measures
    moment_seconds,
}

/// Parts of errors that unreachable poses cause: the error less that on the same instrument without limits.
pub(super) const HOLES: [Judged<Errors>; 2] = quantities! {
    "hole_nrmse": nrmse,
        "nrmse less that of the same schedule on the same instrument without limits; 0 if every pose is reachable, empty if it was not asked for";
    "hole_log_relative": log_relative, "the same of log_relative";
};

/// Every number a reconstruction is judged by, in the order of columns.
pub fn quantities() -> &'static [Quantity] {
    static ALL: OnceLock<Vec<Quantity>> = OnceLock::new();
    ALL.get_or_init(|| {
        let mut all: Vec<Quantity> = Vec::new();
        all.extend(Errors::QUANTITIES.map(|(q, _)| q));
        all.extend(Errors::STANDARD_ERRORS.map(|(q, _)| q));
        all.extend(TruthErrors::QUANTITIES.map(|(q, _)| q));
        all.extend(Uncovered::QUANTITIES.map(|(q, _)| q));
        all.push(WITHIN);
        all.extend(Expected::QUANTITIES.map(|(q, _)| q));
        all.extend([AlbedoProbe::QUANTITY, AlbedoProbe::QUADRATURE]);
        let of_moments = MomentErrors::QUANTITIES.as_flattened();
        all.extend(of_moments.iter().map(|(q, _)| *q));
        all.push(MomentErrors::UNRESOLVED);
        all.extend(HOLES.map(|(q, _)| q));
        all
    })
}

/// Values of the [`quantities`], in their order; `None` where one is not defined or not asked for.
#[derive(Clone, Debug, Deserialize)]
#[serde(try_from = "BTreeMap<String, Option<f64>>")]
pub struct Quantities(
    /// NaN in place of `None`: a run holds all its rows.
    Box<[f64]>,
);

impl Default for Quantities {
    fn default() -> Self {
        Self(vec![f64::NAN; quantities().len()].into())
    }
}

impl PartialEq for Quantities {
    fn eq(&self, other: &Self) -> bool {
        self.values().eq(other.values())
    }
}

impl Quantities {
    /// The value of the quantity of this name; `None` if there is none.
    pub fn get(&self, name: &str) -> Option<f64> {
        self.values().nth(place(name)?)?
    }

    fn values(&self) -> impl Iterator<Item = Option<f64>> {
        self.0.iter().map(|x| Some(*x).filter(|x| !x.is_nan()))
    }

    /// Sets some of the [`quantities`] to those of what is judged, if there is any.
    pub(super) fn set_all<T>(&mut self, judged: &[Judged<T>], of: Option<&T>) {
        for (quantity, value) in judged {
            self.set(quantity.name, of.and_then(value));
        }
    }

    /// Sets the value of one of the [`quantities`].
    pub fn set(&mut self, name: &str, value: Option<f64>) {
        let place = place(name);
        debug_assert!(place.is_some(), "{name} is no quantity");
        if let Some(place) = place {
            self.0[place] = value.unwrap_or(f64::NAN);
        }
    }
}

fn place(name: &str) -> Option<usize> {
    quantities().iter().position(|q| q.name == name)
}

impl Serialize for Quantities {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        for (quantity, value) in quantities().iter().zip(self.values()) {
            match value {
                Some(n) if quantity.is_count => map.serialize_entry(quantity.name, &(n as u64))?,
                value => map.serialize_entry(quantity.name, &value)?,
            }
        }
        map.end()
    }
}

impl TryFrom<BTreeMap<String, Option<f64>>> for Quantities {
    type Error = String;

    fn try_from(columns: BTreeMap<String, Option<f64>>) -> Result<Self, String> {
        let mut values = Self::default();
        for (name, value) in columns {
            // What is no column of its own arrives here: a row of another version.
            let place = place(&name).ok_or_else(|| format!("unknown column `{name}`"))?;
            values.0[place] = value.unwrap_or(f64::NAN);
        }
        Ok(values)
    }
}

impl Row {
    /// The columns, in order, and what they mean; without the wall times, which `timings.jsonl` has.
    pub fn columns() -> impl Iterator<Item = (&'static str, &'static str)> {
        let judged = quantities().iter().map(|q| (q.name, q.summary));
        let head = HEAD.iter().copied();
        head.chain(judged).chain(TAIL.iter().copied())
    }

    /// The wall times by name, and what they mean.
    pub fn times() -> impl Iterator<Item = (&'static str, &'static str)> {
        SPENT.iter().copied()
    }

    /// The value of a quantity by its name; `None` where it is not defined.
    pub fn value(&self, quantity: &str) -> Option<f64> {
        self.quantities.get(quantity)
    }

    /// Sampling and reconstruction of the row: all but material, measure, allowance and seed.
    pub fn choice(&self) -> Choice {
        Choice {
            parametrization: self.parametrization.clone(),
            warp: self.warp.clone(),
            sample_set: self.sample_set.clone(),
            instrument: self.instrument.clone(),
            reconstruction: self.reconstruction.clone(),
            coordinates: self.coordinates.clone(),
        }
    }

    /// Its readings, where a number of poses or readings was allowed; `None` where time was.
    pub(super) fn counted_readings(&self) -> Option<f64> {
        (!Allowance::is_time(&self.allowed)).then_some(self.readings as f64)
    }

    /// The range of [`seconds`](Self::seconds) within the run; `None` where it is not known.
    pub(crate) fn seconds_range(&self) -> Option<[f64; 2]> {
        Some([self.low_seconds?, self.high_seconds?])
    }

    /// Seconds of computing behind this row, were it the only one; `None` if the timings of the run are lost.
    pub(crate) fn seconds(&self) -> Option<f64> {
        let measured = self.plan_seconds? + self.measure_seconds?;
        Some(measured + self.reconstruct_seconds? + self.evaluate_seconds?)
    }
}

impl Record for Row {
    const FILE: &'static str = "results.jsonl";
    const TIMES: &'static [&'static str] = TIMES;

    fn key(&self) -> &str {
        &self.key
    }

    fn material(&self) -> (&str, &str) {
        (&self.material, &self.material_key)
    }

    fn label(&self) -> String {
        let choice = self.choice();
        choice.label(&self.allowed, self.seed, &self.measure)
    }
}
