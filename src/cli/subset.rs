//! `gonio subset`.

use super::output::{Format, one_format};
use super::{BrdfArgs, DrawingArgs, Progress, ThreadArgs, parametrization_of, print, whole};
use crate::analysis::bounces::PathSample;
use crate::analysis::{ENERGY_PAIRS, Reach, Subset as LightPaths};
use crate::brdf::Channels;
use crate::error::Error;
use crate::geometry::Symmetry;
use crate::instrument::{self, Machine};
use crate::parametrization;
use crate::report::SubsetReport;
use clap::Args;
use std::fmt::Display;

/// Light paths that are followed of a material whose light is split by scattering order.
const PATHS: usize = 1 << 18;

#[derive(Debug, Args)]
pub(super) struct Subset {
    /// The coordinates that bound it, in their isotropic form (see `gonio list parametrizations`)
    #[arg(long, value_name = "NAME")]
    parametrization: String,
    /// Ranges by axis, separated by commas, angles in degrees: "h_bar=0..0.2, delta=30..60"; axes
    /// that are not named are free
    #[arg(long = "box", value_name = "AXIS=LOW..HIGH")]
    bounds: String,
    /// A material: a MERL table (*.binary), a kind of material, or a config with one. Its symmetries
    /// fold the coordinates, and the share of its energy is told, of each number of facets that light met where the
    /// material tells them apart (see `gonio paths`) [default: every symmetry]
    #[arg(long, value_name = "CONFIG|BRDF")]
    material: Option<String>,
    /// Set a key of the material (alpha=0.1)
    #[arg(long = "set", value_name = "KEY=VALUE", requires = "material")]
    set: Vec<String>,
    /// Seed of the pairs that are counted
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole::<0, { u64::MAX }>)]
    seed: u64,
    /// Format of what is printed
    #[arg(long, value_parser = one_format([Format::Text, Format::Json]), default_value = "text")]
    format: Format,
    /// JSON: the same as --format json
    #[arg(long, conflicts_with = "format")]
    json: bool,
    #[command(flatten)]
    drawing: DrawingArgs,
    #[command(flatten)]
    threads: ThreadArgs,
}

impl Subset {
    pub(super) fn run(self) -> Result<(), Error> {
        self.threads.apply()?;
        self.drawing.check()?;
        let entry = parametrization_of("--parametrization", &self.parametrization)?;
        let of = |target: &String| BrdfArgs::new(target.clone(), self.set.clone(), None);
        let material = self.material.as_ref().map(of);
        let material = material.map(|args| args.one(Channels::Luminance));
        let material = material.transpose()?;
        let folded = material.as_ref().map(|(m, _)| m.symmetry);
        let symmetry = folded.unwrap_or(Symmetry::FULL).with_isotropy(true);
        let subset = LightPaths::read(entry.form(symmetry), &self.bounds)
            .map_err(|e| Error::config("--box", e))?;
        let Some(needs) = subset.needs() else {
            let message = format!("{}: no pair of this box is above the horizon", self.bounds);
            return Err(Error::config("--box", message));
        };
        let bounces = material.as_ref().and_then(|(_, brdf)| {
            let sample = PathSample::follow(brdf.as_split()?, PATHS);
            let capture = sample.capture(|pair| subset.contains(pair));
            Some((sample, capture))
        });
        let energy = material.map(|(material, brdf)| {
            let progress = Progress::with_work(ENERGY_PAIRS, "energy");
            let share = subset.energy_share(&progress.watches(&*brdf));
            (material.name, share)
        });
        let measure = subset.measure(self.seed);
        let best = measure.best();
        let mut others = parametrization::all();
        others.retain(|e| e.kind != entry.kind);
        let images = others.iter().filter_map(|other| {
            let form = other.form(symmetry);
            let image = subset.image(&form, &best)?;
            Some((form, image))
        });
        let report = SubsetReport {
            measure,
            needs,
            images: images.collect(),
            reaches: reaches(&subset)?,
            energy,
            bounces,
            subset: &subset,
        };
        match self.json || self.format == Format::Json {
            true => print(&format!("{:#}\n", report.json()))?,
            false => print(&report.text())?,
        }
        self.drawing.write(|| {
            let title = report.title();
            let panels = report.panels(&background()?);
            Ok(crate::report::svg(&title, &panels, 3))
        })
    }
}

/// Pairs from everywhere, for the picture.
fn background() -> Result<Vec<crate::geometry::DirectionPair>, Error> {
    use crate::metrics::{Measure, MetricsSpec, test_pairs};
    let spec = MetricsSpec {
        pairs: 500,
        mask_deg: 90.0,
        ..MetricsSpec::default()
    };
    test_pairs(Measure::Cosine, &spec).map_err(Error::internal)
}

/// Name of every preset, and the part of the box it can reach.
fn reaches(subset: &LightPaths) -> Result<Vec<(String, Reach)>, Error> {
    let presets = instrument::presets();
    let reaches = presets.iter().map(|preset| {
        let failed = |e: &dyn Display| Error::Internal(format!("preset {}: {e}", preset.name));
        let spec = instrument::read(preset.text).map_err(|e| failed(&e))?;
        let machine = Machine::new(&spec).map_err(|e| failed(&e))?;
        Ok((preset.name.to_owned(), subset.reach(&machine)))
    });
    reaches.collect()
}
