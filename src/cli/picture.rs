//! `gonio picture`.

use super::{
    BrdfArgs, Progress, ThreadArgs, commands, make_folder, member, not_built, note,
    parametrization_of, print, refuse_existing, write_file, write_text,
};
use crate::brdf::{Brdf, Channels};
use crate::error::{Error, count, excerpt, one_of};
use crate::formats::{self, READ_ENVIRONMENT};
use crate::instrument::{Ideal, Instrument};
use crate::lighting::{self, Lighting};
use crate::parametrization::{self, ParametrizationSpec, WarpSpec, Warps};
use crate::reconstruct;
use crate::registry::{self, Entry};
use crate::report::file_stem;
use crate::report::pictures::{
    BrdfSlices, Comparison, hemispheres_svg, render_sphere, stops_svg, test_functions_svg,
};
use crate::schedule;
use clap::Args;
use std::fmt::Display;
use std::io::Write;
use std::ops::RangeBounds;
use std::path::{Path, PathBuf};
use std::sync::Arc;

commands! {
    #[command(after_help = "\
  gonio picture hemispheres -o pictures
  gonio picture slices gold-metallic-paint3.binary -o pictures
  gonio picture sphere ggx --set alpha=0.05 --lighting panorama.exr -o pictures
  gonio picture compare ggx --budget 1000 --parametrization hybrid --warp h_bar=square-root -o pictures")]
    pub(super) enum Picture {
        /// Parametrizations on the hemisphere of light directions: hemispheres.svg
        Hemispheres(Hemispheres),
        /// The test functions S, G and F on the hemisphere and in slices: functions.svg
        Functions(Functions),
        /// The pairs that a camera reads at a stop, in each parametrization: stops.svg
        Stops(Stops),
        /// A material in slices of each parametrization, with isolines: NAME_slices.svg and .exr
        Slices(Slices),
        /// A sphere of a material under distant light: NAME_sphere.png and .exr
        Sphere(Sphere),
        /// A material, its reconstruction and the difference: NAME_….svg, .png and .exr
        Compare(Compare),
    }
}

/// Where files go.
#[derive(Debug, Args)]
struct Folder {
    /// The folder to write into
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
}

impl Folder {
    /// Paths of files that may be written: one for each ending.
    fn free<const N: usize>(&self, stem: &str, endings: [&str; N]) -> Result<[PathBuf; N], Error> {
        let paths = endings.map(|ending| self.output.join(format!("{stem}.{ending}")));
        for path in &paths {
            refuse_existing(path, self.force)?;
        }
        Ok(paths)
    }
}

/// The parametrizations of a plate.
#[derive(Debug, Args)]
struct Charts {
    /// A parametrization, a row; may be given several times
    #[arg(long = "parametrization", value_name = "NAME",
        default_values = ["half-difference", "orthographic", "hybrid"])]
    names: Vec<String>,
}

impl Charts {
    fn entries(&self) -> Result<Vec<Entry<ParametrizationSpec>>, Error> {
        let named = |name: &String| parametrization_of("--parametrization", name);
        self.names.iter().map(named).collect()
    }
}

/// View elevations, each a picture in a row.
#[derive(Debug, Args)]
struct Views {
    /// View elevation in degrees, in [0, 90); may be given several times
    #[arg(long = "view-deg", value_name = "DEG", default_values_t = [10.0, 40.0, 70.0])]
    views: Vec<f64>,
}

impl Views {
    fn checked(&self) -> Result<&[f64], Error> {
        check_views(&self.views)
    }
}

/// Views that a slice is seen from, degrees; others are refused.
pub(super) fn check_views(views: &[f64]) -> Result<&[f64], Error> {
    let allowed = "view elevation; allowed: a number in [0, 90)";
    checked("--view-deg", views, 0.0..90.0, allowed)
}

fn checked<'a>(
    option: &str,
    angles: &'a [f64],
    range: impl RangeBounds<f64>,
    allowed: &str,
) -> Result<&'a [f64], Error> {
    match angles.iter().find(|angle| !range.contains(angle)) {
        Some(angle) => Err(Error::config(option, format!("{angle} is no {allowed}"))),
        None => Ok(angles),
    }
}

