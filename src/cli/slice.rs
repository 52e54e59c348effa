//! `gonio slice`.

use super::brdf_args::BrdfArgs;
use super::talk::wrote;
use super::{ThreadArgs, print, refuse_existing};
use crate::error::{Error, ParameterError};
use crate::files::write_atomically;
use crate::moments::{Channel, Slice as BrdfSlice};
use crate::report::{FlatSlice, Radius, slice_svg};
use clap::{Args, ValueEnum};
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum RadiusArg {
    /// ρ / max
    Linear,
    /// (ρ / max)^(1/3)
    CubeRoot,
}

#[derive(Debug, Args)]
pub(super) struct Slice {
    #[command(flatten)]
    brdf: BrdfArgs,
    #[command(flatten)]
    threads: ThreadArgs,
    /// View elevation in degrees, in [0, 90); may be given several times
    #[arg(long = "view-deg", value_name = "DEG", required = true)]
    views: Vec<f64>,
    /// Which number of the BRDF: luminance, average, red, green or blue
    #[arg(long, value_name = "CHANNEL", default_value = "luminance", value_parser = channel)]
    channel: Channel,
    /// Cells of the flat picture along each angle
    #[arg(long, value_name = "N", default_value = "180",
        value_parser = clap::value_parser!(u16).range(1..=FlatSlice::MAX_RESOLUTION as i64))]
    resolution: u16,
    /// How long the lobe is in a direction
    #[arg(long, value_enum, default_value = "cube-root")]
    radius: RadiusArg,
    /// The folder to write into, a view: NAME_DEG.svg with map and lobe, NAME_DEG.png with the map
    /// alone and NAME_DEG.csv
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Replace files that exist
    #[arg(long)]
    force: bool,
}

fn channel(text: &str) -> Result<Channel, ParameterError> {
    let found = Channel::ALL.into_iter().find(|c| c.name() == text);
    found.ok_or_else(|| ParameterError::new("channel", text, Channel::names()))
}

impl Slice {
    pub(super) fn run(self) -> Result<(), Error> {
        self.threads.apply()?;
        if let Some(view) = self.views.iter().find(|v| !(0.0..90.0).contains(*v)) {
            let message = format!("{view} is no view elevation; allowed: a number in [0, 90)");
            return Err(Error::config("--view-deg", message));
        }
        let mut views = Vec::new();
        for view in &self.views {
            if !views.contains(view) {
                views.push(*view);
            }
        }
        let source = self.brdf.source()?;
        let plan = self.brdf.plan(&source)?;
        let [material] = plan.materials.as_slice() else {
            let names: Vec<_> = plan.materials.iter().map(|m| m.name.as_str()).collect();
            let allowed = names.join(", ");
            let message = format!("this config has several materials; allowed: one of {allowed}");
            return Err(Error::config("--material", message));
        };
        let stem = crate::report::file_stem(&material.name);
        let path = |view: f64, ending: &str| self.output.join(format!("{stem}_{view}.{ending}"));
        for view in &views {
            for ending in ["png", "csv", "svg"] {
                refuse_existing(&path(*view, ending), self.force)?;
            }
        }
        let brdf = super::build(material, plan.seen_in(self.channel.needs()))?;
        let slices = views.iter().map(|view| {
            BrdfSlice::new(&*brdf, self.channel, view.to_radians())
                .map_err(|e| Error::config("--channel", e))
        });
        let slices: Vec<_> = slices.collect::<Result<_, _>>()?;
        let resolution = usize::from(self.resolution);
        let flat: Vec<_> = slices
            .iter()
            .map(|s| FlatSlice::new(s, resolution))
            .collect();
        let range = FlatSlice::range(&flat);
        fs::create_dir_all(&self.output)
            .map_err(|e| Error::output(&self.output, format!("cannot make this folder: {e}")))?;
        let radius = match self.radius {
            RadiusArg::Linear => Radius::Linear,
            RadiusArg::CubeRoot => Radius::CubeRoot,
        };
        for ((view, slice), flat) in views.iter().zip(&slices).zip(&flat) {
            let (name, channel) = (&material.name, self.channel.name());
            let title = format!("{name}: {channel} of the slice at θ_o = {view}°");
            let figure = slice_svg(&title, slice, flat, range, radius)?;
            let [png, csv, svg] = ["png", "csv", "svg"].map(|ending| path(*view, ending));
            write(&png, |out| flat.write_png(range, out))?;
            write(&csv, |out| flat.write_csv(out))?;
            write(&svg, |out| out.write_all(figure.as_bytes()))?;
        }
        print(&format!(
            "pictures show {:.3e} (dark violet) to {:.3e} 1/sr (yellow) in equal steps of the logarithm, \
             theta -90° to 90° to the right, phi up; hatched: no data\n",
            range[0], range[1]
        ))
    }
}

fn write(
    path: &Path,
    body: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> Result<(), Error> {
    write_atomically(path, body)
        .map_err(|e| Error::output(path, format!("cannot write this file: {e}")))?;
    wrote(path);
    Ok(())
}
