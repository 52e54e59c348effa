//! A page: what it shows, and its text.

use super::facts::{charts, distortion_of, errors, hex, moments, sky};
use super::machine::{MOST_VISITS, Tour, visits};
use super::packed::Parts;
use super::readings;
use super::script::{HASHES, STYLE, script};
use super::table::Grid;
use crate::brdf::Brdf;
use crate::error::Error;
use crate::instrument::{Ideal, Instrument};
use crate::measurement::Measurement;
use crate::metrics::Measure;
use crate::parametrization::{self, WarpSpec, Warps};
use crate::reconstruct::{self, Cubic, Reconstruct, ReconstructError, Replicated};
use crate::report::pictures;
use crate::report::svg::plot::ramp;
use crate::schedule::{self, SampleSet};
use crate::validation::Reconstruction;
use maud::{DOCTYPE, PreEscaped, html};
use rayon::join;
use rayon::prelude::*;
use serde_json::{Value as Json, json};
use std::sync::Arc;

/// Poses of the grid that a BRDF of readings is evaluated at once for everything but its errors.
const DENSE: usize = 40_000;

/// A material of a page.
#[derive(Clone, Copy)]
pub struct ShownMaterial<'a> {
    /// Its name.
    pub name: &'a str,
    /// What commands call it.
    pub argument: &'a str,
    /// Its values.
    pub brdf: &'a dyn Brdf,
    /// True where a value takes long: all but errors is of values between those of a dense grid.
    pub is_slow: bool,
}

/// Readings of a page.
#[derive(Clone, Copy)]
pub struct ShownReadings<'a> {
    /// Name of the file, or of the material that was read.
    pub name: &'a str,
    /// What commands call a material of these readings; `None` of those of the tour.
    pub argument: Option<&'a str>,
    /// The readings.
    pub measurement: &'a Measurement,
}

/// What a page shows.
#[derive(Default)]
pub struct Exploration<'a> {
    /// The command that makes the page.
    pub command: String,
    /// A, and B; none: they are dropped onto the page.
    pub materials: Vec<ShownMaterial<'a>>,
    /// Readings; where there are less than two materials the next is reconstructed from them.
    pub readings: Option<ShownReadings<'a>>,
    /// A tour of an instrument; readings are then those of its poses.
    pub tour: Option<Tour<'a>>,
    /// What is to be said on top of the page.
    pub notes: Vec<String>,
}

