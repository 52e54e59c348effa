//! `gonio reconstruct`.

use super::cross_validation::{LeaveOut, print_scores, table_of};
use super::energy::{EnergyArgs, Known};
use super::{
    BrdfArgs, ReadingArgs, ReadingsFile, ThreadArgs, assumed, build, choose_material, format_names,
    format_of, is_config, listed, no_member, one_value, parametrization_of, print,
    refuse_other_endings, refuse_unwritable, say, suspected, tabulate, with_bound, with_keys,
    write_quietly,
};
use crate::brdf::Brdf;
use crate::error::{Error, ParameterError, count};
use crate::experiment::{AnyPlan, Kind, Plan};
use crate::formats::{self, Format, READ_READINGS, Tabulation, WRITE_READINGS, WRITE_TABLE};
use crate::geometry::{DirectionPair, Symmetry};
use crate::measurement::{About, Flags, Measurement, Outcome};
use crate::metrics::{self, Measure, MetricsSpec, TestSet};
use crate::parametrization;
use crate::reconstruct::{self, Coverage, Covered, Fill, MOST_PREDICTED};
use crate::report::pictures::{ErrorMap, Relative, uncertainty_svg};
use crate::schedule::Pose;
use crate::schedule::{Assume, Sequence, Unreachable};
use crate::validation::{Reconstruction, ReferenceReadings, expected};
use clap::Args;
use clap::builder::{PossibleValue, TypedValueParser};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Pixels along each side of the picture.
const PICTURE: usize = 512;

/// Points per pixel.
const SAMPLES: usize = 16;

/// Pixels along each side of a plane of an error map.
const CELLS: usize = 192;

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
        help = format!("The readings, in one file or more ({}); text of another name is recognised by its first lines",
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
    /// What is left out in turn and predicted by the rest, to estimate the error without a truth
    #[arg(long, value_name = "WHAT", value_enum, default_value_t = LeaveOut::Auto)]
    cross_validation: LeaveOut,
    #[arg(long, value_name = "FILE",
        help = format!("Write the readings with the flag `suspected` where all others contradict one ({})",
            WRITE_READINGS.extensions(".")))]
    checked: Option<PathBuf>,
    /// Take readings that all others contradict too; of 33 to 2000 readings these are left out. Kriging leaves them out by
    /// itself, and says so, unless --set robust=false
    #[arg(long, conflicts_with = "checked")]
    take_all: bool,
    /// Compare with a truth: a config, a table, a kind of material, or other readings. Of readings with
    /// uncertainties it also reports within_2u: the share of pairs where the truth is within the uncertainty
    /// (k = 2) that the readings give the BRDF; about 0.95 if they err at random and nothing else does,
    /// less if it errs between them
    #[arg(long, value_name = "CONFIG|BRDF|READINGS")]
    against: Option<String>,
    /// The material of --against, by its name; not needed if there is only one
    #[arg(long, value_name = "NAME", requires = "against")]
    material: Option<String>,
    /// Draw the error relative to the truth over the first two axes of coordinates, at four azimuths
    #[arg(long, value_name = "FILE.svg")]
    error_map: Option<PathBuf>,
    /// The coordinates of --error-map, a row; may be given several times [default: those of the readings]
    #[arg(long, value_name = "NAME", requires = "error_map")]
    error_map_in: Vec<String>,
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
    match text {
        "none" => Ok(Symmetry::NONE),
        names => Symmetry::named(names.split(',').map(str::trim)),
    }
}

/// The names of fills.
fn fill() -> impl TypedValueParser<Value = Fill> {
    let named = |fill: Fill| (fill, PossibleValue::new(fill.name()));
    one_value(Fill::ALL.map(named).into())
}

/// Share of a table between readings below which it is doubted.
const FEW: f64 = 0.05;

/// Shares of the table by coverage; one of which hardly anything is between readings is doubted.
fn shares(covered: &Covered<'_>, readings: usize) -> String {
    let all = Coverage::ALL.into_iter().zip(covered.shares());
    let mut few = all.clone();
    if few.any(|(of, share)| of == Coverage::Interpolated && share < FEW) {
        let all = count(readings, "reading");
        say(&format!(
            "gonio: hardly any of this table is between its {all}"
        ));
    }
    let shares = all.map(|(of, share)| format!("{:.1} % {}", 100.0 * share, of.name()));
    format!("coverage of the table: {}\n", listed(shares))
}

