//! Observers and output of an acquisition.

use super::{End, Listener, Printed, Shown};
use crate::cli::{note, print};
use crate::error::Error;
use crate::experiment::{
    ByProduct, Event, Findings, Kind, Metric, Observer, Plan, QuantityGroup, Row, Shard,
};
use crate::metrics::{Measure, MetricsSpec};
use crate::report::explore::explored;
use crate::report::{
    Below, EXPLORE, PARQUET, RANKING, REPORT, RESULTS, RunFolder, Studio, TIMES, Table,
    calibration, instruments, levels_text, ranking, ranking_csv, results_csv, schedule_stem,
    slice_name, study_curves, study_html, study_text, study_timings, verdict_text, write_slice,
};
use std::cell::RefCell;
use std::io::Write;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

type Folder = RunFolder<Row>;

impl Shown for Plan {
    fn table(&self) -> Result<Option<Printed<'_, Row>>, Error> {
        if self.kind != Kind::Acquisition {
            return Ok(None);
        }
        let table = Table::new(self);
        let head = table.head();
        let lines = move |rows: &[&Row]| table.lines(rows);
        Ok(Some((head, Box::new(lines))))
    }

    fn listener<'a>(
        &'a self,
        folder: &'a RefCell<Folder>,
        shard: Option<Shard>,
        stop: &Arc<AtomicBool>,
    ) -> Result<Listener<'a, Row>, Error> {
        let studio = self.pictures.draw.then(|| Studio::new(self, shard));
        let studio = studio.transpose()?;
        if let Some(studio) = &studio {
            studio.general(&mut folder.borrow_mut())?;
        }
        Ok(Some(Box::new(Asked {
            plan: self,
            folder,
            studio,
            stop: Arc::clone(stop),
        })))
    }

    fn conclude(&self, folder: &mut Folder, end: &End<'_>) -> Result<(), Error> {
        let (rows, _) = folder.sorted(end.keys);
        if end.whole {
            if self.kind == Kind::Acquisition {
                print(&match self.instruments.is_empty() {
                    true => ranking(&rows),
                    false => instruments(&rows),
                })?;
            }
            note_unconverged(&rows, self);
            note_truths(&rows);
        }
        let table = results_csv(&rows);
        #[cfg(feature = "parquet")]
        let typed = (self.output.parquet).then(|| crate::report::results_parquet(&rows));
        // A plan that asks for it has been refused.
        #[cfg(not(feature = "parquet"))]
        let typed: Option<Vec<u8>> = None;
        let report = match end.whole && end.ended {
            false => None,
            true => {
                let findings = Findings::asked(&rows, self.band, &self.report);
                if self.kind == Kind::Study {
                    print(&study_text(&findings))?;
                }
                print(&levels_text(&findings))?;
                print(&calibration(&findings))?;
                print(&verdict_text(&findings))?;
                let (general, pictures) = match self.pictures.draw {
                    true => Studio::new(self, None)?.gathered(folder, end.materials),
                    false => (Vec::new(), Vec::new()),
                };
                let manifest = serde_json::to_value(end.manifest).map_err(Error::internal)?;
                let html = study_html(self, &rows, &findings, &manifest, &general, &pictures);
                Some((findings, html))
            }
        };
        folder.write_file(RESULTS, table)?;
        if let Some(typed) = typed {
            folder.write_file(PARQUET, typed)?;
        }
        let Some((findings, html)) = report else {
            return Ok(());
        };
        if self.output.explore {
            match explored(self) {
                Ok(page) => folder.write_file(EXPLORE, page)?,
                Err(e) => note(&format!("gonio: {EXPLORE} is left out: {e}")),
            }
        }
        let figure = study_curves(&findings);
        folder.write_below(Below::Pictures, "errors.svg", |out| {
            out.write_all(figure.as_bytes())
        })?;
        folder.write_file(TIMES, study_timings(&findings))?;
        folder.write_file(RANKING, ranking_csv(&findings))?;
        folder.write_file(REPORT, html)
    }

    fn left_out(&self) -> Vec<(&'static str, String)> {
        let quantity =
            |of: QuantityGroup| (of.name(), format!("quantities has no {:?}", of.name()));
        let no = |name, key: &str| (name, format!("{key} is false"));
        let no_tours = ("tours", "there is no [[instrument]]".into());
        let no_schedules = self.output.schedules.0.is_none();
        let all = [
            (self.instruments.is_empty(), no_tours),
            (!self.albedo, quantity(QuantityGroup::Albedo)),
            (self.moments.is_none(), quantity(QuantityGroup::Moments)),
            (!self.uncertainty, quantity(QuantityGroup::Uncertainty)),
            (!self.expected, quantity(QuantityGroup::Expected)),
            (!self.pictures.draw, no("pictures", "pictures.draw")),
            (!self.output.slices, no("slices", "output.slices")),
            (no_schedules, no("schedules", "output.schedules")),
        ];
        let left_out = all.into_iter().filter(|(is_left_out, _)| *is_left_out);
        left_out.map(|(_, what)| what).collect()
    }
}

