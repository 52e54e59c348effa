//! `gonio surface`.

use super::{JsonArgs, ThreadArgs, detail, in_range, member, say, set_all, whole};
use crate::brdf::{BuildError, Channels};
use crate::error::{Error, count, left_open};
use crate::experiment::Source;
use crate::geometry::Direction;
use crate::light_paths::surface::{self, HeightField, Optics, Statistics, SurfaceSpec};
use crate::light_paths::{Energies, FacetsSpec, Transport, TransportSpec, read_facets};
use crate::registry;
use crate::report::Columns;
use clap::Args;
use serde::Serialize;
use std::sync::Arc;
use std::time::Instant;

#[derive(Debug, Args)]
#[command(after_help = "\
Light is followed from facet to facet; shares are of the light that comes from a direction and leaves after one, two, or three and
more of them. Their errors are those of the rays: another seed of the surface differs by more.

  gonio surface gaussian --set rms_slope=0.5
  gonio surface v-grooves --set angle_deg=45 --set facets.kind=diffuse --elevation 0,30
  gonio surface height-map --set file=map.exr --set pitch_um=0.5")]
pub(super) struct SurfaceArgs {
    /// A kind of surface (see `gonio list surfaces`)
    kind: String,
    /// Set a key of the surface (rms_slope=0.5) or of its facets (facets.kind=diffuse)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Elevations of the light, degrees
    #[arg(long, value_name = "DEG,…", value_delimiter = ',', default_value = "0,30,60,80", value_parser = in_range("elevation", 0.0..=89.9))]
    elevation: Vec<f64>,
    /// Azimuth of the light, degrees from the x axis
    #[arg(long, value_name = "DEG", default_value_t = 0.0, value_parser = in_range("azimuth", -360.0..=360.0))]
    azimuth: f64,
    /// Rays from each elevation
    #[arg(long, value_name = "N", default_value_t = 1_000_000, value_parser = whole::<2, 1_000_000_000_000>)]
    rays: u64,
    /// Seed of the rays
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole::<0, { u64::MAX }>)]
    seed: u64,
    /// Width of a cell, µm, of a surface without a key pitch_um [default: 1]
    #[arg(long, value_name = "UM", value_parser = in_range("length", left_open(0.0, 1e9)))]
    pitch_um: Option<f64>,
    /// Wavelength that the surface is compared with, µm
    #[arg(long, value_name = "UM", default_value_t = 0.55, value_parser = in_range("length", left_open(0.0, 1e9)))]
    wavelength_um: f64,
    #[command(flatten)]
    json: JsonArgs,
    #[command(flatten)]
    threads: ThreadArgs,
}

/// Lengths from here on are printed with an exponent, cells.
const LONG: f64 = 1e6;

/// What is printed.
#[derive(Serialize)]
struct Report {
    surface: Statistics,
    optics: Optics,
    light: Vec<Line>,
}

/// Light of one direction.
#[derive(Serialize)]
struct Line {
    elevation_deg: f64,
    #[serde(flatten)]
    energies: Energies,
    seconds: f64,
}

impl SurfaceArgs {
    pub(super) fn run(self) -> Result<(), Error> {
        self.threads.apply()?;
        let (spec, field, facets) = self.surface()?;
        let pitch_um = self.pitch_um(&*spec)?;
        for remark in spec.remarks(&field) {
            say(&format!("gonio: {remark}"));
        }
        let statistics = Statistics::new(&field);
        let optics = statistics.optics(pitch_um, self.wavelength_um);
        let transport = Transport::new(Arc::new(field), &facets, &Channels::Luminance)
            .map_err(|e| Error::config("--set", e))?;
        let spec = TransportSpec {
            rays: self.rays,
            seed: self.seed,
        };
        let light = self.elevation.iter().map(|&elevation_deg| {
            let [elevation, azimuth] = [elevation_deg, self.azimuth].map(f64::to_radians);
            let start = Instant::now();
            let energies = transport.energies(Direction::from_spherical(elevation, azimuth), &spec);
            Line {
                elevation_deg,
                energies,
                seconds: start.elapsed().as_secs_f64(),
            }
        });
        let report = Report {
            light: light.collect(),
            surface: statistics,
            optics,
        };
        self.json.print(&report, Report::text)
    }

