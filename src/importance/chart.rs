//! Charts of the light direction at a fixed view, as points (x, v) of the unit square.
//!
//! All are polar: v = φ/(2π) is the azimuth about a pole, x the radius ρ over its largest, to a power: ρ = ρ_max xᵖ. With
//! δ = atan2(sin θ_o cos φ, cos θ_o), the elevation of the view in the plane of azimuth φ, and φ = 0 towards ω_o (about the mirror
//! direction: towards the normal), directions above the horizon are those of
//!
//! | chart | ρ | dω_i | horizon |
//! |---|---|---|---|
//! | ω_i by solid angle | 1 − cos θ_i | dρ dφ | 1 |
//! | ω_i by cosine | sin² θ_i | dρ dφ / (2 cos θ_i) | 1 |
//! | half vector | θ_h | 4 (ω_o·h) sin θ_h dρ dφ | π/4 + δ/2 |
//! | h̄ = tangential part of (ω_i + ω_o)/2 | \|h̄\| | 4 ρ dρ dφ / cos θ_i | ½ (sin θ_o cos φ + √(1 − sin² θ_o sin² φ)) |
//! | mirror direction | angle γ from it | sin γ dρ dφ | π/2 + δ |
//!
//! of the half vector as ω_i·n = cos(2θ_h − δ) √(1 − sin² θ_o sin² φ), about the mirror direction as 2θ_h = γ in the plane of each
//! azimuth. Ended at the horizon of its azimuth, a radius loses nothing below it; with fixed ends (π/2, 1, π) part of the square lies there.

use crate::geometry::Direction;
use crate::numeric::angles::sin_cos;
use crate::registry::named;
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

named! {
    /// Coordinates of the light direction at a fixed view.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum LightChart {
        SolidAngle = "omega_i": "light direction, equal solid angles",
        Cosine = "omega_i-cosine": "light direction, equal solid angles times cosine",
        HalfVector = "half-vector": "elevation and azimuth of the half vector",
        HBar = "h_bar": "tangential part of the half vector, polar",
        Mirror = "mirror": "angle and azimuth about the mirror direction",
    }
}

named! {
    /// Power p of the radius, ρ = ρ_max xᵖ: how fine cells are at the pole.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum RadialWarp {
        Plain = "none": "equal steps of the radius",
        SquareRoot = "square-root": "equal steps of its square root",
        FourthRoot = "fourth-root": "equal steps of its fourth root",
    }
}

impl RadialWarp {
    /// p.
    fn power(self) -> i32 {
        match self {
            Self::Plain => 1,
            Self::SquareRoot => 2,
            Self::FourthRoot => 4,
        }
    }
}

/// A chart with its warp and its ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axes {
    /// The chart.
    pub chart: LightChart,
    /// The warp of its radius.
    pub warp: RadialWarp,
    /// True if radii end at the horizon of their azimuth, false at the largest of all views.
    pub to_horizon: bool,
}

/// Sensor direction in the frame that is turned about the normal to its azimuth, and that turn.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    sin: f64,
    cos: f64,
    /// (cos φ_o, sin φ_o).
    turn: DVec2,
}

/// A light direction, above the horizon, with its place in a chart.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub omega_i: Direction,
    /// dω_i over dx dv.
    pub jacobian: f64,
}

/// Radius below which the density at a given direction is that of this radius: the direction itself is rounded.
const LEAST_RADIUS: f64 = 1e-14;

impl View {
    pub(crate) fn new(omega_o: Direction) -> Self {
        let o = omega_o.vector();
        let sin = o.x.hypot(o.y);
        let turn = match sin > 0.0 {
            true => DVec2::new(o.x, o.y) / sin,
            false => DVec2::X,
        };
        Self {
            sin,
            cos: o.z,
            turn,
        }
    }

    /// Elevation of the view, rad.
    pub(crate) fn theta(&self) -> f64 {
        self.sin.atan2(self.cos)
    }

    /// Azimuth of the view, in [0, 1) turns.
    pub(crate) fn turns(&self) -> f64 {
        turns(self.turn.x, self.turn.y)
    }

    /// A vector of the turned frame, in that of the sample.
    fn unturned(&self, d: DVec3) -> DVec3 {
        let xy = self.turn.rotate(d.truncate());
        DVec3::new(xy.x, xy.y, d.z)
    }

    fn turned(&self, d: DVec3) -> DVec3 {
        let xy = DVec2::new(self.turn.x, -self.turn.y).rotate(d.truncate());
        DVec3::new(xy.x, xy.y, d.z)
    }
}

/// The angle of (x, y) in turns, in [0, 1).
fn turns(x: f64, y: f64) -> f64 {
    let t = y.atan2(x) / TAU;
    if t < 0.0 {
        (t + 1.0).min(1.0 - f64::EPSILON / 2.0)
    } else {
        t
    }
}

impl Axes {
    /// Name of chart, warp and ends.
    pub fn name(&self) -> String {
        let warp = match self.warp {
            RadialWarp::Plain => String::new(),
            warp => format!(" {}", warp.name()),
        };
        let ends = if self.to_horizon { "" } else { ", fixed ends" };
        format!("{}{warp}{ends}", self.chart.name())
    }

    /// Every chart, plain and by the square root of its radius, ended at the horizon, and with fixed ends where they differ.
    pub fn all() -> Vec<Self> {
        let mut all = Vec::new();
        for chart in LightChart::ALL {
            let has_fixed = !matches!(chart, LightChart::SolidAngle | LightChart::Cosine);
            for to_horizon in [true, false] {
                for warp in [RadialWarp::Plain, RadialWarp::SquareRoot] {
                    all.extend((to_horizon || has_fixed).then_some(Self {
                        chart,
                        warp,
                        to_horizon,
                    }));
                }
            }
        }
        all
    }

