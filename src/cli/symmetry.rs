//! `gonio symmetry`.

use super::brdf_args::BrdfArgs;
use super::output::{JsonArgs, print_json};
use super::progress::Progress;
use super::{ThreadArgs, build, print};
use crate::analysis::{self, Deviation, Deviations, SYMMETRY_TOLERANCE};
use crate::brdf::{Brdf, Channels, Favours};
use crate::error::Error;
use crate::experiment::Material;
use crate::geometry::Symmetry;
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
        let source = self.brdf.source()?;
        let plan = self.brdf.plan(&source)?;
        let pairs = analysis::symmetry_pairs();
        let (mut violations, mut sheets) = (Vec::new(), Vec::new());
        let mut progress = Progress::of(plan.materials.len() as u64, "");
        for (i, material) in plan.materials.iter().enumerate() {
            progress.doing(|| material.name.clone());
            let brdf = build(material, plan.seen_in(Channels::Luminance))?;
            let laws = laws(material.symmetry, &analysis::deviations(&*brdf, &pairs));
            let sheet = Sheet::new(material, &*brdf, &laws, self.tolerance);
            if self.json.wanted() {
                sheets.push(
                    serde_json::to_value(&sheet).map_err(|e| Error::Internal(e.to_string()))?,
                );
            } else {
                let gap = if i > 0 { "\n" } else { "" };
                progress.suspend(|| print(&format!("{gap}{}", sheet.text())))?;
            }
            let broken = |law: &&Law| law.declared && !law.found.holds(self.tolerance);
            for law in laws.iter().filter(broken) {
                violations.push(format!("{} is declared {}", material.name, law.name));
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
    symmetries: Vec<Row>,
    savings: Vec<Saved>,
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

/// What the symmetries that hold leave to be measured.
#[derive(Serialize)]
struct Saved {
    parametrization: &'static str,
    dimensions: usize,
    copies: usize,
    folds: Vec<String>,
}

impl<'a> Sheet<'a> {
    fn new(material: &'a Material, brdf: &dyn Brdf, laws: &[Law; 3], tolerance: f64) -> Self {
        let favours = material.spec.favours();
        let alignment = analysis::alignment(brdf).map(|a| Aligned {
            q: a.q,
            standard_error: a.standard_error,
            half_width_deg: a.half_width.to_degrees(),
            slices: a.slices,
        });
        let symmetries = laws.iter().map(|law| {
            let Deviation {
                relative,
                pairwise,
                max_log,
                compared,
                missing,
                one_sided,
            } = law.found;
            Row {
                symmetry: law.name,
                declared: law.declared,
                relative,
                pairwise,
                max_log: max_log.is_finite().then_some(max_log),
                compared,
                missing: missing + one_sided,
                holds: law.found.holds(tolerance),
            }
        });
        let [isotropic, reciprocal, bilateral] = laws.each_ref().map(|l| l.found.holds(tolerance));
        let holding = Symmetry {
            isotropic,
            reciprocal,
            bilateral,
        };
        let savings = analysis::savings(holding).into_iter().map(|saving| Saved {
            parametrization: saving.parametrization,
            dimensions: saving.dimensions,
            copies: saving.copies,
            folds: saving.folds,
        });
        Self {
            material: &material.name,
            favours: favours.name(),
            favours_because: favours.reason(),
            alignment,
            symmetries: symmetries.collect(),
            savings: savings.collect(),
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

/// One symmetry of a material.
struct Law {
    name: &'static str,
    declared: bool,
    found: Deviation,
}

fn laws(declared: Symmetry, found: &Deviations) -> [Law; 3] {
    [
        ("isotropic", declared.isotropic, found.isotropy),
        ("reciprocal", declared.reciprocal, found.reciprocity),
        ("bilateral", declared.bilateral, found.bilateral),
    ]
    .map(|(name, declared, found)| Law {
        name,
        declared,
        found,
    })
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
