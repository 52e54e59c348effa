//! `gonio reconstruct`.

use super::brdf_args::{BrdfArgs, is_config};
use super::check::words;
use super::cross_validation::{CrossValidationArgs, print_scores};
use super::energy::{EnergyArgs, Known};
use super::output::refuse_other_endings;
use super::reading::ReadingArgs;
use super::readings_file::ReadingsFile;
use super::talk::{say, suspected, with_bound};
use super::{ThreadArgs, build, choose_material, format_names, print, refuse_unwritable, tabulate};
use crate::brdf::Brdf;
use crate::error::{self, Error, ParameterError, count, excerpt, one_of};
use crate::experiment::{AnyPlan, Kind, Plan, Source};
use crate::files::write_atomically;
use crate::formats::{self, Format, READ_READINGS, Tabulation, WRITE_READINGS, WRITE_TABLE};
use crate::geometry::{DirectionPair, Symmetry};
use crate::instrument;
use crate::measurement::{About, Flags, Measurement, Outcome};
use crate::metrics::{
    self, Errors, Expected, Level, Measure, MetricsSpec, TestSet, Uncovered, WITHIN,
};
use crate::parametrization;
use crate::reconstruct::{self, Cover, Coverage, Covered, Fill, Predictive, Replicated, TOLD};
use crate::report::Columns;
use crate::report::pictures::{Relative, uncertainty_svg};
use crate::schedule::Pose;
use crate::schedule::{Assume, Schedule, Sequence, Unreachable};
use crate::validation::{Estimate, Jury};
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Pixels along each side of the picture.
const PICTURE: usize = 200;

/// Points per pixel.
const SAMPLES: usize = 64;

/// Makes a BRDF of readings, and says what it was made of
#[derive(Debug, Args)]
#[command(after_help = "\
The readings are those that `gonio measure` wrote, any CSV with the columns theta_i_deg, phi_i_deg,
theta_o_deg, phi_o_deg and value (f_r in 1/sr, without the cosine), or an ALTA text file. The options
at the end read tables that say the same in other ways; rows of one pose in a file are averaged.

  gonio reconstruct readings.csv --reconstruction thin-plate --set neighbours=40 -o copy.binary
  gonio reconstruct readings.csv --against ggx
  gonio reconstruct lab.csv --columns theta_i=in,theta_o=out,phi_o=az,value=R --angles deg \\
    --azimuth mirror --quantity percent")]
pub(super) struct Reconstruct {
    #[arg(required = true, value_name = "READINGS",
        help = format!("The readings, in one file or more ({}); text of another name is told by its first lines",
            READ_READINGS.extensions(".")))]
    measurements: Vec<PathBuf>,
    /// A kind of reconstruction, see `gonio list reconstructions`, or auto: the one that predicts
    /// readings best that it was not given, in the coordinates where it does; kriging if it is within
    /// a standard error of that [default: auto]
    #[arg(long, value_name = "KIND")]
    reconstruction: Option<String>,
    /// Set a key of the reconstruction, e.g. values=linear
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// The coordinates [default: those of the file, else half-difference]
    #[arg(long, value_name = "NAME")]
    parametrization: Option<String>,
    /// Symmetries of the material, joined by commas: isotropic, reciprocal, bilateral; or none
    /// [default: those of the file, else all three]
    #[arg(long, value_name = "LIST", value_parser = symmetry)]
    symmetry: Option<Symmetry>,
    #[arg(short, long, value_name = "FILE",
        help = format!("Write the BRDF as a table ({})", WRITE_TABLE.extensions(".")))]
    output: Option<PathBuf>,
    /// Format of the table [default: by its extension]
    #[arg(long, requires = "output", value_parser = format_names(&WRITE_TABLE))]
    format: Option<Format>,
    /// What the table has where readings do not surround a pair
    #[arg(long, requires = "output", default_value = "extrapolate", value_parser = fill())]
    fill: Fill,
    #[command(flatten)]
    energy: EnergyArgs,
    #[command(flatten)]
    cross_validation: CrossValidationArgs,
    #[arg(long, value_name = "FILE",
        help = format!("Write the readings with the flag `suspected` where all others contradict one ({})",
            WRITE_READINGS.extensions(".")))]
    checked: Option<PathBuf>,
    /// Take readings that all others contradict too; of 33 to 2000 readings these are left out. Kriging leaves them out by
    /// itself, and says so, unless --set robust=false
    #[arg(long, conflicts_with = "checked")]
    take_all: bool,
    /// Compare with a truth: a config, a table, a kind of material, or other readings. Of readings with
    /// uncertainties it also tells within_2u: the share of pairs where the truth is within the uncertainty
    /// (k = 2) that the readings give the BRDF; about 0.95 if they err at random and nothing else does,
    /// less if it errs between them
    #[arg(long, value_name = "CONFIG|BRDF|READINGS")]
    against: Option<String>,
    /// The material of --against, by its name; not needed if there is only one
    #[arg(long, value_name = "NAME", requires = "against")]
    material: Option<String>,
    /// Draw a sphere of the BRDF under a sky
    #[arg(long, value_name = "FILE.png")]
    picture: Option<PathBuf>,
    /// How uncertain the BRDF is (k = 1), of its readings and, made by kriging, between them: maps (.svg) of its relative
    /// uncertainty over the directions of the sensor, for light at 0°, 30° and 60°, and where readings do not surround it; or
    /// readings (.csv, .npz, …) of every channel and its uncertainties there
    #[arg(long, value_name = "FILE")]
    uncertainty: Option<PathBuf>,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    threads: ThreadArgs,
    #[command(flatten)]
    reading: ReadingArgs,
}