/// Azimuths, each a slice in a row.
#[derive(Debug, Args)]
struct Azimuths {
    /// The azimuth that is fixed in a slice, degrees, in [0, 180]; may be given several times
    #[arg(long = "phi-deg", value_name = "DEG", default_values_t = [0.0, 30.0, 60.0, 90.0])]
    phis: Vec<f64>,
}

impl Azimuths {
    fn checked(&self) -> Result<&[f64], Error> {
        let allowed = "azimuth; allowed: a number in [0, 180]";
        checked("--phi-deg", &self.phis, 0.0..=180.0, allowed)
    }
}

#[derive(Debug, Args)]
pub(super) struct Hemispheres {
    #[command(flatten)]
    charts: Charts,
    #[command(flatten)]
    views: Views,
    #[command(flatten)]
    folder: Folder,
}

impl Hemispheres {
    fn run(self) -> Result<(), Error> {
        let (charts, views) = (self.charts.entries()?, self.views.checked()?);
        let [svg] = self.folder.free("hemispheres", ["svg"])?;
        let text = hemispheres_svg(&charts, views);
        make_folder(&self.folder.output)?;
        write_text(&svg, &text)
    }
}

#[derive(Debug, Args)]
pub(super) struct Functions {
    #[command(flatten)]
    charts: Charts,
    #[command(flatten)]
    views: Views,
    #[command(flatten)]
    azimuths: Azimuths,
    #[command(flatten)]
    folder: Folder,
}

impl Functions {
    fn run(self) -> Result<(), Error> {
        let (charts, views) = (self.charts.entries()?, self.views.checked()?);
        let phis = self.azimuths.checked()?;
        let [svg] = self.folder.free("functions", ["svg"])?;
        let text = test_functions_svg(&charts, views, phis);
        make_folder(&self.folder.output)?;
        write_text(&svg, &text)
    }
}

#[derive(Debug, Args)]
pub(super) struct Stops {
    /// A parametrization, a column; may be given several times
    #[arg(long = "parametrization", value_name = "NAME",
        default_values = ["spherical", "half-difference", "orthographic", "hybrid", "stark"])]
    names: Vec<String>,
    /// θ_d or θ_i of a stop in degrees, in [0, 85]; may be given several times
    #[arg(long = "angle-deg", value_name = "DEG", default_values_t = [10.0, 30.0, 50.0, 70.0])]
    angles: Vec<f64>,
    #[command(flatten)]
    folder: Folder,
}

impl Stops {
    fn run(self) -> Result<(), Error> {
        let charts = Charts { names: self.names }.entries()?;
        let allowed = "angle of a stop; allowed: a number in [0, 85]";
        let angles = checked("--angle-deg", &self.angles, 0.0..=85.0, allowed)?;
        let [svg] = self.folder.free("stops", ["svg"])?;
        let text = stops_svg(&charts, angles);
        make_folder(&self.folder.output)?;
        write_text(&svg, &text)
    }
}

/// The material, in colour, or by wavelength, which is drawn in grey.
fn material(args: &BrdfArgs) -> Result<(String, Box<dyn Brdf>), Error> {
    let (material, brdf) = args.one(Channels::Rgb)?;
    Ok((material.name, brdf))
}

#[derive(Debug, Args)]
pub(super) struct Slices {
    #[command(flatten)]
    brdf: BrdfArgs,
    #[command(flatten)]
    charts: Charts,
    #[command(flatten)]
    azimuths: Azimuths,
    /// Cells of a slice along each axis
    #[arg(long, value_name = "N", default_value = "256",
        value_parser = clap::value_parser!(u16).range(2..=1024))]
    resolution: u16,
    #[command(flatten)]
    threads: ThreadArgs,
    #[command(flatten)]
    folder: Folder,
}

impl Slices {
    fn run(self) -> Result<(), Error> {
        self.threads.apply()?;
        let (charts, phis) = (self.charts.entries()?, self.azimuths.checked()?);
        let (name, brdf) = material(&self.brdf)?;
        let stem = format!("{}_slices", file_stem(&name));
        let [svg, exr] = self.folder.free(&stem, ["svg", "exr"])?;
        let slices = BrdfSlices::new(&*brdf, &charts, phis, self.resolution.into());
        let text = slices.svg(&name);
        make_folder(&self.folder.output)?;
        write_text(&svg, &text)?;
        write_file(&exr, |out| slices.write_exr(out))
    }
}

