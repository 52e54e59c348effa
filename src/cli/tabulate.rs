//! `gonio tabulate`.

use super::cached::CachedBrdf;
use super::energy::EnergyArgs;
use super::{
    ConfigArgs, Progress, ThreadArgs, build, choose_material, format_names, format_of, listed,
    print, refuse_unwritable, writer, wrote,
};
use crate::brdf::{Brdf, Channels, ObservedBrdf, Presence, SplitBrdf};
use crate::error::{Error, ParameterError};
use crate::experiment::{Material, Plan, Source, material_key};
use crate::formats::{Format, TableError, Tabulation, WRITE_TABLE};
use crate::metrics::{self, Errors, Measure, MetricsSpec};
use clap::Args;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

#[derive(Debug, Args)]
#[command(after_help = "\
A table holds R, G, B: those of the material, unless the config says other channels
(--set channels=luminance writes a grey table).

Values that each take random paths of their own are kept in FILE.part until the table is there: the
same command goes on from them, with --force it begins anew.")]
pub(super) struct Tabulate {
    #[command(flatten)]
    config: ConfigArgs,
    #[command(flatten)]
    threads: ThreadArgs,
    /// The material, by its name; not needed if the config has only one
    #[arg(long, value_name = "NAME")]
    material: Option<String>,
    /// Format of the file [default: by its extension]
    #[arg(long, value_parser = format_names(&WRITE_TABLE))]
    format: Option<Format>,
    #[arg(short, long, value_name = "FILE",
        help = format!("The file to write ({})", WRITE_TABLE.extensions(".")))]
    output: PathBuf,
    /// Replace a file that exists
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    table: TableArgs,
}

/// Options of a table that is written.
#[derive(Debug, Args)]
pub(super) struct TableArgs {
    /// Largest error (nrmse, of cosine and of lobe pairs): a format that has sizes takes a larger one until it is met, and
    /// the exit code is 6 if none meets it
    #[arg(long, value_name = "NRMSE", value_parser = tolerance)]
    pub(super) tolerance: Option<f64>,
    /// Fill cells of pairs without data by the cell before them in the file, in a format that can leave them empty
    #[arg(long)]
    fill: bool,
    #[command(flatten)]
    energy: EnergyArgs,
}

impl Tabulate {
    pub(super) fn run(self) -> Result<(), Error> {
        self.threads.apply()?;
        let format = format_of(&WRITE_TABLE, self.format, &self.output)?;
        self.table.suits(format)?;
        let source = self.config.source()?;
        let plan = Plan::read_parts(&source)?;
        let material = choose_material(&plan.materials, self.material.as_deref())?;
        super::remark(std::slice::from_ref(material));
        refuse_unwritable(&self.output, self.force)?;
        let brdf = build(material, channels(&source, &plan, material)?)?;
        let name = format!("--material {}", material.name);
        if !brdf.as_split().is_some_and(SplitBrdf::follows_pairs) {
            self.table.write(format, &*brdf, &self.output, &name)?;
            return Ok(());
        }
        pairs(format, 0, &*brdf, &self.output, &name)?;
        let key = material_key(material)?;
        let kept = CachedBrdf::new(&*brdf, &key, &self.output, self.force)?;
        kept.report_on_signal(self.force);
        match self.table.write(format, &kept, &self.output, &name) {
            // A repeated command may find room for what could not be written; a refusal would be repeated.
            Err(e @ Error::Output { .. }) => Err(e),
            result => kept.done().and(result.map(drop)),
        }
    }
}

impl TableArgs {
    /// True if nothing asks for another table than the one there is.
    pub(crate) fn keeps(&self) -> bool {
        self.tolerance.is_none() && !self.fill
    }

    /// Refuses to fill what is no table.
    pub(crate) fn refuse_fill(&self) -> Result<(), Error> {
        let message = "there is no table to fill; allowed: with a table";
        match self.fill {
            true => Err(Error::config("--fill", message)),
            false => Ok(()),
        }
    }

    /// Refuses a tolerance of tables whose errors are not known, and to fill those that have no empty cells.
    pub fn suits(&self, format: Format) -> Result<(), Error> {
        let holes: fn(&Format) -> bool = |f| f.table.has_holes;
        let read: fn(&Format) -> bool = |f| f.table.read.is_some();
        let filled = "have no empty cells and are always filled";
        let unknown = "are not read back, so that their errors are unknown";
        for (option, is_asked, suits, why) in [
            ("--fill", self.fill, holes, filled),
            ("--tolerance", self.tolerance.is_some(), read, unknown),
        ] {
            if is_asked && !suits(&format) {
                let names = listed(WRITE_TABLE.formats().filter(suits).map(|f| f.name));
                let name = format.name;
                let message = format!("tables of {name} {why}; allowed: {option} with {names}");
                return Err(Error::config(option, message));
            }
        }
        Ok(())
    }

    /// Writes a table and prints its errors: that of the first size that meets the tolerance. Returns the table as it is read,
    /// `None` of a format that is not; `place` is who chose the BRDF.
    pub(crate) fn write(
        &self,
        format: Format,
        brdf: &dyn Brdf,
        path: &Path,
        place: &str,
    ) -> Result<Option<Box<dyn Brdf>>, Error> {
        pairs(format, 0, brdf, path, place)?;
        self.energy.check(brdf, None)?;
        let mut size = 0;
        loop {
            let fill = self.fill;
            write(format, Tabulation { size, fill }, brdf, path, place)?;
            let Some(read) = format.table.read else {
                return Ok(None);
            };
            let table = read(path.into()).build(brdf.channels().clone());
            let table = table.map_err(|e| Error::data(path, e))?;
            let errors = TableErrors::between(brdf, &*table).map_err(|e| Error::data(path, e))?;
            print(&errors.text())?;
            let largest = errors.largest();
            let Some(tolerance) = self.tolerance.filter(|t| largest > *t) else {
                return Ok(Some(table));
            };
            size += 1;
            if size == format.table.sizes {
                return Err(Error::Violation(format!(
                    "the table errs by {largest}; asked: at most {tolerance}, and this format has no finer table"
                )));
            }
        }
    }
}

