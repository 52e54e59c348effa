//! Distant light: radiance as a function of the direction it comes from.

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
#[cfg(feature = "pictures")]
pub use hdr::HdrError;
pub use map::{Map, MapError, MapSpec};
pub use sky::SkySpec;

use crate::brdf::BuildError;
use crate::geometry::Direction;
use crate::registry::{self, Entry, Joined, ReadError, Table, Taken};
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
    fn inputs(&self) -> Vec<PathBuf>;

    /// The lighting.
    ///
    /// # Errors
    /// As [`check`](Self::check); also for pixels that are no radiance.
    fn build(&self) -> Result<Box<dyn Lighting>, BuildError>;
}

static JOINED: Joined<dyn LightingSpec> = Joined::new();

fn built_in() -> Vec<Entry<dyn LightingSpec>> {
    vec![
        constant::ENTRY,
        sky::ENTRY,
        blob::ENTRY,
        checker::ENTRY,
        map::ENTRY,
    ]
}

/// Every lighting a config can name.
pub fn all() -> Vec<Entry<dyn LightingSpec>> {
    JOINED.after(built_in())
}

/// Adds a lighting of a program's own to [`all`].
///
/// # Errors
/// If one of that kind is there.
pub fn join(entry: Entry<dyn LightingSpec>) -> Result<(), Taken> {
    JOINED.add(built_in(), entry)
}

/// Reads a lighting from its config table.
pub fn read(table: Table<'_>) -> Result<Box<dyn LightingSpec>, ReadError> {
    registry::read("lighting", &all(), table)
}

/// Largest radiance a key may have: sums of such values stay far below overflow.
const BRIGHTEST: f64 = 1e30;
