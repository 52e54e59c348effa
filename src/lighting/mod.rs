//! Distant light: radiance as a function of the direction it comes from.

/// A lighting as a config names it: what [`declare!`](crate::registry::declare) needs, the keys in its label, and the
/// lighting of its keys.
macro_rules! light {
    (
        $kind:literal: $summary:literal, $examples:tt
        $(#[$about:meta])*
        pub struct $Name:ident { $($keys:tt)* }
        label: [$($label:ident),*],
        build: $build:expr,
    ) => {
        $crate::registry::declare! {
            dyn $crate::lighting::LightingSpec, $kind: $summary, $examples
            $(#[$about])*
            pub struct $Name(channels: &$crate::brdf::Channels) { $($keys)* }
        }

        impl $crate::lighting::LightingSpec for $Name {
            fn resolved(&self) -> $crate::registry::Keys {
                $crate::registry::resolved(KIND, self)
            }

            fn label(&self) -> String {
                [KIND.to_owned(), $(self.$label.to_string()),*].join("-")
            }

            fn check(&self) -> Result<(), $crate::brdf::BuildError> {
                Ok(self.check_keys(&$crate::brdf::Channels::Rgb)?)
            }

            fn build(
                &self,
            ) -> Result<Box<dyn $crate::lighting::Lighting>, $crate::brdf::BuildError> {
                self.check()?;
                let build: fn(&Self) -> _ = $build;
                Ok(Box::new(build(self)))
            }
        }
    };
}

mod blob;
mod checker;
mod constant;
#[cfg(feature = "pictures")]
mod hdr;
mod map;
mod sky;

pub use blob::BlobSpec;
pub use checker::CheckerSpec;
pub use constant::ConstantSpec;
pub use map::{Map, MapSpec};
pub use sky::SkySpec;

use crate::brdf::BuildError;
use crate::geometry::Direction;
use crate::registry::{self, family};
use std::ops::RangeInclusive;
use std::path::PathBuf;

/// Radiance that arrives from far away, the same at every point of a scene.
pub trait Lighting: Send + Sync {
    /// Radiance (linear R, G, B, each finite and ≥ 0, in arbitrary but equal units) from a
    /// direction on the whole sphere; z is up.
    fn radiance(&self, omega: Direction) -> [f64; 3];
}

/// A lighting as a config writes it.
pub trait LightingSpec: std::fmt::Debug + Send + Sync {
    /// The kind and every key with its value, defaults filled in; reading it back gives the same spec.
    fn resolved(&self) -> registry::Keys;

    /// A short name for tables and files.
    fn label(&self) -> String;

    /// Checks every parameter, and the size of every picture, without loading its pixels.
    ///
    /// # Errors
    /// Names the key, or the file and what is wrong with it.
    fn check(&self) -> Result<(), BuildError>;

    /// Files this lighting reads, for the hashes in the manifest.
    fn inputs(&self) -> Vec<PathBuf> {
        Vec::new()
    }

    /// The lighting.
    ///
    /// # Errors
    /// As [`check`](Self::check); also for pixels that are no radiance.
    fn build(&self) -> Result<Box<dyn Lighting>, BuildError>;
}

family! {
    "lighting": dyn LightingSpec = [
        constant::ENTRY,
        sky::ENTRY,
        blob::ENTRY,
        checker::ENTRY,
        map::ENTRY,
    ]
}

/// Radiance that a key may have: sums of such values stay far below overflow.
const RADIANCE: RangeInclusive<f64> = 0.0..=1e30;
