//! Experiments: what is written ([`Config`]), what it means ([`Plan`]), and doing it
//! ([`run`](run())), the only place where all stages meet. Nothing here prints or knows a folder:
//! an [`Observer`] is told what happens.

mod checks;
mod config;
mod materials;
mod observer;
mod plan;
mod resolved;
mod row;
mod run;
mod source;
mod wording;

pub use config::{Config, Named, Output, Scalars, Schedules};
pub use config::{MaterialTable, ParametrizationTable, SymmetryTable};
pub use observer::{Failure, Input, Job, Observer, ScheduleKey, Seconds, Stage, Summary};
pub use plan::{Coordinates, MAX_BUDGET, Material, Method, Plan, PlannedSet};
pub use row::Row;
pub use run::run;
pub use source::{KeyPath, Source, Step};