/// Notes how many rows are less exact than was asked, where pairs were to be added until they are.
fn note_unconverged(rows: &[&Row], plan: &Plan) {
    let MetricsSpec {
        pairs,
        max_pairs,
        tolerance,
        ..
    } = plan.metrics;
    let open = rows.iter().filter(|row| !row.converged).count();
    let has = |measure| plan.measures.contains(&measure);
    let parts = match has(Measure::Cosine) && (has(Measure::Steep) || has(Measure::Grazing)) {
        true => "; steep and grazing are not waited for beside cosine",
        false => "",
    };
    if max_pairs > pairs && open > 0 {
        let (all, percent) = (rows.len(), 100.0 * tolerance);
        note(&format!(
            "gonio: {open} of {all} rows have a standard error above {percent} % after up to {max_pairs} pairs \
             (metrics.max_pairs{parts}); the column `converged` says which"
        ));
    }
}

/// Notes how many errors are not far above what their truths may be off by.
fn note_truths(rows: &[&Row]) {
    let metric = Metric::Nrmse;
    let is_near = |row: &&&Row| {
        let both = metric.truth_error(row).zip(row.value(metric.name()));
        both.is_some_and(|(truth, error)| error < 2.0 * truth)
    };
    let near = rows.iter().filter(is_near).count();
    if near > 0 {
        let (name, all) = (metric.name(), rows.len());
        note(&format!(
            "gonio: the {name} of {near} of {all} rows is below twice the standard error of a truth from random paths \
             (the column truth_{name}); more paths and rays make it smaller"
        ));
    }
}

/// Writes schedules and slices where `[output]` asks for them, and draws materials for the report.
struct Asked<'a> {
    plan: &'a Plan,
    folder: &'a RefCell<Folder>,
    /// Where materials are drawn, if they are.
    studio: Option<Studio<'a>>,
    stop: Arc<AtomicBool>,
}

impl Asked<'_> {
    /// The file of a schedule.
    fn schedule(&self, key: &crate::experiment::ScheduleKey<'_>) -> Option<String> {
        let format = self.plan.output.schedules.0?;
        Some(format!("{}.{}", schedule_stem(key), format.extension()))
    }
}

impl Observer<Row> for Asked<'_> {
    fn requests(&self, wish: &ByProduct<'_>) -> bool {
        let folder = self.folder.borrow();
        match *wish {
            ByProduct::Schedule(key) => {
                let name = self.schedule(key);
                name.is_some_and(|name| !folder.has(Below::Schedules, &name))
            }
            ByProduct::Reconstruction(job) if self.plan.output.slices => {
                !folder.has(Below::Slices, &slice_name(job))
            }
            ByProduct::Material(position, material, key) => {
                let mut studio = self.studio.iter();
                studio.any(|studio| studio.requests(&folder, position, material, key))
            }
            _ => false,
        }
    }

    fn observe(&mut self, event: &Event<'_, Row>) -> Result<(), Error> {
        let mut folder = self.folder.borrow_mut();
        match *event {
            Event::Planned(key, schedule, itinerary) => {
                let format = self.plan.output.schedules.0;
                let write = format.and_then(|f| f.write_schedule);
                let Some((write, name)) = write.zip(self.schedule(key)) else {
                    return Ok(());
                };
                folder.write_below(Below::Schedules, &name, |out| {
                    write(schedule, itinerary.into(), out)
                })
            }
            Event::Reconstructed(job, truth, copy) if self.plan.output.slices => {
                let name = slice_name(job);
                folder.write_below(Below::Slices, &name, |out| write_slice(truth, copy, out))
            }
            Event::Loaded(material, key, brdf) => {
                let stopped = || self.stop.load(Ordering::SeqCst);
                let mut studio = self.studio.iter_mut();
                studio.try_for_each(|studio| {
                    studio.material(&mut folder, material, brdf, key, &stopped)
                })
            }
            _ => Ok(()),
        }
    }
}
