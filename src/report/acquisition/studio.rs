//! Pictures of a study: its parametrizations, and for every material its slices and spheres of
//! truth, reconstruction and difference.

use super::html::{MaterialPictures, Picture};
use crate::brdf::{Brdf, ObservedBrdf, Part, Presence};
use crate::error::Error;
use crate::experiment::{
    Coordinates, Material, Plan, RESULTS_REVISION, Router, Row, Shard, Share, Stage, preview,
};
use crate::lighting::Lighting;
use crate::parametrization::{ParametrizationSpec, find};
use crate::reconstruct::PriorFile;
use crate::registry::Entry;
use crate::report::pictures::png::file_of;
use crate::report::pictures::{
    BrdfSlices, Comparison, ErrorMap, hemispheres_svg, test_functions_svg,
};
use crate::report::run::{Below, RunFolder, coordinates_stem, file_stem};
use crate::report::{BouncesReport, each_once};
use rayon::prelude::*;
use std::io::Write;

/// Azimuths of slices, degrees, as in the figures of Barla et al. (2015).
const PHI_DEG: [f64; 4] = [0.0, 30.0, 60.0, 90.0];

/// Elevations of views, degrees.
const THETA_O_DEG: [f64; 3] = [10.0, 40.0, 70.0];

/// Pixels along a side of a slice.
const RESOLUTION: usize = 128;

/// Pixels along a side of an error map: four planes have a fiftieth of the points of a sphere.
const CELLS: usize = 96;

/// Raised when pictures look different: a folder that is gone on with holds no two looks.
const LOOK: u32 = 4;

/// Light paths that are followed of a material that separates scattering orders.
const PATHS: usize = 1 << 17;

/// Share of the light of a box of one class.
const PURITY: f64 = 0.9;

const HEMISPHERES: &str = "hemispheres.svg";
const FUNCTIONS: &str = "functions.svg";

/// A picture of a report: its file in the folder of pictures, and its caption.
type Shown = [String; 2];

fn general() -> Vec<Shown> {
    let hemispheres = "The first two axes of each parametrization on the hemisphere of light directions, for three views; \
                       the last pictures are turned to the back direction.";
    let functions = "The test functions S = 1 − |h̄| (red), G = 1 − cos θᵢ cos θₒ (blue) and F = 1 − cos θ_d (white), on \
                     the hemisphere and in slices of each parametrization.";
    vec![
        [HEMISPHERES, hemispheres].map(String::from),
        [FUNCTIONS, functions].map(String::from),
    ]
}

/// Draws the pictures of a study that are missing in its folder.
pub struct Studio<'a> {
    plan: &'a Plan,
    /// The part of the run that draws.
    share: Share,
    lighting: Box<dyn Lighting>,
    parametrizations: Vec<Entry<ParametrizationSpec>>,
    /// Everything but the material that determines a picture.
    how: String,
    /// The schedules of what is drawn, once something is.
    router: Option<Router>,
}

impl<'a> Studio<'a> {
    /// A studio under the light of the plan; [`Error::Config`] if that cannot be built.
    pub(crate) fn new(plan: &'a Plan, shard: Option<Shard>) -> Result<Self, Error> {
        let lighting = plan.pictures.lighting.build();
        let lighting = lighting.map_err(|e| Error::config("pictures.lighting", e))?;
        let names = each_once(plan.parametrizations.iter().map(|c| c.name()));
        Ok(Self {
            plan,
            share: plan.share(shard),
            lighting,
            how: how(plan),
            router: None,
            parametrizations: names.into_iter().filter_map(find).collect(),
        })
    }

    /// Positions of the coordinates whose reconstructions are drawn: of each parametrization the
    /// first that is warped, or the plain one.
    fn drawn(&self) -> Vec<usize> {
        let all = &self.plan.parametrizations;
        let of = |entry: &Entry<ParametrizationSpec>| {
            let mine = (0..all.len()).filter(|&i| all[i].name() == entry.kind);
            mine.min_by_key(|&i| all[i].spec.warps.is_empty())
        };
        self.parametrizations.iter().filter_map(of).collect()
    }

    pub(crate) fn general(&self, folder: &mut RunFolder<Row>) -> Result<(), Error> {
        if !self.share.draws(0) {
            return Ok(());
        }
        let all = &self.parametrizations;
        for (name, svg) in [
            (HEMISPHERES, hemispheres_svg(all, &THETA_O_DEG)),
            (FUNCTIONS, test_functions_svg(all, &THETA_O_DEG, &PHI_DEG)),
        ] {
            folder.write_below(Below::Pictures, name, |out| out.write_all(svg.as_bytes()))?;
        }
        Ok(())
    }

