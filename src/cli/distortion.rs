//! `gonio distortion`.

use super::{BrdfArgs, OutputArgs, ThreadArgs, choice_of, refuse_other_endings, write_text};
use crate::analysis::{self, Averaging, Scale, View, Weight};
use crate::brdf::Brdf;
use crate::error::Error;
use crate::geometry::{DirectionPair, Symmetry};
use crate::metrics::{self, Measure, MetricsSpec};
use crate::parametrization;
use crate::registry::Entry;
use crate::report::{
    AlignmentRow, ReductionRow, SharesRow, alignment_svg, alignment_table, reduction_table,
    shares_table, stretch_table,
};
use crate::schedule::Choice;
use clap::{ArgGroup, Args, ValueEnum};
use serde::Serialize;
use std::path::PathBuf;

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Table {
    /// Share of the variance that one axis explains, and two; energy of the gradient along each
    Shares,
    /// The share that two axes explain, over all materials, beside that of half/difference coordinates
    Alignment,
    /// Errors of the average over the azimuth, in each parametrization
    Reduction,
    /// Longest over shortest way of a small step in coordinates; the same for every material
    Stretch,
}

/// Of what number shares are.
const SCALES: [Choice<Scale>; 2] = choices! {
    "value", "f, in 1/sr" => Scale::Value;
    "log", "ln(f + 1e-3)" => Scale::Log;
};

/// What a node counts.
const WEIGHTS: [Choice<Weight>; 2] = choices! {
    "coordinates", "Nodes in equal steps of the coordinates count the same" => Weight::Coordinates;
    "solid-angle", "Nodes count as the steradians² they stand for" => Weight::SolidAngle;
};

#[derive(Debug, Args)]
#[command(group = ArgGroup::new("files").multiple(true))]
pub(super) struct Distortion {
    #[command(flatten)]
    brdf: BrdfArgs,
    #[command(flatten)]
    threads: ThreadArgs,
    /// What is measured
    #[arg(long, value_enum, default_value = "shares")]
    table: Table,
    /// For shares and alignment: of what number [default: value for the test functions, log for the others]
    #[arg(long, value_parser = choice_of(&SCALES))]
    scale: Option<Scale>,
    /// For shares: what a node counts
    #[arg(long, value_parser = choice_of(&WEIGHTS), default_value = "coordinates")]
    weight: Weight,
    /// For alignment: draw it, material by material, into this file (*.svg) as well
    #[arg(long, value_name = "FILE", group = "files")]
    picture: Option<PathBuf>,
    #[command(flatten)]
    output: OutputArgs,
}

impl Distortion {
    pub(super) fn run(self) -> Result<(), Error> {
        self.threads.apply()?;
        self.output.check()?;
        refuse_other_endings(self.picture.as_deref(), "svg")?;
        self.output.check_also(self.picture.as_deref())?;
        if self.picture.is_some() && self.table != Table::Alignment {
            let message = "this table has no picture; allowed: --table alignment";
            return Err(Error::config("--picture", message));
        }
        match self.table {
            Table::Shares => self.shares(),
            Table::Alignment => self.alignment(),
            Table::Reduction => self.reduction(),
            Table::Stretch => self.stretch(),
        }
    }

    fn shares(&self) -> Result<(), Error> {
        let (rows, outcome) = self.all_shares(&[self.weight], true);
        self.write(&rows, shares_table, outcome)
    }

    fn alignment(&self) -> Result<(), Error> {
        let (rows, outcome) = self.all_shares(&Weight::ALL, false);
        self.write(&AlignmentRow::rows(&rows), alignment_table, outcome)?;
        match &self.picture {
            Some(path) => write_text(path, &alignment_svg(&rows)),
            None => Ok(()),
        }
    }

    /// The shares of every material in every parametrization; `gradients`: the energies of its gradient, too.
    fn all_shares(
        &self,
        weights: &[Weight],
        gradients: bool,
    ) -> (Vec<SharesRow>, Result<(), Error>) {
        let mut rows = Vec::new();
        let outcome = self.brdf.each(self.output.place(), |material, brdf| {
            let scale = match self.scale {
                Some(scale) => scale,
                None if is_test_function(&material.spec.resolved()) => Scale::Value,
                None => Scale::Log,
            };
            for entry in parametrization::all() {
                let form = entry.form(material.symmetry.with_isotropy(true));
                for &weight in weights {
                    let view = View::new(brdf, scale, &*form, weight);
                    let (name, kind, axes) = (&material.name, entry.kind, form.axes());
                    let (of, found) = ((scale, weight), view.distortion());
                    let gradients = gradients.then(|| view.gradients());
                    let found = SharesRow::rows(name, kind, axes, of, &found, gradients.as_ref());
                    rows.extend(found);
                }
            }
            Ok(())
        });
        (rows, outcome)
    }

    fn reduction(&self) -> Result<(), Error> {
        let pairs = pairs()?;
        let mut rows = Vec::new();
        let outcome = self.brdf.each(self.output.place(), |material, brdf| {
            rows.extend(reductions(&material.name, brdf, &pairs));
            Ok(())
        });
        self.write(&rows, reduction_table, outcome)
    }

    fn stretch(&self) -> Result<(), Error> {
        let pairs = pairs()?;
        let entries = parametrization::all();
        let row = |entry| analysis::anisotropy(entry, &pairs);
        let rows: Vec<_> = entries.iter().filter_map(row).collect();
        self.write(&rows, stretch_table, Ok(()))
    }

    /// Writes the rows and returns `outcome`; writes nothing after errors other than failed jobs.
    fn write<T: Serialize>(
        &self,
        rows: &[T],
        text: impl FnOnce(&[T]) -> String,
        outcome: Result<(), Error>,
    ) -> Result<(), Error> {
        if matches!(outcome, Ok(()) | Err(Error::JobsFailed { .. })) {
            self.output.write_rows(rows, text)?;
        }
        outcome
    }
}

/// True for the test functions F, S and G, which are analysed by value.
fn is_test_function(resolved: &toml::Table) -> bool {
    let kind = resolved.get("kind").and_then(|k| k.as_str());
    kind.is_some_and(|k| k.starts_with("test-"))
}

fn pairs() -> Result<Vec<DirectionPair>, Error> {
    let spec = MetricsSpec {
        pairs: 20_000,
        ..MetricsSpec::default()
    };
    metrics::test_pairs(Measure::Cosine, &spec).map_err(Error::internal)
}

/// The approximations of one material in every parametrization.
fn reductions(material: &str, brdf: &dyn Brdf, pairs: &[DirectionPair]) -> Vec<ReductionRow> {
    let truth = metrics::evaluate(brdf, pairs);
    let entries = parametrization::all();
    let mut rows = Vec::new();
    for averaging in Averaging::ALL {
        let of = |entry: &Entry<parametrization::ParametrizationSpec>| {
            analysis::reduced(brdf, &*entry.form(Symmetry::FULL), averaging, pairs)
        };
        let half = entries.iter().find(|e| e.kind == "half-difference").map(of);
        for entry in &entries {
            let values = of(entry);
            let from = half.as_ref().unwrap_or(&truth);
            let errors = metrics::compare(pairs, &truth, &values);
            let errors_from_half = metrics::compare(pairs, from, &values);
            rows.push(ReductionRow {
                material: material.into(),
                parametrization: entry.kind,
                averaging: averaging.name(),
                nrmse: errors.nrmse,
                log_relative: errors.log_relative,
                nrmse_from_half_difference: errors_from_half.nrmse,
                log_relative_from_half_difference: errors_from_half.log_relative,
            });
        }
    }
    rows
}
