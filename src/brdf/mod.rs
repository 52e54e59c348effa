//! Reflectance models and measured tables behind one trait.
//!
//! Values are f_r in sr⁻¹ **without** the cosine.

mod bounces;
mod channels;
mod favours;
mod formula;
mod half_vector;
mod in_channels;
mod lambert;
pub mod laws;
mod low_abc;
pub(crate) mod marks;
pub mod measured;
pub mod microfacet;
mod observed;
mod oren_nayar;
mod phong;
mod retro_reflective;
mod roughness;
mod shape;
mod sheen;
mod shifted_gamma;
mod spectrum;
mod sum;
mod test_functions;
#[cfg(any(test, feature = "stability"))]
pub(crate) mod testing;
mod ward;

pub(crate) use bounces::SumErrors;
pub use bounces::{CLASSES, LightPath, Part, Source, Split, SplitBrdf, SplitErrors};
pub use channels::{Channels, Wavelengths};
pub use favours::Favours;
pub use in_channels::InChannels;
pub use lambert::{Lambert, LambertSpec};
pub use low_abc::{LowAbc, LowAbcParameters, LowAbcSpec, Surface};
pub use marks::Marks;
pub use observed::ObservedBrdf;
pub use oren_nayar::{OrenNayar, OrenNayarSpec};
pub use phong::{Phong, PhongSpec};
pub use retro_reflective::{RetroReflective, RetroReflectiveSpec};
pub use roughness::Roughness;
pub use shape::{Shape, Shaped};
pub use sheen::{Sheen, SheenSpec};
pub use shifted_gamma::{ShiftedGamma, ShiftedGammaSpec};
pub(crate) use spectrum::Limited;
pub use spectrum::{SampledSpectrum, Spectrum};
pub use sum::{ComponentSpec, Sum, SumSpec};
pub use test_functions::TestFunctionSpec;
pub use ward::{Ward, WardSpec};

use crate::error::ParameterError;
use crate::geometry::{Direction, DirectionPair, Symmetry};
use crate::registry::{self, ReadError, family, forwarded};
use smallvec::SmallVec;
use std::path::{Path, PathBuf};

/// One number a channel; luminance and R, G, B need no memory of their own.
pub type ChannelValues = SmallVec<[f64; 3]>;

/// Presence of a value of a BRDF for a pair: a measured table may hold no data, which is neither 0 nor NaN but a fact of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub enum Presence {
    /// The values were written.
    Present,
    /// There is no data here; the values are left at 0 and mean nothing.
    Missing,
}

impl Presence {
    /// Whether there is data.
    #[inline(always)]
    pub(crate) fn of(is_there: bool) -> Self {
        match is_there {
            true => Presence::Present,
            false => Presence::Missing,
        }
    }
}

/// A bidirectional reflectance distribution function.
///
/// Values are f_r in sr⁻¹ without the cosine: 0 where a direction is not above the horizon
/// (z ≤ 0), finite and ≥ 0 above it, or [`Presence::Missing`].
pub trait Brdf: Send + Sync {
    /// What each evaluation returns.
    fn channels(&self) -> &Channels;

    /// The symmetries this BRDF has by construction.
    fn symmetry(&self) -> Symmetry;

    /// True if the directional albedo is at most 1 for every view, by construction.
    fn conserves_energy(&self) -> bool {
        false
    }

    /// True if values and their presence are the same, to rounding, mirrored through the plane of tangent and normal: then
    /// moments of a slice take its half at φ ≥ 0, and those that are odd in φ are 0. A formula can promise it; a measured
    /// table cannot, whatever [`symmetry`](Self::symmetry) it is read with.
    fn is_mirrored(&self) -> bool {
        false
    }

    /// Writes the value of each channel to `out` (length `channels().count()`).
    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence;