fn tolerance(text: &str) -> Result<f64, String> {
    let number = text.parse().ok().filter(|t| *t > 0.0 && *t <= 1.0);
    number.ok_or_else(|| "a number in (0, 1]".into())
}

/// Elevations up to which errors are printed, degrees: the first is that of experiments; no instrument reads the last, and no
/// grid holds what rises there without bound.
const UP_TO_DEG: [f64; 2] = [80.0, 90.0];

/// Errors of a table against what it was made of, at the usual test pairs of [`UP_TO_DEG`].
struct TableErrors([[(Measure, Errors); 2]; 2]);

impl TableErrors {
    fn between(brdf: &dyn Brdf, table: &dyn Brdf) -> Result<Self, ParameterError> {
        let mut all = [Measure::USUAL.map(|measure| (measure, Errors::default())); 2];
        for (errors, mask_deg) in all.iter_mut().zip(UP_TO_DEG) {
            let spec = MetricsSpec {
                mask_deg,
                ..MetricsSpec::default()
            };
            for (measure, errors) in errors {
                let pairs = metrics::test_pairs(*measure, &spec)?;
                let [truth, table] = [brdf, table].map(|brdf| metrics::evaluate(brdf, &pairs));
                *errors = metrics::compare(&pairs, &truth, &table);
            }
        }
        Ok(Self(all))
    }

    /// The largest nrmse up to the first of [`UP_TO_DEG`]; 0 of a black BRDF.
    fn largest(&self) -> f64 {
        let all = self.0[0].iter().filter_map(|(_, e)| e.nrmse);
        all.fold(0.0, f64::max)
    }

    fn text(&self) -> String {
        let number = |x: Option<f64>| x.map_or("none".into(), |x| format!("{x:.4}"));
        let each = self.0.iter().zip(UP_TO_DEG);
        let each = each.flat_map(|(e, up_to)| e.iter().map(move |(m, e)| (m.name(), e, up_to)));
        let of = |(measure, e, up_to): (_, &Errors, _)| {
            let [nrmse, log_relative, energy] = [e.nrmse, e.log_relative, e.energy].map(number);
            let (lost, all) = (e.pairs_unreconstructed, e.pairs + e.pairs_unreconstructed);
            format!(
                "errors of the table, {measure} pairs up to {up_to}°: nrmse {nrmse}, log_relative {log_relative}, energy {energy}; without data {lost} of the {all} that have some\n"
            )
        };
        each.map(of).collect()
    }
}

/// The channels of the table: those that the config names; else R, G, B, for which every format has
/// room, of a material that has them.
fn channels(source: &Source, plan: &Plan, material: &Material) -> Result<Channels, Error> {
    let named = source.table()?.get_ref().contains_key("channels");
    Ok(match !named && material.is_coloured() {
        true => Channels::Rgb,
        false => plan.channels.clone(),
    })
}

/// Writes a BRDF as a table; `place` is who chose it.
pub(super) fn write(
    format: Format,
    tabulation: Tabulation,
    brdf: &dyn Brdf,
    path: &Path,
    place: &str,
) -> Result<(), Error> {
    let table = writer(&WRITE_TABLE, &format, path)?;
    let all = pairs(format, tabulation.size, brdf, path, place)?;
    let progress = Progress::with_work(all, "tabulates");
    // Bits of the largest value so far: those of positive numbers stand in their order.
    let largest = AtomicU64::new(0);
    let width = brdf.channels().count();
    let brdf = ObservedBrdf::new(brdf, |values: &[f64], presence: &[Presence]| {
        let present = values.chunks(width).zip(presence);
        let present = present.filter(|(_, p)| **p == Presence::Present);
        let most = present.flat_map(|(v, _)| v).copied().fold(0.0, f64::max);
        largest.fetch_max(most.to_bits(), Ordering::Relaxed);
        progress.count(presence.len() as u64);
    });
    let filled = table(&brdf, tabulation, path).map_err(|e| refused(e, path, place))?;
    let largest = f64::from_bits(largest.load(Ordering::Relaxed));
    drop(progress);
    wrote(path);
    print(&format!("largest value: {largest:.4e} 1/sr\n"))?;
    if filled > 0 {
        print(&format!(
            "filled: {filled} of {all} pairs, which had no data\n"
        ))?;
    }
    Ok(())
}

/// Pairs of a table of some size; before anything is computed.
pub(super) fn pairs(
    format: Format,
    size: usize,
    brdf: &dyn Brdf,
    path: &Path,
    place: &str,
) -> Result<u64, Error> {
    let pairs = format.table.pairs.map_or(Ok(0), |pairs| pairs(brdf, size));
    pairs.map_err(|e| refused(e, path, place))
}

fn refused(error: TableError, path: &Path, place: &str) -> Error {
    match error {
        TableError::Io(..) => Error::output(path, error),
        _ => Error::config(place, error),
    }
}
