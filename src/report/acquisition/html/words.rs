//! Numbers and verdicts as texts.

use super::super::findings::p_text;
use crate::statistics::{Paired, Verdict};

/// The verdict of a comparison, and the p that leaves it undecided.
pub(super) fn said(cell: &Paired) -> String {
    match (cell.verdict(), cell.p) {
        (Verdict::Undecided, None) => "undecided, too few for a p".into(),
        (Verdict::Undecided, p) => format!("undecided, p {}", p_text(p)),
        (verdict, _) => verdict.to_string(),
    }
}

/// A ratio with enough digits to differ from 1.
pub(super) fn number(ratio: f64) -> String {
    match ratio {
        r if (r - 1.0).abs() < 0.05 => format!("{r:.3}"),
        r if (0.01..10.0).contains(&r) => format!("{r:.2}"),
        r if (10.0..1e4).contains(&r) => format!("{r:.0}"),
        r => format!("{r:.1e}"),
    }
}
