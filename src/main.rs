//! The `gonio` command.

fn main() {}