    /// The largest radius at an azimuth with this cosine.
    fn end(&self, view: &View, cos_phi: f64) -> f64 {
        let delta = || (view.sin * cos_phi).atan2(view.cos);
        match (self.chart, self.to_horizon) {
            (LightChart::SolidAngle | LightChart::Cosine, _) | (LightChart::HBar, false) => 1.0,
            (LightChart::HalfVector, true) => FRAC_PI_4 + 0.5 * delta(),
            (LightChart::HalfVector, false) => FRAC_PI_2,
            (LightChart::HBar, true) => {
                let along = view.sin * cos_phi;
                // √(1 − sin² θ_o sin² φ).
                let whole = (view.cos * view.cos + along * along).sqrt();
                match along < 0.0 {
                    // Without the cancellation of the sum.
                    true => 0.5 * view.cos * view.cos / (whole - along),
                    false => 0.5 * (along + whole),
                }
            }
            (LightChart::Mirror, true) => FRAC_PI_2 + delta(),
            (LightChart::Mirror, false) => PI,
        }
    }

    /// The direction at (x, v), `None` below the horizon.
    pub(super) fn place(&self, view: &View, [x, v]: [f64; 2]) -> Option<Place> {
        let (sin_phi, cos_phi) = sin_cos(TAU * v);
        let end = self.end(view, cos_phi);
        let power = self.warp.power();
        let rho = end * x.powi(power);
        let View { sin, cos, .. } = *view;
        let polar = |s: f64, c: f64| DVec3::new(s * cos_phi, s * sin_phi, c);
        let (d, jacobian) = match self.chart {
            LightChart::SolidAngle => {
                let d = polar((rho * (2.0 - rho)).max(0.0).sqrt(), 1.0 - rho);
                (d, 1.0)
            }
            LightChart::Cosine => {
                let c = (1.0 - rho).max(0.0).sqrt();
                (polar(rho.sqrt(), c), 0.5 / c)
            }
            LightChart::HalfVector => {
                let (s, c) = sin_cos(rho);
                let h = polar(s, c);
                let along = h.x * sin + h.z * cos;
                let d = 2.0 * along * h - DVec3::new(sin, 0.0, cos);
                (d, 4.0 * along * s)
            }
            LightChart::HBar => {
                let [dx, dy] = [2.0 * rho * cos_phi - sin, 2.0 * rho * sin_phi];
                let c = (1.0 - dx * dx - dy * dy).max(0.0).sqrt();
                (DVec3::new(dx, dy, c), 4.0 * rho / c)
            }
            LightChart::Mirror => {
                let (s, c) = sin_cos(rho);
                let m = polar(s, c);
                let d = DVec3::new(cos * m.x - sin * m.z, m.y, sin * m.x + cos * m.z);
                (d, s)
            }
        };
        let stretch = end * f64::from(power) * x.powi(power - 1) * TAU;
        (d.z > 0.0 && jacobian * stretch > 0.0).then(|| Place {
            omega_i: Direction::from_unit(view.unturned(d)),
            jacobian: jacobian * stretch,
        })
    }

    /// The place (x, v) of a direction above the horizon, and dω_i over dx dv there.
    pub(super) fn at(&self, view: &View, omega_i: Direction) -> ([f64; 2], f64) {
        let d = view.turned(omega_i.vector());
        let View { sin, cos, .. } = *view;
        let (rho, [a, b], jacobian) = match self.chart {
            LightChart::SolidAngle => {
                let sin2 = d.x * d.x + d.y * d.y;
                (sin2 / (1.0 + d.z), [d.x, d.y], 1.0)
            }
            LightChart::Cosine => (d.x * d.x + d.y * d.y, [d.x, d.y], 0.5 / d.z),
            LightChart::HalfVector => {
                let h = DVec3::new(d.x + sin, d.y, d.z + cos);
                let (across, length) = (h.x.hypot(h.y), h.length());
                let along = 0.5 * length;
                let sin = (across / length).max(LEAST_RADIUS);
                (across.atan2(h.z), [h.x, h.y], 4.0 * along * sin)
            }
            LightChart::HBar => {
                let h = 0.5 * DVec2::new(d.x + sin, d.y);
                let rho = h.length().max(LEAST_RADIUS);
                (rho, [h.x, h.y], 4.0 * rho / d.z)
            }
            LightChart::Mirror => {
                let m = DVec3::new(cos * d.x + sin * d.z, d.y, cos * d.z - sin * d.x);
                let s = m.x.hypot(m.y);
                (s.atan2(m.z), [m.x, m.y], s.max(LEAST_RADIUS))
            }
        };
        let across = a.hypot(b);
        let end = self.end(view, if across > 0.0 { a / across } else { 1.0 });
        let power = self.warp.power();
        let share = (rho.max(LEAST_RADIUS) / end.max(LEAST_RADIUS)).min(1.0);
        let x = match self.warp {
            RadialWarp::Plain => share,
            RadialWarp::SquareRoot => share.sqrt(),
            RadialWarp::FourthRoot => share.sqrt().sqrt(),
        };
        let stretch = end * f64::from(power) * x.powi(power - 1) * TAU;
        ([x, turns(a, b)], jacobian * stretch)
    }
}
