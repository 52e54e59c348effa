//! A page that shows materials, coordinates, arms, readings and uncertainties, and answers a hand: one file that asks for no other.
//!
//! Numbers, colours and words are computed here; its script evaluates tables between nodes, maps pairs of directions to coordinates
//! and back (for which a browser cannot ask), and draws. Everything is in the page, and its policy forbids requests.

mod carried;
mod facts;
mod packed;
mod page;
mod readings;
mod script;
mod table;

pub use carried::Carried;
pub(crate) use page::explored;
pub use page::{Exploration, ShownMaterial, ShownReadings};
