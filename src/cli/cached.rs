//! Values that were found before a command was stopped.

use super::{note, say, signals};
use crate::brdf::{Brdf, Presence, SplitBrdf, of_wrapped};
use crate::error::Error;
use crate::geometry::DirectionPair;
use rustc_hash::FxHashMap;
use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// A BRDF whose values are kept in a file as they are found, `FILE.part` beside the `FILE` that is made of them.
///
/// The file begins with a line that says what they are values of. A record is a hash of the pair (16 bytes), one of the rest (8),
/// 1 for a value and 0 for none (1), and the channels (8 each, little-endian); a record that is not whole is none.
pub(super) struct CachedBrdf<'a> {
    brdf: &'a dyn Brdf,
    path: PathBuf,
    known: FxHashMap<[u8; 16], Box<[u8]>>,
    /// `None` since the disk took no more.
    file: Mutex<Option<File>>,
}

/// A hash of bytes, cut off.
fn hash<const N: usize>(bytes: &[u8]) -> [u8; N] {
    let mut cut = [0; N];
    cut.copy_from_slice(&blake3::hash(bytes).as_bytes()[..N]);
    cut
}

fn hash_of(pair: &DirectionPair) -> [u8; 16] {
    let numbers = pair.vectors().map(|v| v.to_array());
    let bytes = numbers.as_flattened().iter().flat_map(|x| x.to_le_bytes());
    hash(&bytes.collect::<Vec<u8>>())
}

impl<'a> CachedBrdf<'a> {
    /// Values of `brdf`, which is what `key` stands for, those that the file holds too; `anew`: without them.
    /// [`Error::Output`] if the file holds values of something else, or if it cannot be read and written.
    pub(super) fn new(
        brdf: &'a dyn Brdf,
        key: &str,
        output: &Path,
        anew: bool,
    ) -> Result<Self, Error> {
        let mut name = OsString::from(output);
        name.push(".part");
        let path = PathBuf::from(name);
        let failed = |e: io::Error| Error::output(&path, e);
        if anew {
            if_there(fs::remove_file(&path)).map_err(failed)?;
        }
        let head = format!("gonio values {key} {:?}\n", brdf.channels());
        let size = 25 + 8 * brdf.channels().count();
        let mut known = FxHashMap::default();
        let held = if_there(fs::read(&path)).map_err(failed)?;
        let records = match held.strip_prefix(head.as_bytes()) {
            Some(records) => records,
            // Stopped before its first record, or not there.
            None if head.as_bytes().starts_with(&held) => &[],
            None => {
                let message = "this holds values of another material, or of another version; \
                               allowed: --force to begin anew";
                return Err(failed(io::Error::other(message)));
            }
        };
        for record in records.chunks_exact(size) {
            let (pair, rest) = record.split_at(16);
            let (check, value) = rest.split_at(8);
            if check == hash::<8>(value)
                && let Ok(pair) = pair.try_into()
            {
                known.insert(pair, value.into());
            }
        }
        if !known.is_empty() {
            let (pairs, file) = (known.len(), path.display());
            note(&format!("gonio: goes on from {pairs} pairs of {file}"));
        }
        let file = OpenOptions::new().create(true).append(true).open(&path);
        let file = file.map_err(failed)?;
        let whole = head.len() + records.len() / size * size;
        if held.len() < head.len() {
            let emptied = file.set_len(0);
            emptied.and_then(|()| (&file).write_all(head.as_bytes()))
        } else {
            file.set_len(whole as u64)
        }
        .map_err(failed)?;
        Ok(Self {
            brdf,
            path,
            known,
            file: Mutex::new(Some(file)),
        })
    }

    /// Says where the values are when a signal ends the program; `anew`: one that would begin without them.
    pub(super) fn report_on_signal(&self, anew: bool) {
        let path = self.path.display().to_string();
        let again = match anew {
            true => "the same command without --force",
            false => "the same command",
        };
        signals::answer(move || {
            say(&format!(
                "gonio: interrupted; values are kept in {path}, and {again} goes on from them"
            ));
            false
        });
    }

    /// Removes the file: what was to be made of it is there.
    pub(super) fn done(self) -> Result<(), Error> {
        if_there(fs::remove_file(&self.path)).map_err(|e| Error::output(&self.path, e))
    }

    /// The value of a pair that is known.
    fn recall(&self, pair: &[u8; 16], out: &mut [f64]) -> Option<Presence> {
        let (presence, values) = self.known.get(pair)?.split_first()?;
        let (values, _) = values.as_chunks();
        let pairs = out.iter_mut().zip(values);
        pairs.for_each(|(out, bytes)| *out = f64::from_le_bytes(*bytes));
        Some(match presence {
            0 => Presence::Missing,
            _ => Presence::Present,
        })
    }