    /// The pictures of a report that are there: of the study, and of its materials. `keys` are those
    /// of the materials; one without a key has none.
    pub(crate) fn gathered(
        &self,
        folder: &RunFolder<Row>,
        keys: &[Option<String>],
    ) -> (Vec<Picture>, Vec<MaterialPictures>) {
        let read = |shown: Vec<Shown>| -> Vec<Picture> {
            let found = shown.into_iter().filter_map(|[file, caption]| {
                let svg = String::from_utf8(folder.below(Below::Pictures, &file)?).ok()?;
                Some(Picture { caption, svg })
            });
            found.collect()
        };
        let materials = self.plan.materials.iter().zip(keys);
        let materials = materials.filter_map(|(material, key)| {
            let key = key.as_ref()?;
            let stem = self.stem(material, key);
            let mut pictures = read(self.of_material(material, key));
            // Of a material that separates scattering orders.
            if let Some(caption) = folder.below(Below::Pictures, &format!("{stem}.paths.txt")) {
                let caption = String::from_utf8_lossy(&caption).trim().to_owned();
                pictures.extend(read(vec![[format!("{stem}.paths.svg"), caption]]));
            }
            Some(MaterialPictures {
                material: material.name.clone(),
                pictures,
            })
        });
        (read(general()), materials.collect())
    }

    /// The pictures of a material in a report; `key` is the hash of the material's keys and files.
    fn of_material(&self, material: &Material, key: &str) -> Vec<Shown> {
        let stem = self.stem(material, key);
        let slices =
            "Slices at four azimuths: luminance in equal steps of its logarithm, with isolines.";
        let mut shown = vec![[format!("{stem}.slices.svg"), slices.into()]];
        for i in self.drawn() {
            let coordinates = &self.plan.parametrizations[i];
            let caption = format!(
                "Truth, reconstruction from at most {} poses uniform in {}{}, and their difference, which has the same \
                 scale in all pictures.",
                self.plan.pictures.budget,
                coordinates.label(),
                self.by()
            );
            let file = format!("{stem}.{}.svg", coordinates_stem(coordinates));
            shown.push([file, caption]);
        }
        let errors = "Relative error of the reconstruction whose sphere errs least, at four azimuths of its coordinates; \
                      the same scale in all maps.";
        shown.push([format!("{stem}.errors.svg"), errors.into()]);
        shown
    }

    /// The instrument, as captions name it.
    fn by(&self) -> String {
        let first = self.plan.instruments.first();
        first.map_or(String::new(), |i| format!(" read by {}", i.name))
    }

    /// True if a picture of the material at a position is missing, and another part of the run does
    /// not draw it.
    pub(crate) fn requests(
        &self,
        folder: &RunFolder<Row>,
        position: usize,
        material: &Material,
        key: &str,
    ) -> bool {
        if !self.share.draws(position) {
            return false;
        }
        let mut shown = self.of_material(material, key).into_iter();
        shown.any(|[file, _]| !folder.has(Below::Pictures, &file))
    }

    /// The beginning of the names of a material's pictures: different for different pictures.
    fn stem(&self, material: &Material, key: &str) -> String {
        let hash = blake3::hash(format!("{key} {}", self.how).as_bytes());
        format!("{}.{}", file_stem(&material.name), &hash.to_hex()[..16])
    }

