//! `gonio explore`.

use super::schedule::suppose_material;
use super::{
    BrdfArgs, ConfigArgs, ReadingArgs, SeedArgs, ThreadArgs, assumed, build, choose_material,
    make_folder, not_built, note, planned_instrument, read_schedule, refuse_existing,
    refuse_unwritable, write_text,
};
use crate::brdf::{Brdf, Channels};
use crate::error::Error;
use crate::experiment::{Plan, PlannedInstrument, quoted};
use crate::geometry::Symmetry;
use crate::instrument::Order;
use crate::measurement::Measurement;
use crate::report::explore::{Carried, Exploration, ShownMaterial, ShownReadings};
use crate::schedule::Assume;
use clap::{ArgGroup, Args, FromArgMatches};
use std::path::{Path, PathBuf};

/// Writes a page that shows materials, coordinates, arms, readings and uncertainties, and answers a hand
#[derive(Debug, Args)]
#[command(after_help = "\
  gonio explore gold-metallic-paint3.binary -o gold.html
  gonio explore ggx --set alpha=0.3 --readings readings.csv -o readings.html
  gonio explore brass.binary --plan configs/quickstart.toml --instrument cornell -o tour.html
  gonio explore -o blank.html

The page asks for no other file. Without a material it is blank: MERL tables and readings that are dropped onto
it are shown. Readings are reconstructed from where there is room for B.")]
#[command(mut_group("ReadingArgs", |group| group.requires("readings")))]
#[command(mut_arg("seed", |seed| seed.requires("tour")))]
#[command(group = ArgGroup::new("tour").args(["plan", "schedule"]))]
pub(super) struct Explore {
    /// A: a config (*.toml) with one material, a table, readings, or a kind of material
    #[arg(value_name = "CONFIG|BRDF")]
    a: Option<String>,
    /// B, which is compared with A
    #[arg(value_name = "CONFIG|BRDF", id = "b")]
    b: Option<String>,
    /// Set a key of A, or override one of its config
    #[arg(long = "set", value_name = "KEY=VALUE", requires = "a")]
    set: Vec<String>,
    /// Set a key of B, or override one of its config
    #[arg(long = "set-b", value_name = "KEY=VALUE", requires = "b")]
    set_b: Vec<String>,
    /// Readings that are shown as dots
    #[arg(long, value_name = "FILE")]
    readings: Option<PathBuf>,
    /// A schedule that an instrument carries out
    #[arg(long, value_name = "FILE")]
    schedule: Option<PathBuf>,
    /// A config whose largest schedule of at most 5000 poses is carried out, by its first instrument
    #[arg(long, value_name = "CONFIG")]
    plan: Option<PathBuf>,
    /// Another instrument for it: a preset (see `gonio list instruments`) or a file
    #[arg(long, value_name = "NAME|FILE", requires = "tour")]
    instrument: Option<String>,
    #[command(flatten)]
    seed: SeedArgs,
    /// The page to write
    #[arg(short, long, value_name = "FILE", required_unless_present = "gallery")]
    output: Option<PathBuf>,
    /// Write five pages of models into this folder instead
    #[arg(long, value_name = "DIR", conflicts_with_all = ["a", "readings", "schedule", "plan", "instrument", "output"])]
    gallery: Option<PathBuf>,
    /// Replace a file that exists
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    threads: ThreadArgs,
    #[command(flatten)]
    reading: ReadingArgs,
}

/// A material that is shown.
struct Loaded {
    name: String,
    argument: String,
    brdf: Box<dyn Brdf>,
    is_slow: bool,
}

/// Pages of a gallery, with the arguments that make them.
const GALLERY: [(&str, &str); 5] = [
    ("roughness", "ggx ggx --set alpha=0.3 --set-b alpha=0.15"),
    ("anisotropy", "ggx --set alpha=[0.15,0.4]"),
    ("families", "sheen ward"),
    (
        "arms",
        "ggx --set alpha=0.3 --plan ggx --instrument cornell",
    ),
    (
        "pictures",
        "ggx --set alpha=0.3 --plan ggx --instrument sphere-camera",
    ),
];

impl Explore {
    pub(super) fn run(self) -> Result<(), Error> {
        self.threads.apply()?;
        match (&self.gallery, &self.output) {
            (Some(folder), _) => self.write_gallery(folder),
            (None, Some(output)) => {
                let words = std::env::args().skip_while(|word| word != "explore");
                let words = words
                    .filter(|word| word != "--force")
                    .map(|word| quoted(&word));
                let words: Vec<String> = words.collect();
                self.write(output, format!("gonio {}", words.join(" ")))
            }
            // The parser asks for either.
            (None, None) => Ok(()),
        }
    }

    fn write_gallery(&self, folder: &Path) -> Result<(), Error> {
        make_folder(folder)?;
        let pages = GALLERY.map(|(name, words)| (folder.join(format!("{name}.html")), words));
        for (path, _) in &pages {
            refuse_existing(path, self.force)?;
        }
        for (path, words) in pages {
            let output = path.to_string_lossy().into_owned();
            let command = format!("gonio explore {words} -o {}", quoted(&output));
            let words = words.split(' ').map(str::to_owned);
            let words = words.chain(["--force".into(), "-o".into(), output]);
            let parser = Self::augment_args(clap::Command::new("explore").no_binary_name(true));
            let matches = parser.try_get_matches_from(words);
            let page = matches.and_then(|matches| Self::from_arg_matches(&matches));
            page.map_err(Error::internal)?.write(&path, command)?;
        }
        Ok(())
    }