    fn keep(&self, records: &[u8]) {
        // A thread that panicked wrote whole records or none.
        let mut file = self.file.lock().unwrap_or_else(|e| e.into_inner());
        if let Some(Err(e)) = file.as_mut().map(|file| file.write_all(records)) {
            let path = self.path.display();
            say(&format!("gonio: values are no longer kept: {path}: {e}"));
            *file = None;
        }
    }
}

/// What is made of a file that may not be there.
fn if_there<T: Default>(made: io::Result<T>) -> io::Result<T> {
    match made {
        Err(e) if e.kind() == io::ErrorKind::NotFound => Ok(T::default()),
        made => made,
    }
}

impl Brdf for CachedBrdf<'_> {
    of_wrapped! {
        brdf, is_mirrored -> bool, remarks -> Vec<String>, as_split -> Option<&dyn SplitBrdf>
    }

    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        let mut presence = [Presence::Missing];
        self.eval_batch(std::slice::from_ref(pair), out, &mut presence);
        presence[0]
    }

    fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64], presence: &mut [Presence]) {
        let n = self.channels().count();
        let hashes: Vec<_> = pairs.iter().map(hash_of).collect();
        let places = (0..pairs.len()).filter(|i| {
            let found = self.recall(&hashes[*i], &mut out[n * i..][..n]);
            found.map(|found| presence[*i] = found).is_none()
        });
        let places: Vec<usize> = places.collect();
        if places.is_empty() {
            return;
        }
        let new: Vec<DirectionPair> = places.iter().map(|i| pairs[*i]).collect();
        let (values, flags) = self.brdf.values(&new);
        let mut records = Vec::new();
        for ((place, values), flag) in places.into_iter().zip(values.chunks(n)).zip(flags) {
            out[n * place..][..n].copy_from_slice(values);
            presence[place] = flag;
            let mut value = vec![u8::from(flag == Presence::Present)];
            value.extend(values.iter().flat_map(|v| v.to_le_bytes()));
            records.extend(hashes[place]);
            records.extend(hash::<8>(&value));
            records.extend(value);
        }
        self.keep(&records);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{Channels, Lambert, ObservedBrdf, Spectrum};
    use crate::geometry::Direction;
    use std::sync::atomic::{AtomicUsize, Ordering};

    fn pairs() -> Vec<DirectionPair> {
        let at = |theta: f64| Direction::from_spherical(theta, 2.0 * theta);
        (0..40)
            .map(|i| DirectionPair::new(at(0.04 * f64::from(i)), at(0.3)))
            .collect()
    }

    /// Wherever the file ends, and whatever the disk lost of it.
    #[test]
    fn values_that_are_kept_are_not_found_again() {
        let dir = tempfile::tempdir().unwrap();
        let output = dir.path().join("t.binary");
        let part = dir.path().join("t.binary.part");
        let brdf = Lambert::new(Spectrum::Grey(0.5), Channels::Rgb);
        let count = AtomicUsize::new(0);
        let watched = ObservedBrdf::new(&brdf, |_: &[f64], seen: &[Presence]| {
            count.fetch_add(seen.len(), Ordering::Relaxed);
        });
        let pairs = pairs();
        let all = || {
            let kept = CachedBrdf::new(&watched, "key", &output, false).unwrap();
            let mut values = vec![0.0; 3 * pairs.len()];
            let mut presence = vec![Presence::Missing; pairs.len()];
            let (some, rest) = values.split_at_mut(3 * 25);
            kept.eval_batch(&pairs[..25], some, &mut presence[..25]);
            kept.eval_batch(&pairs[25..], rest, &mut presence[25..]);
            (values, presence, count.swap(0, Ordering::Relaxed))
        };
        let (values, presence, asked) = all();
        assert_eq!(asked, 40);
        let whole = fs::read(&part).unwrap();
        let head = whole.len() - 40 * 49;
        // Steps that meet every place of a record.
        let ends = (0..whole.len()).step_by(11).chain([head, whole.len()]);
        for length in ends {
            fs::write(&part, &whole[..length]).unwrap();
            let again = all();
            let held = length.saturating_sub(head) / 49;
            assert_eq!(again, (values.clone(), presence.clone(), 40 - held));
            assert_eq!(fs::read(&part).unwrap(), whole, "after {length}");
        }
        // A bit of a value, and one of a pair.
        for lost in [head + 49 + 30, head + 49 + 3] {
            let mut bytes = whole.clone();
            bytes[lost] ^= 1;
            fs::write(&part, &bytes).unwrap();
            assert_eq!(all(), (values.clone(), presence.clone(), 1));
        }
        let other = CachedBrdf::new(&watched, "other", &output, false);
        let message = other.err().unwrap().to_string();
        assert!(message.contains("--force"), "{message}");
        CachedBrdf::new(&watched, "other", &output, true)
            .unwrap()
            .done()
            .unwrap();
        assert!(!part.exists());
    }
}