/// What a reconstruction is compared with.
enum Truth {
    /// Another BRDF, with its name, at the test pairs of these measures.
    Brdf(String, Box<dyn Brdf>, MetricsSpec, Vec<Measure>),
    /// Other readings.
    Readings(ReferenceReadings),
}

/// The name of the choice by cross-validation.
pub(super) const AUTO: &str = "auto";

impl Reconstruct {
    pub(super) fn run(self) -> Result<(), Error> {
        self.threads.apply()?;
        refuse_other_endings(self.picture.as_deref(), "png")?;
        refuse_other_endings(self.error_map.as_deref(), "svg")?;
        if self.error_map.is_some() && self.against.is_none() {
            let message = "there is no truth to err from; allowed: with --against CONFIG|BRDF";
            return Err(Error::config("--error-map", message));
        }
        let is_svg = |e: &std::ffi::OsStr| e.eq_ignore_ascii_case("svg");
        let is_table = |path: &&Path| !path.extension().is_some_and(is_svg);
        let where_uncertain = self.uncertainty.as_deref().filter(is_table);
        let for_uncertainties = |path| ReadingsFile::new(None, path)?.for_uncertainties();
        let where_uncertain = where_uncertain.map(for_uncertainties).transpose()?;
        let files = [&self.output, &self.picture, &self.uncertainty];
        let files = files.into_iter().chain([&self.error_map]).flatten();
        let mut outputs: Vec<&PathBuf> = files.collect();
        for path in &outputs {
            refuse_unwritable(path, self.force)?;
        }
        outputs.extend(&self.checked);
        outputs.sort();
        if let Some(pair) = outputs.windows(2).find(|pair| pair[0] == pair[1]) {
            let message = "two of the files to be written have this name; allowed: one each";
            return Err(Error::output(pair[0], message));
        }
        let checked = self.checked.as_deref();
        let checked = checked.map(|path| ReadingsFile::new(None, path));
        let checked = checked.transpose()?;
        if let Some(file) = &checked {
            file.refuse_existing(self.force)?;
        }
        let table = match &self.output {
            Some(path) => Some((format_of(&WRITE_TABLE, self.format, path)?, path)),
            None => None,
        };
        if let Some(name) = &self.parametrization {
            parametrization_of("--parametrization", name)?;
        }
        let map_in = self.error_map_in.iter();
        let map_in = map_in.map(|name| parametrization_of("--error-map-in", name));
        let mut map_in: Vec<_> = map_in.collect::<Result<_, _>>()?;
        if self.reconstruction.as_deref() == Some(AUTO) && self.cross_validation == LeaveOut::None {
            let message = "auto chooses by what is left out; allowed: auto, sheets, points";
            return Err(Error::config("--cross-validation none", message));
        }
        let (measurement, notes) = self.read(&self.measurements)?;
        let path = &self.measurements[0];
        print(&(material_of(&measurement) + &notes))?;
        let truth = self.truth(&measurement)?;
        if let (Some(Truth::Readings(_)), Some(_)) = (&truth, &self.error_map) {
            let message =
                "--against names readings, between which there is no truth; allowed: CONFIG|BRDF";
            return Err(Error::config("--error-map", message));
        }
        if map_in.is_empty() {
            let own = measurement.schedule.parametrization.name();
            map_in.extend(parametrization::find(own));
        }
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
        let failed = |e| Error::data(path, e);
        let method = self.method(&measurement)?;
        let made = Reconstruction::new(Arc::new(measurement), Some(method)).map_err(failed)?;
        let (measurement, brdf) = (&*made.measurement, &*made.brdf);
        print(&format!("reconstruction: {}\n", made.method.label()))?;
        for remark in brdf.remarks() {
            print(&format!("  {remark}\n"))?;
        }
        let predictive = made.predictive();
        if let Some(expected) = predictive.as_ref().and_then(|known| expected(&**known)) {
            let errors = with_bound(&expected, measurement.readings());
            print(&format!("  {errors}\n"))?;
        }
        let replicated = match truth.is_some() || self.uncertainty.is_some() {
            true => made.replicated().map_err(failed)?,
            false => None,
        };
        if where_uncertain.is_some() && replicated.is_none() {
            let message = format!(
                "most readings have no uncertainty; allowed: readings with type_a or type_b, or --reconstruction kriging of up to {MOST_PREDICTED}"
            );
            return Err(Error::data(path, message));
        }
        match truth {
            Some(Truth::Brdf(name, truth, metrics, measures)) => {
                let set = TestSet::new(&measures, &metrics);
                let set = set.map_err(|e| Error::config("metrics", e))?;
                let against = made.against(&*truth, &set).map_err(failed)?;
                print(&table_of(&against, &set.measures, 4))?;
                if let Some(path) = &self.error_map {
                    let map = ErrorMap::new(&*truth, brdf, &map_in, CELLS);
                    let title = format!("{name}: relative error (%) of {}", made_of(&made));
                    write_quietly(path, map.svg(&title))?;
                }
            }
            Some(Truth::Readings(jury)) => {
                let predicted = metrics::evaluate(brdf, jury.pairs());
                let uncertainties = replicated.map(|r| r.uncertainties(jury.pairs()));
                let within = uncertainties.map(|u| jury.within(&predicted, &u));
                print_scores(&jury.errors(&predicted), within)?;
            }
            None => {}
        }
        if let Some((table, path)) = table {
            let covered = Covered::new(brdf, measurement, self.fill);
            let covered = covered.map_err(|e| Error::data(path, e))?;
            tabulate::pairs(table, 0, &covered, path, "--output")?;
            let predictive = predictive.as_deref();
            let known = Known {
                measurement,
                predictive,
            };
            self.energy.check(&covered, Some(&known))?;
            // What this asked for is no cell of the table.
            covered.forget();
            tabulate::write(table, Tabulation::default(), &covered, path, "--output")?;
            print(&shares(&covered, measurement.readings()))?;
        }
        if let Some(path) = &self.picture {
            picture(brdf, path)?;
        }
        if let Some(file) = &where_uncertain {
            let readings = made.uncertain_readings().map_err(failed)?;
            let write = |m| file.write(&m, &About::default(), Sequence::Generated);
            return readings.map_or(Ok(()), write);
        }
        let Some(path) = &self.uncertainty else {
            return Ok(());
        };
        let at = |pairs: &[DirectionPair]| -> Vec<f64> {
            let all = replicated.iter().flat_map(|r| r.luminance_at(pairs));
            all.map(|u| u.share(u.uncertainty())).collect()
        };
        let of = match predictive {
            Some(_) => "of its readings and between them",
            None => "of its readings",
        };
        let relative = replicated.map(|_| Relative { at: &at, of });
        let what = match relative {
            Some(_) => "Relative standard uncertainty of",
            None => "Where readings surround",
        };
        let title = format!("{what} {}", made_of(&made));
        let svg = uncertainty_svg(&title, relative, &made.cover().map_err(failed)?);
        write_quietly(path, svg)
    }