pub(super) fn symmetry(text: &str) -> Result<Symmetry, ParameterError> {
    let mut symmetry = Symmetry::NONE;
    if text == "none" {
        return Ok(symmetry);
    }
    for name in text.split(',') {
        match name.trim() {
            "isotropic" => symmetry.isotropic = true,
            "reciprocal" => symmetry.reciprocal = true,
            "bilateral" => symmetry.bilateral = true,
            name => {
                let allowed = "isotropic, reciprocal, bilateral, or none";
                return Err(ParameterError::new("symmetry", name, allowed));
            }
        }
    }
    Ok(symmetry)
}

/// The names of fills.
fn fill() -> impl TypedValueParser<Value = Fill> {
    PossibleValuesParser::new(Fill::ALL.map(|(_, name)| name)).map(|text| {
        let named = Fill::ALL.into_iter().find(|(_, name)| *name == text);
        named.map_or(Fill::default(), |(fill, _)| fill)
    })
}

/// Share of a table between readings below which it is doubted.
const FEW: f64 = 0.05;

/// Shares of the table by coverage; one of which hardly anything is between readings is doubted.
fn shares(covered: &Covered<'_>, readings: usize) -> String {
    let all = Coverage::ALL.iter().zip(covered.shares());
    let mut few = all.clone();
    if few.any(|((of, _), share)| *of == Coverage::Interpolated && share < FEW) {
        let readings = count(readings, "reading");
        say(&format!(
            "gonio: hardly any of this table is between its {readings}"
        ));
    }
    let shares = all.map(|((_, name), share)| format!("{:.1} % {name}", 100.0 * share));
    let shares: Vec<String> = shares.collect();
    format!("coverage of the table: {}\n", shares.join(", "))
}

/// What a reconstruction is compared with.
enum Truth {
    /// Another BRDF, at the test pairs of these measures.
    Brdf(Box<dyn Brdf>, MetricsSpec, Vec<Measure>),
    /// Other readings.
    Readings(Jury),
}

/// Light at 0°, 30° and 60°, and sensors every 5° of elevation and 15° of azimuth.
fn around() -> Vec<DirectionPair> {
    let sensors =
        (0..18).flat_map(|k| (0..24).map(move |l| [5.0 * f64::from(k), 15.0 * f64::from(l)]));
    let of_light = |light: f64| {
        let pair = move |sensor: [f64; 2]| {
            let [theta, phi] = sensor.map(f64::to_radians);
            DirectionPair::from_spherical(light.to_radians(), 0.0, theta, phi)
        };
        sensors.clone().map(pair)
    };
    [0.0, 30.0, 60.0].into_iter().flat_map(of_light).collect()
}

/// The name of the choice by cross-validation.
const AUTO: &str = "auto";

