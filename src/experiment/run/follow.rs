//! Rows along routes: one for all materials, or one for each.

use super::super::counts::Stage;
use super::super::observer::{Event, ScheduleKey, Stop};
use super::super::route::Route;
use super::super::row::Row;
use super::{Batch, Member, Runner};

impl Runner<'_> {
    /// A route; where there is none, emits the failure of the jobs of its batch.
    pub(super) fn or_lost<T>(
        &mut self,
        found: Result<T, Stop>,
        batch: &Batch<'_>,
    ) -> Result<Option<T>, Stop> {
        let name = |m: &&Member<'_>| format!("{}, {}", m.material.name, batch.schedule);
        let names = batch.members.iter().map(name);
        let found = self.events.or_failed(found, names, batch.tasks.len())?;
        if found.is_none() {
            self.events.advanced(batch.work(batch.members.len()))?;
        }
        Ok(found)
    }

    /// Rows of a planner that learns: each material has a schedule of its own.
    pub(super) fn learn(&mut self, batch: &Batch<'_>) -> Result<Vec<Row>, Stop> {
        let (mut made, schedule) = (Vec::new(), &batch.schedule);
        if batch.members.is_empty() {
            return Ok(made);
        }
        let events = &self.events;
        let begun = self.router.begin(schedule, &|| events.go_on());
        let Some(begun) = self.or_lost(begun, batch)? else {
            return Ok(made);
        };
        for &member in &batch.members {
            let Some(truth) = &member.truth else {
                continue;
            };
            let name = &member.material.name;
            self.events
                .doing(&format_args!("acquiring {name}, {schedule}"))?;
            let events = &self.events;
            let course = self.router.course(schedule, name);
            let (found, _) = events.counters.timed(Stage::Plan, || {
                let brdf = truth.brdf.counted_at(&events.counters, Stage::Plan);
                begun.route(&brdf, course, &|| events.go_on())
            });
            let own = Batch {
                schedule: ScheduleKey {
                    material: Some(member.material),
                    ..*schedule
                },
                members: vec![member],
                ..*batch
            };
            let Some(route) = self.or_lost(found, &own)? else {
                continue;
            };
            let event = Event::Planned(&own.schedule, &route.schedule, route.itinerary());
            self.events.observer.observe(&event)?;
            made.extend(self.follow(&own, &route)?);
        }
        Ok(made)
    }

    /// Measures materials along a route, and makes every reconstruction.
    pub(super) fn follow(&mut self, batch: &Batch<'_>, route: &Route) -> Result<Vec<Row>, Stop> {
        let mut made = Vec::new();
        let groups = self.measure(batch, route)?;
        for task in batch.tasks {
            for group in &groups {
                let rows = self.reconstruct(&batch.schedule, group, task)?;
                self.events.made(&rows)?;
                made.extend(rows);
                self.events
                    .advanced(group.members.len() as f64 * task.work)?;
            }
        }
        Ok(made)
    }
}
