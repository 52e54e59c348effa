//! Writing of files that are whole or not there, and reading of inputs of limited size.

mod encoding;

use crate::error::{IS_INPUT, reason};
use std::collections::BTreeSet;
use std::fs::{self, File};
use std::io::{self, BufWriter, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Bytes that a config may have: far more than anybody writes.
pub(crate) const CONFIG_LIMIT: u64 = 64 << 20;

/// Bytes that a table of poses or readings may have: ten million rows and more.
pub(crate) const TABLE_LIMIT: u64 = 4 << 30;

/// Bytes that a compressed file may hold, whatever it promises: as many as four channels of 16384 × 8192 pixels.
pub const UNPACKED_LIMIT: u64 = 2 << 30;

/// Bytes that one byte of a compressed file may stand for. Deflate, of all that is read, packs the most into a byte:
/// 1032.
pub const UNPACKED_A_BYTE: u64 = 1100;

/// Checks that a compressed file of `packed` bytes can hold the `unpacked` ones that its header promises, before there
/// is room made for them.
pub fn may_unpack(packed: u64, unpacked: u64) -> Result<(), String> {
    let allowed = packed.saturating_mul(UNPACKED_A_BYTE).min(UNPACKED_LIMIT);
    match unpacked <= allowed {
        true => Ok(()),
        false => Err(format!(
            "{packed} bytes promise to hold {unpacked}; allowed: {allowed}, at most {UNPACKED_A_BYTE} for each byte and {UNPACKED_LIMIT} in all"
        )),
    }
}

/// Bytes of a text that are looked at before more are read.
const PART_OF_TEXT: u64 = 1 << 20;

/// Paths of the streams of a process: the shell's `<(…)` and `/dev/stdin`.
const STREAMS: [&str; 3] = ["/dev/stdin", "/dev/fd", "/proc/self/fd"];

/// True of a stream that the process was given.
pub(crate) fn is_stream(path: &Path) -> bool {
    STREAMS.iter().any(|stream| path.starts_with(stream))
}

/// Files that were read, and files that are there and will be replaced, by where they are on the disk.
static USED: Mutex<[BTreeSet<PathBuf>; 2]> = Mutex::new([BTreeSet::new(), BTreeSet::new()]);

/// Files that are being written, by their temporary names.
static UNFINISHED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

fn lock<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}

