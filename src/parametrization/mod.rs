//! Coordinates of a pair of directions: forward, inverse, domain, Jacobian.
//!
//! Each file holds one [`Chart`]: the bare formulas of one parametrization in its four
//! coordinates (radial, azimuth, radial, azimuth). [`Form`] turns a chart into the
//! [`Parametrization`] of a BRDF with given symmetries: the 4-D form, or the 3-D form of isotropic
//! materials, its domain folded so that one configuration has one set of coordinates.
//! [`Warped`] bends any axis of any of them.
//!
//! A parametrization that is no polar chart implements [`Parametrization`] itself, or, slower, gives its two maps and its domain
//! alone as [`Maps`]. Each kind is one file and one line in [`all`].

pub mod by_name;
mod chart;
mod edwards;
mod form;
mod half_difference;
mod hybrid;
mod mapped;
mod orthographic;
mod spec;
mod spherical;
mod stark;
mod usual;
mod view_centered;
mod warp;
mod warped;

pub use chart::{Azimuth, Chart, Radial};
pub use edwards::Edwards;
pub use form::Form;
pub(crate) use half_difference::Frame;
pub use half_difference::HalfDifference;
pub use hybrid::Hybrid;
pub use mapped::{Mapped, Maps, mapped_entry};
pub use orthographic::Orthographic;
pub use spec::{ParametrizationKind, ParametrizationSpec, entry};
pub use spherical::Spherical;
pub use stark::Stark;
pub use usual::usual_form;
pub use view_centered::{VIEW_CENTERED_AREA, view_centered, view_centered_angles};
pub use warp::{Warp, WarpSpec, Warps, warps};
pub use warped::Warped;

use crate::geometry::{DirectionPair, Symmetry};
use crate::registry::{Entry, family};
use smallvec::SmallVec;

/// Coordinates of a pair: the first `axes().len()` entries count, the rest are 0.
pub type Coords = [f64; 4];

/// Coordinates that name one configuration: no symmetry has more than eight.
pub type Images = SmallVec<[Coords; 8]>;

/// Unit of a coordinate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Radians inside, degrees in files (columns end in `_deg`).
    Radian,
    /// A length or squared length of a projected vector, or a warped coordinate; no unit.
    One,
}

/// Kind of a coordinate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AxisKind {
    /// 0 at a pole, where the azimuths that belong to it are undefined.
    Radial,
    /// An azimuth whose two ends are the same place.
    Periodic,
    /// An azimuth folded by a mirror at both ends.
    Mirrored,
    /// A component: no azimuth, and no pole at 0.
    Straight,
}

/// What a coordinate measures, which decides the warps it can have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// The elevation of the half vector, which the rows of a MERL table are of.
    HalfAngle,
    /// Another elevation, or an angle between directions, in [0, π/2].
    Angle,
    /// A length in [0, 1]: the sine of an angle.
    Length,
    /// Anything else.
    Other,
}

/// How coordinates lie in the space in which scattered readings look for their neighbours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Layout {
    /// Radial coordinates and azimuths, in polar coordinates: 3-D (r1, r2 cos a, r2 sin a), 4-D
    /// (r1 cos a1, r1 sin a1, r2 cos a2, r2 sin a2).
    Polar,
    /// Polar coordinates as [`Layout::Polar`], with a1 + a2 in place of a2, which turns with a1: where r1 vanishes only that sum has a
    /// meaning.
    Nested,
    /// As they are.
    Straight,
}

/// What holds all over the domain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facts {
    /// How coordinates lie in space.
    pub layout: Layout,
    /// True if exchanging light and sensor exchanges coordinates; the box then holds both orders.
    pub exchange: bool,
    /// Largest errors (rad) of pair → coordinates → pair: where both cosines exceed 1e-3, and
    /// anywhere.
    pub round_trip: [f64; 2],
    /// True if the Jacobian is infinite where a direction is on the horizon.
    pub singular: bool,
    /// True if radial coordinates are squares of lengths: the Jacobian does not vanish at the
    /// poles, and a step of s from a pole moves a direction by sqrt(s).
    pub squared: bool,
}

/// A coordinate axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    /// The field's symbol, e.g. `theta_h`; part of file columns.
    pub symbol: &'static str,
    /// The symbol as it is printed, e.g. `θ_h`.
    pub label: &'static str,
    /// Unit of the values.
    pub unit: Unit,
    /// Smallest and largest value.
    pub range: [f64; 2],
    /// Its kind.
    pub kind: AxisKind,
    /// What it measures.
    pub quantity: Quantity,
    /// True if the mirror direction, where lobes peak, sits at the start of this axis.
    pub peak_at_start: bool,
    /// Default number of a grid's nodes along this axis, relative to the other axes.
    pub density: f64,
    /// The warp that bends it, if any; `symbol` stays that of the plain axis.
    pub warp: Option<WarpSpec>,
}

impl Axis {
    /// An axis of numbers without a unit that is no azimuth and has no pole.
    pub fn straight(symbol: &'static str, label: &'static str, range: [f64; 2]) -> Self {
        Self {
            symbol,
            label,
            unit: Unit::One,
            range,
            kind: AxisKind::Straight,
            quantity: Quantity::Other,
            peak_at_start: false,
            density: 1.0,
            warp: None,
        }
    }

