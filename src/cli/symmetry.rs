//! `gonio symmetry`.

use super::{BrdfArgs, JsonArgs, Progress, ThreadArgs, build, print, print_json};
use crate::analysis::{self, Deviations, SYMMETRY_TOLERANCE};
use crate::brdf::{Brdf, Channels, Favours};
use crate::error::Error;
use crate::experiment::Material;
use crate::geometry::Symmetry;
use crate::report::Columns;
use clap::Args;
use serde::Serialize;
use serde_json::{Value as Json, json};

#[derive(Debug, Args)]
pub(super) struct SymmetryArgs {
    #[command(flatten)]
    brdf: BrdfArgs,
    #[command(flatten)]
    threads: ThreadArgs,
    /// Relative and pairwise error up to which a symmetry holds, in (0, 1]
    #[arg(long, value_name = "X", default_value_t = SYMMETRY_TOLERANCE)]
    tolerance: f64,
    #[command(flatten)]
    json: JsonArgs,
}

impl SymmetryArgs {
    pub(super) fn run(self) -> Result<(), Error> {
        self.threads.apply()?;
        if !(self.tolerance > 0.0 && self.tolerance <= 1.0) {
            let found = self.tolerance;
            let message = format!("{found} is no tolerance; allowed: a number in (0, 1]");
            return Err(Error::config("--tolerance", message));
        }
        let plan = self.brdf.plan()?;
        let pairs = analysis::symmetry_pairs();
        let (mut violations, mut sheets) = (Vec::new(), Vec::new());
        Progress::over(&plan.materials, |material, progress| {
            let brdf = build(material, plan.seen_in(Channels::Luminance))?;
            let found = analysis::deviations(&*brdf, &pairs);
            let rows = rows(material.symmetry, &found, self.tolerance);
            let (text, object) = sheet(material, &*brdf, &rows, found.holding(self.tolerance));
            if !self.json.wanted() {
                let gap = if sheets.is_empty() { "" } else { "\n" };
                progress.suspend(|| print(&format!("{gap}{text}")))?;
            }
            sheets.push(object);
            for row in rows.iter().filter(|r| r.declared && !r.holds) {
                violations.push(format!("{} is declared {}", material.name, row.symmetry));
            }
            Ok(())
        })?;
        if self.json.wanted() {
            print_json(&sheets)?;
        }
        if violations.is_empty() {
            return Ok(());
        }
        let (violations, most) = (violations.join("; "), self.tolerance);
        Err(Error::Violation(format!(
            "{violations}, but the error is above the tolerance of {most}"
        )))
    }
}

/// What was found of a symmetry.
#[derive(Serialize)]
struct Row {
    symmetry: &'static str,
    declared: bool,
    relative: f64,
    pairwise: f64,
    /// Left out where one of two values is 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    max_log: Option<f64>,
    compared: usize,
    missing: usize,
    holds: bool,
}

/// The symmetries, each with whether it is declared and whether it holds.
fn rows(declared: Symmetry, found: &Deviations, tolerance: f64) -> [Row; 3] {
    [
        ("isotropic", declared.isotropic, found.isotropy),
        ("reciprocal", declared.reciprocal, found.reciprocity),
        ("bilateral", declared.bilateral, found.bilateral),
    ]
    .map(|(symmetry, declared, found)| Row {
        symmetry,
        declared,
        relative: found.relative,
        pairwise: found.pairwise,
        max_log: found.max_log.is_finite().then_some(found.max_log),
        compared: found.compared,
        missing: found.missing + found.one_sided,
        holds: found.holds(tolerance),
    })
}

/// The report on one material, with the symmetries that hold, for people, and for programs.
fn sheet(
    material: &Material,
    brdf: &dyn Brdf,
    rows: &[Row; 3],
    holding: Symmetry,
) -> (String, Json) {
    let declared = material.spec.favours();
    let aligned = analysis::alignment(brdf);
    let favours = aligned.map_or(declared, |a| declared.measured(a.q, a.standard_error));
    let (name, because) = (favours.name(), favours.summary());
    let mut text = format!("{}\n  favours {name}: {because}\n", material.name);
    if favours == Favours::Reconstruction {
        text += "  the symmetries that it declares were imposed on its readings\n";
    }
    // Left out where there is no lobe about the mirror direction.
    let mut alignment = Json::Null;
    text += &match aligned {
        Some(a) => {
            let half_width = a.half_width.to_degrees();
            alignment = json!({
                "q": a.q,
                "standard_error": a.standard_error,
                "half_width_deg": half_width,
                "slices": a.slices,
            });
            format!(
                "  alignment q = {:.3} ± {:.3} (0: theta_h, 1: |h_bar|), half width {half_width:.3}°, {} of 13 slices\n",
                // No "-0.000".
                if a.q.abs() < 5e-4 { 0.0 } else { a.q },
                a.standard_error,
                a.slices
            )
        }
        None => "  alignment: no lobe about the mirror direction\n".into(),
    };
    let mut columns = Columns::new(
        "  symmetry\tdeclared\t>relative\t>pairwise\t>max log\t>compared\t>missing\tholds",
    );
    let yes = |is: bool| if is { "yes" } else { "no" };
    for row in rows {
        columns.row(&format!(
            "  {}\t{}\t{}\t{}\t{}\t{}\t{}\t{}",
            row.symmetry,
            yes(row.declared),
            short(row.relative),
            short(row.pairwise),
            row.max_log.map_or("none".into(), short),
            row.compared,
            row.missing,
            yes(row.holds)
        ));
    }
    text += &columns.to_string();
    text += "  what those that hold leave to be measured:\n";
    let savings = analysis::savings(holding);
    for saving in &savings {
        let share = match saving.copies {
            1 => "all of it".into(),
            n => format!("1/{n}: {}", saving.folds.join(", ")),
        };
        let (name, dimensions) = (saving.parametrization, saving.dimensions);
        text += &format!("    {name:<16} {dimensions}-D, {share}\n");
    }
    let object = json!({
        "material": material.name,
        "favours": name,
        "favours_because": because,
        "alignment": alignment,
        "symmetries": rows,
        "savings": savings,
    });
    (text, object)
}

/// Two digits are enough for an error.
fn short(value: f64) -> String {
    match value {
        0.0 => "0".into(),
        v if (0.001..100.0).contains(&v) => format!("{v:.4}"),
        v => format!("{v:.1e}"),
    }
}