/// Light, and how carefully it is drawn.
#[derive(Debug, Args)]
struct Scene {
    #[arg(long, value_name = "FILE|KIND", default_value = "sky",
        help = format!("A panorama ({}), or a kind of light (see `gonio list lightings`)",
            READ_ENVIRONMENT.extensions(".")))]
    lighting: String,
    /// Pixels along each side of a sphere
    #[arg(long, value_name = "N", default_value = "512",
        value_parser = clap::value_parser!(u16).range(1..=4096))]
    resolution: u16,
    /// Points a pixel
    #[arg(long, value_name = "N", default_value = "16",
        value_parser = clap::value_parser!(u32).range(2..=65_536))]
    samples: u32,
    #[command(flatten)]
    threads: ThreadArgs,
}

impl Scene {
    fn light(&self) -> Result<Box<dyn Lighting>, Error> {
        let path = Path::new(&self.lighting);
        let panorama = formats::of_name(path).and_then(|f| f.read_environment);
        let mut kinds = lighting::all();
        // Kinds without an example have no defaults.
        kinds.retain(|e| !e.examples.is_empty());
        let named = kinds.iter().find(|e| e.kind == self.lighting);
        let spec = match (panorama, named) {
            (Some(read), _) => read(path.into()),
            (None, Some(entry)) => registry::read_text(entry, "").map_err(Error::internal)?,
            (None, None) => {
                let message = format!(
                    "{:?} is neither a panorama ({}) nor a kind of light; allowed kinds: {}",
                    excerpt(&self.lighting),
                    READ_ENVIRONMENT.extensions("*."),
                    one_of(&self.lighting, kinds.iter().map(|e| e.kind))
                );
                return Err(Error::config("--lighting", message));
            }
        };
        spec.build().map_err(|e| not_built("--lighting", e))
    }
}

#[derive(Debug, Args)]
pub(super) struct Sphere {
    #[command(flatten)]
    brdf: BrdfArgs,
    #[command(flatten)]
    scene: Scene,
    #[command(flatten)]
    folder: Folder,
}

impl Sphere {
    fn run(self) -> Result<(), Error> {
        self.scene.threads.apply()?;
        let light = self.scene.light()?;
        let (name, brdf) = material(&self.brdf)?;
        let stem = format!("{}_sphere", file_stem(&name));
        let [png, exr] = self.folder.free(&stem, ["png", "exr"])?;
        let start = std::time::Instant::now();
        let samples = self.scene.samples as usize;
        let draw = |brdf: &dyn Brdf, resolution| render_sphere(brdf, &*light, resolution, samples);
        let image = watched(&*brdf, self.scene.resolution.into(), draw);
        let seconds = start.elapsed().as_secs_f64();
        note(&format!("gonio: drawn in {seconds:.2} s"));
        make_folder(&self.folder.output)?;
        write_file(&png, |out| out.write_all(&image.png(image.white())))?;
        write_file(&exr, |out| image.write_exr(out))
    }
}

/// Draws with a progress bar. How many pairs a picture asks for is known by two small ones.
fn watched<T>(brdf: &dyn Brdf, resolution: usize, draw: impl Fn(&dyn Brdf, usize) -> T) -> T {
    let progress = Progress::with_work(0, "draws");
    if progress.is_hidden() {
        return draw(brdf, resolution);
    }
    let pairs = |resolution| {
        let progress = &Progress::hidden();
        draw(&progress.watches(brdf), resolution);
        progress.counted() as f64
    };
    let [small, less] = [8, 16].map(|part| resolution.div_ceil(part));
    let area = |resolution: usize| (resolution * resolution) as f64;
    let a_pixel = match small > less {
        true => (pairs(small) - pairs(less)) / (area(small) - area(less)),
        false => 0.0,
    };
    let all = pairs(small) + a_pixel * (area(resolution) - area(small));
    progress.begin(all as u64);
    draw(&progress.watches(brdf), resolution)
}

#[derive(Debug, Args)]
pub(super) struct Compare {
    #[command(flatten)]
    brdf: BrdfArgs,
    /// The coordinates that are sampled and interpolated in
    #[arg(long, value_name = "NAME", default_value = "half-difference")]
    parametrization: String,
    /// A warp of one of its axes, e.g. theta_h=square-root (see `gonio list warps`); may be given
    /// several times
    #[arg(long = "warp", value_name = "AXIS=WARP")]
    warps: Vec<String>,
    /// Distinct physical configurations
    #[arg(long, value_name = "N", default_value = "4000", value_parser = super::budget)]
    budget: usize,
    /// A kind of reconstruction (see `gonio list reconstructions`), with its defaults: of a grid if
    /// it needs one, else of Sobol points
    #[arg(long, value_name = "KIND", default_value = "cubic")]
    reconstruction: String,
    #[command(flatten)]
    scene: Scene,
    #[command(flatten)]
    folder: Folder,
}