impl Reconstruct {
    pub(super) fn run(self) -> Result<(), Error> {
        self.threads.apply()?;
        if let Some(path) = &self.picture {
            refuse_other_endings(path, "png")?;
        }
        let is_svg = |e: &std::ffi::OsStr| e.eq_ignore_ascii_case("svg");
        let is_table = |path: &&Path| !path.extension().is_some_and(is_svg);
        let where_uncertain = self.uncertainty.as_deref().filter(is_table);
        let where_uncertain = where_uncertain
            .map(|path| ReadingsFile::new(None, path)?.for_uncertainties())
            .transpose()?;
        let files = [&self.output, &self.picture, &self.uncertainty];
        let written = files.into_iter().chain([&self.checked]).flatten();
        let mut written: Vec<&PathBuf> = written.collect();
        for path in files.into_iter().flatten() {
            refuse_unwritable(path, self.force)?;
        }
        written.sort();
        if let Some(pair) = written.windows(2).find(|pair| pair[0] == pair[1]) {
            let message = "two of the files to be written have this name; allowed: one each";
            return Err(Error::output(pair[0], message));
        }
        let checked = self.checked.as_ref();
        let checked = checked
            .map(|path| ReadingsFile::new(None, path))
            .transpose()?;
        if let Some(file) = &checked {
            file.refuse_existing(self.force)?;
        }
        let table = match &self.output {
            Some(path) => {
                let table = WRITE_TABLE.format(self.format, path);
                Some((table.map_err(|e| Error::output(path, e))?, path))
            }
            None => None,
        };
        self.check_parametrization()?;
        if self.reconstruction.as_deref() == Some(AUTO) && self.cross_validation.is_none() {
            return Err(Error::config(
                "--cross-validation none",
                "auto chooses by what is left out; allowed: auto, sheets, points",
            ));
        }
        let (measurement, notes) = self.read(&self.measurements)?;
        let path = &self.measurements[0];
        print(&(material_of(&measurement) + &notes))?;
        let truth = self.truth(&measurement)?;
        let suspects = match self.take_all {
            true => Vec::new(),
            false => reconstruct::suspects(&measurement),
        };
        print(&suspected(&measurement, &self.measurements, &suspects))?;
        let poses = suspects.iter().map(|suspect| suspect.pose);
        if let Some(file) = &checked {
            let measurement = measurement.clone().flagged(Flags::SUSPECTED, poses.clone());
            file.write(&measurement, &About::default(), Sequence::Generated)?;
        }
        let measurement = measurement.without(poses);
        let method = self.method(&measurement)?;
        let brdf = method
            .reconstruct(&measurement)
            .map_err(|e| Error::data(path, e))?;
        print(&format!("reconstruction: {}\n", method.label()))?;
        for remark in brdf.remarks() {
            print(&format!("  {remark}\n"))?;
        }
        let failed = |e| Error::data(path, e);
        let predictive = match measurement.readings() {
            1..=TOLD => method.predictive(&measurement).ok().flatten(),
            _ => None,
        };
        if let Some(expected) = predictive.as_ref().and_then(|known| expected(&**known)) {
            let told = with_bound(&expected, measurement.readings());
            print(&format!("  {told}\n"))?;
        }
        let replicated = match truth.is_some() || self.uncertainty.is_some() {
            true => Replicated::of(&measurement, &*method).map_err(failed)?,
            false => None,
        };
        if where_uncertain.is_some() && replicated.is_none() {
            let message = format!(
                "most readings have no uncertainty; allowed: readings with type_a or type_b, or --reconstruction kriging of up to {TOLD}"
            );
            return Err(Error::data(path, message));
        }
        match truth {
            Some(Truth::Brdf(truth, metrics, measures)) => {
                let cover = Cover::of(&measurement).map_err(failed)?;
                let set = TestSet::new(&measures, &metrics);
                let set = set.map_err(|e| Error::config("metrics", e))?;
                compare(&*brdf, replicated.as_ref(), &*truth, &set, &cover)?;
            }
            Some(Truth::Readings(jury)) => {
                let predicted = metrics::evaluate(&*brdf, jury.pairs());
                let within = replicated
                    .as_ref()
                    .map(|r| jury.within(&predicted, &r.uncertainties(jury.pairs())));
                print_scores(&jury.errors(&predicted), within)?;
            }
            None => {}
        }
        if let Some((table, path)) = table {
            let covered = Covered::new(&*brdf, &measurement, self.fill);
            let covered = covered.map_err(|e| Error::data(path, e))?;
            tabulate::pairs(table, 0, &covered, path, &|| "--output".into())?;
            let known = Known::new(&measurement, predictive.as_deref());
            self.energy.check(&covered, Some(&known))?;
            // What this asked for is no cell of the table.
            covered.forget();
            let place = || "--output".into();
            tabulate::write(table, Tabulation::default(), &covered, path, place)?;
            print(&shares(&covered, measurement.readings()))?;
        }
        if let Some(path) = &self.picture {
            picture(&*brdf, path)?;
        }
        if let (Some(file), Some(replicated)) = (&where_uncertain, &replicated) {
            let parametrization = measurement.schedule.parametrization.clone();
            let around = Schedule::of_pairs(parametrization, around()).distinct();
            let cover = Cover::of(&measurement).map_err(failed)?;
            let readings = replicated.readings(Arc::new(around), &cover);
            file.write(&readings, &About::default(), Sequence::Generated)?;
        } else if let Some(path) = &self.uncertainty {
            let cover = Cover::of(&measurement).map_err(failed)?;
            let title = format!("{}: {}", path.display(), method.label());
            let at = |pairs: &[DirectionPair]| -> Vec<f64> {
                let all = replicated.iter().flat_map(|r| r.at(pairs));
                all.map(|u| u.share(u.uncertainty())).collect()
            };
            let of = match predictive {
                Some(_) => "of its readings and between them",
                None => "of its readings",
            };
            let relative = replicated.as_ref().map(|_| Relative { at: &at, of });
            let svg = uncertainty_svg(&title, relative, &cover)?;
            let drawn = write_atomically(path, |out| out.write_all(svg.as_bytes()));
            drawn.map_err(|e| cannot_write(path, &e))?;
        }
        Ok(())
    }

