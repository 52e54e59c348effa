//! What the README and the pages of `docs` tell the reader to type, and what that prints.

use super::Bench;
use std::env;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};

/// A file of the repository.
pub fn of_repository(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(path)
}

pub fn read(path: &str) -> String {
    fs::read_to_string(of_repository(path)).unwrap()
}

impl Bench {
    /// Has the shell do a line; all that a terminal would show.
    pub fn typed(&self, line: &str) -> (ExitStatus, String) {
        let program = Path::new(env!("CARGO_BIN_EXE_gonio")).parent().unwrap();
        let mut path = vec![program.to_owned()];
        path.extend(env::split_paths(&env::var_os("PATH").unwrap()));
        // One file for both streams keeps their order.
        let (shown, name) = (self.path(".shown"), "a file to write into");
        let out = File::create(&shown).expect(name);
        let mut shell = Command::new("sh");
        shell.args(["-c", line]).current_dir(self.path("."));
        shell.env("PATH", env::join_paths(path).unwrap());
        shell
            .stdin(Stdio::null())
            .stdout(out.try_clone().expect(name))
            .stderr(out);
        let status = shell.status().unwrap();
        (status, fs::read_to_string(shown).unwrap())
    }

    /// What a line shows that must work.
    pub fn shown(&self, line: &str) -> String {
        let (status, shown) = self.typed(line);
        assert!(status.success(), "{line}: {shown}");
        shown
    }
}
