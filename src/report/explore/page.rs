//! A page: what it shows, and its text.

use super::carried::{Carried, MOST_VISITS};
use super::facts::{charts, distortion_of, errors, hex, moments, sky};
use super::packed::Parts;
use super::readings;
use super::script::{HASHES, STYLE, script};
use super::table::Grid;
use crate::brdf::Brdf;
use crate::error::Error;
use crate::experiment::{Plan, quoted};
use crate::instrument::{Ideal, Instrument};
use crate::measurement::Measurement;
use crate::metrics::Measure;
use crate::parametrization::{self, WarpSpec, Warps};
use crate::reconstruct::{self, Cubic, Reconstruct, ReconstructError, Replicated};
use crate::report::{pictures, svg::plot::ramp};
use crate::schedule::{self, SampleSet};
use crate::validation::Reconstruction;
use maud::{DOCTYPE, PreEscaped, html};
use rayon::join;
use rayon::prelude::*;
use serde_json::{Map, Value as Json, json};
use std::sync::Arc;

/// Poses of the grid that a BRDF of readings is evaluated at once for everything but its errors.
const DENSE: usize = 40_000;

/// A material of a page.
#[derive(Clone)]
pub struct ShownMaterial {
    /// Its name.
    pub name: String,
    /// What commands call it.
    pub argument: String,
    /// Its values.
    pub brdf: Arc<dyn Brdf>,
    /// True where a value takes long: all but errors is of values between those of a dense grid.
    pub is_slow: bool,
}

impl ShownMaterial {
    /// A material; values that are estimated take long.
    pub fn new(name: &str, argument: &str, brdf: Arc<dyn Brdf>) -> Self {
        Self {
            name: name.into(),
            argument: argument.into(),
            is_slow: brdf.as_estimated().is_some(),
            brdf,
        }
    }
}

/// Readings of a page.
#[derive(Clone)]
pub struct ShownReadings {
    /// Name of the file, or of the material that was read.
    pub name: String,
    /// What commands call a material of these readings; empty: they have no such.
    pub argument: String,
    /// The readings.
    pub measurement: Arc<Measurement>,
}

/// What a page shows.
#[derive(Default)]
pub struct Exploration {
    /// The command that makes the page.
    pub command: String,
    /// A, and B; none: they are dropped onto the page.
    pub materials: Vec<ShownMaterial>,
    /// Readings; where there are less than two materials the next is reconstructed from them.
    pub readings: Option<ShownReadings>,
    /// Poses that are carried out; without readings they are read of A.
    pub carried: Option<Carried>,
    /// What is to be said on top of the page.
    pub notes: Vec<String>,
}

