//! A chart with the symmetries of a BRDF: the 4-D form, or the 3-D form of isotropic BRDFs, with
//! its domain folded so that one configuration has one set of coordinates.
//!
//! | symmetry | spherical | the others |
//! |---|---|---|
//! | isotropic | azimuth difference in [−π, π] | the same |
//! | + reciprocal | exchanged if the azimuth is negative: [0, π] | azimuth and azimuth + π are one: [0, π] |
//! | + bilateral | [0, π], exchanged if theta_i < theta_o | [0, π/2] |
//!
//! In 4-D, reciprocity folds the second azimuth to a period of π (spherical: exchanged if
//! theta_i < theta_o), and bilateral symmetry about both tangent axes folds the first azimuth to
//! [0, π/2].

use super::{
    Axis, AxisKind, Azimuth, Chart, Coords, Facts, Layout, Parametrization, ParametrizationKind,
    Quantity, Unit,
};
use crate::geometry::{DirectionPair, Symmetry};
use crate::numeric::wrap_angle;
use std::f64::consts::{FRAC_PI_2, PI};

/// A [`Chart`] under given symmetries.
#[derive(Clone, Debug)]
pub struct Form<C> {
    chart: C,
    symmetry: Symmetry,
    axes: Vec<Axis>,
}

impl<C: Chart> Form<C> {
    /// The form of `chart` for BRDFs with this symmetry.
    pub fn new(chart: C, symmetry: Symmetry) -> Self {
        let [r1, r2] = C::RADIAL.map(|r| Axis {
            symbol: r.symbol,
            label: r.label,
            unit: r.unit,
            range: [0.0, r.max],
            kind: AxisKind::Radial,
            quantity: r.quantity,
            peak_at_start: false,
            density: C::RADIAL_DENSITY,
            warp: None,
        });
        let r1 = Axis {
            peak_at_start: C::PEAK_AT_START,
            ..r1
        };
        let azimuth = |azimuth: Azimuth, range: [f64; 2], kind| Axis {
            symbol: azimuth.symbol,
            label: azimuth.label,
            unit: Unit::Radian,
            range,
            kind,
            quantity: Quantity::Other,
            peak_at_start: false,
            density: (range[1] - range[0]) / FRAC_PI_2,
            warp: None,
        };
        let full = ([-PI, PI], AxisKind::Periodic);
        let axes = if symmetry.isotropic {
            let (range, kind) = match (symmetry.reciprocal, symmetry.bilateral, C::EXCHANGE) {
                (false, false, _) => full,
                (true, false, false) => ([0.0, PI], AxisKind::Periodic),
                (true, true, false) => ([0.0, FRAC_PI_2], AxisKind::Mirrored),
                (true, _, true) | (false, true, _) => ([0.0, PI], AxisKind::Mirrored),
            };
            vec![r1, r2, azimuth(C::RELATIVE, range, kind)]
        } else {
            let (range1, kind1) = if symmetry.bilateral {
                ([0.0, FRAC_PI_2], AxisKind::Mirrored)
            } else {
                full
            };
            let (range2, kind2) = if symmetry.reciprocal && !C::EXCHANGE {
                ([0.0, PI], AxisKind::Periodic)
            } else {
                full
            };
            vec![
                r1,
                azimuth(C::AZIMUTH[0], range1, kind1),
                r2,
                azimuth(C::AZIMUTH[1], range2, kind2),
            ]
        };
        Self {
            chart,
            symmetry,
            axes,
        }
    }

    /// Folds the azimuth of the 3-D form; `a` is in [−π, π].
    #[inline]
    fn fold_relative(&self, [mut r1, mut r2, mut a]: [f64; 3]) -> [f64; 3] {
        let s = self.symmetry;
        if C::EXCHANGE {
            if s.bilateral {
                a = a.abs();
                if s.reciprocal && r1 < r2 {
                    std::mem::swap(&mut r1, &mut r2);
                }
            } else if s.reciprocal {
                // Light and sensor exchanged: (r1, r2, a) is (r2, r1, −a). At a = 0 and ±π the
                // azimuth cannot tell the two apart, the elevations do.
                let tie = same(a, 0.0) || same(a.abs(), PI);
                let exchanged = if tie { r1 < r2 } else { a < 0.0 };
                if exchanged {
                    std::mem::swap(&mut r1, &mut r2);
                    a = -a;
                }
                a = a.abs();
            }
        } else {
            if s.bilateral {
                a = a.abs();
                if s.reciprocal && a > FRAC_PI_2 {
                    a = PI - a;
                }
            } else if s.reciprocal {
                if a < 0.0 {
                    a += PI;
                }
                if a >= PI {
                    a = 0.0;
                }
            }
        }
        [r1, r2, a]
    }