    /// [`eval`](Self::eval) for many pairs: `out` is pair-major (`pairs.len() × channels`), and
    /// `presence` has one entry a pair. One virtual call per batch; the loop is compiled per model.
    fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64], presence: &mut [Presence]) {
        let n = self.channels().count();
        debug_assert_eq!(out.len(), pairs.len() * n);
        debug_assert_eq!(presence.len(), pairs.len());
        for ((pair, out), presence) in pairs.iter().zip(out.chunks_exact_mut(n)).zip(presence) {
            *presence = self.eval(pair, out);
        }
    }

    /// [`eval_batch`](Self::eval_batch) of pairs of one θ_h and θ_d, as a row of a table has them: f + 10⁻³ sr⁻¹ may be off by
    /// 10⁻⁵ of it, in one cell of a thousand by 5·10⁻⁵.
    fn eval_row(&self, pairs: &[DirectionPair], out: &mut [f64], presence: &mut [Presence]) {
        self.eval_batch(pairs, out, presence);
    }

    /// The values of each channel at pairs, pair-major, and one presence a pair, as [`eval_batch`](Self::eval_batch) has them.
    fn values(&self, pairs: &[DirectionPair]) -> (Vec<f64>, Vec<Presence>) {
        let mut values = vec![0.0; pairs.len() * self.channels().count()];
        let mut presence = vec![Presence::Missing; pairs.len()];
        self.eval_batch(pairs, &mut values, &mut presence);
        (values, presence)
    }

    /// Luminance of one pair, `None` where there is no data. For single look-ups; batches are faster.
    fn luminance(&self, pair: &DirectionPair) -> Option<f64> {
        let channels = self.channels();
        let mut out = ChannelValues::from_elem(0.0, channels.count());
        match self.eval(pair, &mut out) {
            Presence::Present => Some(channels.luminance(&out)),
            Presence::Missing => None,
        }
    }

    /// What is peculiar about it, a sentence each.
    fn remarks(&self) -> Vec<String> {
        Vec::new()
    }

    /// The sampler, for models that can draw directions.
    fn as_sample(&self) -> Option<&dyn SampleBrdf> {
        None
    }

    /// Cells of its file whose number or text stands for no reading.
    fn cells_without_reading(&self) -> usize {
        0
    }

    /// Itself, if it separates light by scattering order.
    fn as_split(&self) -> Option<&dyn SplitBrdf> {
        None
    }

    /// Itself, if its values are estimates from readings.
    fn as_estimated(&self) -> Option<&dyn EstimatedBrdf> {
        None
    }

    /// The MERL table that this is: copies need its cells, some of which hold data at the horizon, where no
    /// pair is looked up.
    fn as_merl(&self) -> Option<&measured::merl::Merl> {
        None
    }
}

/// A BRDF whose values are estimates from uncertain readings.
pub trait EstimatedBrdf: Send + Sync {
    /// Standard uncertainties (k = 1) of sums of luminance Σ w f over some pairs: a list of weights for each sum, a weight for each
    /// pair. `None` where nothing is known of the errors of the readings.
    fn uncertainties_of_sums(
        &self,
        pairs: &[DirectionPair],
        weights: &[Vec<f64>],
    ) -> Option<Vec<f64>>;

    /// Makes what all sums need, before many threads ask for some.
    fn prepare(&self) {}
}

/// Drawing of light directions in proportion (roughly) to a BRDF times cos θ_i.
pub trait SampleBrdf: Send + Sync {
    /// A light direction for the sensor direction `omega_o` from two numbers in `[0, 1)`;
    /// `None` if the draw falls below the horizon.
    fn sample(&self, omega_o: Direction, u: [f64; 2]) -> Option<Direction>;

    /// Probability density of [`sample`](Self::sample), per steradian of omega_i. Integrates to
    /// 1 minus the share of draws below the horizon.
    fn pdf(&self, pair: &DirectionPair) -> f64;
}

/// The facts of a wrapper that are those of the BRDF in one of its fields, and other methods that return what its methods do.
macro_rules! of_wrapped {
    ($field:tt $(, $method:ident -> $Value:ty)*) => {
        $crate::registry::forwarded! {
            $field: channels -> &$crate::brdf::Channels,
            symmetry -> $crate::geometry::Symmetry,
            conserves_energy -> bool,
            $($method -> $Value),*
        }
    };
}
pub(crate) use of_wrapped;

/// A material as a config writes it, checked and turned into a BRDF in two steps, so that a
/// wrong value costs one second and a large table is only loaded when its turn comes.
pub trait BrdfSpec: std::fmt::Debug + Send + Sync {
    /// The kind and every key with its value, defaults filled in; reading it back gives the same spec.
    fn resolved(&self) -> registry::Keys;