impl Compare {
    /// The warps by the symbol of their axis.
    fn warps(&self) -> Result<Warps, Error> {
        let mut warps = Warps::new();
        for text in &self.warps {
            let refuse = |message: String| Err(Error::config("--warp", message));
            // As configs write it, or as results and `schedule --warp` do.
            let Some((axis, name)) = text.split_once(['=', ':']) else {
                let text = excerpt(text);
                return refuse(format!(
                    "{text:?} has no `=`; allowed: AXIS=WARP, e.g. theta_h=square-root"
                ));
            };
            let Some(warp) = WarpSpec::named(name.trim()) else {
                let all = parametrization::warps().into_iter();
                let allowed = one_of(name, all.map(|e| e.kind));
                let name = excerpt(name);
                return refuse(format!(
                    "{name:?} is no warp; allowed: {allowed}; of power its exponent too: power-0.4"
                ));
            };
            if warps.insert(axis.trim().into(), warp).is_some() {
                return refuse(format!("{axis} is there twice; allowed: once"));
            }
        }
        Ok(warps)
    }

    fn run(self) -> Result<(), Error> {
        self.scene.threads.apply()?;
        let chart = parametrization_of("--parametrization", &self.parametrization)?;
        let methods = reconstruct::all();
        let name = &self.reconstruction;
        let method = member("--reconstruction", "reconstruction", name, &methods)?;
        let method = registry::read_text(&method, "").map_err(Error::internal)?;
        let light = self.scene.light()?;
        let (name, truth) = material(&self.brdf)?;
        let warps = self.warps()?;
        let form = chart.warped(truth.symmetry(), &warps);
        let form = form.map_err(|e| Error::config("--warp", e))?;
        let names = warps.iter().map(|(axis, w)| format!("{axis}:{}", w.name()));
        let names = std::iter::once(chart.kind.to_owned()).chain(names);
        let (coordinates, budget) = (names.collect::<Vec<_>>(), self.budget);
        // A colon is no part of a file's name on every system.
        let plain = file_stem(&coordinates.join("_").replace(':', "-"));
        let choice = format!("{}_{plain}_{budget}", self.reconstruction);
        let stem = format!("{}_{choice}", file_stem(&name));
        let [svg, png, exr] = self.folder.free(&stem, ["svg", "png", "exr"])?;

        let (set, keys) = match method.needs_grid() {
            true => ("grid", "fill = true"),
            false => ("sobol", ""),
        };
        let set = schedule::all().into_iter().find(|e| e.kind == set);
        let set = set.ok_or_else(|| Error::Internal("a sample set is gone".into()))?;
        let set = registry::read_text(&set, keys).map_err(Error::internal)?;
        let refused = |e: &dyn Display| Error::config("--budget", e);
        let poses = set.plan(&form, budget, 1).map_err(|e| refused(&e))?;
        let measurement = Ideal.measure(&*truth, &Arc::new(poses));
        let copy = method.reconstruct(&measurement);
        let copy = copy.map_err(|e| refused(&e))?;
        let samples = self.scene.samples as usize;
        let draw = |copy: &dyn Brdf, resolution| {
            Comparison::new(&*truth, copy, &*light, resolution, samples)
        };
        let pictures = watched(&*copy, self.scene.resolution.into(), draw);
        let (method, coordinates) = (method.label(), coordinates.join(" "));
        let readings = count(measurement.readings(), "reading");
        let title = format!(
            "{name}: truth and reconstruction by {method} of {readings} in {coordinates} coordinates"
        );
        let bytes = pictures.png();
        let text = pictures.svg(&title, &bytes);
        make_folder(&self.folder.output)?;
        print(&format!("{title}\n{}\n", pictures.errors()))?;
        write_text(&svg, &text)?;
        write_file(&png, |out| out.write_all(&bytes))?;
        write_file(&exr, |out| pictures.write_exr(out))
    }
}