    /// The measurement of a file or several, and notes on it.
    fn read(&self, paths: &[PathBuf]) -> Result<(Measurement, String), Error> {
        let assume = Assume {
            parametrization: self.parametrization.clone(),
            symmetry: self.symmetry,
            otherwise: Symmetry::FULL,
            ..assumed()
        };
        let read = self.reading.read_all(paths, &assume)?;
        let notes = read.notes.into_iter().map(|note| note + "\n");
        Ok((read.measurement, notes.collect()))
    }

    /// The method that is asked for; `None` if the readings choose.
    fn named(&self) -> Result<Option<Arc<dyn reconstruct::Reconstruct>>, Error> {
        let Some(kind) = self.reconstruction.as_deref().filter(|kind| *kind != AUTO) else {
            let message =
                "the readings choose the reconstruction; allowed: --set with --reconstruction KIND";
            return match self.set.first() {
                Some(set) => Err(Error::config(format!("--set {set}"), message)),
                None => Ok(None),
            };
        };
        let all = reconstruct::all();
        let Some(entry) = all.iter().find(|e| e.kind == kind) else {
            let known = all.iter().map(|e| e.kind).chain([AUTO]);
            return Err(no_member("--reconstruction", "reconstruction", kind, known));
        };
        let method = with_keys(entry, &self.set)?;
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
        let coordinates = self.parametrization.as_deref();
        let validation = self.cross_validation;
        let best = validation.choose(measurement, path, methods, coordinates)?;
        let best = method.or(best);
        Ok(best.unwrap_or_else(|| reconstruct::default_for(measurement)))
    }

