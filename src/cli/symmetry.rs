//! `gonio symmetry`.

use super::{BrdfArgs, JsonArgs, Progress, ThreadArgs, build, print, print_json};
use crate::analysis::{self, Deviation, Deviations, SYMMETRY_TOLERANCE, Saving};
use crate::brdf::{Brdf, Channels, Favours};
use crate::error::Error;
use crate::experiment::Material;
use crate::report::Columns;
use clap::Args;
use serde::Serialize;

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
            let message = format!(
                "{} is no tolerance; allowed: a number in (0, 1]",
                self.tolerance
            );
            return Err(Error::config("--tolerance", message));
        }
        let plan = self.brdf.plan()?;
        let pairs = analysis::symmetry_pairs();
        let (mut violations, mut sheets) = (Vec::new(), Vec::new());
        let mut progress = Progress::with_work(plan.materials.len() as u64, "");
        for (i, material) in plan.materials.iter().enumerate() {
            progress.doing(|| material.name.clone());
            let brdf = build(material, plan.seen_in(Channels::Luminance))?;
            let found = analysis::deviations(&*brdf, &pairs);
            let sheet = Sheet::new(material, &*brdf, &found, self.tolerance);
            if self.json.wanted() {
                sheets.push(serde_json::to_value(&sheet).map_err(Error::internal)?);
            } else {
                let gap = if i > 0 { "\n" } else { "" };
                progress.suspend(|| print(&format!("{gap}{}", sheet.text())))?;
            }
            for row in sheet.symmetries.iter().filter(|r| r.declared && !r.holds) {
                violations.push(format!("{} is declared {}", material.name, row.symmetry));
            }
            progress.advance(1.0);
        }
        drop(progress);
        if self.json.wanted() {
            print_json(&sheets)?;
        }
        if violations.is_empty() {
            return Ok(());
        }
        Err(Error::Violation(format!(
            "{}, but the error is above the tolerance of {}",
            violations.join("; "),
            self.tolerance
        )))
    }
}

/// The report on one material.
#[derive(Serialize)]
struct Sheet<'a> {
    material: &'a str,
    favours: &'static str,
    favours_because: &'static str,
    /// Left out where there is no lobe about the mirror direction.
    alignment: Option<Aligned>,
    symmetries: [Row; 3],
    savings: Vec<Saving>,
}

#[derive(Serialize)]
struct Aligned {
    q: f64,
    standard_error: f64,
    half_width_deg: f64,
    slices: usize,
}

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

impl Row {
    fn new(symmetry: &'static str, declared: bool, found: Deviation, tolerance: f64) -> Self {
        Self {
            symmetry,
            declared,
            relative: found.relative,
            pairwise: found.pairwise,
            max_log: found.max_log.is_finite().then_some(found.max_log),
            compared: found.compared,
            missing: found.missing + found.one_sided,
            holds: found.holds(tolerance),
        }
    }
}

impl<'a> Sheet<'a> {
    fn new(material: &'a Material, brdf: &dyn Brdf, found: &Deviations, tolerance: f64) -> Self {
        let declared = material.spec.favours();
        let aligned = analysis::alignment(brdf);
        let favours = aligned.map_or(declared, |a| declared.measured(a.q, a.standard_error));
        let alignment = aligned.map(|a| Aligned {
            q: a.q,
            standard_error: a.standard_error,
            half_width_deg: a.half_width.to_degrees(),
            slices: a.slices,
        });
        let declared = material.symmetry;
        let symmetries = [
            ("isotropic", declared.isotropic, found.isotropy),
            ("reciprocal", declared.reciprocal, found.reciprocity),
            ("bilateral", declared.bilateral, found.bilateral),
        ]
        .map(|(name, declared, found)| Row::new(name, declared, found, tolerance));
        Self {
            material: &material.name,
            favours: favours.name(),
            favours_because: favours.summary(),
            alignment,
            symmetries,
            savings: analysis::savings(found.holding(tolerance)),
        }
    }

    fn text(&self) -> String {
        let mut text = format!(
            "{}\n  favours {}: {}\n",
            self.material, self.favours, self.favours_because
        );
        if self.favours == Favours::Reconstruction.name() {
            text += "  the symmetries that it declares were imposed on its readings\n";
        }
        text += &match &self.alignment {
            Some(a) => format!(
                "  alignment q = {:.3} ± {:.3} (0: theta_h, 1: |h_bar|), half width {:.3}°, {} of 13 slices\n",
                // No "-0.000".
                if a.q.abs() < 5e-4 { 0.0 } else { a.q },
                a.standard_error,
                a.half_width_deg,
                a.slices
            ),
            None => "  alignment: no lobe about the mirror direction\n".into(),
        };
        let mut columns = Columns::new(
            "  symmetry\tdeclared\t>relative\t>pairwise\t>max log\t>compared\t>missing\tholds",
        );
        for row in &self.symmetries {
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
        for saving in &self.savings {
            let share = match saving.copies {
                1 => "all of it".into(),
                n => format!("1/{n}: {}", saving.folds.join(", ")),
            };
            text += &format!(
                "    {:<16} {}-D, {share}\n",
                saving.parametrization, saving.dimensions
            );
        }
        text
    }
}

fn yes(is: bool) -> &'static str {
    if is { "yes" } else { "no" }
}

/// Two digits are enough for an error.
fn short(value: f64) -> String {
    match value {
        0.0 => "0".into(),
        v if (0.001..100.0).contains(&v) => format!("{v:.4}"),
        v => format!("{v:.1e}"),
    }
}
