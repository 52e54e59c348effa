//! `gonio symmetry`.

use super::brdf_args::BrdfArgs;
use super::{ThreadArgs, build, print};
use crate::analysis::{self, Deviation, Deviations, SYMMETRY_TOLERANCE};
use crate::brdf::{Brdf, Channels};
use crate::error::Error;
use crate::experiment::Material;
use crate::geometry::Symmetry;
use crate::report::Columns;
use clap::Args;

#[derive(Debug, Args)]
pub(super) struct SymmetryArgs {
    #[command(flatten)]
    brdf: BrdfArgs,
    #[command(flatten)]
    threads: ThreadArgs,
    /// Relative and pairwise error up to which a symmetry holds, in (0, 1]
    #[arg(long, value_name = "X", default_value_t = SYMMETRY_TOLERANCE)]
    tolerance: f64,
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
        let mut violations = Vec::new();
        for (i, material) in plan.materials.iter().enumerate() {
            let brdf = build(material, plan.seen_in(Channels::Luminance))?;
            let laws = laws(material.symmetry, &analysis::deviations(&*brdf, &pairs));
            let gap = if i > 0 { "\n" } else { "" };
            let text = self.sheet(material, &*brdf, &laws);
            print(&format!("{gap}{text}"))?;
            let broken = |law: &&Law| law.declared && !law.found.holds(self.tolerance);
            for law in laws.iter().filter(broken) {
                violations.push(format!("{} is declared {}", material.name, law.name));
            }
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

    /// The report on one material.
    fn sheet(&self, material: &Material, brdf: &dyn Brdf, laws: &[Law; 3]) -> String {
        let favours = material.spec.favours();
        let mut text = format!(
            "{}\n  favours {}: {}\n",
            material.name,
            favours.name(),
            favours.reason()
        );
        text += &match analysis::alignment(brdf) {
            Some(a) => format!(
                "  alignment q = {:.3} ± {:.3} (0: theta_h, 1: |h_bar|), half width {:.3}°, {} of 13 slices\n",
                // No "-0.000".
                if a.q.abs() < 5e-4 { 0.0 } else { a.q },
                a.standard_error,
                a.half_width.to_degrees(),
                a.slices
            ),
            None => "  alignment: no lobe about the mirror direction\n".into(),
        };
        let mut columns = Columns::new(
            "  symmetry\tdeclared\t>relative\t>pairwise\t>max log\t>compared\t>missing\tholds",
        );
        for law in laws {
            let Deviation {
                relative,
                pairwise,
                max_log,
                compared,
                missing,
                one_sided,
            } = law.found;
            columns.row(&format!(
                "  {}\t{}\t{}\t{}\t{}\t{compared}\t{}\t{}",
                law.name,
                yes(law.declared),
                short(relative),
                short(pairwise),
                short(max_log),
                missing + one_sided,
                yes(law.found.holds(self.tolerance))
            ));
        }
        text += &columns.to_string();
        let [isotropic, reciprocal, bilateral] =
            laws.each_ref().map(|l| l.found.holds(self.tolerance));
        let holding = Symmetry {
            isotropic,
            reciprocal,
            bilateral,
        };
        text += "  what those that hold leave to be measured:\n";
        for saving in analysis::savings(holding) {
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
