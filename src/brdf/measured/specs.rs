//! Tables in files as a config names them.

use super::{TableError, label_of};
use crate::brdf::{Brdf, BrdfSpec, BuildError, Channels, Favours, Tables};
use crate::geometry::Symmetry;
use crate::registry;
use serde::Serialize;
use std::fmt::Debug;
use std::path::Path;

/// A table in a file as a config names it. Errors do not name the file.
pub(super) trait TableFile: Debug + Serialize + Send + Sync {
    /// Name in configs.
    const KIND: &'static str;
    /// The coordinates that it was tabulated in.
    const FAVOURS: Favours;

    fn path(&self) -> &Path;

    /// Checks the keys and the header of the file, and that a scene in `channels` can make use of it.
    fn fits(&self, channels: &Channels) -> Result<(), TableError>;

    /// The channels of the file; `None` of R, G, B.
    fn channels(&self) -> Result<Option<Channels>, TableError> {
        Ok(None)
    }

    /// The symmetries that the table declares.
    fn symmetries(&self, channels: &Channels) -> Result<Symmetry, TableError>;

    fn load(&self, channels: Channels) -> Result<impl Brdf + 'static, TableError>;

    /// Bytes that the table holds, for each channel.
    fn channel_bytes(&self) -> usize;
}

impl<T: TableFile> BrdfSpec for T {
    fn resolved(&self) -> registry::Keys {
        registry::resolved(T::KIND, self)
    }

    fn label(&self) -> String {
        label_of(self.path(), T::KIND)
    }

    fn check(&self, channels: &Channels) -> Result<(), BuildError> {
        self.fits(channels).map_err(|e| e.of_file(self.path()))
    }

    fn held_channels(&self) -> Result<Option<Channels>, BuildError> {
        self.channels().map_err(|e| e.of_file(self.path()))
    }

    fn symmetry(&self, channels: &Channels) -> Result<Symmetry, BuildError> {
        self.symmetries(channels)
            .map_err(|e| e.of_file(self.path()))
    }

    fn favours(&self) -> Favours {
        T::FAVOURS
    }

    fn build(&self, channels: Channels) -> Result<Box<dyn Brdf>, BuildError> {
        let table = self.load(channels).map_err(|e| e.of_file(self.path()))?;
        Ok(Box::new(table))
    }

    fn tables(&self) -> Tables {
        Tables {
            files: vec![self.path().into()],
            channel_bytes: self.channel_bytes(),
        }
    }
}

/// A [`TableFile`]: its registry entry, its kind and summary, the coordinates that it favours, its keys beside `path` and
/// `no_reading`, each with its default, and the methods of the trait. Without examples: those must build on every machine, and
/// these kinds need a file.
macro_rules! file_table {
    (
        $kind:literal: $summary:literal, $favours:ident, { $($format:tt)* }
        $(#[$about:meta])*
        pub struct $Name:ident {
            $($(#[$attribute:meta])* $key:ident: $type:ty = $default:expr;)*
        }
        $($methods:item)*
    ) => {
        /// The format of its files.
        pub(crate) const FORMAT: FileFormat = FileFormat {
            name: $kind,
            material: Some($crate::registry::Entry {
                kind: $kind,
                summary: $summary,
                examples: &[],
                read: |table| Ok(Box::new($crate::registry::parse::<$Name>(table)?)),
            }),
            read: Some(|path| Box::new($Name::new(path))),
            $($format)*
            ..FileFormat::NONE
        };

        $(#[$about])*
        #[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct $Name {
            /// The file.
            pub path: std::path::PathBuf,
            /// One more number that stands for no reading.
            pub no_reading: Option<f64>,
            $($(#[$attribute])* pub $key: $type,)*
        }

        impl $Name {
            /// A file with every other key at its default.
            pub fn new(path: std::path::PathBuf) -> Self {
                Self {
                    path,
                    no_reading: None,
                    $($key: $default,)*
                }
            }
        }

        impl $crate::brdf::measured::specs::TableFile for $Name {
            const KIND: &'static str = $kind;
            const FAVOURS: $crate::brdf::Favours = $crate::brdf::Favours::$favours;

            fn path(&self) -> &std::path::Path {
                &self.path
            }

            $($methods)*
        }
    };
}

pub(super) use file_table;

/// Length of a file in bytes; 0 without one.
pub(super) fn length(path: &Path) -> usize {
    std::fs::metadata(path).map_or(0, |file| file.len() as usize)
}
