//! `gonio moments`.

use super::brdf_args::BrdfArgs;
use super::collect::Collect;
use super::run::{tell_inputs, tell_missing};
use super::talk::{note, say, wrote};
use super::{ThreadArgs, print, refuse_existing};
use crate::error::{Error, count_are};
use crate::experiment::moments::{MaterialProfiles, MomentsPlan, ProfileRow};
use crate::experiment::{Experiment, Extent, Failure, Known, Source};
use crate::files::write_atomically;
use crate::report::{profiles_csv, profiles_json};
use clap::{Args, ValueEnum};
use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Format {
    Csv,
    Json,
}

#[derive(Debug, Args)]
pub(super) struct Moments {
    #[command(flatten)]
    brdf: BrdfArgs,
    #[command(flatten)]
    threads: ThreadArgs,
    /// Format of what is printed
    #[arg(long, value_enum, default_value = "csv", conflicts_with = "output")]
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
        let source = self.brdf.source()?;
        let plan = self.brdf.plan(&source)?;
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
        tell_missing(&plan.missing);
        let mut collected = Collect::<MaterialProfiles>::new();
        let summary = plan.run(&Extent::default(), &Known::default(), &mut collected)?;
        tell_inputs(&summary);
        let (profiles, failures) = collected.end();
        if let (Some(failure), true) = (failures.first(), profiles.is_empty()) {
            return Err(unusable(&plan, failure, &source));
        }
        for Failure { job, reason, .. } in &failures {
            say(&format!("gonio: {job}: {reason}"));
        }
        for material in plan.materials.iter().filter(|m| !m.symmetry.isotropic) {
            note(&format!(
                "gonio: {} is anisotropic; its slices are those of views at azimuth 0",
                material.name
            ));
        }
        let rows: Vec<ProfileRow<'_>> = profiles.iter().flat_map(MaterialProfiles::rows).collect();
        for row in rows.iter().filter(|r| r.slice.unresolved.is_some()).take(3) {
            let why = row
                .slice
                .unresolved
                .map_or(String::new(), |u| u.to_string());
            note(&format!(
                "gonio: {} {} at {:.3}°: {why}",
                row.material,
                row.channel.name(),
                row.theta_o.to_degrees()
            ));
        }
        let unresolved = rows.iter().filter(|r| r.slice.unresolved.is_some()).count();
        if unresolved > 0 {
            note(&format!(
                "gonio: {unresolved} of {} unresolved; their uncertainties are not to be trusted",
                count_are(rows.len(), "slice")
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
            match self.format {
                Format::Csv if !self.json => print(&text(|out| profiles_csv(&rows, out))?)?,
                Format::Csv | Format::Json => print(&text(|out| profiles_json(&rows, out))?)?,
            }
            return failed(Path::new("stdout"));
        };
        fs::create_dir_all(dir)
            .map_err(|e| Error::output(dir, format!("cannot make this folder: {e}")))?;
        write(&files[0], |out| profiles_csv(&rows, out))?;
        write(&files[1], |out| profiles_json(&rows, out))?;
        let config = toml::to_string(&plan.resolved).map_err(|e| Error::Internal(e.to_string()))?;
        write(&files[2], |out| out.write_all(config.as_bytes()))?;
        for profile in &profiles {
            let mut of = plan.materials.iter().filter(|m| m.name == profile.material);
            let bilateral = of.next().is_some_and(|m| m.symmetry.bilateral);
            let sheet = crate::report::material_sheet(profile, bilateral);
            let svg = crate::report::svg(&sheet.title, &sheet.panels, sheet.columns)?;
            let path = diagram(dir, &profile.material);
            write(&path, |out| out.write_all(svg.as_bytes()))?;
        }
        for path in files.iter().filter(|path| path.exists()) {
            wrote(path);
        }
        failed(dir)
    }
}

/// The diagram of a material.
fn diagram(dir: &Path, material: &str) -> PathBuf {
    dir.join(crate::report::file_stem(material) + ".svg")
}

/// The error of a material that could not be built: its keys are checked, so a file is at fault.
fn unusable(plan: &MomentsPlan, failure: &Failure, source: &Source) -> Error {
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
    Error::config(source.name(), message)
}

/// The files of an output folder: table, JSON, then one diagram per material.
fn names(plan: &MomentsPlan, dir: &Path) -> Vec<PathBuf> {
    let mut names: Vec<_> = ["profiles.csv", "profiles.json", "config.toml"]
        .map(|name| dir.join(name))
        .into();
    names.extend(plan.materials.iter().map(|m| diagram(dir, &m.name)));
    names
}

fn write(
    path: &Path,
    body: impl FnOnce(&mut BufWriter<fs::File>) -> io::Result<()>,
) -> Result<(), Error> {
    write_atomically(path, body)
        .map_err(|e| Error::output(path, format!("cannot write this file: {e}")))
}

fn text(body: impl FnOnce(&mut Vec<u8>) -> io::Result<()>) -> Result<String, Error> {
    let mut out = Vec::new();
    body(&mut out).map_err(|e| Error::Internal(e.to_string()))?;
    String::from_utf8(out).map_err(|e| Error::Internal(e.to_string()))
}
