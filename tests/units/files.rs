use crate::common::{says, table};
use gonio::files::{UNPACKED_LIMIT, may_unpack, read_text, write_atomically};
use std::io::Write;
use std::path::Path;
use std::{fs, io};

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
    for [link, file] in table("far | below/file\nnear | below/file\ndangling | below/new") {
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
fn a_text_is_utf_8_without_zero_bytes_and_has_an_end() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.txt");
    let text = |bytes: &[u8], most| {
        fs::write(&path, bytes).unwrap();
        read_text(&path, most).map_err(|e| e.to_string())
    };
    // A mark in front is none of it.
    let marked = text("\u{feff}°\n\u{feff}".as_bytes(), 99);
    assert_eq!(marked.unwrap(), "°\n\u{feff}");
    // A degree sign in Latin-1.
    let told = text(b"\xc2\xb0\nin \xb0\n", 99).unwrap_err();
    assert_eq!(told, "line 2 is no UTF-8; allowed: text in UTF-8");
    let mut bytes = b"twelve bytes".repeat(1 << 18);
    bytes.extend(b"\n\0\n");
    let told = text(&bytes, 1 << 30).unwrap_err();
    assert!(told.starts_with("line 2 has a zero byte"), "{told}");
    bytes.truncate(bytes.len() - 2);
    let whole = text(&bytes, 1 << 30).unwrap();
    assert!(whole.as_bytes() == bytes && whole.capacity() <= 2 * bytes.len());
    assert_eq!(text(b"12345", 5).unwrap(), "12345");
    for (path, why) in [(&*path, "too long"), (dir.path(), "no regular file")] {
        says(&read_text(path, 4).unwrap_err().to_string(), why);
    }
}

#[test]
fn what_is_unpacked_has_a_limit() {
    assert!(may_unpack(1000, 1_032_000).is_ok());
    let told = may_unpack(10, 1_000_000_000).unwrap_err();
    assert!(told.starts_with("10 bytes promise to hold 1000000000; allowed: 11000,"));
    assert!(may_unpack(u64::MAX, UNPACKED_LIMIT).is_ok());
    assert!(may_unpack(u64::MAX, UNPACKED_LIMIT + 1).is_err());
    assert!(may_unpack(0, 0).is_ok() && may_unpack(0, 1).is_err());
}
