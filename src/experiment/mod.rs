//! Experiments: what is written ([`Config`]), what it means ([`Plan`]), and doing it
//! ([`run`](run())), the only place where all stages meet. Nothing here prints or knows a folder:
//! an [`Observer`] is told what happens.
//!
//! ```
//! use gonio::experiment::{Config, Observer, Plan, Row, Source, run};
//!
//! struct Keep(Vec<Row>);
//!
//! impl Observer for Keep {
//!     fn rows(&mut self, rows: Vec<Row>) -> Result<(), gonio::Error> {
//!         self.0.extend(rows);
//!         Ok(())
//!     }
//! }
//!
//! let text = "budgets = [100]\nmeasures = [\"cosine\"]\n[[material]]\nkind = \"lambert\"";
//! let source = Source::new("example", text);
//! let plan = Plan::new(Config::read(&source)?)?;
//! let mut keep = Keep(Vec::new());
//! let summary = run(&plan, &mut keep)?;
//! assert_eq!((plan.rows(), summary.rows), (1, 1));
//! assert!(keep.0[0].nrmse.unwrap() < 1e-12);
//! # Ok::<(), gonio::Error>(())
//! ```

mod checks;
mod config;
mod instruments;
mod kind;
mod materials;
pub mod moments;
mod observer;
mod plan;
mod readings;
pub mod relations;
mod resolved;
mod route;
mod row;
mod run;
mod source;
pub mod study;
mod wording;

pub use config::{Config, Named, Output, Quantity, Scalars, Schedules};
pub use config::{MaterialTable, ParametrizationTable, SymmetryTable};
pub use instruments::{InstrumentTable, PlannedInstrument, Use, load as load_instrument};
pub use kind::Kind;
pub use observer::{Failure, Input, Job, Observer, ScheduleKey, Seconds, Stage, Summary};
pub use plan::{Allowance, Coordinates, MAX_BUDGET, Material, Method, Plan, PlannedSet};
pub use route::{Routed, route};
pub use row::{IDEAL, Row};
pub use run::run;
pub use source::{KeyPath, Source, Step};