    /// Draws a material, until `cancelled`.
    pub(crate) fn material(
        &mut self,
        folder: &mut RunFolder<Row>,
        material: &Material,
        brdf: &dyn Brdf,
        key: &str,
        cancelled: &(dyn Fn() -> bool + Sync),
    ) -> Result<(), Error> {
        let brdf = &ObservedBrdf::new(brdf, |_: &[f64], _: &[Presence]| ()).until(cancelled);
        let stem = self.stem(material, key);
        let name = format!("{stem}.slices");
        if !folder.has(Below::Pictures, &format!("{name}.svg")) {
            // Before the slices, which are looked for.
            if let Some(split) = brdf.as_split() {
                let class = (Part::Second, PURITY);
                let of = &self.parametrizations;
                let report = BouncesReport::new(&material.name, split, PATHS, of, class, |_| ());
                if let Ok(report) = report {
                    let caption = report.caption() + "\n";
                    folder.write_picture(&format!("{stem}.paths.svg"), || report.svg())?;
                    folder.write_picture(&format!("{stem}.paths.txt"), || caption)?;
                }
            }
            let slices = BrdfSlices::new(brdf, &self.parametrizations, &PHI_DEG, RESOLUTION);
            if cancelled() {
                return Ok(());
            }
            let exr = || file_of(|out| slices.write_exr(out));
            folder.write_picture(&format!("{name}.exr"), exr)?;
            folder.write_picture(&format!("{name}.svg"), || slices.svg(&material.name))?;
        }
        let drawn = self.drawn();
        let names = drawn.iter().map(|&i| {
            let coordinates = coordinates_stem(&self.plan.parametrizations[i]);
            format!("{stem}.{coordinates}")
        });
        let names: Vec<_> = names.collect();
        let is_there = |name: &String| folder.has(Below::Pictures, &format!("{name}.svg"));
        let errors = format!("{stem}.errors");
        if names.iter().chain([&errors]).all(is_there) {
            return Ok(());
        }
        let counters = folder.counters.within(Stage::Pictures);
        let mut shown = Vec::new();
        for (i, name) in drawn.into_iter().zip(names) {
            if cancelled() {
                return Ok(());
            }
            let router = &mut self.router;
            let router = router.get_or_insert_with(|| Router::counting(&counters));
            // Too few readings for a schedule of this symmetry: there is nothing to show.
            if let Some(preview) = preview(self.plan, material, brdf, i, router)? {
                shown.push((name, &self.plan.parametrizations[i], preview));
            }
        }
        let mut missing = shown.iter().map(|(name, ..)| name).chain([&errors]);
        if cancelled() || shown.is_empty() || missing.all(is_there) {
            return Ok(());
        }
        // All by the same points, also where some are in the folder: a run that was stopped draws the same.
        let copies = shown.iter().map(|(_, _, preview)| {
            let copy: &dyn Brdf = &*preview.brdf;
            counters.reconstruction(copy, Stage::Pictures)
        });
        let copies: Vec<_> = copies.collect();
        let copies: Vec<&dyn Brdf> = copies.iter().map(|copy| copy as _).collect();
        let spec = &self.plan.pictures;
        let (side, samples) = (spec.resolution, spec.samples);
        let all = Comparison::all(brdf, &copies, &*self.lighting, side, samples);
        if cancelled() {
            return Ok(());
        }
        let title = |what: &str, coordinates: &Coordinates, method: &str| {
            format!(
                "{}: {what} by {method} of at most {} poses{} in {} coordinates",
                material.name,
                spec.budget,
                self.by(),
                coordinates.label()
            )
        };
        let error = |i: &usize| all[*i].nrmse.unwrap_or(f64::INFINITY);
        let best = (0..all.len()).min_by(|a, b| error(a).total_cmp(&error(b)));
        let map = best.filter(|_| !is_there(&errors)).map(|i| {
            let (_, coordinates, preview) = &shown[i];
            let chart: Vec<_> = find(coordinates.name()).into_iter().collect();
            let map = ErrorMap::new(brdf, copies[i], &chart, CELLS);
            let what = "relative error (%) of the reconstruction";
            let title = title(what, coordinates, &preview.method);
            (format!("{errors}.svg"), map.svg(&title).into_bytes())
        });
        if cancelled() {
            return Ok(());
        }
        let each = shown.par_iter().zip(all);
        let files = each.map(|((name, coordinates, preview), made)| {
            let title = title("truth and reconstruction", coordinates, &preview.method);
            let exr = file_of(|out| made.write_exr(out));
            let png = made.png();
            let svg = made.svg(&title, &png).into_bytes();
            // What is looked for is the last.
            let files = [("exr", exr), ("png", png), ("svg", svg)];
            files.map(|(end, bytes)| (format!("{name}.{end}"), bytes))
        });
        let files: Vec<_> = files.collect();
        for (name, bytes) in files.into_iter().flatten().chain(map) {
            folder.write_picture(&name, || bytes)?;
        }
        Ok(())
    }
}

/// Text of the parts of a plan that determine its pictures.
fn how(plan: &Plan) -> String {
    let mut text = format!("{RESULTS_REVISION} {LOOK}");
    text += &plan.pictures.resolved().to_string();
    text += &format!("{:?}", plan.seeds.first());
    text += &format!("{:?}", plan.channels);
    for set in &plan.sample_sets {
        text += &set.set.resolved().to_string();
        text += &format!(
            "{:?} {:?}",
            set.tuning,
            set.set.prior().map(PriorFile::content)
        );
    }
    if let Some(instrument) = plan.instruments.first() {
        text += &instrument.resolved().to_string();
    }
    for method in &plan.methods {
        text += &method.method.resolved().to_string();
        text += &format!("{:?}", method.method.prior().map(PriorFile::content));
    }
    let labels = plan.parametrizations.iter().map(|c| c.label());
    text + &labels.collect::<Vec<_>>().join(",")
}
