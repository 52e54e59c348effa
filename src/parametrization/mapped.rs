//! A parametrization of which two maps and a domain are given, and nothing else.
//!
//! A type implements [`Maps`]: pair → coordinates, coordinates → pair, and the box of its axes, without any symmetry folded.
//! [`Mapped`] makes a [`Parametrization`] of it for BRDFs of any symmetry:
//!
//! - Images are found in the group of the symmetries: the pair is exchanged and mirrored, and mapped. The representative is the
//!   image whose coordinates are the largest or the smallest, the first one first; the box keeps the others.
//! - The Jacobian is found by differences of the inverse, where no formula is given: five points an axis, three to one side where the
//!   domain ends.
//!
//! Both cost several calls of the maps. A Jacobian is off by less than 1e-6 of its value where both directions are 6° or more above
//! the horizon (`tests/cartesian.rs`), and by more at the edges of the domain. Where speed or the last digits count, implement [`Parametrization`], or [`Chart`](super::Chart) for polar coordinates.

use super::spec::{ParametrizationKind, ParametrizationSpec};
use super::{Axis, Coords, Facts, Images, Layout, Parametrization};
use crate::error::ParameterError;
use crate::geometry::{Direction, DirectionPair, Symmetry};
use crate::registry::{Entry, ReadError};
use crate::sampling::{Random, cosine_hemisphere};
use glam::DVec3;
use nalgebra::Matrix4;
use std::any::TypeId;
use std::collections::BTreeSet;
use std::marker::PhantomData;
use std::sync::{Mutex, PoisonError};

/// Coordinates of pairs of directions by their two maps.
///
/// ```
/// use gonio::geometry::{Direction, DirectionPair, Symmetry};
/// use gonio::parametrization::{self, Axis, Coords, Maps, Mapped, Parametrization, ParametrizationKind, mapped_entry};
/// use std::f64::consts::{FRAC_PI_2, PI, TAU};
///
/// /// Elevations and azimuths by the cosines of the elevations: uniform in solid angle.
/// struct Cosines;
///
/// impl Maps for Cosines {
///     const KIND: &'static str = "cosines";
///
///     fn axes(isotropic: bool) -> Vec<Axis> {
///         let axis = Axis::straight;
///         let azimuth = |symbol, label| axis(symbol, label, [-PI, PI]);
///         let [i, o] = [axis("mu_i", "μ_i", [0.0, 1.0]), axis("mu_o", "μ_o", [0.0, 1.0])];
///         if isotropic {
///             vec![i, o, azimuth("phi", "φ")]
///         } else {
///             vec![i, azimuth("phi_i", "φ_i"), o, azimuth("phi_o", "φ_o")]
///         }
///     }
///
///     fn forward(pair: &DirectionPair, isotropic: bool) -> Coords {
///         let [i, o] = [pair.omega_i, pair.omega_o];
///         if isotropic {
///             let turn = (o.phi() - i.phi() + 3.0 * PI).rem_euclid(TAU) - PI;
///             [i.cos_theta(), o.cos_theta(), turn, 0.0]
///         } else {
///             [i.cos_theta(), i.phi(), o.cos_theta(), o.phi()]
///         }
///     }
///
///     fn inverse(&[x, y, z, w]: &Coords, isotropic: bool) -> Option<DirectionPair> {
///         let [mu_i, phi_i, mu_o, phi_o] = if isotropic { [x, 0.0, y, z] } else { [x, y, z, w] };
///         let at = |mu: f64, phi| {
///             let is_above = (0.0..=1.0).contains(&mu);
///             is_above.then(|| Direction::from_spherical(mu.acos(), phi))
///         };
///         Some(DirectionPair::new(at(mu_i, phi_i)?, at(mu_o, phi_o)?))
///     }
/// }
///
/// // Solid angles are products of these steps: J = 1.
/// let form = Mapped::<Cosines>::with_symmetry(Symmetry::FULL);
/// assert!((form.jacobian(&[0.3, 0.8, 1.0, 0.0]) - 1.0).abs() < 1e-8);
/// // By name in configs.
/// parametrization::join(mapped_entry::<Cosines>("cosines of elevations", &["", "warp = {}"]))?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait Maps: Send + Sync + 'static {
    /// Name in configs and result files.
    const KIND: &'static str;

    /// How coordinates lie in the space in which scattered readings look for their neighbours.
    const LAYOUT: Layout = Layout::Straight;

    /// True if of several images of a pair the one with the smallest coordinates is the representative, the first one first; else the
    /// one with the largest is.
    const SMALLEST: bool = false;

    /// Largest errors (rad) of pair → coordinates → pair, as [`Facts::round_trip`] has them.
    const ROUND_TRIP: [f64; 2] = [1e-9, MISSED];

    /// The axes of the form of isotropic BRDFs, three, or of all BRDFs, four: they hold every pair, no two of a symmetry in one.
    fn axes(isotropic: bool) -> Vec<Axis>;

    /// Coordinates of a pair above the horizon; of the isotropic form equal for pairs that a turn about the normal makes equal.
    fn forward(pair: &DirectionPair, isotropic: bool) -> Coords;

    /// The pair at coordinates; `None` where there is none above the horizon. Azimuths may have any finite value.
    fn inverse(coords: &Coords, isotropic: bool) -> Option<DirectionPair>;

    /// [`Parametrization::jacobian`] at coordinates that have a pair; `None`: it is found by differences.
    fn jacobian(_coords: &Coords, _isotropic: bool) -> Option<f64> {
        None
    }
}

