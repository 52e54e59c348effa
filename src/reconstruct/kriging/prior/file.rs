//! Files of priors: a line of JSON, then the values of each configuration of the lattice and the centres, half
//! precision, the lowest byte first.

use super::{About, Prior};
use crate::error::reason;
use crate::files;
use half::f16;
use nalgebra::DMatrix;
use std::io::{self, Error, ErrorKind};
use std::path::Path;

/// The version that is written and read.
pub(super) const VERSION: u32 = 2;

/// Size of a file, at most: one that is larger is no prior.
const MOST: u64 = 1 << 28;

impl Prior {
    /// The bytes of a file.
    pub fn to_bytes(&self) -> Vec<u8> {
        [line(&self.about).as_bytes(), b"\n", &bytes(&self.values)].concat()
    }

    /// Reads a file.
    ///
    /// # Errors
    /// If it cannot be read, is of another version, or was changed.
    pub fn read(path: &Path) -> io::Result<Self> {
        let refuse = |why: &str| Error::new(ErrorKind::InvalidData, why.to_owned());
        Self::decode(&files::read(path, MOST)?).map_err(|why| refuse(&why))
    }

    pub(super) fn decode(bytes: &[u8]) -> Result<Self, String> {
        #[derive(serde::Deserialize)]
        struct Version {
            gonio_prior: u32,
        }
        let end = bytes.iter().position(|b| *b == b'\n');
        let (line, body) = bytes.split_at(end.ok_or("it is something else")?);
        let body = &body[1..];
        let version: Version = serde_json::from_slice(line).map_err(|_| "it is something else")?;
        if version.gonio_prior != VERSION {
            return Err(format!(
                "it has version {}, this program reads {VERSION}",
                version.gonio_prior
            ));
        }
        let about: About = serde_json::from_slice(line).map_err(reason)?;
        if hash(&about, body) != about.blake3 {
            return Err("it was changed or cut".into());
        }
        let values = body
            .chunks_exact(2)
            .map(|b| f16::from_le_bytes([b[0], b[1]]));
        Self::new(about, values.collect())
            .ok_or_else(|| "its numbers do not suit each other".into())
    }

    /// The prior of these values, a row of [`BEFORE`](super::BEFORE) and the functions for each configuration, and these
    /// centres.
    pub(super) fn from_values(
        mut about: About,
        values: Vec<f64>,
        centres: &DMatrix<f64>,
    ) -> Option<Self> {
        let all = values.iter().chain(centres.iter());
        let values: Vec<f16> = all.map(|x| f16::from_f64(*x)).collect();
        about.blake3 = hash(&about, &bytes(&values));
        Self::new(about, values)
    }
}

fn line(about: &About) -> String {
    serde_json::to_string(about).unwrap_or_else(|_| unreachable!("numbers and strings"))
}

/// The hash of the whole content of a file.
pub(super) fn hash(about: &About, body: &[u8]) -> String {
    let nameless = About {
        blake3: String::new(),
        ..about.clone()
    };
    let mut hasher = blake3::Hasher::new();
    hasher.update(line(&nameless).as_bytes());
    hasher.update(body);
    hasher.finalize().to_hex().to_string()
}

fn bytes(values: &[f16]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_le_bytes()).collect()
}
