//! `gonio convert`.

use super::tabulate::TableArgs;
use super::{
    ReadingArgs, ReadingsFile, ThreadArgs, assumed, format_names, format_of, listed, print,
    read_schedule, refuse_unwritable, say, write_file, writer,
};
use crate::brdf::{self, Brdf, BrdfSpec, Channels, laws};
use crate::error::{Error, count};
use crate::files;
use crate::formats::{self, Format, Readings, WRITE, WRITE_SCHEDULE, WRITE_TABLE};
use crate::geometry::Symmetry;
use crate::measurement::{Flags, Measurement, Outcome};
use crate::schedule::{ScheduleFile, Sequence};
use clap::Args;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Pairs that reciprocity and holes are stated of.
const PAIRS: usize = 4096;

#[derive(Debug, Args)]
#[command(
    override_usage = "gonio convert [OPTIONS] <IN>… <OUT>",
    after_help = "\
Tables become tables, readings readings, schedules schedules; a file that is written is read again and compared.
A table that goes into its own format is copied as it is, unless --tolerance, --fill or --no-reading ask for another one:

  gonio convert gold.binary gold.bsdf
  gonio convert scans/*.pab all.npz
  gonio convert lab.csv --quantity percent lab.astm

A table of readings is made by `gonio reconstruct`, readings of a table by `gonio measure`."
)]
pub(super) struct Convert {
    #[arg(value_name = "IN… OUT", num_args = 2.., required = true,
        help = format!("The files to read, several of readings, and the one to write ({})", WRITE.extensions(".")))]
    files: Vec<PathBuf>,
    /// Format of the file that is written [default: by its extension]
    #[arg(long, value_parser = format_names(&WRITE))]
    format: Option<Format>,
    /// Replace a file that exists
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    table: TableArgs,
    #[command(flatten)]
    reading: ReadingArgs,
    #[command(flatten)]
    threads: ThreadArgs,
}

impl Convert {
    pub(super) fn run(self) -> Result<(), Error> {
        self.threads.apply()?;
        // There are two files or more.
        let Some((output, inputs)) = self.files.split_last() else {
            return Ok(());
        };
        let format = format_of(&WRITE, self.format, output)?;
        let of_table = |input: &PathBuf| {
            let format = formats::of_file(input)?;
            Some((format, format.table.read?))
        };
        match (inputs, inputs.iter().find_map(of_table)) {
            ([one], Some((own, read))) => {
                let mut keys = read(one.clone()).resolved();
                if let Some(value) = self.reading.no_reading {
                    keys.insert("no_reading".into(), value.into());
                }
                let spec = brdf::read_keys(keys);
                let spec = spec.map_err(Error::internal)?;
                self.table(one, own, &*spec, format, output)
            }
            (_, Some(_)) => {
                let message =
                    "a table is among several files; allowed: one table, or files of readings";
                Err(Error::config("IN", message))
            }
            (inputs, None) => self.rows(inputs, format, output),
        }
    }

    fn table(
        &self,
        input: &Path,
        own: Format,
        spec: &dyn BrdfSpec,
        format: Format,
        output: &Path,
    ) -> Result<(), Error> {
        let unreadable = |e: &dyn std::fmt::Display| Error::data(input, e);
        writer(&WRITE_TABLE, &format, output)?;
        self.table.suits(format)?;
        refuse_unwritable(output, self.force)?;
        let brdf = spec.widest_channels().and_then(|c| spec.build(c));
        let brdf = brdf.map_err(|e| unreadable(&e))?;
        for remark in brdf.remarks() {
            say(&format!("gonio: {}: {remark}", input.display()));
        }
        self.reading
            .refuse_lost(input, brdf.cells_without_reading())?;
        let channels = known_in(brdf.channels());
        print(&format!("table: {channels}, {}\n", brdf.symmetry()))?;
        if own == format && self.reading.no_reading.is_none() && self.table.keeps() {
            return keep(input, output);
        }
        let place = input.display().to_string();
        let Some(copy) = self.table.write(format, &*brdf, output, &place)? else {
            return print("errors of the table: unknown, this format is not read\n");
        };
        print(&laws_of(&*brdf, &*copy))
    }

    fn rows(&self, inputs: &[PathBuf], format: Format, output: &Path) -> Result<(), Error> {
        self.table.refuse_fill()?;
        let mut assume = assumed();
        if self.reading.pixels.is_some() {
            // As of `reconstruct`: patches are those of the coordinates that these leave.
            assume.otherwise = Symmetry::FULL;
        }
        match (self.reading.read_all(inputs, &assume), inputs) {
            (Ok(read), _) => {
                for note in &read.notes {
                    print(&format!("{note}\n"))?;
                }
                self.readings(&read, format, output)
            }
            (Err(e), [one]) if self.reading.pixels.is_none() => match read_schedule(one, &assume) {
                Ok(file) => self.schedule(&file, format, output),
                Err(_) => Err(e),
            },
            (Err(e), _) => Err(e),
        }
    }

    fn readings(&self, read: &Readings, format: Format, output: &Path) -> Result<(), Error> {
        let (measurement, about) = (&read.measurement, &read.about);
        let file = ReadingsFile::new(Some(format), output)?;
        file.refuse_existing(self.force)?;
        // A lattice has poses that the file does not list.
        let poses = 0..measurement.outcomes.len() as u32;
        let listed = poses.filter(|p| measurement.outcomes[*p as usize] != Outcome::NotVisited);
        let listed: Vec<u32> = listed.collect();
        file.write(measurement, about, Sequence::Order(&listed))?;
        let copy = ReadingArgs::default().read_all(&file.files()?, &assumed())?;
        let [before, after] = [read, &copy].map(facts);
        let copy = copy.measurement;
        let mut text = String::new();
        for ((name, before), (_, after)) in before.iter().zip(&after) {
            text += &match before == after {
                true => format!("kept: {name}, {before}\n"),
                false => format!("changed: {name}, {before} before, {after} after\n"),
            };
        }
        if !read.unread.is_empty() {
            text += &format!("left out of the header: {}\n", read.unread.join(", "));
        }
        let Some([value, angle]) =
            differences(measurement, &file.order(measurement, &listed), &copy)
        else {
            return print(&(text + "values cannot be compared one by one\n"));
        };
        text += &format!(
            "values moved by at most {value:.1e} of their own, directions by {angle:.1e} rad\n"
        );
        print(&text)?;
        match self.table.tolerance {
            Some(tolerance) if value > tolerance => Err(Error::Violation(format!(
                "values moved by {value}; asked: at most {tolerance}"
            ))),
            _ => Ok(()),
        }
    }

    fn schedule(&self, file: &ScheduleFile, format: Format, output: &Path) -> Result<(), Error> {
        let write = writer(&WRITE_SCHEDULE, &format, output)?;
        refuse_unwritable(output, self.force)?;
        let order = Sequence::Order(&file.order);
        write_file(output, |out| write(&file.schedule, order, out))?;
        let mut text = format!("kept: {}\n", count(file.order.len(), "pose"));
        if !file.axes.is_empty() {
            let axes = file.axes.join(", ");
            text += &format!(
                "changed: positions of {axes}, which `gonio schedule --instrument` plans\n"
            );
        }
        print(&text)
    }
}

/// Writes the bytes of a table that has been read.
fn keep(input: &Path, output: &Path) -> Result<(), Error> {
    let bytes = files::read(input, files::TABLE_LIMIT);
    let bytes = bytes.map_err(|e| Error::data(input, format!("cannot read this file: {e}")))?;
    write_file(output, |out| out.write_all(&bytes))?;
    print("kept: the table as it is\n")
}

fn known_in(channels: &Channels) -> String {
    match channels {
        Channels::Luminance => "luminance".into(),
        Channels::Rgb => "R, G, B".into(),
        Channels::Wavelengths(w) => format!("{} nm", listed(w.nm())),
    }
}

/// Reciprocity and holes of a table and of its copy.
fn laws_of(brdf: &dyn Brdf, copy: &dyn Brdf) -> String {
    let pairs = laws::pairs(PAIRS, 1);
    let [before, after] = [brdf, copy].map(|brdf| laws::reciprocity(brdf, &pairs).max_relative);
    let [holes, left] = [brdf, copy].map(|brdf| laws::positivity(brdf, &pairs).missing);
    let all = pairs.len();
    format!(
        "reciprocity, largest relative difference: {before:.4} before, {after:.4} after\n\
         pairs without data: {holes} before, {left} after, of {all}\n"
    )
}

/// What readings have, by name.
fn facts(read: &Readings) -> [(&'static str, String); 9] {
    let (m, about) = (&read.measurement, &read.about);
    let name = |name: &Option<String>| name.clone().unwrap_or("not named".into());
    let seed = about.seed.map(|seed| seed.to_string());
    let symmetry = match about.is_bare {
        true => "symmetries not said".into(),
        false => m.schedule.parametrization.symmetry().to_string(),
    };
    let flags = m.details.as_ref().map_or(0, |details| {
        details.flags.iter().filter(|f| **f != Flags::NONE).count()
    });
    let uncertainties = match &m.details {
        Some(d) => match [&d.type_a, &d.type_b].map(|u| u.iter().any(|u| *u > 0.0)) {
            [true, true] => "of type A and B",
            [true, false] => "of type A",
            [false, true] => "of type B",
            [false, false] => "not known",
        },
        None => "none",
    };
    let schedule = &m.schedule;
    let layout = match schedule.lattice.is_some() {
        true => "a grid",
        false => "scattered poses",
    };
    let known = [Outcome::Reading, Outcome::NotVisited];
    let without = m.outcomes.iter().filter(|o| !known.contains(o));
    [
        ("readings", m.readings().to_string()),
        ("poses without a reading", without.count().to_string()),
        ("channels", known_in(&m.channels)),
        ("uncertainties", uncertainties.into()),
        ("flags", count(flags, "pose")),
        ("layout", format!("{layout}, {symmetry}")),
        ("material", name(&about.material)),
        ("instrument", name(&about.instrument)),
        ("seed", seed.unwrap_or("none".into())),
    ]
}

/// How far values (relative) and directions (rad) moved, at most; `None` if readings were lost or averaged. `order` is that of
/// the files.
fn differences(before: &Measurement, order: &[u32], after: &Measurement) -> Option<[f64; 2]> {
    let has_value = |i: &usize| after.value(*i).is_some();
    let read: Vec<usize> = (0..after.outcomes.len()).filter(has_value).collect();
    if order.len() != read.len() || before.channels.count() != after.channels.count() {
        return None;
    }
    let (mut angle, mut value) = (0.0_f64, 0.0_f64);
    for (i, j) in order.iter().map(|i| *i as usize).zip(read) {
        let [a, b] = [&before.schedule.poses[i], &after.schedule.poses[j]];
        for (a, b) in a.pair.vectors().iter().zip(b.pair.vectors()) {
            angle = angle.max(a.distance(b));
        }
        let [a, b] = [before.value(i)?, after.value(j)?];
        for (a, b) in a.iter().zip(b).filter(|(a, b)| a != b) {
            value = value.max((a - b).abs() / a.abs().max(b.abs()));
        }
    }
    Some([value, angle])
}
