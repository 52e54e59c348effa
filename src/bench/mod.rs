//! Errors against run time: what a choice is worth for what it costs, on this machine.
//!
//! A [`Section`] is a family of choices. Each choice is a [`Ladder`] of rungs, which cost more and should err less from
//! rung to rung; a [`Rung`] is timed until its median is known and judged against a truth once. What follows from the
//! rows (seconds to reach an error, the front of Pareto, tables and diagrams) is the same for all sections.

mod engine;
mod figure;
mod ladder;
mod machine;
mod row;
mod sections;
mod table;

pub(crate) use engine::{Listener, Task};
pub(crate) use figure::svg;
pub use ladder::{Effort, Judged, Ladder, Rung, Times, Watch};
pub use machine::Machine;
pub(crate) use row::{Row, grown};
pub use row::{Time, front, reached};
pub use sections::all;
pub(crate) use table::{Layout, csv, fronts, json};

use crate::error::Error;
use std::path::PathBuf;

/// How much is measured, and of what.
#[derive(Clone, Debug, Default)]
pub struct Settings {
    /// True: few small rungs, all sections in less than 20 s on two cores.
    pub quick: bool,
    /// View elevations of moments; `None`: 90, or 1 if quick.
    pub views: Option<usize>,
    /// A MERL table in place of one of GGX 0.1.
    pub merl: Option<PathBuf>,
}

/// A number of each row beside its seconds.
#[derive(Clone, Copy, Debug)]
pub struct Column {
    /// Its name in files.
    pub name: &'static str,
    /// What it is, with its unit.
    pub summary: &'static str,
    /// Name of the column with its uncertainty; `None` of a number that is exact.
    pub uncertainty: Option<&'static str>,
}

impl Column {
    /// A number that is exact, or is not judged.
    pub(crate) const fn exact(name: &'static str, summary: &'static str) -> Self {
        Self {
            name,
            summary,
            uncertainty: None,
        }
    }

    /// A number with an uncertainty.
    pub(crate) const fn estimated(
        name: &'static str,
        uncertainty: &'static str,
        summary: &'static str,
    ) -> Self {
        Self {
            name,
            summary,
            uncertainty: Some(uncertainty),
        }
    }
}

/// A column over another.
#[derive(Clone, Copy, Debug)]
pub struct Diagram {
    /// The column along the horizontal axis; `seconds` are one.
    pub x: &'static str,
    /// The column along the vertical axis.
    pub y: &'static str,
    /// True if less is better along both: the best choices are marked.
    pub has_front: bool,
}

impl Diagram {
    /// An error over a cost.
    pub(crate) const fn error(x: &'static str, y: &'static str) -> Self {
        Self {
            x,
            y,
            has_front: true,
        }
    }

    /// A cost over a size.
    pub(crate) const fn cost(x: &'static str, y: &'static str) -> Self {
        Self {
            x,
            y,
            has_front: false,
        }
    }

    /// Name of the column that marks the rows on the front.
    pub fn column(&self) -> String {
        format!("front_{}_{}", self.y, self.x)
    }
}

/// A family of choices that are measured against the clock.
#[derive(Clone, Copy, Debug)]
pub struct Section {
    /// Its name on the command line and in files.
    pub name: &'static str,
    /// What is compared, for help and titles.
    pub summary: &'static str,
    /// Columns of names: what rows are compared within, the choice, and last the rung.
    pub names: &'static [&'static str],
    /// Number of the name that colours stand for.
    pub color: usize,
    /// Numbers of a row beside its seconds.
    pub columns: &'static [Column],
    /// Its diagrams, for each of what rows are compared within.
    pub diagrams: &'static [Diagram],
    /// Columns and values for which the seconds to reach them are printed.
    pub targets: (&'static [&'static str], &'static [f64]),
    /// The choices.
    ///
    /// # Errors
    /// Of a table that cannot be read.
    pub ladders: fn(&Settings) -> Result<Vec<Ladder>, Error>,
}

impl Section {
    /// Number of the column of a name.
    fn place(&self, column: &str) -> Option<usize> {
        self.columns.iter().position(|c| c.name == column)
    }

    pub(crate) fn number(&self, row: &Row, column: &str) -> Option<f64> {
        match column {
            "seconds" => Some(row.times.median),
            column => row.judged.values.get(self.place(column)?)?.value,
        }
    }
}