fn refused(why: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> io::Error {
    io::Error::new(ErrorKind::InvalidInput, why)
}

/// Marks a file as an output, unless it was read. Until [`write_atomically`] has replaced it, [`open`] refuses it.
pub(crate) fn claim(path: &Path) -> io::Result<()> {
    use_once(path, [0, 1])
}

/// Puts a file among those that were read (0) or will be replaced (1), unless it is among the others.
fn use_once(path: &Path, [other, own]: [usize; 2]) -> io::Result<()> {
    // What is not there is no input.
    let Ok(place) = path.canonicalize() else {
        return Ok(());
    };
    let mut used = lock(&USED);
    if used[other].contains(&place) {
        return Err(refused(IS_INPUT));
    }
    used[own].insert(place);
    Ok(())
}

/// Opens a file to be read: a folder, a pipe or a device (which may have no end, or no writer) is an error.
pub(crate) fn open(path: &Path) -> io::Result<File> {
    open_or(path, "a file")
}

/// [`open`], with words for what is allowed.
fn open_or(path: &Path, allowed: &str) -> io::Result<File> {
    if !fs::metadata(path)?.is_file() {
        let message = format!("this is no regular file; allowed: {allowed}");
        return Err(refused(message));
    }
    use_once(path, [1, 0])?;
    File::open(path)
}

/// Reads a file of at most `limit` bytes: a longer one is an error.
pub fn read(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open(path)?.take(limit + 1).read_to_end(&mut bytes)?;
    within(limit, bytes)
}

/// These bytes, or the error of more than are allowed.
fn within(limit: u64, bytes: Vec<u8>) -> io::Result<Vec<u8>> {
    match bytes.len() as u64 <= limit {
        true => Ok(bytes),
        false => {
            let message = format!("this is too long; allowed: at most {} MB", limit >> 20);
            Err(refused(message))
        }
    }
}

/// Reads a text of at most `limit` bytes from a regular file or from a stream that the process was given: UTF-8 or UTF-16, without the
/// byte-order mark that some programs put in front.
///
/// # Errors
/// If it cannot be opened or read, is no file, is longer, or has a line that is no text.
pub fn read_text(path: &Path, limit: u64) -> io::Result<String> {
    encoding::strict(bytes_of_text(path, limit)?)
}

/// [`read_text`] of a file that other programs wrote: also compressed by gzip, in the code page 1252 of Windows, and with the line ends
/// of old Macs.
pub fn read_foreign_text(path: &Path, limit: u64) -> io::Result<String> {
    encoding::tolerant(bytes_of_text(path, limit)?, limit)
}

/// The bytes of a text, or of what holds one.
fn bytes_of_text(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    let file = match is_stream(path) {
        true => File::open(path)?,
        false => open_or(path, "a file, or /dev/stdin")?,
    };
    let long = file.metadata().map_or(0, |meta| meta.len()).min(limit) as usize;
    let mut file = file.take(limit + 1);
    let mut bytes = Vec::new();
    loop {
        let before = bytes.len();
        if file.by_ref().take(PART_OF_TEXT).read_to_end(&mut bytes)? == 0 {
            break;
        }
        // What is no text, or a hole, is no reason to read on.
        let zero = bytes[before..].iter().position(|b| *b == 0);
        if let Some(at) = zero.filter(|_| !encoding::is_packed(&bytes)) {
            return Err(encoding::refuse(&bytes[..before + at], encoding::ZERO));
        }
        bytes.reserve_exact(long.saturating_sub(bytes.len()));
    }
    within(limit, bytes)
}

/// The file that is made or replaced by writing to `path`: where a symbolic link leads, whether
/// that is there or not.
///
/// # Errors
/// If a folder, a pipe or a device is there, or if the file system does not let us look.
pub fn destination(path: &Path) -> io::Result<PathBuf> {
    match fs::metadata(path) {
        Ok(meta) if !meta.is_file() => {
            let message = "this is no regular file; allowed: a file, or a new name";
            return Err(refused(message));
        }
        // A missing folder is made later, and an obstacle is an error then.
        Err(e) if !matches!(e.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => {
            return Err(e);
        }
        Ok(_) | Err(_) => {}
    }
    // Ends: of links in a circle there is no metadata.
    let mut destination = path.to_owned();
    while let Ok(link) = fs::read_link(&destination) {
        destination.set_file_name("");
        destination.push(link);
    }
    Ok(destination)
}

/// Beginning and end of the names of files that are being written.
const PART: [&str; 2] = [".gonio-", ".part"];

/// Writes a file under a temporary name in the same folder and renames it when it is whole and on
/// the disk; on error nothing is left behind and an older file of that name is untouched. A symbolic
/// link stays, and the file that it leads to is written.
///
/// # Errors
/// Whatever [`destination`], the file system or `body` reports.
pub fn write_atomically(
    path: &Path,
    body: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> io::Result<()> {
    let mut body = Some(body);
    write_by(path, &mut |out| {
        body.take().map_or(Ok(()), |body| body(out))
    })
}

/// [`write_atomically`], compiled once and not for each body, which it calls once at most.
fn write_by(
    path: &Path,
    body: &mut dyn FnMut(&mut BufWriter<File>) -> io::Result<()>,
) -> io::Result<()> {
    let path = destination(path)?;
    if path.file_name().is_none() {
        return Err(refused("this is no file name"));
    }
    // Not made of the name, which may be as long as the file system allows.
    static WRITTEN: AtomicU64 = AtomicU64::new(0);
    let number = WRITTEN.fetch_add(1, Ordering::Relaxed);
    let [head, tail] = PART;
    let part = path.with_file_name(format!("{head}{}-{number}{tail}", std::process::id()));
    lock(&UNFINISHED).insert(part.clone());
    let written = File::create(&part).and_then(|file| {
        let mut out = BufWriter::with_capacity(1 << 18, file);
        body(&mut out)?;
        out.flush()?;
        sync(out.get_ref())
    });
    let renamed = written.and_then(|()| fs::rename(&part, &path));
    lock(&UNFINISHED).remove(&part);
    if let (Ok(()), Ok(place)) = (&renamed, path.canonicalize()) {
        for files in &mut *lock(&USED) {
            files.remove(&place);
        }
    }
    if renamed.is_err() {
        // The first error is the one to report; a leftover that cannot be removed either adds nothing.
        let _ = fs::remove_file(&part);
    } else {
        // The new name is in the folder. The file is whole with or without it on the disk.
        let folder = path.parent().filter(|dir| !dir.as_os_str().is_empty());
        let _ = File::open(folder.unwrap_or(Path::new("."))).and_then(|dir| dir.sync_all());
    }
    renamed
}

/// Removes the files that are being written: the process ends.
pub(crate) fn remove_unfinished() {
    for part in &*lock(&UNFINISHED) {
        // A leftover has a temporary name, by which `remove_parts` finds it.
        let _ = fs::remove_file(part);
    }
}

/// Removes from a folder what a crash left of files that were being written.
pub(crate) fn remove_parts(dir: &Path) {
    let [head, tail] = PART;
    for entry in fs::read_dir(dir).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let is_part = |name: &str| name.starts_with(head) && name.ends_with(tail);
        if name.to_str().is_some_and(is_part) {
            // A part that cannot be removed does no harm.
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Puts a file on the disk, where the file system supports it.
fn sync(file: &File) -> io::Result<()> {
    match file.sync_all() {
        Err(e) if matches!(e.kind(), ErrorKind::Unsupported | ErrorKind::InvalidInput) => Ok(()),
        result => result,
    }
}

/// Reason why a picture, or a map of heights, cannot be used: one sentence.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct PictureError(pub(crate) String);

impl PictureError {
    /// The error of a file that cannot be read.
    pub(crate) fn unread(why: impl std::fmt::Display) -> Self {
        Self(format!("cannot read this file: {}", reason(why)))
    }
}

impl From<io::Error> for PictureError {
    fn from(e: io::Error) -> Self {
        Self::unread(e)
    }
}

#[cfg(any(feature = "pictures", feature = "surfaces"))]
impl From<exr::error::Error> for PictureError {
    fn from(e: exr::error::Error) -> Self {
        Self::unread(e)
    }
}

/// A layer of an OpenEXR, any channels.
#[cfg(any(feature = "pictures", feature = "surfaces"))]
type ExrLayer = exr::prelude::Layer<exr::prelude::AnyChannels<exr::prelude::FlatSamples>>;

/// Bytes that a tile of an OpenEXR file may have where its whole picture has fewer: 512 × 512 pixels of four channels.
#[cfg(any(feature = "pictures", feature = "surfaces"))]
const EXR_BLOCK: usize = 4 << 20;

/// Headers of an OpenEXR file. Room for a tile is reserved before it is read, so that a large tile of a small picture is
/// refused.
#[cfg(any(feature = "pictures", feature = "surfaces"))]
pub(crate) fn exr_headers(path: &Path) -> exr::error::Result<exr::meta::Headers> {
    use exr::math::Vec2;
    use exr::meta::BlockDescription;
    let headers = exr::meta::MetaData::read_from_file(path, false)?.headers;
    for header in &headers {
        let pixel = header.channels.bytes_per_pixel;
        let bytes = |size: Vec2<usize>| size.0.saturating_mul(size.1).saturating_mul(pixel);
        let allowed = EXR_BLOCK.max(bytes(header.layer_size));
        if let BlockDescription::Tiles(tiles) = header.blocks
            && let found = bytes(tiles.tile_size)
            && found > allowed
        {
            let text = format!("a tile of pixels has {found} bytes; allowed: {allowed}");
            return Err(exr::error::Error::Invalid(text.into()));
        }
    }
    Ok(headers)
}

/// The first layer that can be read of an OpenEXR file, in its finest resolution.
#[cfg(any(feature = "pictures", feature = "surfaces"))]
pub(crate) fn exr_layer(path: &Path) -> exr::error::Result<ExrLayer> {
    exr_layer_of(std::io::BufReader::new(File::open(path)?))
}

/// The first layer that can be read of an OpenEXR file, in its finest resolution, from its bytes.
#[cfg(any(feature = "pictures", feature = "surfaces"))]
pub fn exr_layer_of(
    file: impl std::io::Read + std::io::Seek + Send,
) -> exr::error::Result<ExrLayer> {
    use exr::prelude::{ReadChannels, ReadLayers};
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(file)?;
    Ok(image.layer_data)
}
