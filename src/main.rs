//! The `gonio` program: parse, run, print the error chain, exit code.

use clap::Parser;
use gonio::cli::{Cli, say};
use std::error::Error;
use std::process::ExitCode;

fn main() -> ExitCode {
    match Cli::parse().run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            say(&format!("gonio: {error}"));
            let mut cause = error.source();
            while let Some(error) = cause {
                say(&format!("  because: {error}"));
                cause = error.source();
            }
            ExitCode::from(error.exit_code())
        }
    }
}
