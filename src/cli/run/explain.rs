//! What a run did, for `--explain`.

use crate::error::count;
use crate::experiment::{Counts, Stage, Work};
use std::collections::BTreeMap;

/// What a run did, and what it had no need to do: a line for each kind of work of each stage, and one for each thing that
/// was left out and why. `rows` are those that were made, and those that were known before.
pub(super) fn explained(
    counts: &Counts,
    seconds_of: &BTreeMap<String, f64>,
    rows: [usize; 2],
    left_out: &[(&'static str, String)],
) -> String {
    let mut out = String::from("\nwhat was done\n");
    for stage in Stage::ALL {
        let of = |work: &Work| counts.get(stage, *work);
        let seconds = format!("{:.3} s", seconds_of[stage.name()]);
        let mut head = [stage.name(), &seconds];
        for work in Work::ALL.iter().filter(|work| of(work) > 0) {
            let [name, seconds] = std::mem::take(&mut head);
            let (number, what) = (of(work), work.summary());
            out += &format!("  {name:<12}{seconds:>12}{number:>15}  {what}\n");
        }
    }
    let [made, known] = rows.map(|n| count(n, "row"));
    out += &format!("  {made} made, {known} known before\n");
    if !left_out.is_empty() {
        out += "what was left out\n";
    }
    for (name, why) in left_out {
        out += &format!("  {name:<12}{why}\n");
    }
    out
}
