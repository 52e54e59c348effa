//! `gonio moments`.

use super::output::{Format, one_format};
use super::run::{collect, note_missing, print_failures};
use super::{BrdfArgs, ThreadArgs, make_folder, note, print, refuse_existing, written, wrote};
use crate::error::{Error, count, count_are};
use crate::experiment::Failure;
use crate::experiment::moments::{MaterialProfiles, MomentsPlan, ProfileRow};
use crate::files::write_atomically;
use crate::report::{profiles_csv, profiles_json};
use clap::Args;
use std::io::Write;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
pub(super) struct Moments {
    #[command(flatten)]
    brdf: BrdfArgs,
    #[command(flatten)]
    threads: ThreadArgs,
    /// Format of what is printed
    #[arg(long, value_parser = one_format([Format::Csv, Format::Json]), default_value = "csv", conflicts_with = "output")]
    format: Format,
    /// JSON: the same as --format json
    #[arg(long, conflicts_with_all = ["format", "output"])]
    json: bool,
    /// Write profiles.csv, profiles.json, config.toml and, one a material, NAME.svg here instead of printing
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Replace files that exist
    #[arg(long, requires = "output")]
    force: bool,
}

impl Moments {
    pub(super) fn run(self) -> Result<(), Error> {
        self.threads.apply()?;
        let plan = self.brdf.plan()?;
        let files = match &self.output {
            Some(dir) => {
                if dir.exists() && !dir.is_dir() {
                    let message = "this is no folder; choose another with -o";
                    return Err(Error::output(dir, message));
                }
                let files = names(&plan, dir);
                for path in &files {
                    refuse_existing(path, self.force)?;
                }
                files
            }
            None => Vec::new(),
        };
        note_missing(&plan.missing);
        let (profiles, failures) = collect(&plan)?;
        if let (Some(failure), true) = (failures.first(), profiles.is_empty()) {
            return Err(unusable(&plan, failure, &self.brdf.target));
        }
        print_failures(&failures);
        let is_map = plan.moments.spec.azimuths > 1;
        let turned = plan
            .materials
            .iter()
            .filter(|m| !is_map && !m.symmetry.isotropic);
        for material in turned {
            note(&format!(
                "gonio: {} is anisotropic; its slices are those of views at azimuth 0 (--set moments.azimuths=24 makes a map)",
                material.name
            ));
        }
        let rows: Vec<ProfileRow<'_>> = profiles.iter().flat_map(MaterialProfiles::rows).collect();
        let unresolved = rows.iter().filter_map(|r| Some((r, r.slice.unresolved?)));
        for (row, why) in unresolved.clone().take(3) {
            note(&format!(
                "gonio: {} {} at {:.3}°: {why}",
                row.material,
                row.channel.name(),
                row.theta_o.to_degrees()
            ));
        }
        if let unresolved @ 1.. = unresolved.count() {
            note(&format!(
                "gonio: {unresolved} of {} unresolved; their uncertainties are not to be trusted",
                count_are(rows.len(), "slice")
            ));
        }
        // Nothing is determined of a slice that is black or has no data.
        let is_there = |r: &&ProfileRow<'_>| {
            r.slice.missing_share < 1.0 && r.slice.moments.energy() != Some(0.0)
        };
        let asked = rows.iter().filter(is_there);
        let asked = asked.flat_map(|r| {
            plan.moments
                .spec
                .order
                .components()
                .map(|c| r.slice.moments.get(c))
        });
        let (known, open): (Vec<_>, Vec<_>) = asked.partition(Option::is_some);
        if !open.is_empty() {
            note(&format!(
                "gonio: {} of {} are left out: not defined, or not determined by the readings",
                open.len(),
                count(known.len() + open.len(), "moment")
            ));
        }
        let failed = |path: &Path| match failures.len() {
            0 => Ok(()),
            failed => Err(Error::JobsFailed {
                failed,
                jobs: plan.materials.len(),
                path: path.to_owned(),
            }),
        };
        let Some(dir) = &self.output else {
            print(&match self.json || self.format == Format::Json {
                true => profiles_json(&rows),
                false => profiles_csv(&rows),
            })?;
            return failed(Path::new("stdout"));
        };
        make_folder(dir)?;
        let write = |path: &Path, text: &str| {
            let made = write_atomically(path, |out| out.write_all(text.as_bytes()));
            written(path, made)
        };
        let config = toml::to_string(&plan.resolved).map_err(Error::internal)?;
        let texts = [profiles_csv(&rows), profiles_json(&rows), config];
        for (path, text) in files.iter().zip(&texts) {
            write(path, text)?;
        }
        for profile in &profiles {
            let mut of = plan.materials.iter().filter(|m| m.name == profile.material);
            let bilateral = of.next().is_some_and(|m| m.symmetry.bilateral);
            let sheet = crate::report::material_sheet(profile, bilateral);
            let svg = crate::report::svg(&sheet.title, &sheet.panels, sheet.columns);
            let path = diagram(dir, &profile.material);
            write(&path, &svg)?;
        }
        for path in files.iter().filter(|path| path.exists()) {
            wrote(path);
        }
        failed(dir)
    }
}

fn diagram(dir: &Path, material: &str) -> PathBuf {
    dir.join(crate::report::file_stem(material) + ".svg")
}

/// The error of a material that could not be built: its keys are checked, so a file is at fault.
fn unusable(plan: &MomentsPlan, failure: &Failure, place: &str) -> Error {
    let material = plan.materials.iter().find(|m| m.name == failure.job);
    let files = material.map(|m| m.spec.tables().files).unwrap_or_default();
    for file in files {
        if let Some(why) = failure
            .reason
            .strip_prefix(&format!("{}: ", file.display()))
        {
            return Error::data(&file, why);
        }
    }
    let message = format!("{}: {}", failure.job, failure.reason);
    Error::config(place, message)
}

/// The files of an output folder: table, JSON, then one diagram per material.
fn names(plan: &MomentsPlan, dir: &Path) -> Vec<PathBuf> {
    let mut names: Vec<_> = ["profiles.csv", "profiles.json", "config.toml"]
        .map(|name| dir.join(name))
        .into();
    names.extend(plan.materials.iter().map(|m| diagram(dir, &m.name)));
    names
}