impl Exploration<'_> {
    /// The page.
    ///
    /// # Errors
    /// If readings cannot be reconstructed from.
    pub fn html(&self) -> Result<String, Error> {
        let failed = |e| Error::config("readings", e);
        let made = self.made().transpose().map_err(failed)?;
        let replicated = made.as_ref().map(Reconstruction::replicated);
        let replicated = replicated.transpose().map_err(failed)?.flatten();
        let mut materials = self.materials.clone();
        let mut notes = self.notes.clone();
        let named = made.as_ref().zip(self.readings).map(|(made, read)| {
            let method = made.method.label();
            let of = |path| format!("{path} --set reconstruction.kind={method}");
            let suspects = read.measurement.readings() - made.measurement.readings();
            if suspects > 0 {
                let which = "that the others contradict";
                notes.push(format!(
                    "{} is made without {suspects} readings {which}.",
                    read.name
                ));
            }
            (
                format!("{} by {method}", read.name),
                read.argument.map_or_else(String::new, of),
            )
        });
        if let (Some(made), Some((name, argument))) = (&made, &named) {
            materials.push(ShownMaterial {
                name,
                argument,
                brdf: &*made.brdf,
                is_slow: true,
            });
        }
        let visits = self
            .tour
            .as_ref()
            .map_or(0, |tour| tour.itinerary.visits.len());
        if visits > MOST_VISITS {
            notes.push(format!(
                "The first {MOST_VISITS} of {visits} visits are here."
            ));
        }
        // A value of a reconstruction takes a thousand times as long as one of a grid of its values.
        let dense = |m: &ShownMaterial<'_>| if m.is_slow { dense(m.brdf) } else { None };
        let dense: Vec<Option<Box<dyn Brdf>>> = materials.iter().map(dense).collect();
        for (m, dense) in materials.iter().zip(&dense) {
            let error = dense.as_deref();
            let error = error.map(|dense| errors(&[m.brdf, dense], &[Measure::Cosine]));
            let error = error.into_iter().flatten().next();
            if let Some(nrmse) = error.and_then(|e| e["nrmse"].as_f64()) {
                let of = format!("{} is shown between {DENSE} of its values", m.name);
                notes.push(format!("{of}, which err by a cosine nrmse of {nrmse:.4}."));
            }
        }
        let parts = Parts::default();
        let data = self.data(&materials, &dense, replicated, &parts)?;
        // No text of the data ends its element.
        let data = data.to_string().replace('<', "\\u003c");
        let policy = format!(
            "default-src 'none'; script-src 'sha256-{}'; style-src 'sha256-{}'; img-src data: blob:",
            HASHES[0], HASHES[1]
        );
        let names: Vec<&str> = materials.iter().map(|m| m.name).collect();
        let title = match names[..] {
            [] => "gonio explore".into(),
            _ => names.join(" and "),
        };
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

    /// The reconstruction from readings, if there are some and there is room for it.
    fn made(&self) -> Option<Result<Reconstruction, ReconstructError>> {
        let read = self.readings.filter(|_| self.materials.len() < 2)?;
        (read.measurement.readings() > 2).then(|| made_of(read.measurement))
    }

    fn data(
        &self,
        materials: &[ShownMaterial<'_>],
        dense: &[Option<Box<dyn Brdf>>],
        replicated: Option<&Replicated>,
        parts: &Parts,
    ) -> Result<Json, Error> {
        let failed = |e| Error::config("readings", e);
        let brdfs = materials.iter().zip(dense);
        let brdfs: Vec<&dyn Brdf> = brdfs.map(|(m, d)| d.as_deref().unwrap_or(m.brdf)).collect();
        let shown: Vec<_> = materials.iter().zip(&brdfs).enumerate().collect();
        let own: Vec<&dyn Brdf> = materials.iter().map(|m| m.brdf).collect();
        let tables = || {
            let of = |(i, (m, brdf)): &(usize, (&ShownMaterial<'_>, &&dyn Brdf))| {
                Grid::of(**brdf, m.is_slow).facts(*i, m.name, m.argument, parts)
            };
            shown.par_iter().map(of).collect::<Vec<Json>>()
        };
        let distortion = || {
            let of = |(_, (m, brdf)): &(usize, (&ShownMaterial<'_>, &&dyn Brdf))| {
                distortion_of(m.name, **brdf)
            };
            shown.par_iter().flat_map(of).collect::<Vec<Json>>()
        };
        let moments = || {
            brdfs
                .par_iter()
                .map(|brdf| moments(*brdf))
                .collect::<Vec<_>>()
        };
        let of_tour = self.readings.is_some_and(|read| read.argument.is_none());
        let visit = self.tour.as_ref().filter(|_| of_tour);
        let visit = visit.map(|t| visits(t.itinerary, t.schedule.poses.len()));
        let readings = || {
            self.readings.map(|shown| {
                readings::facts(shown.name, shown.measurement, visit.as_deref(), parts)
            })
        };
        let uncertainty = || {
            let of = replicated.zip(materials.last());
            of.and_then(|(u, of)| readings::uncertainties(u, of.brdf.symmetry(), parts))
        };
        let ((tables, distortion), (((readings, uncertainty), errors), (moments, sky))) = join(
            || join(tables, distortion),
            || {
                join(
                    || {
                        join(
                            || join(readings, uncertainty),
                            || errors(&own, &Measure::USUAL),
                        )
                    },
                    || join(moments, || sky(&brdfs, parts)),
                )
            },
        );
        Ok(json!({
            "materials": tables,
            "colours": {
                "sequential": hex(ramp),
                "signed": hex(|t| pictures::signed(2.0 * t - 1.0)),
            },
            "signed": {"least": pictures::LEAST, "most": 1.0},
            "charts": charts(),
            "distortion": distortion,
            "errors": errors,
            "sky": sky.0,
            "skyError": sky.1,
            "moments": moments,
            "uncertainty": uncertainty,
            "readings": readings.transpose().map_err(failed)?,
            "machine": self.tour.as_ref().and_then(|tour| tour.facts(parts)),
        }))
    }
}

/// Values of a BRDF between the nodes of a grid that is dense enough for pictures; `None` where it cannot be made.
fn dense(brdf: &dyn Brdf) -> Option<Box<dyn Brdf>> {
    let entry = parametrization::find("half-difference")?;
    let warps = Warps::from([("theta_h".into(), WarpSpec::SquareRoot)]);
    let form = entry.warped(brdf.symmetry(), &warps).ok()?;
    let schedule = schedule::Grid::default().plan(&form, DENSE, 1).ok()?;
    let measured = Ideal.measure(brdf, &schedule.into());
    Cubic::default().reconstruct(&measured).ok()
}

/// The BRDF of readings, without those that the others contradict, by the method for as many.
fn made_of(measurement: &Measurement) -> Result<Reconstruction, ReconstructError> {
    let suspects = reconstruct::suspects(measurement);
    let measurement = measurement.clone();
    let measurement = measurement.without(suspects.iter().map(|s| s.pose));
    let method = reconstruct::default_for(&measurement);
    Reconstruction::new(Arc::new(measurement), Some(method))
}