/// [`Maps`] as a parametrization under given symmetries.
pub struct Mapped<M> {
    maps: PhantomData<fn() -> M>,
    symmetry: Symmetry,
    axes: Vec<Axis>,
}

/// Difference of coordinates up to which they count as equal when the representative of several images is chosen.
const EQUAL: f64 = 1e-12;

/// Steps of central differences, in lengths of an axis: the first that stays in the domain is taken.
const STEPS: [f64; 3] = [1e-4, 1e-5, 1e-6];

/// Pairs at which an entry is tried, and the angle by which the inverse may miss them, rad.
const TRIED: u64 = 64;
const MISSED: f64 = 1e-6;

impl<M: Maps> Mapped<M> {
    fn isotropic(&self) -> bool {
        self.symmetry.isotropic
    }

    /// Coordinates of all pairs that the symmetries make one, of `pair` first.
    fn orbit(&self, pair: &DirectionPair) -> Images {
        let mut pairs = vec![*pair];
        let extend = |pairs: &mut Vec<DirectionPair>,
                      by: &dyn Fn(&DirectionPair) -> DirectionPair| {
            let more: Vec<_> = pairs.iter().map(by).collect();
            pairs.extend(more);
        };
        let mirrored = |along: DVec3| {
            move |p: &DirectionPair| {
                let mirror = |d: Direction| Direction::from_unit(d.vector() * along);
                DirectionPair::new(mirror(p.omega_i), mirror(p.omega_o))
            }
        };
        if self.symmetry.reciprocal {
            extend(&mut pairs, &DirectionPair::swapped);
        }
        if self.symmetry.bilateral {
            extend(&mut pairs, &mirrored(DVec3::new(1.0, -1.0, 1.0)));
            if !self.isotropic() {
                extend(&mut pairs, &mirrored(DVec3::new(-1.0, 1.0, 1.0)));
            }
        }
        let forward = |p: &DirectionPair| M::forward(p, self.isotropic());
        pairs.iter().map(forward).collect()
    }

    /// True if coordinates are in the box of the axes.
    fn holds(&self, coords: &Coords) -> bool {
        let mut both = self.axes.iter().zip(coords);
        both.all(|(axis, c)| (axis.range[0]..=axis.range[1]).contains(c))
    }

    /// The derivative of both directions by a coordinate; `None` where too little of the domain is near.
    fn derivative(&self, coords: &Coords, k: usize) -> Option<[DVec3; 2]> {
        let at = |step: f64| {
            let mut c = *coords;
            c[k] += step;
            let pair = M::inverse(&c, self.isotropic())?;
            Some([pair.omega_i.vector(), pair.omega_o.vector()])
        };
        let sum = |h: f64, weights: &[(f64, f64)]| {
            let mut total = [DVec3::ZERO; 2];
            for (step, weight) in weights {
                let [i, o] = at(step * h)?;
                total[0] += i * *weight / h;
                total[1] += o * *weight / h;
            }
            Some(total)
        };
        let length = self.axes[k].length();
        let third = 1.0 / 12.0;
        let central = [
            (-2.0, third),
            (-1.0, -8.0 * third),
            (1.0, 8.0 * third),
            (2.0, -third),
        ];
        let aside = |side: f64| {
            [
                (0.0, -1.5 * side),
                (side, 2.0 * side),
                (2.0 * side, -0.5 * side),
            ]
        };
        let mut steps = STEPS.iter().map(|s| s * length);
        steps.find_map(|h| sum(h, &central)).or_else(|| {
            [1.0, -1.0]
                .into_iter()
                .find_map(|side| sum(STEPS[2] * length, &aside(side)))
        })
    }
}

impl<M: Maps> ParametrizationKind for Mapped<M> {
    const KIND: &'static str = M::KIND;

    fn with_symmetry(symmetry: Symmetry) -> Self {
        Self {
            maps: PhantomData,
            symmetry,
            axes: M::axes(symmetry.isotropic),
        }
    }
}

