//! `gonio merge`.
