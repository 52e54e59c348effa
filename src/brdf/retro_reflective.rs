//! A material that sends back what another one mirrors: glass beads, cat's eyes, dust.
//!
//! f_r(ω_i, ω_o) = f(ω_i, R ω_o),  R ω_o = (−x, −y, z),  f the BRDF of the material `of`.
//!
//! The peak that f has at the mirror direction lies at the light itself. R is a half turn of one
//! direction, which keeps cosines and solid angles: each directional albedo is that of f at R ω_o, so
//! energy is conserved if f conserves it. Turns and mirrors of the sample commute with R, so f's
//! isotropy and bilateral symmetry stay. Exchanging light and sensor gives f(R ω_i, ω_o) after
//! f's own reciprocity, which is the same only if a half turn of the sample changes nothing:
//! reciprocity stays if f is isotropic, or bilateral about both tangent axes.

use super::{Brdf, BrdfSpec, BuildError, Channels, Presence, SampleBrdf, Tables, forwarded};
use crate::geometry::{Direction, DirectionPair, Symmetry};
use crate::registry::{self, Entry, ReadError, Table, only};
use glam::DVec3;

const KIND: &str = "retro-reflective";

/// The registry entry.
pub const ENTRY: Entry<dyn BrdfSpec> = Entry {
    kind: KIND,
    summary: "another material with its peak turned back to the light",
    examples: &[
        "of = { kind = \"ggx\", alpha = 0.3 }",
        "of = { kind = \"ward\", alpha = [0.15, 0.4] }",
    ],
    read,
};

/// A retro-reflective material, as a config writes it.
#[derive(Debug)]
pub struct RetroReflectiveSpec {
    /// The material whose peak is turned.
    pub of: Box<dyn BrdfSpec>,
}

fn read(mut table: Table<'_>) -> Result<Box<dyn BrdfSpec>, ReadError> {
    let of = registry::take_table(&mut table, "of")?;
    let span = table.span();
    only!(table, "of")?;
    let Some(of) = of else {
        let message = "of is missing from the retro-reflective material; allowed: the table of a \
                       material, e.g. of = { kind = \"ggx\" }";
        return Err(ReadError::new(span, message));
    };
    let of = super::read(of)?;
    Ok(Box::new(RetroReflectiveSpec { of }))
}

impl BrdfSpec for RetroReflectiveSpec {
    fn resolved(&self) -> registry::Keys {
        registry::nested(KIND, "of", self.of.resolved())
    }

    fn label(&self) -> String {
        format!("{KIND}-{}", self.of.label())
    }

    fn check(&self, channels: &Channels) -> Result<(), BuildError> {
        self.of.check(channels).map_err(|e| e.within("of"))
    }

    fn symmetry(&self, channels: &Channels) -> Result<Symmetry, BuildError> {
        let of = self.of.symmetry(channels).map_err(|e| e.within("of"))?;
        Ok(symmetry(of))
    }

    fn build(&self, channels: Channels) -> Result<Box<dyn Brdf>, BuildError> {
        let of = self.of.build(channels).map_err(|e| e.within("of"))?;
        Ok(Box::new(RetroReflective::new(of)))
    }

    forwarded!(of: is_constant -> bool, remarks -> Vec<String>, tables -> Tables);
}

/// The symmetries that are left of those of the material inside.
fn symmetry(of: Symmetry) -> Symmetry {
    Symmetry {
        reciprocal: of.reciprocal && (of.isotropic || of.bilateral),
        ..of
    }
}

/// A BRDF with its peak turned back to the light.
pub struct RetroReflective {
    of: Box<dyn Brdf>,
}

impl RetroReflective {
    /// The retro-reflective form of a BRDF.
    pub fn new(of: Box<dyn Brdf>) -> Self {
        Self { of }
    }
}

/// R ω_o.
#[inline]
fn half_turn(omega_o: Direction) -> Direction {
    Direction::from_unit(omega_o.vector() * DVec3::new(-1.0, -1.0, 1.0))
}

#[inline]
fn turned(pair: &DirectionPair) -> DirectionPair {
    DirectionPair::new(pair.omega_i, half_turn(pair.omega_o))
}

impl Brdf for RetroReflective {
    forwarded!(of: channels -> &Channels, conserves_energy -> bool, is_mirrored -> bool);

    fn symmetry(&self) -> Symmetry {
        symmetry(self.of.symmetry())
    }

    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        self.of.eval(&turned(pair), out)
    }

    fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64], presence: &mut [Presence]) {
        let pairs: Vec<_> = pairs.iter().map(turned).collect();
        self.of.eval_batch(&pairs, out, presence);
    }

    fn as_sample(&self) -> Option<&dyn SampleBrdf> {
        self.of.as_sample().is_some().then_some(self)
    }
}

impl SampleBrdf for RetroReflective {
    fn sample(&self, omega_o: Direction, u: [f64; 2]) -> Option<Direction> {
        self.of.as_sample()?.sample(half_turn(omega_o), u)
    }

    fn pdf(&self, pair: &DirectionPair) -> f64 {
        let of = self.of.as_sample();
        of.map_or(0.0, |of| of.pdf(&turned(pair)))
    }
}
