//! Ladder after ladder, with a guess beforehand how long it takes.

use super::{Effort, Ladder, Row, Section, Settings};
use crate::error::Error;

/// Observer of the progress of benches, which may stop them.
pub(crate) trait Listener {
    /// False if they shall stop; asked before every pass.
    fn go_on(&self) -> bool;

    /// A rung that was measured.
    ///
    /// # Errors
    /// Any error ends the benches.
    fn made(&mut self, task: &Task, row: &Row) -> Result<(), Error>;

    /// What cannot be measured, and why.
    fn left_out(&mut self, what: &str, why: &str);

    /// Seconds of the guess that are over.
    fn passed(&mut self, seconds: f64);
}

/// The ladders of a section.
pub(crate) struct Task {
    /// The section.
    pub section: &'static Section,
    effort: Effort,
    ladders: Vec<(Ladder, Vec<f64>)>,
}

impl Task {
    /// The ladders of a section, each tried once; as far as the listener lets it come.
    ///
    /// # Errors
    /// As [`Section::ladders`].
    pub(crate) fn new(
        section: &'static Section,
        settings: &Settings,
        listener: &mut dyn Listener,
    ) -> Result<Self, Error> {
        let effort = match settings.quick {
            true => Effort::QUICK,
            false => Effort::USUAL,
        };
        let mut ladders = Vec::new();
        for ladder in (section.ladders)(settings)? {
            if !listener.go_on() {
                break;
            }
            match ladder.seconds(effort) {
                Ok(seconds) => ladders.push((ladder, seconds)),
                Err(why) => listener.left_out(&ladder.names.join(" "), &why),
            }
        }
        Ok(Self {
            section,
            effort,
            ladders,
        })
    }

    /// Seconds that it takes, about.
    pub(crate) fn seconds(&self) -> f64 {
        self.ladders.iter().flat_map(|(_, s)| s).sum()
    }

    /// Names of all rows that it may make.
    pub(super) fn names(&self) -> impl Iterator<Item = Vec<&str>> {
        self.ladders.iter().flat_map(|(ladder, _)| {
            ladder.rungs.iter().map(|rung| {
                let names = ladder.names.iter().map(String::as_str);
                names.chain([rung.setting.as_str()]).collect()
            })
        })
    }

    /// Measures every rung, the cheapest of a ladder first; the rows so far if the listener stops it.
    ///
    /// # Errors
    /// Those of the listener.
    pub(crate) fn run(&self, listener: &mut dyn Listener) -> Result<Vec<Row>, Error> {
        let mut rows = Vec::new();
        for (ladder, seconds) in &self.ladders {
            let mut is_done = false;
            for (rung, seconds) in ladder.rungs.iter().zip(seconds) {
                if !listener.go_on() {
                    return Ok(rows);
                }
                if !is_done {
                    let mut names = ladder.names.clone();
                    names.push(rung.setting.clone());
                    match rung.run(self.effort, &|| listener.go_on()) {
                        Ok(ran) => {
                            is_done = ran.judged.is_last;
                            let row = Row {
                                names,
                                times: ran.times,
                                judged: ran.judged,
                            };
                            listener.made(self, &row)?;
                            rows.push(row);
                        }
                        Err(why) => listener.left_out(&names.join(" "), &why),
                    }
                }
                listener.passed(*seconds);
            }
        }
        Ok(rows)
    }
}
