//! `gonio slice`.

use super::picture::check_views;
use super::{
    BrdfArgs, ThreadArgs, choice_of, choose_material, each_once, make_folder, print,
    refuse_existing, write_file, write_text,
};
use crate::error::{Error, ParameterError};
use crate::moments::{Channel, Slice as BrdfSlice};
use crate::report::{FlatSlice, Radius, slice_svg};
use crate::schedule::Choice;
use clap::Args;
use std::io::Write;
use std::path::PathBuf;

/// How long a lobe is drawn.
const RADII: [Choice<Radius>; 2] = choices! {
    "linear", "ρ / max" => Radius::Linear;
    "cube-root", "(ρ / max)^(1/3)" => Radius::CubeRoot;
};

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
    #[arg(long, value_parser = choice_of(&RADII), default_value = "cube-root")]
    radius: Radius,
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
        check_views(&self.views)?;
        let views = each_once(self.views.iter().copied());
        let plan = self.brdf.plan()?;
        let material = choose_material(&plan.materials, None)?;
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
        let flat = |slice| FlatSlice::new(slice, self.resolution.into());
        let flat: Vec<_> = slices.iter().map(flat).collect();
        let range = FlatSlice::range(&flat);
        make_folder(&self.output)?;
        for ((view, slice), flat) in views.iter().zip(&slices).zip(&flat) {
            let (name, channel) = (&material.name, self.channel.name());
            let title = format!("{name}: slice of the BRDF at θ_o = {view}°, {channel} (sr⁻¹)");
            let figure = slice_svg(&title, slice, flat, range, self.radius);
            let [png, csv, svg] = ["png", "csv", "svg"].map(|ending| path(*view, ending));
            write_file(&png, |out| out.write_all(&flat.png(range)))?;
            write_file(&csv, |out| flat.write_csv(out))?;
            write_text(&svg, &figure)?;
        }
        print(&format!(
            "pictures show {:.3e} (dark violet) to {:.3e} 1/sr (yellow) in equal steps of the logarithm, \
             theta -90° to 90° to the right, phi up; hatched: no data\n",
            range[0], range[1]
        ))
    }
}