    /// Width of a cell, µm.
    fn pitch_um(&self, spec: &dyn SurfaceSpec) -> Result<f64, Error> {
        match (self.pitch_um, spec.pitch_um()) {
            (Some(asked), Some(own)) if asked != own => {
                let message = format!("{asked}: allowed is {own}, the pitch_um of the surface");
                Err(Error::config("--pitch-um", message))
            }
            (asked, own) => Ok(own.or(asked).unwrap_or(1.0)),
        }
    }

    /// The surface, its heights, and what the facets do.
    fn surface(&self) -> Result<(Box<dyn SurfaceSpec>, HeightField, FacetsSpec), Error> {
        let entry = member("KIND", "surface", &self.kind, &surface::all())?;
        let mut source = Source::new(self.kind.as_str(), "");
        set_all(&mut source, &self.set)?;
        let unreadable = |e| source.error(e);
        let mut table = source.table()?;
        let facets = registry::take_table(&mut table, "facets").map_err(unreadable)?;
        let facets = facets.map(read_facets).transpose().map_err(unreadable)?;
        let facets = facets.unwrap_or_default();
        let spec = (entry.read)(table).map_err(unreadable)?;
        let unbuilt = |e| match e {
            BuildError::Parameter(e) => source.place(&e.key).error(e),
            BuildError::Data { path, message } => Error::data(path, message),
        };
        facets.check(&Channels::Luminance).map_err(unbuilt)?;
        for file in spec.files() {
            detail(|| format!("gonio: surface {}, reads {}", self.kind, file.display()));
        }
        let field = spec.build(0).map_err(unbuilt)?;
        Ok((spec, field, facets))
    }
}

impl Report {
    fn text(&self) -> String {
        let Statistics {
            size: [nx, ny],
            rms_height,
            range,
            rms_slope: [sx, sy],
            area,
            correlation,
            curvature_radius,
            beckmann,
            ggx,
        } = &self.surface;
        let length = |v: Option<f64>| match v {
            None => "none".into(),
            Some(v) if v < LONG => format!("{v:.1}"),
            Some(v) => format!("{v:.1e}"),
        };
        let each = |values: &[Option<f64>; 2]| values.map(length).join(" and ");
        let mut text = format!(
            "{nx} × {ny} cells; heights: rms {rms_height:.3}, range {range:.2} cells\n\
             slopes: rms {sx:.4} along x, {sy:.4} along y; {area:.4} of area on each of plane\n\
             along x and y, cells: correlation length {}, rms radius of curvature {}\n",
            each(correlation),
            each(curvature_radius)
        );
        if let (Some(beckmann), Some(ggx)) = (beckmann, ggx) {
            let alpha = std::f64::consts::SQRT_2 * (sx * sy).sqrt();
            text += &format!(
                "cumulative slopes are off by {beckmann:.3} from Beckmann's, {ggx:.3} from GGX of alpha {alpha:.3}\n"
            );
        }
        text += &format!("{}\n\n", self.optics);
        let mut table = Columns::new(
            ">light\t>1 facet\t>2\t>3 and more\t>absorbed\t>masked\t>shadowed\t>± of all\t>M segments/s",
        );
        for line in &self.light {
            let e = &line.energies;
            let mut row = format!("{}°", line.elevation_deg);
            for (share, error) in e.bounces.iter().zip(&e.errors) {
                row += &format!("\t{share:.4} ± {error:.4}");
            }
            for share in [e.absorbed, e.masked, e.shadowed, e.error_of_sum] {
                row += &format!("\t{share:.4}");
            }
            let speed = e.segments as f64 / line.seconds / 1e6;
            table.row(&format!("{row}\t{speed:.2}"));
        }
        text += &table.to_string();
        let lost: u64 = self.light.iter().map(|l| l.energies.lost).sum();
        if lost > 0 {
            let rays = count(lost as usize, "ray");
            text += &format!("{rays} lost along a groove or between facets\n");
        }
        text
    }
}
