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
use crate::registry::{self, Entry, NoKeys, named};

named! {
    /// A test function, as a config writes it.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum TestFunctionSpec {
        /// 1 − |h|.
        F = "test-f": "Fresnel test function 1 - cos theta_d of Barla et al. 2015",
        /// 1 − |h̄|.
        S = "test-s": "specular test function 1 - |h_bar| of Barla et al. 2015",
        /// 1 − cos θ_i cos θ_o.
        G = "test-g": "grazing test function 1 - cos theta_i cos theta_o of Barla et al. 2015",
    }
}

/// The registry entry of function `I` of all.
pub fn entry<const I: usize>() -> Entry<dyn BrdfSpec> {
    Entry {
        kind: TestFunctionSpec::ALL[I].name(),
        summary: TestFunctionSpec::ALL[I].summary(),
        examples: &[""],
        read: |table| {
            registry::parse::<NoKeys>(table)?;
            Ok(Box::new(TestFunctionSpec::ALL[I]))
        },
    }
}

impl BrdfSpec for TestFunctionSpec {
    fn resolved(&self) -> registry::Keys {
        registry::resolved(self.name(), &NoKeys {})
    }

    fn label(&self) -> String {
        self.name().into()
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
        let one = (&Spectrum::Grey(1.0), 1.0);
        Ok(Box::new(Shaped::on_base(BLACK, one, *self, channels)))
    }
}

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
