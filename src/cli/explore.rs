//! `gonio explore`.

use super::schedule::suppose_material;
use super::{
    BrdfArgs, ConfigArgs, ReadingArgs, SeedArgs, ThreadArgs, assumed, build, choose_material,
    make_folder, not_built, note, planned_instrument, read_schedule, refuse_existing,
    refuse_unwritable, write_text,
};
use crate::brdf::Channels;
use crate::error::Error;
use crate::experiment::{Plan, PlannedInstrument, quoted};
use crate::geometry::Symmetry;
use crate::instrument::Order;
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

/// Pages of a gallery: the name of each, and the arguments that make it.
const GALLERY: [&str; 5] = [
    "roughness ggx ggx --set alpha=0.3 --set-b alpha=0.15",
    "anisotropy ggx --set alpha=[0.15,0.4]",
    "families sheen ward",
    "arms ggx --set alpha=0.3 --plan ggx --instrument cornell",
    "pictures ggx --set alpha=0.3 --plan ggx --instrument sphere-camera",
];

impl Explore {
    pub(super) fn run(self) -> Result<(), Error> {
        self.threads.apply()?;
        match (&self.gallery, &self.output) {
            (Some(folder), _) => self.write_gallery(folder),
            (None, Some(output)) => {
                let words = std::env::args().skip_while(|word| word != "explore");
                let words = words.filter(|word| word != "--force");
                let words: Vec<String> = words.map(|word| quoted(&word)).collect();
                self.write(output, format!("gonio {}", words.join(" ")))
            }
            // The parser asks for either.
            (None, None) => Ok(()),
        }
    }

    fn write_gallery(&self, folder: &Path) -> Result<(), Error> {
        make_folder(folder)?;
        let pages = GALLERY.map(|page| page.split_once(' ').unwrap_or_default());
        let pages = pages.map(|(name, words)| (folder.join(format!("{name}.html")), words));
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
        let readings = self.readings.as_ref().map(|path| self.read(path));
        let page = Exploration {
            command,
            readings: readings.transpose()?,
            carried: self.carried(materials.first())?,
            materials,
            notes: Vec::new(),
        };
        write_text(output, &page.html()?)
    }

    fn read(&self, path: &Path) -> Result<ShownReadings, Error> {
        let read = self
            .reading
            .read_all(&[path.to_owned()], &assume(Symmetry::FULL))?;
        for text in &read.notes {
            note(&format!("gonio: {}: {text}", path.display()));
        }
        let name = path.file_name().unwrap_or_default();
        Ok(ShownReadings {
            name: name.to_string_lossy().into_owned(),
            argument: quoted(&path.to_string_lossy()),
            measurement: read.measurement.into(),
        })
    }

    /// The poses that are carried out.
    fn carried(&self, material: Option<&ShownMaterial>) -> Result<Option<Carried>, Error> {
        let symmetry = material.map_or(Symmetry::FULL, |m| m.brdf.symmetry());
        let named = self.instrument.as_ref();
        if let Some(path) = &self.schedule {
            let file = read_schedule(path, &assume(symmetry))?;
            let Some(name) = named.or(file.instrument.as_ref()).cloned() else {
                let message = "this schedule names no instrument; allowed: with --instrument";
                return Err(Error::config(path.display().to_string(), message));
            };
            let instrument = PlannedInstrument::load(&name, Order::default())?;
            let path = quoted(&path.to_string_lossy());
            let config = material.map_or("CONFIG", |m| &m.argument);
            let by = format!("--instrument {} -o readings.csv", quoted(&name));
            let command = format!("gonio measure {path} --config {config} {by}");
            return Carried::of_file(file, instrument, command).map(Some);
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
        let mut by = String::new();
        if let Some(name) = named {
            plan.instruments = vec![planned_instrument(&plan, name)?];
            by = format!(" --instrument {}", quoted(name));
        }
        let path = quoted(&path.to_string_lossy());
        let command = format!("gonio schedule {path}{by} --skip-unreachable -o schedules/");
        Carried::of_plan(&plan, symmetry, command).map(Some)
    }
}

/// What files without words about symmetry are taken for.
fn assume(otherwise: Symmetry) -> Assume {
    let assumed = assumed();
    Assume {
        otherwise,
        ..assumed
    }
}

fn load(target: &str, set: &[String]) -> Result<ShownMaterial, Error> {
    let plan = BrdfArgs::new(target.into(), set.to_vec(), None).plan()?;
    let material = choose_material(&plan.materials, None)?;
    let widest = || material.spec.widest_channels();
    let channels = match &plan.wavelengths {
        Some(_) => plan.seen_in(Channels::Rgb),
        None => widest().map_err(|e| not_built(&material.name, e))?,
    };
    let keys = set.iter().map(|key| format!(" --set {}", quoted(key)));
    let argument = quoted(target) + &keys.collect::<String>();
    let brdf = build(material, channels)?;
    Ok(ShownMaterial::new(&material.name, &argument, brdf.into()))
}