    /// Column of result files, the unit in its name: `theta_h_deg`, `k`, `theta_h_square_root`.
    pub fn column(&self) -> String {
        match (self.warp, self.unit) {
            (None, Unit::Radian) => format!("{}_deg", self.symbol),
            (None, Unit::One) => self.symbol.to_owned(),
            (Some(w), unit) => {
                // What its keys are stands in headers, so that the columns can be listed.
                let name = w.kind().replace('-', "_");
                let deg = if unit == Unit::Radian { "_deg" } else { "" };
                format!("{}_{name}{deg}", self.symbol)
            }
        }
    }

    /// A value as files show it: degrees for angles.
    pub fn file_value(&self, value: f64) -> f64 {
        match self.unit {
            Unit::Radian => value.to_degrees(),
            Unit::One => value,
        }
    }

    /// Length of the range.
    pub fn length(&self) -> f64 {
        self.range[1] - self.range[0]
    }
}

/// A change of variables between pairs of directions and coordinates.
pub trait Parametrization: Send + Sync {
    /// Name in configs and result files, e.g. `half-difference`.
    fn name(&self) -> &'static str;

    /// The axes, 3 (isotropic) or 4 of them.
    fn axes(&self) -> &[Axis];

    /// The symmetries that fold the domain.
    fn symmetry(&self) -> Symmetry;

    /// Coordinates of a pair above the horizon, inside the ranges of [`axes`](Self::axes); where
    /// a coordinate is undefined it is 0, so that the same pair always has the same coordinates.
    fn forward(&self, pair: &DirectionPair) -> Coords;

    /// The pair at `coords`: `None` if a radial coordinate is out of range, a direction lies below
    /// the horizon, or a coordinate is NaN. Azimuths may have any finite value.
    fn inverse(&self, coords: &Coords) -> Option<DirectionPair>;

    /// The representative, in the box of [`axes`](Self::axes), of the configuration at `coords`,
    /// which may lie outside it: beyond a pole (negative radial coordinates, with azimuths turned
    /// by π) or beyond the ends of an azimuth. Two coordinates name one configuration, up to the
    /// declared symmetries, exactly if their representatives agree. `None` past the far end of a
    /// radial axis. The box itself, not the physical domain, is what counts.
    fn canonical(&self, coords: &Coords) -> Option<Coords>;

    /// d omega_i d omega_o = J · d(coords of the 4-D form), in steradians². The 3-D form has the
    /// same J, at any value of the azimuth that isotropy drops; multiply by its 2π, and by the
    /// number of folded copies, to integrate.
    fn jacobian(&self, coords: &Coords) -> f64;

    /// [`forward`](Self::forward) for many pairs: one virtual call per batch.
    fn forward_batch(&self, pairs: &[DirectionPair], out: &mut [Coords]) {
        debug_assert_eq!(pairs.len(), out.len());
        for (pair, out) in pairs.iter().zip(out) {
            *out = self.forward(pair);
        }
    }

    /// [`inverse`](Self::inverse) of many coordinates: one virtual call per batch.
    fn inverse_batch(&self, coords: &[Coords], out: &mut [Option<DirectionPair>]) {
        debug_assert_eq!(coords.len(), out.len());
        for (coords, out) in coords.iter().zip(out) {
            *out = self.inverse(coords);
        }
    }

    /// Names of the warps: `none`, or e.g. `theta_h:square-root`.
    fn warp_name(&self) -> String {
        "none".into()
    }

    /// What holds all over the domain.
    fn facts(&self) -> Facts;

    /// Labels for planes of the first two axes of a 3-D form: of the coordinate in which planes
    /// differ, and of the azimuth of the sample, which is 0.
    fn plane_labels(&self) -> [&'static str; 2] {
        [self.axes()[2].label, "φ"]
    }

    /// All coordinates that name the configuration of `coords` under the declared symmetries, with
    /// radial coordinates ≥ 0, `coords` first.
    fn images(&self, coords: &Coords) -> Images;
}

/// A warp was asked for on an axis that cannot have it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("warp.{axis}: {problem}")]
pub struct WarpError {
    /// The axis symbol as written.
    pub axis: String,
    /// The error, with the allowed values.
    #[source]
    pub problem: WarpProblem,
}

/// Reason why an axis cannot have a warp.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum WarpProblem {
    /// It is no radial axis.
    #[error("only radial axes are warped")]
    NotRadial,
    /// The rows of a MERL table are those of one axis.
    #[error("the merl warp is defined for theta_h only")]
    NotThetaH,
    /// An arcsine is that of a length or of a share of a right angle.
    #[error("the arcsine warp is defined for lengths and angles, not for their squares")]
    NoArcsine,
    /// There is no such axis.
    #[error("no axis of {parametrization}; allowed: {axes}")]
    NoAxis {
        /// The parametrization.
        parametrization: &'static str,
        /// Its axes.
        axes: String,
    },
}

family! {
    /// [`entry`] makes one of its type.
    "parametrization": ParametrizationSpec = [
        spherical::ENTRY,
        half_difference::ENTRY,
        orthographic::ENTRY,
        hybrid::ENTRY,
        stark::ENTRY,
        edwards::ENTRY,
    ]
}

/// Finds a member of [`all`] by name.
pub fn find(name: &str) -> Option<Entry<ParametrizationSpec>> {
    all().into_iter().find(|e| e.kind == name)
}
