//! Writing of files that are whole or not there, and reading of inputs of limited size.

use std::fs::{self, File};
use std::io::{self, BufWriter, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// Bytes that a config may have: far more than anybody writes.
pub const CONFIG_LIMIT: u64 = 64 << 20;

/// Bytes that a table of poses or readings may have: ten million rows and more.
pub const TABLE_LIMIT: u64 = 4 << 30;

/// What some programs put in front of a text.
const BYTE_ORDER_MARK: char = '\u{feff}';

/// Paths of the streams of a process: the shell's `<(…)` and `/dev/stdin`.
const STREAMS: [&str; 3] = ["/dev/stdin", "/dev/fd", "/proc/self/fd"];

/// Reads a text of at most `limit` bytes from a regular file or from a stream that the process was
/// given, without the byte-order mark that some programs put in front.
///
/// # Errors
/// Whatever the file system reports, a folder, pipe or device by name (which may have no end, or
/// nobody who writes to it), a longer text, the first line that is no UTF-8.
pub fn read_text(path: &Path, limit: u64) -> io::Result<String> {
    if !STREAMS.iter().any(|stream| path.starts_with(stream)) && !fs::metadata(path)?.is_file() {
        let message = "this is no regular file; allowed: a file, or /dev/stdin";
        return Err(io::Error::new(ErrorKind::InvalidInput, message));
    }
    let mut bytes = Vec::new();
    File::open(path)?.take(limit + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit {
        let message = format!("this is too long; allowed: at most {} MB", limit >> 20);
        return Err(io::Error::new(ErrorKind::InvalidInput, message));
    }
    let mut text = String::from_utf8(bytes).map_err(|e| {
        let good = &e.as_bytes()[..e.utf8_error().valid_up_to()];
        let line = 1 + good.iter().filter(|b| **b == b'\n').count();
        let message = format!("line {line} is no UTF-8; allowed: text in UTF-8");
        io::Error::new(ErrorKind::InvalidData, message)
    })?;
    if text.starts_with(BYTE_ORDER_MARK) {
        text.drain(..BYTE_ORDER_MARK.len_utf8());
    }
    Ok(text)
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
            return Err(io::Error::new(ErrorKind::InvalidInput, message));
        }
        // Whoever makes the folder that is not there says what is in its way.
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
    let path = destination(path)?;
    if path.file_name().is_none() {
        let message = "this is no file name";
        return Err(io::Error::new(ErrorKind::InvalidInput, message));
    }
    // Not made of the name, which may be as long as the file system allows.
    static WRITTEN: AtomicU64 = AtomicU64::new(0);
    let number = WRITTEN.fetch_add(1, Ordering::Relaxed);
    let [head, tail] = PART;
    let part = path.with_file_name(format!("{head}{}-{number}{tail}", std::process::id()));
    let written = File::create(&part).and_then(|file| {
        let mut out = BufWriter::with_capacity(1 << 18, file);
        body(&mut out)?;
        out.flush()?;
        sync(out.get_ref())
    });
    let renamed = written.and_then(|()| fs::rename(&part, &path));
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

/// Removes from a folder what a crash left of files that were being written.
pub fn remove_parts(dir: &Path) {
    let [head, tail] = PART;
    for entry in fs::read_dir(dir).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let is_part = |name: &str| name.starts_with(head) && name.ends_with(tail);
        if name.to_str().is_some_and(is_part) {
            // What cannot be removed is in nobody's way.
            let _ = fs::remove_file(entry.path());
        }
    }
}

/// Puts a file on the disk, where the file system knows how to.
fn sync(file: &File) -> io::Result<()> {
    match file.sync_all() {
        Err(e) if matches!(e.kind(), ErrorKind::Unsupported | ErrorKind::InvalidInput) => Ok(()),
        result => result,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(dir: &Path) -> Vec<String> {
        let names = fs::read_dir(dir).unwrap().map(|e| e.unwrap().file_name());
        let mut names: Vec<_> = names.map(|n| n.into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn failure_leaves_nothing_and_keeps_the_old_file() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        write_atomically(&path, |out| out.write_all(b"old")).unwrap();
        let failed = write_atomically(&path, |out| {
            out.write_all(b"half")?;
            Err(io::Error::other("disk full"))
        });
        assert!(failed.is_err());
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(names(dir.path()), ["a.txt"]);
    }

    #[test]
    fn a_name_may_be_as_long_as_the_file_system_allows() {
        let dir = tempfile::tempdir().unwrap();
        let name = "n".repeat(255);
        write_atomically(&dir.path().join(&name), |out| out.write_all(b"x")).unwrap();
        assert_eq!(names(dir.path()), [name]);
    }

    #[test]
    #[cfg(unix)]
    fn links_stay_and_what_they_lead_to_is_written() {
        use std::os::unix::fs::symlink;
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        fs::create_dir(at("below")).unwrap();
        fs::write(at("below/file"), "old").unwrap();
        symlink("below/file", at("near")).unwrap();
        symlink(at("near"), at("far")).unwrap();
        symlink("below/new", at("dangling")).unwrap();
        symlink("round", at("circle")).unwrap();
        symlink("circle", at("round")).unwrap();
        for (link, file) in [
            ("far", "below/file"),
            ("near", "below/file"),
            ("dangling", "below/new"),
        ] {
            write_atomically(&at(link), |out| out.write_all(link.as_bytes())).unwrap();
            assert!(at(link).symlink_metadata().unwrap().is_symlink());
            assert!(at(file).symlink_metadata().unwrap().is_file());
            assert_eq!(fs::read_to_string(at(file)).unwrap(), link);
        }
        assert!(write_atomically(&at("circle"), |_| Ok(())).is_err());
        assert!(write_atomically(&at("below"), |_| Ok(())).is_err());
        let all = ["below", "circle", "dangling", "far", "near", "round"];
        assert_eq!(names(dir.path()), all);
        assert_eq!(names(&at("below")), ["file", "new"]);
    }

    #[test]
    fn a_text_is_utf_8_with_a_mark_in_front_or_without() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        fs::write(&path, "\u{feff}°\n\u{feff}").unwrap();
        assert_eq!(read_text(&path, 99).unwrap(), "°\n\u{feff}");
        // A degree sign in Latin-1.
        fs::write(&path, b"\xc2\xb0\nin \xb0\n").unwrap();
        let told = read_text(&path, 99).unwrap_err().to_string();
        assert_eq!(told, "line 2 is no UTF-8; allowed: text in UTF-8");
    }

    #[test]
    fn a_text_has_an_end() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.txt");
        fs::write(&path, "12345").unwrap();
        assert_eq!(read_text(&path, 5).unwrap(), "12345");
        assert!(
            read_text(&path, 4)
                .unwrap_err()
                .to_string()
                .contains("too long")
        );
        assert!(
            read_text(dir.path(), 4)
                .unwrap_err()
                .to_string()
                .contains("no regular file")
        );
    }
}
