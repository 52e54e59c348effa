//! Coordinates of a pair of directions: forward, inverse, domain, Jacobian.
//!
//! Each file holds one [`Chart`]: the bare formulas of one parametrization in its four
//! coordinates (radial, azimuth, radial, azimuth). [`Form`] turns a chart into the
//! [`Parametrization`] of a BRDF with given symmetries: the 4-D form, or the 3-D form of isotropic
//! materials, its domain folded so that one configuration has one set of coordinates.
//! [`Warped`] bends any axis of any of them.

mod chart;
mod form;
mod half_difference;
mod hybrid;
mod orthographic;
mod spherical;
mod stark;
mod view_centered;
mod warped;

pub use chart::Chart;
pub use form::Form;
pub use half_difference::HalfDifference;
pub use hybrid::Hybrid;
pub use orthographic::Orthographic;
pub use spherical::Spherical;
pub use stark::Stark;
pub use view_centered::{VIEW_CENTERED_AREA, view_centered, view_centered_angles};
pub use warped::{Warp, WarpName, Warped};

use crate::geometry::{DirectionPair, Symmetry};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Coordinates of a pair: the first `axes().len()` entries count, the rest are 0.
pub type Coords = [f64; 4];

/// What a coordinate is measured in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// Radians inside, degrees in files (columns end in `_deg`).
    Radian,
    /// A length or squared length of a projected vector, or a warped coordinate; no unit.
    One,
}

/// The part a coordinate plays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AxisKind {
    /// 0 at a pole, where the azimuths that belong to it are undefined.
    Radial,
    /// An azimuth whose two ends are the same place.
    Periodic,
    /// An azimuth folded by a mirror at both ends.
    Mirrored,
}

/// One coordinate axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    /// The field's symbol, e.g. `theta_h`; part of file columns.
    pub symbol: &'static str,
    /// Unit of the values.
    pub unit: Unit,
    /// Smallest and largest value.
    pub range: [f64; 2],
    /// The part it plays.
    pub kind: AxisKind,
    /// True if the mirror direction, where lobes peak, sits at the start of this axis.
    pub peak_at_start: bool,
    /// Nodes a grid puts along this axis relative to the others, if it is not told.
    pub density: f64,
    /// The warp that bends it, if any; `symbol` stays that of the plain axis.
    pub warp: Option<WarpName>,
}

impl Axis {
    /// Column of result files, the unit in its name: `theta_h_deg`, `k`, `theta_h_square_root`.
    pub fn column(&self) -> String {
        match (self.warp, self.unit) {
            (None, Unit::Radian) => format!("{}_deg", self.symbol),
            (None, Unit::One) => self.symbol.to_owned(),
            (Some(w), unit) => {
                let name = w.name().replace('-', "_");
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
    /// radial axis. The box itself, not the physical domain, is what this knows about.
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

    /// How far each coordinate is bent: `none`, or e.g. `theta_h:square-root`.
    fn warp_name(&self) -> String {
        "none".into()
    }

    /// True if the second azimuth is measured in a frame that turns with the first (4-D
    /// half/difference): where the first radial coordinate vanishes only their sum has a meaning.
    fn nested(&self) -> bool;

    /// All coordinates that name the configuration of `coords` under the declared symmetries and
    /// lie on the chart's azimuth circle (radial coordinates ≥ 0), `coords` first.
    fn images(&self, coords: &Coords) -> Vec<Coords>;
}

/// Builds a form for given symmetries, with warps by axis symbol.
type Build =
    fn(Symmetry, &BTreeMap<String, WarpName>) -> Result<Arc<dyn Parametrization>, WarpError>;

/// A member of the registry.
pub struct ParametrizationEntry {
    /// Name in configs and result files.
    pub name: &'static str,
    /// One line for lists.
    pub summary: &'static str,
    /// Builds the form for given symmetries, with warps by axis symbol.
    build: Build,
    /// The axes of the form for given symmetries.
    axes: fn(Symmetry) -> Vec<Axis>,
}

/// A warp was asked for on an axis that cannot have it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("warp.{axis}: {problem}")]
pub struct WarpError {
    /// The axis symbol as written.
    pub axis: String,
    /// What is wrong and what is allowed.
    #[source]
    pub problem: WarpProblem,
}

/// Why an axis cannot have a warp.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum WarpProblem {
    /// It is an azimuth.
    #[error("azimuths are not warped; allowed are radial axes")]
    Azimuth,
    /// The rows of a MERL table are those of one axis.
    #[error("the merl warp is defined for theta_h only")]
    NotThetaH,
    /// An arcsine is that of a length.
    #[error("the arcsine warp is defined for the lengths h_bar, k_bar and k only")]
    NoLength,
    /// There is no such axis.
    #[error("no axis of {parametrization}; allowed: {axes}")]
    NoAxis {
        /// The parametrization.
        parametrization: &'static str,
        /// Its axes.
        axes: String,
    },
}

impl ParametrizationEntry {
    /// The plain form of this parametrization for a BRDF with these symmetries.
    pub fn form(&self, symmetry: Symmetry) -> Arc<dyn Parametrization> {
        // Without warps there is nothing that could be refused.
        match (self.build)(symmetry, &BTreeMap::new()) {
            Ok(form) => form,
            Err(e) => unreachable!("no warp was asked for: {e}"),
        }
    }

    /// The form with warps on the named axes.
    ///
    /// # Errors
    /// If a name is no axis of this form, or its axis cannot have that warp.
    pub fn warped(
        &self,
        symmetry: Symmetry,
        warps: &BTreeMap<String, WarpName>,
    ) -> Result<Arc<dyn Parametrization>, WarpError> {
        (self.build)(symmetry, warps)
    }

    /// The axes of the plain form.
    pub fn axes(&self, symmetry: Symmetry) -> Vec<Axis> {
        (self.axes)(symmetry)
    }
}

/// The entry of one chart.
const fn entry<C: Chart + Default>(summary: &'static str) -> ParametrizationEntry {
    ParametrizationEntry {
        name: C::NAME,
        summary,
        build: |symmetry, warps| {
            let form = Form::new(C::default(), symmetry);
            if warps.is_empty() {
                Ok(Arc::new(form))
            } else {
                Ok(Arc::new(Warped::new(form, warps)?))
            }
        },
        axes: |symmetry| Form::new(C::default(), symmetry).axes().to_vec(),
    }
}

/// Every parametrization a config can name.
pub fn all() -> Vec<ParametrizationEntry> {
    vec![
        entry::<Spherical>("elevation and azimuth of each direction"),
        entry::<HalfDifference>(
            "angles of the half vector and of the light about it (Rusinkiewicz)",
        ),
        entry::<Orthographic>("half and back vector projected on the tangent plane (Neumann)"),
        entry::<Hybrid>("projected half vector, full length of the back vector (Barla et al.)"),
        entry::<Stark>("squares of the hybrid lengths, sigma and alpha (Stark et al.)"),
    ]
}

/// Finds a member of [`all`] by name.
pub fn find(name: &str) -> Option<ParametrizationEntry> {
    all().into_iter().find(|e| e.name == name)
}