    fn write(&self, output: &Path, command: String) -> Result<(), Error> {
        refuse_unwritable(output, self.force)?;
        let mut materials = Vec::new();
        for (target, set) in [(&self.a, &self.set), (&self.b, &self.set_b)] {
            if let Some(target) = target {
                materials.push(load(target, set)?);
            }
        }
        let read = self
            .readings
            .as_ref()
            .map(|path| self.read(path))
            .transpose()?;
        let carried = self.carried(materials.first())?;
        let mut notes = Vec::new();
        let simulated = match (&read, &carried, materials.first()) {
            (None, Some((carried, _)), Some(a)) => Some((a, carried.read(&*a.brdf)?)),
            _ => None,
        };
        let readings = match (&read, &simulated) {
            (Some((name, argument, measurement)), _) => Some(ShownReadings {
                name,
                argument: Some(argument),
                measurement,
            }),
            (None, Some((a, measurement))) => {
                notes.push(format!("The readings are simulated, of {}.", a.name));
                Some(ShownReadings {
                    name: &a.name,
                    argument: None,
                    measurement,
                })
            }
            (None, None) => None,
        };
        let truth = simulated.as_ref().map(|(a, read)| (&*a.brdf, read));
        let page = Exploration {
            command,
            materials: materials.iter().map(Loaded::shown).collect(),
            readings,
            tour: carried
                .as_ref()
                .and_then(|(carried, command)| carried.tour(truth, command.clone())),
            notes,
        };
        write_text(output, &page.html()?)
    }

    /// Name, argument and readings of a file.
    fn read(&self, path: &Path) -> Result<(String, String, Measurement), Error> {
        let assume = Assume {
            otherwise: Symmetry::FULL,
            ..assumed()
        };
        let read = self.reading.read_all(&[path.to_owned()], &assume)?;
        for text in &read.notes {
            note(&format!("gonio: {}: {text}", path.display()));
        }
        let name = path.file_name().unwrap_or_default();
        let argument = quoted(&path.to_string_lossy());
        Ok((
            name.to_string_lossy().into_owned(),
            argument,
            read.measurement,
        ))
    }

    /// The poses that are carried out, and a command that does so.
    fn carried(&self, material: Option<&Loaded>) -> Result<Option<(Carried, String)>, Error> {
        let symmetry = material.map_or(Symmetry::FULL, |m| m.brdf.symmetry());
        if let Some(path) = &self.schedule {
            let file = read_schedule(
                path,
                &Assume {
                    otherwise: symmetry,
                    ..assumed()
                },
            )?;
            let Some(name) = self.instrument.clone().or(file.instrument.clone()) else {
                let message = "this schedule names no instrument; allowed: with --instrument";
                return Err(Error::config(path.display().to_string(), message));
            };
            let instrument = PlannedInstrument::load(&name, Order::default())?;
            let path = quoted(&path.to_string_lossy());
            let config = material.map_or("CONFIG", |m| &m.argument);
            let name = quoted(&name);
            let command = format!(
                "gonio measure {path} --config {config} --instrument {name} -o readings.csv"
            );
            return Ok(Some((Carried::of_file(file, instrument)?, command)));
        }
        let Some(path) = &self.plan else {
            return Ok(None);
        };
        let config = ConfigArgs {
            config: path.clone(),
            set: Vec::new(),
        };
        let mut source = config.source()?;
        self.seed.apply(&mut source)?;
        suppose_material(&mut source)?;
        let mut plan = Plan::read_parts(&source)?;
        if let Some(name) = &self.instrument {
            plan.instruments = vec![planned_instrument(&plan, name)?];
        }
        let by = self
            .instrument
            .iter()
            .map(|name| format!(" --instrument {}", quoted(name)));
        let by: String = by.collect();
        let path = quoted(&path.to_string_lossy());
        let command = format!("gonio schedule {path}{by} --skip-unreachable -o schedules/");
        Ok(Some((Carried::of_plan(&plan, symmetry)?, command)))
    }
}

fn load(target: &str, set: &[String]) -> Result<Loaded, Error> {
    let plan = BrdfArgs::new(target.into(), set.to_vec(), None).plan()?;
    let material = choose_material(&plan.materials, None)?;
    let channels = match &plan.wavelengths {
        Some(_) => plan.seen_in(Channels::Rgb),
        None => material
            .spec
            .widest_channels()
            .map_err(|e| not_built(&material.name, e))?,
    };
    let brdf = build(material, channels)?;
    let keys: String = set
        .iter()
        .map(|key| format!(" --set {}", quoted(key)))
        .collect();
    Ok(Loaded {
        name: material.name.clone(),
        argument: quoted(target) + &keys,
        is_slow: brdf.as_estimated().is_some(),
        brdf,
    })
}

impl Loaded {
    fn shown(&self) -> ShownMaterial<'_> {
        ShownMaterial {
            name: &self.name,
            argument: &self.argument,
            brdf: &*self.brdf,
            is_slow: self.is_slow,
        }
    }
}