    /// Folds the 4-D form; azimuths are in [−π, π].
    #[inline]
    fn fold_absolute(&self, c: Coords) -> Coords {
        let s = self.symmetry;
        if !C::EXCHANGE {
            let mut c = self.fold_mirrors(c);
            if s.reciprocal {
                c[3] = half_turn(c[3]);
                if s.bilateral && self.on_mirror(c[1]) {
                    // The mirror that keeps a1 sends a2 to −a2 (or π − a2): one of the two.
                    c[3] = c[3].min(half_turn(-c[3]));
                }
            }
            return c;
        }
        let kept = self.fold_mirrors(c);
        if !s.reciprocal {
            return kept;
        }
        let exchanged = self.fold_mirrors([c[2], c[3], c[0], c[1]]);
        // Elevations decide; azimuths only where the elevations are equal.
        let key = |c: &Coords| [c[0], -c[1], -c[3]];
        if key(&exchanged) > key(&kept) {
            exchanged
        } else {
            kept
        }
    }

    /// True if the azimuth lies on a mirror plane.
    #[inline]
    fn on_mirror(&self, a1: f64) -> bool {
        same(a1, 0.0) || same(a1, FRAC_PI_2)
    }

    /// Brings the first azimuth into [0, π/2] by the mirrors y → −y and x → −x.
    #[inline]
    fn fold_mirrors(&self, [r1, mut a1, r2, mut a2]: Coords) -> Coords {
        if !self.symmetry.bilateral {
            return [r1, a1, r2, a2];
        }
        // At a pole one azimuth is left, the one of the other direction, and both mirrors fold it.
        if r1 == 0.0 {
            return [r1, 0.0, r2, quarter_turn(a2)];
        }
        if r2 == 0.0 {
            return [r1, quarter_turn(a1), r2, 0.0];
        }
        if a1 < 0.0 {
            (a1, a2) = (-a1, -a2);
        }
        if a1 > FRAC_PI_2 {
            a1 = PI - a1;
            // A mirror always flips the nested azimuth; an absolute one is reflected like a1.
            a2 = if C::NESTED { -a2 } else { wrap_angle(PI - a2) };
        }
        if same(a1, 0.0) || (C::NESTED && same(a1, FRAC_PI_2)) {
            a2 = a2.abs();
        } else if same(a1, FRAC_PI_2) && a2.abs() > FRAC_PI_2 {
            a2 = wrap_angle(PI - a2);
        }
        [r1, a1, r2, a2]
    }
}

/// True if two azimuths differ by rounding only: a few ulp of π, which the last of many equal steps
/// from 0 to π/2 misses it by.
#[inline]
fn same(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-15
}

/// An angle in [−π, π] as its image in [0, π/2] under both mirrors.
#[inline]
fn quarter_turn(a: f64) -> f64 {
    a.abs().min(PI - a.abs())
}

/// An angle in [−π, π] as its representative in [0, π).
#[inline]
fn half_turn(mut a: f64) -> f64 {
    if a < 0.0 {
        a += PI;
    }
    if a >= PI { 0.0 } else { a }
}

impl<C: Chart + Default> ParametrizationKind for Form<C> {
    const KIND: &'static str = C::NAME;

    fn of(symmetry: Symmetry) -> Self {
        Self::new(C::default(), symmetry)
    }
}

