//! The three test functions of Barla, Belcour and Pacanowski 2015 (section 3), each a caricature of
//! one effect, made to see how a parametrization bends it:
//!
//! | kind | function | effect |
//! |---|---|---|
//! | `test-f` | F = 1 − cos θ_d = 1 − \|h\| | Fresnel |
//! | `test-s` | S = 1 − \|h̄\| | specular peak |
//! | `test-g` | G = 1 − (ω_i·n)(ω_o·n) | grazing |
//!
//! Values in [0, 1], read as sr⁻¹; no parameters. They are not materials: the directional albedo
//! may reach π. h = (ω_i + ω_o)/2 is not normalised and h̄ is its tangent-plane part.
//!
//! **Errata** of the paper: one transcription prints S = 1 − |h|, which is F; and G as printed equals 1
//! on the horizon, not 0: the isoline meant is (ω_i·n)(ω_o·n) = 0.

use super::shape::{BLACK, Shape, Shaped};
use super::{Brdf, BrdfSpec, BuildError, Channels, Favours, Spectrum};
use crate::geometry::DirectionPair;
use crate::registry::{self, Entry, NoKeys, ReadError, Table};

/// The Fresnel test function.
pub const F: Entry<dyn BrdfSpec> = Entry {
    kind: "test-f",
    summary: "Fresnel test function 1 - cos theta_d of Barla et al. 2015",
    examples: &[""],
    read: |table| read(table, TestFunctionSpec::F),
};

/// The specular test function.
pub const S: Entry<dyn BrdfSpec> = Entry {
    kind: "test-s",
    summary: "specular test function 1 - |h_bar| of Barla et al. 2015",
    examples: &[""],
    read: |table| read(table, TestFunctionSpec::S),
};

/// The grazing test function.
pub const G: Entry<dyn BrdfSpec> = Entry {
    kind: "test-g",
    summary: "grazing test function 1 - cos theta_i cos theta_o of Barla et al. 2015",
    examples: &[""],
    read: |table| read(table, TestFunctionSpec::G),
};

fn read(table: Table<'_>, spec: TestFunctionSpec) -> Result<Box<dyn BrdfSpec>, ReadError> {
    registry::parse::<NoKeys>(table)?;
    Ok(Box::new(spec))
}

/// A test function, as a config writes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TestFunctionSpec {
    /// 1 − |h|.
    F,
    /// 1 − |h̄|.
    S,
    /// 1 − cos θ_i cos θ_o.
    G,
}

impl TestFunctionSpec {
    fn kind(self) -> &'static str {
        match self {
            TestFunctionSpec::F => F.kind,
            TestFunctionSpec::S => S.kind,
            TestFunctionSpec::G => G.kind,
        }
    }
}

impl BrdfSpec for TestFunctionSpec {
    fn resolved(&self) -> registry::Keys {
        registry::resolved(self.kind(), &NoKeys {})
    }

    fn label(&self) -> String {
        self.kind().into()
    }

    fn check(&self, _channels: &Channels) -> Result<(), BuildError> {
        Ok(())
    }

    fn favours(&self) -> Favours {
        match self {
            TestFunctionSpec::S => Favours::ProjectedHalf,
            TestFunctionSpec::F | TestFunctionSpec::G => Favours::Neither,
        }
    }

    fn build(&self, channels: Channels) -> Result<Box<dyn Brdf>, BuildError> {
        let scale = (&Spectrum::Grey(1.0), 1.0);
        Ok(Box::new(TestFunction::on_base(
            BLACK, scale, *self, channels,
        )))
    }
}

/// A test function as a BRDF.
pub type TestFunction = Shaped<TestFunctionSpec>;

impl Shape for TestFunctionSpec {
    const IS_SAMPLED: bool = false;

    #[inline]
    fn value(&self, pair: &DirectionPair) -> f64 {
        let (h, k) = pair.half_and_back();
        match self {
            // 1 − |h| = |k|²/(1 + |h|): near retro-reflection the difference would cancel.
            TestFunctionSpec::F => k.length_squared() / (1.0 + h.length()),
            TestFunctionSpec::S => (1.0 - h.truncate().length()).max(0.0),
            TestFunctionSpec::G => {
                (1.0 - pair.omega_i.cos_theta() * pair.omega_o.cos_theta()).max(0.0)
            }
        }
    }
}
