//! Rows along routes: one for all materials, or one for each.

use super::super::counts::Stage;
use super::super::observer::{Event, ScheduleKey, Stop, timed};
use super::super::route::{NoRoute, Route};
use super::super::row::Row;
use super::super::unit::Unit;
use super::{Member, Runner, Task};

impl<'a> Runner<'a> {
    /// Tells that nothing comes of a schedule for some materials.
    pub(super) fn lose(
        &mut self,
        members: &[&Member<'_>],
        unit: &Unit,
        tasks: &[Task],
        text: &str,
        reason: &NoRoute,
    ) -> Result<(), Stop> {
        for member in members {
            let job = format!("{}, {text}", member.material.name);
            self.teller.failed(job, reason, tasks.len())?;
        }
        let lost = (members.len() * tasks.len()) as f64;
        self.teller.advanced(lost * unit.work())
    }

    /// Rows of a planner that learns: each material has a schedule of its own.
    pub(super) fn learn(
        &mut self,
        members: &[&Member<'_>],
        schedule: &ScheduleKey<'a>,
        unit: &Unit,
        tasks: &[Task],
        text: &str,
    ) -> Result<Vec<Row>, Stop> {
        let mut made = Vec::new();
        if members.is_empty() {
            return Ok(made);
        }
        let observer = &*self.teller.observer;
        let begun = match self.router.begin(schedule, &|| observer.cancelled())? {
            Ok(begun) => begun,
            Err(reason) => {
                self.lose(members, unit, tasks, text, &reason)?;
                return Ok(made);
            }
        };
        for member in members {
            let Some(truth) = &member.truth else {
                continue;
            };
            let name = &member.material.name;
            self.teller
                .doing(&format_args!("acquiring {name}, {text}"))?;
            let observer = &*self.teller.observer;
            let course = self.router.course(schedule, name);
            let (found, seconds) = timed(|| {
                let brdf = truth.brdf.at(&self.teller.ledger, Stage::Plan);
                begun.route(&brdf, course, &|| observer.cancelled())
            });
            self.teller.summary.seconds.plan += seconds;
            let found = found?;
            let route = match found {
                Ok(route) => route,
                Err(reason) => {
                    self.lose(&[member], unit, tasks, text, &reason)?;
                    continue;
                }
            };
            let own = ScheduleKey {
                material: Some(member.material),
                ..*schedule
            };
            let event = Event::Planned(&own, &route.schedule, route.itinerary());
            self.teller.observer.tell(&event)?;
            made.extend(self.follow(&[member], &own, &route, (unit, tasks, text))?);
        }
        Ok(made)
    }

    /// Measures materials along a route, and makes every reconstruction.
    pub(super) fn follow(
        &mut self,
        members: &[&Member<'_>],
        schedule: &ScheduleKey<'_>,
        route: &Route,
        (unit, tasks, text): (&Unit, &[Task], &str),
    ) -> Result<Vec<Row>, Stop> {
        let mut made = Vec::new();
        let groups = self.measure(members, schedule, route, text)?;
        for task in tasks {
            for group in &groups {
                let rows = self.reconstruct(schedule, route, group, unit, task, text)?;
                self.teller.made(&rows)?;
                made.extend(rows);
                self.teller
                    .advanced(group.members.len() as f64 * unit.work())?;
            }
        }
        Ok(made)
    }
}