    fn check_parametrization(&self) -> Result<(), Error> {
        let Some(name) = &self.parametrization else {
            return Ok(());
        };
        if parametrization::find(name).is_some() {
            return Ok(());
        }
        let all = parametrization::all();
        let message = format!(
            "{:?} is no parametrization; allowed: {}",
            excerpt(name),
            one_of(name, all.iter().map(|e| e.kind))
        );
        Err(Error::config("--parametrization", message))
    }

    /// The measurement of a file or several, and notes on it.
    fn read(&self, paths: &[PathBuf]) -> Result<(Measurement, String), Error> {
        let assume = Assume {
            parametrization: self.parametrization.clone(),
            symmetry: self.symmetry,
            otherwise: Symmetry::FULL,
            axes: instrument::axis_names(),
            ..Assume::default()
        };
        let read = self.reading.read_all(paths, &assume)?;
        let notes = read.notes.into_iter().map(|note| note + "\n");
        Ok((read.measurement, notes.collect()))
    }

    /// The method that is asked for; `None` if the readings choose.
    fn named(&self) -> Result<Option<Arc<dyn reconstruct::Reconstruct>>, Error> {
        let mut keys = match self.reconstruction.as_deref() {
            Some(kind) if kind != AUTO => toml::Table::from_iter([("kind".into(), kind.into())]),
            _ => {
                return match self.set.first() {
                    Some(set) => Err(Error::config(
                        format!("--set {set}"),
                        "the readings choose the reconstruction; allowed: --set with --reconstruction KIND",
                    )),
                    None => Ok(None),
                };
            }
        };
        let all = reconstruct::all();
        let kind = keys.remove("kind");
        let kind = kind.as_ref().and_then(toml::Value::as_str).unwrap_or("");
        let Some(entry) = all.iter().find(|e| e.kind == kind) else {
            let message = format!(
                "{:?} is no reconstruction; allowed: {}",
                excerpt(kind),
                one_of(kind, all.iter().map(|e| e.kind).chain([AUTO]))
            );
            return Err(Error::config("--reconstruction", message));
        };
        let mut keys = Source::new("--set", keys.to_string());
        for assignment in &self.set {
            keys.set(assignment, format!("--set {assignment}"))?;
        }
        let method = (entry.read)(keys.table()?).map_err(|e| keys.error(e))?;
        method.check().map_err(|e| Error::config("--set", e))?;
        Ok(Some(Arc::from(method)))
    }

