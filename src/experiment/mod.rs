//! Experiments: a config, the [`Plan`] read from it, and its run ([`Experiment::run`]), the only place where
//! all stages meet. Nothing here prints or writes into a folder: an [`Observer`] receives the events of a run.
//!
//! ```
//! use gonio::experiment::{Event, Experiment, Extent, Known, Observer, Plan, Row, Source};
//!
//! struct Keep(Vec<Row>);
//!
//! impl Observer<Row> for Keep {
//!     fn observe(&mut self, event: &Event<'_, Row>) -> Result<(), gonio::Error> {
//!         if let Event::Made(rows) = event {
//!             self.0.extend_from_slice(rows);
//!         }
//!         Ok(())
//!     }
//! }
//!
//! let text = "budgets = [100]\nmeasures = [\"cosine\"]\n[[material]]\nkind = \"lambert\"";
//! let plan = Plan::read(&Source::new("example", text))?;
//! let mut keep = Keep(Vec::new());
//! let summary = plan.run(&Extent::default(), &Known::default(), &mut keep)?;
//! assert_eq!((plan.rows(), summary.rows), (1, 1));
//! assert!(keep.0[0].value("nrmse").unwrap() < 1e-12);
//! # Ok::<(), gonio::Error>(())
//! ```
//!
//! A plan of values instead of a text starts from the defaults:
//!
//! ```
//! use gonio::brdf::microfacet::{FresnelSpec, Ggx, MicrofacetSpec};
//! use gonio::brdf::{BrdfSpec, Roughness};
//! use gonio::experiment::{Config, MaterialTable, Named, Plan, Reach, Source};
//! use gonio::parametrization::{Form, Hybrid, ParametrizationSpec, Warps};
//! use gonio::reconstruct::{Cubic, Reconstruct};
//!
//! let source = Source::new("my program", "");
//! let mut config = Config::read(&source)?;
//! let ggx = MicrofacetSpec::<Ggx>::new(Roughness::Isotropic(0.3), FresnelSpec::default());
//! let ggx: Box<dyn BrdfSpec> = Box::new(ggx);
//! config.materials = vec![MaterialTable::from(ggx)];
//! let hybrid = ParametrizationSpec::new::<Form<Hybrid>>(Warps::new());
//! config.parametrizations = vec![hybrid];
//! let cubic: Box<dyn Reconstruct> = Box::new(Cubic::default());
//! config.reconstructions = vec![(Named::from(cubic), Reach::default())];
//! config.scalars.budgets = vec![100, 400];
//! let plan = Plan::new(config)?;
//! assert_eq!(plan.jobs(), 2);
//! # Ok::<(), gonio::Error>(())
//! ```

mod advice;
mod any;
mod checks;
mod choices;
mod config;
mod counts;
mod each;
mod evaluator;
mod findings;
mod instruments;
mod key;

mod kind;

mod material_batch;
mod materials;
pub mod moments;
mod observer;
mod of_readings;
mod pictures;
mod plan;
mod preview;
mod priors;
mod question;
mod readings;
mod record;
pub mod relations;
mod route;
mod row;
mod run;
mod schedules;
mod schema;
mod source;
mod stop;
mod tables;
mod training;
mod tuning;
mod wording;

pub(crate) use advice::quoted;
pub use advice::{ADVICE, Advice, AdviceSpec, Advised, AgainstFirst, FORMULAS, Spread};
pub use any::AnyPlan;
pub(crate) use checks::{each_once, first_of_each};
#[cfg(feature = "cli")]
pub(crate) use choices::POSES_A_MINUTE;
pub(crate) use choices::are_named;
pub use choices::{
    Allowance, Choice, Coordinates, DEFAULT, IDEAL, MAX_BUDGET, Material, Method, NONE, OWN,
    PlannedSet, Reach, UsedIn,
};
#[cfg(feature = "cli")]
pub(crate) use config::is_config_key;
pub use config::{Config, MAX_MINUTES, Output, Scalars, Schedules};
pub use counts::{Built, Counters, Counts, Seconds, Stage, Work};
pub use findings::{
    Calibrated, Calibration, Cell, Duel, Duels, Explained, Findings, LevelLine, Levels, Line,
    Metric, Needed, Ranking, Scope,
};
pub use instruments::{InstrumentTable, PlannedInstrument, Use, load as load_instrument};
pub use key::{Expected, Input, RESULTS_REVISION, RowKey, asks_the_same, content, material_key};
pub use kind::{Kind, QuantityGroup};
pub use materials::{MaterialTable, SymmetryTable, all as materials, split_of};
pub use observer::{ByProduct, Event, Failure, Job, Observer, ScheduleKey, Summary};
pub use of_readings::{ReadingsSpec, keys_of_file};
pub use plan::Plan;
pub(crate) use preview::preview;
pub use question::{Factor, ReportSpec};
pub use record::{Experiment, Extent, Head, Known, Record, Shard, ShardError};
pub(crate) use route::Router;
pub use row::{Quantities, Row, quantities};
pub use schedules::{Share, Unit};
pub(crate) use schema::{config_schema, instrument_schema};
pub use source::Source;
pub use tables::Named;
pub use training::{TuningKeys, TuningTable};
pub(crate) use tuning::Tuned;
