//! `gonio run` of a moment experiment.

use super::run::{End, Run, stop_on_ctrl_c, tell_missing};
use super::{print, say};
use crate::brdf::Brdf;
#[cfg(feature = "exr")]
use crate::brdf::BuildError;
use crate::error::Error;
use crate::experiment::moments::{
    self, Group, MaterialProfiles, MomentsPlan, ProfileFits, at_bound,
};
use crate::experiment::{Failure, Input, Kind, Material, Source};
#[cfg(feature = "exr")]
use crate::lighting::Lighting;
use crate::moments::{Clamping, ViewRange};
use crate::report::{CORRELATIONS, FITS, MadeBy, Manifest, Outcome, RunFolder, SUMMARY};
#[cfg(feature = "exr")]
use crate::report::{FilterEllipse, file_stem, sphere, sphere_svg};
use crate::report::{correlations_csv, fits_csv, study_table, summary_json};
use std::io::Write;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Instant, SystemTime};

impl Run {
    /// Runs a config of kind `moments`.
    pub(super) fn moment_study(&self, source: &Source, started: SystemTime) -> Result<(), Error> {
        let plan = MomentsPlan::read(source)?;
        let stop = stop_on_ctrl_c()?;
        let folder = self.folder(Kind::Moments, &plan.resolved)?;
        tell_missing(&plan.missing, self.is_quiet());
        for name in &plan.analysis.spheres {
            if !self.is_quiet() && plan.materials.iter().all(|m| m.name != *name) {
                say(&format!(
                    "gonio: {name} of analysis.spheres is not among the materials; not drawn"
                ));
            }
        }
        if let Some(question) = &plan.question {
            print(&format!("{}\n\n", question.trim()))?;
        }
        print(HEAD)?;
        let mut desk = Desk {
            plan: &plan,
            stop,
            folder,
            range: plan
                .analysis
                .range()
                .map_err(|e| Error::Internal(e.to_string()))?,
            materials: Vec::new(),
            fits: Vec::new(),
            inputs: Vec::new(),
            failures: Vec::new(),
            #[cfg(feature = "exr")]
            light: None,
        };
        let begun = Instant::now();
        let complete = moments::measure(&plan, &mut desk)?;
        let profiles_seconds = begun.elapsed().as_secs_f64();
        let begun = Instant::now();
        let mut groups = desk.groups();
        desk.folder.write_file(FITS, |out| fits_csv(&groups, out))?;
        // A run that was stopped knows what its materials are, not what a group has in common that is
        // not whole.
        groups.retain(|group| complete || desk.is_whole(&group.name));
        desk.write(&groups)?;
        print(&study_table(&groups))?;
        let analysis_seconds = begun.elapsed().as_secs_f64();
        let outcome = Outcome {
            rows: desk.folder.rows(),
            failures: desk.failures,
            seconds: serde_json::json!({
                "profiles": profiles_seconds,
                "analysis": analysis_seconds,
            }),
            interrupted: !complete,
            ..Outcome::default()
        };
        let made_by = MadeBy {
            resolved: &plan.resolved,
            seeds: &[plan.seed],
            missing: &plan.missing,
        };
        let end = End {
            rows: outcome.rows,
            failed: outcome.failures.len(),
            jobs: plan.materials.len(),
            interrupted: !complete,
        };
        let manifest = Manifest::new(made_by, source, desk.inputs, outcome, started);
        let path = desk.folder.finish(manifest)?;
        self.tell(&end, path)
    }
}

/// Pixels along each side of a sphere.
#[cfg(feature = "exr")]
const SPHERE: usize = 200;

/// View elevation and azimuth (deg) of the filters that are drawn on it.
#[cfg(feature = "exr")]
const FILTERS: [(f64, f64); 3] = [(25.0, 150.0), (50.0, 30.0), (75.0, 270.0)];

/// Where the news of a run arrive.
struct Desk<'a> {
    plan: &'a MomentsPlan,
    stop: Arc<AtomicBool>,
    folder: RunFolder,
    range: ViewRange,
    materials: Vec<MaterialProfiles>,
    /// Of each material those of its channels.
    fits: Vec<Vec<ProfileFits>>,
    inputs: Vec<Input>,
    failures: Vec<Failure>,
    /// Built when the first sphere needs it.
    #[cfg(feature = "exr")]
    light: Option<Box<dyn Lighting>>,
}