impl Exploration {
    /// The page.
    ///
    /// # Errors
    /// If readings cannot be reconstructed from, or an instrument cannot read A.
    pub fn html(mut self) -> Result<String, Error> {
        let failed = |e| Error::config("readings", e);
        let is_simulated = self.readings.is_none();
        let (mut tour, mut notes) = (Vec::new(), std::mem::take(&mut self.notes));
        if let (true, Some(carried), [a, ..]) = (is_simulated, &self.carried, &self.materials[..]) {
            let measurement = carried.read(&*a.brdf)?;
            tour = carried.errors(&*a.brdf, &measurement);
            notes.push(format!("The readings are simulated, of {}.", a.name));
            self.readings = Some(ShownReadings {
                name: a.name.clone(),
                argument: String::new(),
                measurement: measurement.into(),
            });
        }
        let made = self.made().map_err(failed)?;
        let replicated = made.as_ref().map(Reconstruction::replicated);
        let replicated = replicated.transpose().map_err(failed)?.flatten();
        if let (Some(made), Some(read)) = (&made, &self.readings) {
            let (method, name) = (made.method.label(), &read.name);
            let suspects = read.measurement.readings() - made.measurement.readings();
            if suspects > 0 {
                let without = format!("without {suspects} readings that the others contradict");
                notes.push(format!("{name} is made {without}."));
            }
            self.materials.push(ShownMaterial {
                name: format!("{name} by {method}"),
                argument: match read.argument.as_str() {
                    "" => String::new(),
                    path => format!("{path} --set reconstruction.kind={method}"),
                },
                brdf: made.brdf.clone(),
                is_slow: true,
            });
        }
        let visits = self.carried.as_ref().map_or(0, Carried::visits);
        if visits > MOST_VISITS {
            let first = format!("The first {MOST_VISITS} of {visits} visits");
            notes.push(format!("{first} are here."));
        }
        // A value of a reconstruction takes a thousand times as long as one of a grid of its values.
        let quick = |m: &ShownMaterial| {
            let dense = if m.is_slow { dense(&*m.brdf) } else { None };
            dense.unwrap_or_else(|| m.brdf.clone())
        };
        let quick: Vec<Arc<dyn Brdf>> = self.materials.iter().map(quick).collect();
        for (m, quick) in self.materials.iter().zip(&quick) {
            if Arc::ptr_eq(&m.brdf, quick) {
                continue;
            }
            let error = errors(&[&*m.brdf, &**quick], &[Measure::Cosine]);
            if let Some(nrmse) = error.first().and_then(|e| e["nrmse"].as_f64()) {
                let of = format!("{} is shown between {DENSE} of its values", m.name);
                notes.push(format!("{of}, which err by a cosine nrmse of {nrmse:.4}."));
            }
        }
        let parts = Parts::default();
        let places = self.carried.as_ref().filter(|_| is_simulated);
        let places = places.and_then(Carried::places);
        let data = self.data(&quick, replicated, &tour, places.as_deref(), &parts);
        let data = Json::Object(data.map_err(failed)?);
        // No text of the data ends its element.
        let data = data.to_string().replace('<', "\\u003c");
        let policy = format!(
            "default-src 'none'; script-src 'sha256-{}'; style-src 'sha256-{}'; img-src data: blob:",
            HASHES[0], HASHES[1]
        );
        let names: Vec<&str> = self.materials.iter().map(|m| &*m.name).collect();
        let title = Some(names.join(" and ")).filter(|title| !title.is_empty());
        let title = title.unwrap_or_else(|| "gonio explore".into());
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta http-equiv="Content-Security-Policy" content=(policy);
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    title { (title) }
                    style { (PreEscaped(STYLE)) }
                }
                body {
                    header {
                        h1 { (title) }
                        @for note in &notes { p { (note) } }
                        p id="said" role="status" {}
                        div id="controls" {}
                        noscript { p { "This page is drawn by its script, which this browser does not run." } }
                    }
                    main id="views" {}
                    footer {
                        p { "Made by gonio " (env!("CARGO_PKG_VERSION")) ": " code { (self.command) } }
                        p { "Drop MERL tables (.binary) or readings of gonio (.csv) onto the page: they are read here and go nowhere." }
                    }
                    script type="application/json" id="data" { (PreEscaped(data)) }
                    @for (id, text) in parts.into_all() {
                        script type="text/plain" id=(id) { (PreEscaped(text)) }
                    }
                    script { (PreEscaped(script())) }
                }
            }
        };
        Ok(page.into_string())
    }

    /// The reconstruction from readings, if there are some and there is room for it: without those that the others contradict, by the
    /// method for as many.
    fn made(&self) -> Result<Option<Reconstruction>, ReconstructError> {
        let read = self.readings.as_ref().map(|read| &*read.measurement);
        let has_room = self.materials.len() < 2;
        let Some(read) = read.filter(|read| has_room && read.readings() > 2) else {
            return Ok(None);
        };
        let suspects = reconstruct::suspects(read);
        let measurement = read.clone().without(suspects.iter().map(|s| s.pose));
        let method = reconstruct::default_for(&measurement);
        Reconstruction::new(Arc::new(measurement), Some(method)).map(Some)
    }

    /// What the script reads. `quick` has values of the materials, `tour` errors along it, `places` the place of each pose on it.
    fn data(
        &self,
        quick: &[Arc<dyn Brdf>],
        replicated: Option<&Replicated>,
        tour: &[Json],
        places: Option<&[u32]>,
        parts: &Parts,
    ) -> Result<Map<String, Json>, ReconstructError> {
        let shown = || self.materials.par_iter().zip(quick);
        let quick: Vec<&dyn Brdf> = quick.iter().map(|brdf| &**brdf).collect();
        let own: Vec<&dyn Brdf> = self.materials.iter().map(|m| &*m.brdf).collect();
        let table = |(i, (m, quick)): (usize, (&ShownMaterial, &Arc<dyn Brdf>))| {
            Grid::of(&**quick, m.is_slow).facts(i, &m.name, &m.argument, parts)
        };
        let distortion =
            |(m, quick): (&ShownMaterial, &Arc<dyn Brdf>)| distortion_of(&m.name, &**quick);
        let moments = || quick.par_iter().map(|brdf| moments(*brdf));
        let uncertainty = || {
            let (u, of) = replicated.zip(self.materials.last())?;
            readings::uncertainties(u, of.brdf.symmetry(), parts)
        };
        let machine = || self.carried.as_ref()?.facts(tour, parts);
        let signed = |t| pictures::signed(2.0 * t - 1.0);
        let all: [(&str, &(dyn Fn() -> Json + Sync)); 10] = [
            ("materials", &|| {
                json!(shown().enumerate().map(table).collect::<Vec<_>>())
            }),
            ("distortion", &|| {
                json!(shown().flat_map(distortion).collect::<Vec<_>>())
            }),
            ("errors", &|| json!(errors(&own, &Measure::USUAL))),
            ("sky", &|| json!(sky(&quick, parts).unwrap_or_default())),
            ("moments", &|| json!(moments().collect::<Vec<_>>())),
            ("uncertainty", &|| json!(uncertainty())),
            ("machine", &|| json!(machine())),
            ("charts", &|| json!(charts())),
            (
                "colours",
                &|| json!({"sequential": hex(ramp), "signed": hex(signed)}),
            ),
            ("signed", &|| json!({"least": pictures::LEAST, "most": 1.0})),
        ];
        let all = || all.par_iter().map(|(name, of)| (name.to_string(), of()));
        let readings = || {
            let read = self.readings.as_ref();
            read.map(|read| readings::facts(&read.name, &read.measurement, places, parts))
        };
        let (readings, all) = join(readings, || all().collect::<Vec<_>>());
        let mut all: Map<String, Json> = all.into_iter().collect();
        all.insert("readings".into(), json!(readings.transpose()?));
        Ok(all)
    }
}

