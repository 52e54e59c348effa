//! The `gonio` program: parse, run, print the error chain, exit code.

use gonio::cli::{Cli, exit_code, say_error};
use std::process::ExitCode;

fn main() -> ExitCode {
    match Cli::read().run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            say_error(&error);
            ExitCode::from(exit_code(&error))
        }
    }
}