impl<M: Maps> Parametrization for Mapped<M> {
    fn name(&self) -> &'static str {
        M::KIND
    }

    fn axes(&self) -> &[Axis] {
        &self.axes
    }

    fn symmetry(&self) -> Symmetry {
        self.symmetry
    }

    fn forward(&self, pair: &DirectionPair) -> Coords {
        let later = |a: &Coords, b: &Coords| {
            let differs = a.iter().zip(b).find(|(a, b)| (*a - *b).abs() > EQUAL);
            differs.is_some_and(|(a, b)| (a > b) != M::SMALLEST)
        };
        let images = self.orbit(pair);
        let mut best = images[0];
        for image in &images[1..] {
            if later(image, &best) {
                best = *image;
            }
        }
        best
    }

    fn inverse(&self, coords: &Coords) -> Option<DirectionPair> {
        M::inverse(coords, self.isotropic())
    }

    /// Of coordinates that no pair has themselves in the box, and none outside it.
    fn canonical(&self, coords: &Coords) -> Option<Coords> {
        match self.inverse(coords) {
            Some(pair) => Some(self.forward(&pair)),
            None => self.holds(coords).then_some(*coords),
        }
    }

    fn jacobian(&self, coords: &Coords) -> f64 {
        let Some(pair) = self.inverse(coords) else {
            return f64::INFINITY;
        };
        if let Some(exact) = M::jacobian(coords, self.isotropic()) {
            return exact;
        }
        let [i, o] = [pair.omega_i.vector(), pair.omega_o.vector()];
        let tangents = [i, o].map(|v| v.any_orthonormal_pair());
        let mut columns = Vec::with_capacity(4);
        for k in 0..self.axes.len() {
            let Some(derivative) = self.derivative(coords, k) else {
                return f64::INFINITY;
            };
            columns.push(derivative);
        }
        if self.isotropic() {
            // What isotropy drops: a turn about the normal.
            columns.push([DVec3::Z.cross(i), DVec3::Z.cross(o)]);
        }
        let entry = |row: usize, column: usize| {
            let (along, across) = tangents[row / 2];
            let tangent = if row.is_multiple_of(2) { along } else { across };
            tangent.dot(columns[column][row / 2])
        };
        Matrix4::from_fn(entry).determinant().abs()
    }

    fn facts(&self) -> Facts {
        Facts {
            layout: M::LAYOUT,
            exchange: false,
            round_trip: M::ROUND_TRIP,
            singular: true,
            squared: false,
        }
    }

    fn images(&self, coords: &Coords) -> Images {
        let mut images = match self.inverse(coords) {
            Some(pair) => self.orbit(&pair),
            None => Images::new(),
        };
        match images.first_mut() {
            // As they are: `inverse` accepts azimuths beyond the box.
            Some(first) => *first = *coords,
            None => images.push(*coords),
        }
        images
    }
}

/// The registry entry of [`Maps`]; a config that names it is refused if one map does not invert the other.
pub const fn mapped_entry<M: Maps>(
    summary: &'static str,
    examples: &'static [&'static str],
) -> Entry<ParametrizationSpec> {
    Entry {
        kind: M::KIND,
        summary,
        examples,
        read: |table| {
            let span = table.span();
            inverts::<M>().map_err(|e| ReadError::new(span, e.to_string()))?;
            (super::entry::<Mapped<M>>("", &[]).read)(table)
        },
    }
}

/// [`invert`], done once in a process for each type that passes.
fn inverts<M: Maps>() -> Result<(), ParameterError> {
    static PASSED: Mutex<BTreeSet<TypeId>> = Mutex::new(BTreeSet::new());
    let passed = || PASSED.lock().unwrap_or_else(PoisonError::into_inner);
    if !passed().contains(&TypeId::of::<M>()) {
        invert::<M>()?;
        passed().insert(TypeId::of::<M>());
    }
    Ok(())
}

/// Tries if the inverse of a map leads back to random pairs.
fn invert<M: Maps>() -> Result<(), ParameterError> {
    let random = Random::new(1);
    for index in 0..TRIED {
        let [a, b, c, d] = random.point(index);
        let [i, o] = [[a, b], [c, d]].map(cosine_hemisphere);
        let pair = DirectionPair::new(i, o);
        for isotropic in [true, false] {
            let coords = M::forward(&pair, isotropic);
            let back = M::inverse(&coords, isotropic);
            // A pair up to a turn about the normal.
            let seen = |p: &DirectionPair| {
                let [i, o] = [p.omega_i.vector(), p.omega_o.vector()];
                match isotropic {
                    true => vec![i.z, o.z, i.dot(o)],
                    false => [i.to_array(), o.to_array()].concat(),
                }
            };
            let missed = back.map(|back| {
                let both = seen(&back).into_iter().zip(seen(&pair));
                both.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
            });
            if missed.is_none_or(|missed| !(missed <= MISSED)) {
                let form = if isotropic {
                    "isotropic"
                } else {
                    "anisotropic"
                };
                let allowed = format!(
                    "an inverse that leads back to every pair; that of the {form} coordinates {coords:.3?} {}",
                    missed.map_or("has none".into(), |m| format!("is off by {m:.1e}"))
                );
                return Err(ParameterError::new(
                    "kind",
                    format!("\"{}\"", M::KIND),
                    allowed,
                ));
            }
        }
    }
    Ok(())
}
