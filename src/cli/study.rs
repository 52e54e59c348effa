//! `gonio run` of a config of kind `study`.

use super::progress::Progress;
use super::run::{End, RUNS, Run, stop_on_ctrl_c, tell_missing};
use super::{print, say};
use crate::brdf::Brdf;
use crate::error::Error;
use crate::experiment::study::{self, Findings, RowKey, Shard, StudyObserver, StudyPlan, StudyRow};
use crate::experiment::{Failure, Material, Source};
#[cfg(all(feature = "exr", feature = "plots"))]
use crate::report::Studio;
#[cfg(feature = "plots")]
use crate::report::study_curves;
use crate::report::{
    MadeBy, Manifest, MaterialPictures, Outcome, Picture, ROWS, StudyFolder, read_rows, study_html,
    study_text,
};
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Instant, SystemTime};

impl Run {
    /// Runs a study, or goes on with it.
    pub(super) fn study(&self, source: &Source, started: SystemTime) -> Result<(), Error> {
        let plan = StudyPlan::read(source)?;
        tell_missing(&plan.plan.missing, self.is_quiet());
        let dir = self.study_folder();
        if self.list {
            return list(&plan, self.shard, &dir);
        }
        if let Some(shard) = self.shard.filter(|_| StudyFolder::has_report(&dir)) {
            let message = format!(
                "a whole study is here, of which --shard {shard} would leave a part; choose \
                 another folder with -o"
            );
            return Err(Error::output(dir, message));
        }
        let stop = stop_on_ctrl_c()?;
        let folder = StudyFolder::open(&dir, self.force, &plan.resolved)?;
        if let Some(question) = &plan.plan.question {
            print(&format!("{}\n\n", question.trim()))?;
        }
        let known = folder.known();
        let units = plan.shard(self.shard);
        let jobs = plan.jobs_of(&units) * plan.plan.materials.len();
        let clock = Instant::now();
        let mut desk = Desk {
            progress: Progress::with_length(jobs as u64, self.is_quiet()),
            stop,
            folder,
            #[cfg(all(feature = "exr", feature = "plots"))]
            studio: plan.pictures.draw.then(|| Studio::new(&plan)).transpose()?,
            #[cfg(not(all(feature = "exr", feature = "plots")))]
            plan: std::marker::PhantomData,
        };
        #[cfg(all(feature = "exr", feature = "plots"))]
        if let Some(studio) = &desk.studio {
            studio.general(&mut desk.folder)?;
        }
        let summary = study::study(&plan, self.shard, &known, &mut desk)?;
        desk.progress.finish();
        let Desk { folder, .. } = desk;
        let seconds = clock.elapsed().as_secs_f64();
        let outcome = Outcome {
            rows: summary.rows,
            failures: summary.failures.clone(),
            seconds: serde_json::json!({ "run": seconds }),
            interrupted: summary.interrupted,
            ..Outcome::default()
        };
        let end = End {
            rows: summary.rows,
            failed: summary.failures.iter().map(|f| f.jobs).sum(),
            jobs,
            interrupted: summary.interrupted,
        };
        let made_by = MadeBy {
            resolved: &plan.resolved,
            seeds: &plan.plan.seeds,
            missing: &plan.plan.missing,
        };
        let manifest = Manifest::new(made_by, source, summary.inputs.clone(), outcome, started);
        let path = if summary.interrupted || self.shard.is_some() {
            folder.finish(&summary.keys, manifest, None)?
        } else {
            finish(&plan, folder, &summary.keys, &summary.materials, manifest)?
        };
        self.tell(&end, path)
    }

    /// Where the results are: a study goes on in the folder of its config.
    fn study_folder(&self) -> PathBuf {
        if let Some(dir) = &self.output {
            return dir.clone();
        }
        let stem = self.config.config.file_stem().unwrap_or("study".as_ref());
        let mut name = stem.to_os_string();
        if let Some(Shard { part, of }) = self.shard {
            name.push(format!(".shard-{part}-of-{of}"));
        }
        Path::new(RUNS).join(name)
    }
}

