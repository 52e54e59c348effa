//! What a run did, for `--explain`.

use crate::error::count;
use crate::experiment::{Counts, Seconds, Stage, Work};

/// What a run did, and what it had no need to do.
pub(super) struct Explained<'a> {
    pub(super) counts: &'a Counts,
    pub(super) seconds: &'a Seconds,
    /// Rows that were made, and rows that were known before.
    pub(super) rows: [usize; 2],
    /// What the config does not ask for: a name, and by which key.
    pub(super) left_out: Vec<(&'static str, String)>,
}

impl Explained<'_> {
    /// A line for each kind of work of each stage, and one for each thing that was left out.
    pub(super) fn text(&self) -> String {
        let mut out = String::from("\nwhat was done\n");
        for stage in Stage::ALL {
            let of = |work: &Work| self.counts.get(stage, *work);
            let seconds = format!("{:.3} s", self.seconds.of(stage));
            let mut head = [stage.name(), &seconds];
            for work in Work::ALL.iter().filter(|work| of(work) > 0) {
                let [name, seconds] = std::mem::take(&mut head);
                let (number, what) = (of(work), work.meaning());
                out += &format!("  {name:<12}{seconds:>12}{number:>15}  {what}\n");
            }
        }
        let [made, known] = self.rows.map(|n| count(n, "row"));
        out += &format!("  {made} made, {known} known before\n");
        if !self.left_out.is_empty() {
            out += "what was left out\n";
        }
        for (name, why) in &self.left_out {
            out += &format!("  {name:<12}{why}\n");
        }
        out
    }
}