    /// The method that is asked for, else the one that the readings choose; says how good it is.
    fn method(
        &self,
        measurement: &Measurement,
    ) -> Result<Arc<dyn reconstruct::Reconstruct>, Error> {
        let method = self.named()?;
        let methods = method.iter().cloned().collect();
        let path = &self.measurements[0];
        let best = self.cross_validation.choose(
            measurement,
            path,
            methods,
            self.parametrization.as_deref(),
        )?;
        let best = method.or(best);
        Ok(best.unwrap_or_else(|| reconstruct::default_for(measurement)))
    }

    fn truth(&self, measurement: &Measurement) -> Result<Option<Truth>, Error> {
        let Some(target) = &self.against else {
            return Ok(None);
        };
        let path = Path::new(target);
        let format = formats::of_name(path);
        if format.is_some_and(|f| f.read_readings.is_some() && f.read_table.is_none()) {
            let (other, notes) = self.read(&[path.to_owned()])?;
            print(&format!(
                "against {}: {}{notes}",
                path.display(),
                material_of(&other)
            ))?;
            return match Jury::new(&other) {
                Ok(jury) => Ok(Some(Truth::Readings(jury))),
                Err(e) => Err(Error::data(path, e)),
            };
        }
        let source = BrdfArgs::of(target).source()?;
        let (materials, metrics, measures) =
            if is_config(target) && !Kind::of(&source)?.has_profiles() {
                let plan = Plan::read(&source)?;
                (plan.materials, plan.metrics, plan.measures)
            } else {
                let plan = AnyPlan::read(&source)?.into_moments();
                let all = Measure::USUAL.to_vec();
                (plan.materials, MetricsSpec::default(), all)
            };
        let material = choose_material(&materials, self.material.as_deref())?;
        super::remark(std::slice::from_ref(material));
        let brdf = build(material, measurement.channels.clone())?;
        Ok(Some(Truth::Brdf(brdf, metrics, measures)))
    }
}

/// An angle of a pose, rad.
type Angle = fn(&Pose) -> f64;

/// Text about a measurement: its readings, its holes with their reasons, the angles they cover.
fn material_of(measurement: &Measurement) -> String {
    let schedule = &measurement.schedule;
    let form = &schedule.parametrization;
    let mut text = format!(
        "{} ({}) in {} coordinates (warp: {}; {}): {}\n",
        error::count(schedule.poses.len(), "pose"),
        schedule.sample_set,
        form.name(),
        form.warp_name(),
        words(form.symmetry()),
        error::count(measurement.readings(), "reading"),
    );
    let outcomes = &measurement.outcomes;
    let count = |is: &dyn Fn(Outcome) -> bool| outcomes.iter().filter(|o| is(**o)).count();
    let mut holes = vec![
        ("no-data", measurement.no_data()),
        ("not-visited", count(&|o| o == Outcome::NotVisited)),
    ];
    for name in Unreachable::NAMES {
        let of = |o| matches!(o, Outcome::Unreachable(why) if why.name() == name);
        holes.push((name, count(&of)));
    }
    let list = |counts: Vec<(&str, usize)>| {
        let some = counts.into_iter().filter(|(_, n)| *n > 0);
        let some: Vec<_> = some.map(|(name, n)| format!("{name} {n}")).collect();
        some.join(", ")
    };
    let holes = list(holes);
    if !holes.is_empty() {
        text += &format!("without a reading: {holes}\n");
    }
    if let Some(details) = &measurement.details {
        let with = |flag: Flags| details.flags.iter().filter(|f| f.has(flag)).count();
        let flags = list(Flags::ALL.map(|(flag, name)| (name, with(flag))).to_vec());
        if !flags.is_empty() {
            text += &format!("flags: {flags}\n");
        }
    }
    let read = || {
        let poses = schedule.poses.iter().zip(outcomes);
        poses.filter(|(_, o)| **o == Outcome::Reading)
    };
    let ranges: [(&str, Angle); 3] = [
        ("theta_i", |p| p.pair.omega_i.theta()),
        ("theta_o", |p| p.pair.omega_o.theta()),
        ("separation", |p| p.pair.separation()),
    ];
    if measurement.readings() > 0 {
        let ranges = ranges.map(|(name, angle)| {
            let angles = read().map(|(pose, _)| angle(pose).to_degrees());
            let ends = angles.fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], a| {
                [lo.min(a), hi.max(a)]
            });
            format!("{name} {:.2}° to {:.2}°", ends[0], ends[1])
        });
        text += &format!("covered: {}\n", ranges.join(", "));
    }
    text
}