impl<C: Chart> Parametrization for Form<C> {
    fn name(&self) -> &'static str {
        C::NAME
    }

    fn axes(&self) -> &[Axis] {
        &self.axes
    }

    fn symmetry(&self) -> Symmetry {
        self.symmetry
    }

    #[inline]
    fn forward(&self, pair: &DirectionPair) -> Coords {
        if self.symmetry.isotropic {
            let [r1, r2, a] = self.fold_relative(self.chart.relative(pair));
            [r1, r2, a, 0.0]
        } else {
            self.fold_absolute(self.chart.absolute(pair))
        }
    }

    #[inline]
    fn inverse(&self, &[x, y, z, w]: &Coords) -> Option<DirectionPair> {
        let [r1, a1, r2, a2] = if self.symmetry.isotropic {
            self.chart.lift([x, y, z])
        } else {
            [x, y, z, w]
        };
        let [max1, max2] = C::RADIAL.map(|r| r.max);
        let in_range = (0.0..=max1).contains(&r1) && (0.0..=max2).contains(&r2);
        if in_range && a1.is_finite() && a2.is_finite() {
            self.chart.inverse([r1, a1, r2, a2])
        } else {
            None
        }
    }

    fn canonical(&self, &[x, y, z, w]: &Coords) -> Option<Coords> {
        let [max1, max2] = C::RADIAL.map(|r| r.max);
        let in_range = |r1: f64, r2: f64| r1.abs() <= max1 && r2.abs() <= max2;
        if self.symmetry.isotropic {
            let (mut r1, mut r2, mut a) = (x, y, z);
            if !in_range(r1, r2) {
                return None;
            }
            // Through a pole: the other side of the circle.
            for r in [&mut r1, &mut r2] {
                if *r < 0.0 {
                    *r = -*r;
                    a += PI;
                }
            }
            a = wrap_angle(a);
            if r1 == 0.0 || r2 == 0.0 {
                a = 0.0;
            }
            let [r1, r2, a] = self.fold_relative([r1, r2, a]);
            return Some([r1, r2, a, 0.0]);
        }
        let (mut r1, mut a1, mut r2, mut a2) = (x, y, z, w);
        if !in_range(r1, r2) {
            return None;
        }
        if r1 < 0.0 {
            r1 = -r1;
            a1 += PI;
            if C::NESTED {
                a2 += PI;
            }
        }
        if r2 < 0.0 {
            r2 = -r2;
            a2 += PI;
        }
        if r1 == 0.0 {
            // Only the sum of nested azimuths is left at the pole.
            if C::NESTED {
                a2 += a1;
            }
            a1 = 0.0;
        }
        if r2 == 0.0 {
            a2 = 0.0;
        }
        Some(self.fold_absolute([r1, wrap_angle(a1), r2, wrap_angle(a2)]))
    }

    #[inline]
    fn jacobian(&self, &[x, y, z, w]: &Coords) -> f64 {
        if self.symmetry.isotropic {
            self.chart.jacobian(self.chart.lift([x, y, z]))
        } else {
            self.chart.jacobian([x, y, z, w])
        }
    }

    fn facts(&self) -> Facts {
        Facts {
            layout: if C::NESTED && !self.symmetry.isotropic {
                Layout::Nested
            } else {
                Layout::Polar
            },
            exchange: C::EXCHANGE,
            round_trip: C::ROUND_TRIP,
            singular: C::SINGULAR,
            squared: C::SQUARED,
        }
    }

    fn plane_labels(&self) -> [&'static str; 2] {
        C::LIFTED
    }

    fn images(&self, &c: &Coords) -> Vec<Coords> {
        let s = self.symmetry;
        let mut images = vec![c];
        if s.isotropic {
            if s.reciprocal {
                images.push(if C::EXCHANGE {
                    [c[1], c[0], -c[2], 0.0]
                } else {
                    [c[0], c[1], wrap_angle(c[2] + PI), 0.0]
                });
            }
            if s.bilateral {
                for i in 0..images.len() {
                    let [r1, r2, a, _] = images[i];
                    images.push([r1, r2, -a, 0.0]);
                }
            }
            return images;
        }
        if s.reciprocal {
            images.push(if C::EXCHANGE {
                [c[2], c[3], c[0], c[1]]
            } else {
                [c[0], c[1], c[2], wrap_angle(c[3] + PI)]
            });
        }
        if s.bilateral {
            for i in 0..images.len() {
                let [r1, a1, r2, a2] = images[i];
                images.push([r1, -a1, r2, -a2]);
            }
            for i in 0..images.len() {
                let [r1, a1, r2, a2] = images[i];
                let b2 = if C::NESTED { -a2 } else { wrap_angle(PI - a2) };
                images.push([r1, wrap_angle(PI - a1), r2, b2]);
            }
        }
        images
    }
}