    fn truth(&self, measurement: &Measurement) -> Result<Option<Truth>, Error> {
        let Some(target) = &self.against else {
            return Ok(None);
        };
        let path = Path::new(target);
        let format = formats::of_file(path);
        if format.is_some_and(|f| f.read_readings.is_some() && f.table.read.is_none()) {
            let (other, notes) = self.read(&[path.to_owned()])?;
            let text = material_of(&other);
            print(&format!("against {}: {text}{notes}", path.display()))?;
            let jury = ReferenceReadings::new(&other).map_err(|e| Error::data(path, e))?;
            return Ok(Some(Truth::Readings(jury)));
        }
        let source = BrdfArgs::new(target.clone(), Vec::new(), None).source()?;
        let (materials, metrics, measures) =
            if is_config(target) && !Kind::of_config(&source)?.has_profiles() {
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
        let name = material.name.clone();
        Ok(Some(Truth::Brdf(name, brdf, metrics, measures)))
    }
}

/// What a title calls a reconstruction.
fn made_of(made: &Reconstruction) -> String {
    let (method, readings) = (made.method.label(), made.measurement.readings());
    let readings = count(readings, "reading");
    format!("the reconstruction by {method} of {readings}")
}

/// An angle of a pose, rad.
type Angle = fn(&Pose) -> f64;

/// Text about a measurement: its readings, its holes with their reasons, the angles they cover.
fn material_of(measurement: &Measurement) -> String {
    let schedule = &measurement.schedule;
    let form = &schedule.parametrization;
    let mut text = format!(
        "{} ({}) in {} coordinates (warp: {}; {}): {}\n",
        count(schedule.poses.len(), "pose"),
        schedule.sample_set,
        form.name(),
        form.warp_name(),
        form.symmetry(),
        count(measurement.readings(), "reading"),
    );
    let outcomes = &measurement.outcomes;
    let of = |name| (name, outcomes.iter().filter(|o| o.name() == name).count());
    let list = |counts: Vec<(&str, usize)>| {
        let some = counts.into_iter().filter(|(_, n)| *n > 0);
        listed(some.map(|(name, n)| format!("{name} {n}")))
    };
    let holes = ["no-data", "not-visited"].into_iter();
    let holes = list(holes.chain(Unreachable::NAMES).map(of).collect());
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
    let read = schedule.poses.iter().zip(outcomes);
    let read = read.filter(|(_, o)| **o == Outcome::Reading);
    let ranges: [(&str, Angle); 3] = [
        ("theta_i", |p| p.pair.omega_i.theta()),
        ("theta_o", |p| p.pair.omega_o.theta()),
        ("separation", |p| p.pair.separation()),
    ];
    if measurement.readings() > 0 {
        let ranges = ranges.map(|(name, angle)| {
            let angles = read.clone().map(|(pose, _)| angle(pose).to_degrees());
            let ends = angles.fold([f64::INFINITY, f64::NEG_INFINITY], |[lo, hi], a| {
                [lo.min(a), hi.max(a)]
            });
            format!("{name} {:.2}° to {:.2}°", ends[0], ends[1])
        });
        text += &format!("covered: {}\n", listed(ranges));
    }
    text
}

fn picture(brdf: &dyn Brdf, path: &Path) -> Result<(), Error> {
    use crate::lighting::{LightingSpec, SkySpec};
    let light = SkySpec::default().build().map_err(Error::internal)?;
    let image = crate::report::pictures::render_sphere(brdf, &*light, PICTURE, SAMPLES);
    write_quietly(path, image.png(image.white()))
}