impl Desk<'_> {
    /// The materials of a group.
    fn members(&self, group: &str) -> Vec<&MaterialProfiles> {
        self.materials.iter().filter(|m| m.group == group).collect()
    }

    /// Every material of a group is there.
    fn is_whole(&self, group: &str) -> bool {
        let planned = self.plan.materials.iter().filter(|m| m.group() == group);
        planned.count() == self.members(group).len()
    }

    /// What there is, put together by kind.
    fn groups(&self) -> Vec<Group> {
        let names = self.plan.groups().into_iter();
        names
            .map(|name| {
                let members = self.members(&name);
                let all = self.materials.iter().zip(&self.fits);
                let fits = all.filter(|(m, _)| m.group == name);
                let fits = fits.flat_map(|(_, fits)| fits.clone()).collect();
                Group::new(name, &members, fits, self.range)
            })
            .filter(|group| !group.fits.is_empty())
            .collect()
    }

    /// Draws a material on a sphere, with the filters of three views (Fig. 8 of Zubiaga et al.).
    #[cfg(feature = "exr")]
    fn sphere(&mut self, brdf: &dyn Brdf, of: &MaterialProfiles) -> Result<(), Error> {
        let (name, profile) = (&of.material, &of.profiles[0]);
        if self.light.is_none() {
            let built = self.plan.lighting.build();
            self.light = Some(built.map_err(|e| match e {
                BuildError::Data { path, message } => Error::Data { path, message },
                e => Error::config("lighting", e),
            })?);
        }
        let Some(light) = &self.light else {
            return Ok(());
        };
        let image = sphere(brdf, &**light, SPHERE);
        let white = image.white();
        let ellipse = |&(view, azimuth): &(f64, f64)| {
            let near = |theta: &f64| (theta.to_degrees() - view).abs();
            let views = profile.views.iter().enumerate();
            let (i, theta_o) = views.min_by(|a, b| near(a.1).total_cmp(&near(b.1)))?;
            FilterEllipse::new(
                *theta_o,
                f64::to_radians(azimuth),
                &profile.slices[i].moments,
            )
        };
        let ellipses: Vec<_> = FILTERS.iter().filter_map(ellipse).collect();
        let title = format!("{name}: means and covariances of its slices");
        let svg = sphere_svg(&title, &image, white, &ellipses)
            .map_err(|e| Error::Internal(e.to_string()))?;
        let stem = format!("sphere-{}", file_stem(name));
        self.folder
            .write_figure(format!("{stem}.svg"), |out| out.write_all(svg.as_bytes()))?;
        self.folder
            .write_figure(format!("{stem}.png"), |out| image.write_png(white, out))
    }

    #[cfg(not(feature = "exr"))]
    fn sphere(&mut self, _brdf: &dyn Brdf, of: &MaterialProfiles) -> Result<(), Error> {
        say(&format!(
            "gonio: {}: this build draws no spheres",
            of.material
        ));
        Ok(())
    }

    fn write(&mut self, groups: &[Group]) -> Result<(), Error> {
        self.folder
            .write_file(CORRELATIONS, |out| correlations_csv(groups, out))?;
        self.folder
            .write_file(SUMMARY, |out| summary_json(groups, out))?;
        #[cfg(feature = "plots")]
        for group in groups {
            for sheet in crate::report::group_sheets(group, &self.members(&group.name)) {
                let svg = crate::report::svg(&sheet.title, &sheet.panels, sheet.columns)?;
                let name = format!("{}.svg", sheet.name);
                self.folder
                    .write_figure(name, |out| out.write_all(svg.as_bytes()))?;
            }
        }
        Ok(())
    }
}

/// A material of the table that is printed while materials are analysed.
fn line(fits: &[ProfileFits], seconds: f64) -> String {
    let Some(first) = fits.first() else {
        return String::new();
    };
    let number = |v: Option<f64>| v.map_or("undefined".into(), |v| format!("{v:.4}"));
    let knots = first.energy.as_ref().ok().and_then(|e| e.knots());
    let knots = match knots {
        Some(knots) => {
            let fit = first.energy.as_ref().ok();
            let bound = fit.map_or([false; 2], |fit| at_bound(fit, first.range));
            let marks = [
                if bound[0] { "≤" } else { "" },
                if bound[1] { "≥" } else { "" },
            ];
            let [a, b] = knots.map(f64::to_degrees);
            format!("{}{a:.1}° {}{b:.1}°", marks[0], marks[1])
        }
        None => "undetermined".into(),
    };
    format!(
        "  {:<28} {:>10} {:>10} {:>14} {:>8.1} %{:>6} {seconds:>8.2} s\n",
        first.material,
        number(first.slope()),
        number(first.average_variance()),
        knots,
        100.0 * first.clamped_share,
        fits.iter().map(|f| f.unresolved).sum::<usize>(),
    )
}

const HEAD: &str =
    "  material                     mean slope   variance          knots   clamped  unresolved\n";

impl moments::Desk for Desk<'_> {
    fn cancelled(&self) -> bool {
        self.stop.load(Ordering::SeqCst)
    }

    fn begins(&mut self, _material: &Material) {}

    fn profiles(
        &mut self,
        brdf: &dyn Brdf,
        profiles: MaterialProfiles,
        inputs: Vec<Input>,
    ) -> Result<(), Error> {
        let rows: Vec<_> = profiles.rows().collect();
        self.folder.write_profiles(&rows)?;
        self.inputs.extend(inputs);
        let mut fits = Vec::with_capacity(profiles.profiles.len());
        for (i, profile) in profiles.profiles.iter().enumerate() {
            // Colours of a material share their shape: the first channel stands for all.
            let horizon = (i == 0 && self.plan.analysis.horizon).then(|| {
                let estimator = &*self.plan.moments.estimator;
                Clamping::of(brdf, profile, estimator, self.range.ends()[1])
            });
            let horizon = horizon.transpose();
            let horizon = horizon.map_err(|e| Error::Internal(e.to_string()))?;
            fits.push(ProfileFits::new(&profiles, i, horizon, self.range));
        }
        print(&line(&fits, profiles.seconds.iter().sum()))?;
        if self.plan.analysis.spheres.contains(&profiles.material) {
            self.sphere(brdf, &profiles)?;
        }
        self.fits.push(fits);
        self.materials.push(profiles);
        Ok(())
    }

    fn failed(&mut self, failure: Failure) {
        say(&format!("gonio: {}: {}", failure.job, failure.reason));
        self.failures.push(failure);
    }
}