/// The page of a plan: its first material that can be built, the readings of it by the largest schedule, and the tour of the instrument.
/// Errors: as [`Carried::of_plan`]; of no material that can be built the last one's.
pub(crate) fn explored(plan: &Plan) -> Result<String, Error> {
    let mut last = Error::infeasible("material", "there is none");
    for material in &plan.materials {
        let name = &material.name;
        let brdf = match material.spec.build(plan.channels.clone()) {
            Ok(brdf) => brdf,
            Err(e) => {
                last = Error::infeasible("material", format!("{name}: {e}"));
                continue;
            }
        };
        let argument = format!("config.toml --material {}", quoted(name));
        let command = String::from("gonio schedule config.toml -o schedules/");
        let page = Exploration {
            command: "gonio run config.toml --set output.explore=true".into(),
            materials: vec![ShownMaterial::new(name, &argument, brdf.into())],
            carried: Some(Carried::of_plan(plan, material.symmetry, command)?),
            ..Exploration::default()
        };
        return page.html();
    }
    Err(last)
}

/// Values of a BRDF between the nodes of a grid that is dense enough for pictures; `None` where it cannot be made.
fn dense(brdf: &dyn Brdf) -> Option<Arc<dyn Brdf>> {
    let entry = parametrization::find("half-difference")?;
    let warps = Warps::from([("theta_h".into(), WarpSpec::SquareRoot)]);
    let form = entry.warped(brdf.symmetry(), &warps).ok()?;
    let schedule = schedule::Grid::default().plan(&form, DENSE, 1).ok()?;
    let measured = Ideal.measure(brdf, &schedule.into());
    Cubic::default().reconstruct(&measured).ok().map(Arc::from)
}