/// Prints what rows say, and writes it into their folder.
pub(super) fn finish(
    plan: &StudyPlan,
    mut folder: StudyFolder,
    keys: &[RowKey],
    materials: &[Option<String>],
    manifest: Manifest,
) -> Result<PathBuf, Error> {
    let (rows, _) = folder.sorted(keys);
    let findings = Findings::new(&rows, plan.band);
    print(&study_text(&findings))?;
    let facts = serde_json::to_value(&manifest).map_err(|e| Error::Internal(e.to_string()))?;
    let (general, pictures) = gathered(plan, &folder, materials)?;
    let report = study_html(plan, &rows, &findings, &facts, &general, &pictures)?;
    #[cfg(feature = "plots")]
    let figure = study_curves(&findings)?;
    drop(rows);
    #[cfg(feature = "plots")]
    folder.write_figure("errors.svg", &figure)?;
    folder.finish(keys, manifest, Some((&findings, report)))
}

/// The pictures of a report; `materials` are the keys of theirs, as far as they are known.
fn gathered(
    plan: &StudyPlan,
    folder: &StudyFolder,
    materials: &[Option<String>],
) -> Result<(Vec<Picture>, Vec<MaterialPictures>), Error> {
    #[cfg(all(feature = "exr", feature = "plots"))]
    if plan.pictures.draw {
        return Ok(Studio::new(plan)?.gathered(folder, materials));
    }
    let _ = (plan, folder, materials);
    Ok((Vec::new(), Vec::new()))
}

/// Prints every job and whether it is done.
fn list(plan: &StudyPlan, shard: Option<Shard>, dir: &Path) -> Result<(), Error> {
    let rows = if dir.join(ROWS).exists() {
        read_rows(dir)?
    } else {
        Vec::new()
    };
    let known: HashSet<RowKey> = rows.into_iter().map(|r| r.key).collect();
    let jobs = study::jobs(plan, shard)?;
    let mut out = String::new();
    let mut done = 0;
    for job in &jobs {
        let is_done = job.keys.iter().all(|k| known.contains(k));
        done += usize::from(is_done);
        let word = if is_done { "done" } else { "open" };
        out += &format!("{word}  {}  {}\n", job.keys.join(" "), job.name);
    }
    out += &format!(
        "{done} of {} jobs are done in {}\n",
        jobs.len(),
        dir.display()
    );
    print(&out)
}

/// Where a study's news arrive.
struct Desk<'a> {
    progress: Progress,
    stop: Arc<AtomicBool>,
    folder: StudyFolder,
    /// `None` where nothing is drawn.
    #[cfg(all(feature = "exr", feature = "plots"))]
    studio: Option<Studio<'a>>,
    #[cfg(not(all(feature = "exr", feature = "plots")))]
    plan: std::marker::PhantomData<&'a StudyPlan>,
}

impl StudyObserver for Desk<'_> {
    fn cancelled(&self) -> bool {
        self.stop.load(Ordering::SeqCst)
    }

    fn stage(&mut self, what: &str) {
        self.progress.say(what);
    }

    #[cfg(all(feature = "exr", feature = "plots"))]
    fn wants(&self, material: &Material, key: &str) -> bool {
        let studio = self.studio.as_ref();
        studio.is_some_and(|s| s.wants(&self.folder, material, key))
    }

    #[cfg(all(feature = "exr", feature = "plots"))]
    fn loaded(&mut self, material: &Material, brdf: &dyn Brdf, key: &str) -> Result<(), Error> {
        let Some(studio) = &self.studio else {
            return Ok(());
        };
        self.progress.say(&format!("drawing {}", material.name));
        let stop = Arc::clone(&self.stop);
        let cancelled = || stop.load(Ordering::SeqCst);
        studio.material(&mut self.folder, material, brdf, key, &cancelled)
    }

    #[cfg(not(all(feature = "exr", feature = "plots")))]
    fn loaded(&mut self, _material: &Material, _brdf: &dyn Brdf, _key: &str) -> Result<(), Error> {
        Ok(())
    }

    fn rows(&mut self, rows: Vec<StudyRow>) -> Result<(), Error> {
        self.folder.write_rows(rows)
    }

    fn failed(&mut self, failure: &Failure) {
        let Failure { job, reason, .. } = failure;
        self.progress
            .aside(|| say(&format!("gonio: {job}: {reason}")));
    }

    fn advanced(&mut self, jobs: usize) {
        self.progress.step(jobs as u64);
    }
}
