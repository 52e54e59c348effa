//! Measured tables, and anything turned into one.

pub mod merl;
mod tabulated;
pub mod utia;

pub use tabulated::TabulatedSpec;

pub(super) use merl::ENTRY as MERL;
pub(super) use tabulated::ENTRY as TABULATED;
pub(super) use utia::ENTRY as UTIA;

use super::BuildError;
use std::path::{Path, PathBuf};

/// The extension of a MERL file.
const EXTENSION: &str = "binary";

/// What a table is called: its file, or its kind where that has no name.
fn label_of(path: &Path, kind: &str) -> String {
    let stem = path.file_stem();
    stem.map_or(kind.into(), |stem| stem.to_string_lossy().into_owned())
}

/// The MERL files (`*.binary`) directly in a folder, sorted by name.
///
/// Names that start with a dot are left out: they are other programs' side files (`._gold.binary`
/// on a disk that has seen a Mac), not tables.
///
/// # Errors
/// [`BuildError::Data`] if the folder cannot be read or holds no such file.
pub fn merl_files(dir: &Path) -> Result<Vec<PathBuf>, BuildError> {
    let fail = |message: String| BuildError::Data {
        path: dir.to_owned(),
        message,
    };
    let unreadable = |e| fail(format!("no folder to look for *.{EXTENSION} files in: {e}"));
    let mut files = Vec::new();
    for entry in std::fs::read_dir(dir).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        let hidden = path
            .file_name()
            .is_some_and(|name| name.as_encoded_bytes().starts_with(b"."));
        if !hidden && path.extension().is_some_and(|e| e == EXTENSION) && path.is_file() {
            files.push(path);
        }
    }
    if files.is_empty() {
        return Err(fail(format!(
            "this folder holds no MERL file; looked for *.{EXTENSION}"
        )));
    }
    files.sort();
    Ok(files)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_tables_are_listed_and_in_order() {
        let dir = tempfile::tempdir().unwrap();
        let message = |dir: &Path| merl_files(dir).unwrap_err().to_string();
        assert!(message(dir.path()).contains("looked for *.binary"));
        let nowhere = dir.path().join("nowhere");
        assert!(message(&nowhere).starts_with(&nowhere.display().to_string()));
        for name in ["b.binary", "a.binary", "._a.binary", "c.binary.part", "d"] {
            std::fs::write(dir.path().join(name), "").unwrap();
        }
        std::fs::create_dir(dir.path().join("e.binary")).unwrap();
        let names: Vec<_> = merl_files(dir.path())
            .unwrap()
            .into_iter()
            .map(|p| p.strip_prefix(dir.path()).unwrap().to_owned())
            .collect();
        assert_eq!(names, [Path::new("a.binary"), Path::new("b.binary")]);
    }
}