/// The errors under the cosine measure that a BRDF expects of itself.
fn expected(known: &dyn Predictive) -> Option<Expected> {
    let set = TestSet::new(&[Measure::Cosine], &MetricsSpec::default()).ok()?;
    Expected::at(&set.level(0), known).first().copied()
}

/// A number with its standard error, as text.
fn estimate(e: &Estimate) -> String {
    match (e.value, e.standard_error) {
        (None, _) => "undefined".into(),
        (Some(value), None) => format!("{value:.4e}"),
        (Some(value), Some(error)) => format!("{value:.4e} ± {error:.0e}"),
    }
}

/// Prints the errors against a truth under some measures, how much of it is not interpolated, and of
/// uncertain readings how much of it is within k = 2.
fn compare(
    brdf: &dyn Brdf,
    replicated: Option<&Replicated>,
    truth: &dyn Brdf,
    set: &TestSet,
    cover: &Cover,
) -> Result<(), Error> {
    let first = set.level(0);
    let values = |level: &Level| [truth, brdf].map(|brdf| metrics::evaluate(brdf, &level.pairs));
    let [f, g] = values(&first);
    let mut tally = set.tally();
    first.add_to(&mut tally, &f, &g);
    let mut n = 0;
    while !set.is_enough(&tally) && !set.is_last(n) {
        n += 1;
        let level = set.level(n);
        let [f, g] = values(&level);
        level.add_to(&mut tally, &f, &g);
    }
    let counted: Vec<_> = Uncovered::counted(first.pairs.len()).collect();
    let counted: Vec<_> = counted.into_iter().map(|i| first.pairs[i]).collect();
    let coverage = cover.coverages(&counted);
    let uncertainty = replicated.map(|r| r.uncertainties(&first.pairs));
    let columns = (0..set.measures().len()).map(|at| {
        let weights = &first.weights[at];
        let (errors, standard) = (tally.errors(at), tally.standard_errors(at));
        let mut column: Vec<Estimate> = Errors::QUANTITIES
            .iter()
            .map(|(_, of)| Estimate {
                value: of(&errors),
                standard_error: of(&standard),
            })
            .collect();
        let uncovered = Uncovered::among(&coverage, weights, &f);
        let shares = Uncovered::QUANTITIES.iter().map(|(_, of)| of(&uncovered));
        let within = uncertainty
            .as_ref()
            .map(|u| metrics::share_within(|i| weights[i], &f, &g, u));
        column.extend(shares.chain(within).map(|value| Estimate {
            value,
            standard_error: None,
        }));
        column
    });
    let columns: Vec<Vec<Estimate>> = columns.collect();
    let errors = Errors::QUANTITIES.iter().map(|(quantity, _)| quantity.name);
    let shares = Uncovered::QUANTITIES
        .iter()
        .map(|(quantity, _)| quantity.name);
    let within = replicated.map(|_| WITHIN.name);
    let names = set.measures().iter().map(|m| format!("\t>{}", m.name()));
    let mut text = Columns::new(&format!("error{}", names.collect::<String>()));
    for (i, name) in errors.chain(shares).chain(within).enumerate() {
        let cells = columns.iter().map(|c| format!("\t{}", estimate(&c[i])));
        text.row(&format!("{name}{}", cells.collect::<String>()));
    }
    print(&text.to_string())
}

fn picture(brdf: &dyn Brdf, path: &Path) -> Result<(), Error> {
    use crate::lighting::{LightingSpec, SkySpec};
    let light = SkySpec::default().build();
    let light = light.map_err(|e| Error::Internal(e.to_string()))?;
    let image = crate::report::pictures::render_sphere(brdf, &*light, PICTURE, SAMPLES);
    let drawn = write_atomically(path, |out| image.write_png(image.white(), out));
    drawn.map_err(|e| cannot_write(path, &e))
}

fn cannot_write(path: &Path, e: &io::Error) -> Error {
    Error::output(path, format!("cannot write this file: {e}"))
}
