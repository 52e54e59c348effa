//! Output of a run: the printed tables, the files of a run's folder, diagrams and pictures.

mod acquisition;
mod analysis;
mod columns;
#[cfg(feature = "pictures")]
pub mod explore;
mod moments;
#[cfg(feature = "pictures")]
pub mod pictures;
mod run;
pub(crate) mod schema;
#[cfg(feature = "stability")]
mod stability;
#[cfg(feature = "pictures")]
mod svg;

pub use acquisition::*;
pub use analysis::*;
pub use columns::Columns;
pub use moments::*;
pub use run::*;

#[cfg(all(feature = "stability", feature = "pictures"))]
pub(crate) use stability::stability_html;
#[cfg(feature = "stability")]
pub use stability::{broken, stability_table};

#[cfg(feature = "pictures")]
pub use pictures::{
    FilterEllipse, FlatSlice, RESOLUTION, Radius, SphereImage, THETA_O_DEG, slice_svg, sphere_svg,
    write_slice,
};
#[cfg(feature = "pictures")]
pub use svg::plot::{Axis, Forest, ForestGroup, ForestLine, Mark, Panel, Scale, Series};
#[cfg(feature = "pictures")]
pub use svg::{forest_svg, labelled, svg};

pub(crate) use crate::experiment::{each_once, first_of_each};

use std::fmt::Display;

/// Files of tables, and their columns with their meaning, a paragraph each; groups of like columns share a line.
pub const TABLE_COLUMNS: &str = include_str!("columns.txt");

/// Values by their keys, in the order of the first of each key.
pub(crate) fn grouped<K: PartialEq, V>(
    items: impl IntoIterator<Item = (K, V)>,
) -> Vec<(K, Vec<V>)> {
    let mut groups: Vec<(K, Vec<V>)> = Vec::new();
    for (key, value) in items {
        match groups.iter_mut().find(|(known, _)| *known == key) {
            Some((_, values)) => values.push(value),
            None => groups.push((key, vec![value])),
        }
    }
    groups
}

/// What writing to memory gives: memory takes every byte, and what is written there has a form for every value.
pub(crate) fn in_memory<T, E: Display>(written: Result<T, E>) -> T {
    written.unwrap_or_else(|e| unreachable!("memory takes every byte: {e}"))
}