    /// A short name that distinguishes this material from others of its kind, e.g. `ggx-0.3`.
    fn label(&self) -> String;

    /// Checks every parameter, that a scene in `channels` can make use of it, and the header and size
    /// of every file, without loading tables.
    fn check(&self, channels: &Channels) -> Result<(), BuildError>;

    /// The channels that the file of a table holds, where it says which; `None` of what has values in any.
    ///
    /// # Errors
    /// [`BuildError::Data`] of a file that cannot be read.
    fn held_channels(&self) -> Result<Option<Channels>, BuildError> {
        Ok(None)
    }

    /// The channels in which it loses nothing: those that its file holds, else R, G, B if it has values in them, else luminance.
    fn widest_channels(&self) -> Result<Channels, BuildError> {
        let held = self.held_channels()?;
        Ok(held.unwrap_or_else(|| match self.check(&Channels::Rgb) {
            Ok(()) => Channels::Rgb,
            Err(_) => Channels::Luminance,
        }))
    }

    /// The symmetries the BRDF will declare. Schedules are planned before tables are loaded, so a
    /// kind that is slow to build answers this without building.
    fn symmetry(&self, channels: &Channels) -> Result<Symmetry, BuildError> {
        Ok(self.build(channels.clone())?.symmetry())
    }

    /// The coordinates this truth favours by its formula, or by how it was tabulated; known without
    /// building or reading it.
    fn favours(&self) -> Favours {
        Favours::Neither
    }

    /// What is peculiar about its files, or may be wrong, a sentence each; called after [`check`](Self::check).
    fn remarks(&self) -> Vec<String> {
        Vec::new()
    }

    /// True if f_r is one number above the horizon: it then favours no coordinates, and a lobe
    /// that is added to it keeps what it favours.
    fn is_constant(&self) -> bool {
        false
    }

    /// Builds the BRDF for a scene in `channels`.
    fn build(&self, channels: Channels) -> Result<Box<dyn Brdf>, BuildError>;

    /// The files this material reads and the tables it holds; those of a formula unless it says otherwise.
    fn tables(&self) -> Tables {
        Tables::NONE
    }
}

/// What a material reads, and what it holds once it is built.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tables {
    /// Files, for the hashes in the manifest.
    pub files: Vec<PathBuf>,
    /// Bytes of its tables, for each channel.
    pub channel_bytes: usize,
}

impl Tables {
    /// Those of a formula.
    pub const NONE: Self = Self {
        files: Vec::new(),
        channel_bytes: 0,
    };
}

/// Reason why a material could not be built.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BuildError {
    /// A parameter outside its range: the config's author must act.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// A file that cannot be used: the data's owner must act.
    #[error("{}: {message}", path.display())]
    Data {
        /// The file.
        path: PathBuf,
        /// The message, one sentence.
        message: String,
    },
}

impl BuildError {
    /// This error for a table inside `table`: a parameter's key gets that prefix.
    pub fn within(self, table: &str) -> Self {
        match self {
            BuildError::Parameter(e) => e.within(table).into(),
            data => data,
        }
    }

    /// That of a file, in one sentence.
    pub fn data(path: &Path, message: impl std::fmt::Display) -> Self {
        BuildError::Data {
            path: path.into(),
            message: message.to_string(),
        }
    }
}

family! {
    "material": dyn BrdfSpec = [
        lambert::ENTRY,
        oren_nayar::ENTRY,
        phong::ENTRY,
        ward::ENTRY,
        microfacet::GGX,
        microfacet::BECKMANN,
        low_abc::entry::<0>(),
        low_abc::entry::<1>(),
        shifted_gamma::ENTRY,
        sheen::ENTRY,
        retro_reflective::ENTRY,
        test_functions::entry::<0>(),
        test_functions::entry::<1>(),
        test_functions::entry::<2>(),
        sum::ENTRY,
    ] + measured::entries()
}

/// Reads a material from keys, as [`BrdfSpec::resolved`] gives them.
pub(crate) fn read_keys(keys: registry::Keys) -> Result<Box<dyn BrdfSpec>, ReadError> {
    registry::read_keys("material", &all(), keys)
}
