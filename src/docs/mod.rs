//! Long-form pages.
//!
//! Links between pages have their targets twice: in `links.md`, which comes first here, and at the end of each page, for readers of
//! the files.

#[doc = include_str!("links.md")]
#[doc = include_str!("findings.md")]
pub mod findings {}

#[doc = include_str!("links.md")]
#[doc = include_str!("laboratory.md")]
pub mod laboratory {}

#[doc = include_str!("links.md")]
#[doc = include_str!("design.md")]
pub mod design {}

#[doc = include_str!("links.md")]
#[doc = include_str!("formats.md")]
pub mod formats {}

#[doc = include_str!("links.md")]
#[doc = include_str!("inputs.md")]
pub mod inputs {}

#[doc = include_str!("links.md")]
#[doc = include_str!("terms.md")]
pub mod terms {}

#[doc = include_str!("links.md")]
#[doc = include_str!("errata.md")]
pub mod errata {}

#[doc = include_str!("links.md")]
#[doc = include_str!("relations.md")]
#[doc = ""]
#[doc = include_str!("relations.svg")]
pub mod relations {}

#[doc = include_str!("links.md")]
#[doc = include_str!("parametrizations.md")]
#[doc = ""]
#[doc = include_str!("parametrizations.svg")]
pub mod parametrizations {}

#[doc = include_str!("links.md")]
#[doc = include_str!("moments.md")]
#[doc = ""]
#[doc = include_str!("moments.svg")]
pub mod moments {}

#[doc = include_str!("links.md")]
#[doc = include_str!("light_paths.md")]
#[doc = ""]
#[doc = include_str!("light_paths.svg")]
pub mod light_paths {}

#[doc = include_str!("links.md")]
#[doc = include_str!("planning.md")]
pub mod planning {}

#[doc = include_str!("links.md")]
#[doc = include_str!("cluster.md")]
pub mod cluster {}

#[doc = include_str!("links.md")]
#[doc = include_str!("python.md")]
pub mod python {}

#[doc = include_str!("links.md")]
#[doc = include_str!("stability.md")]
pub mod stability {}

#[doc = include_str!("links.md")]
#[doc = include_str!("changelog.md")]
pub mod changelog {}
