//! `gonio claims`.

use super::{BrdfArgs, OutputArgs, ThreadArgs, note};
use crate::analysis;
use crate::error::Error;
use crate::report::{claims_csv, claims_json, claims_table};
use clap::Args;

#[derive(Debug, Args)]
pub(super) struct Claims {
    /// The materials to judge the claims on materials by: a config (*.toml), a MERL table (*.binary), a
    /// folder of them, or a kind of material; left out, only what needs no material is judged
    #[arg(value_name = "CONFIG|BRDF")]
    target: Option<String>,
    /// Override a key of the config, or set one of the material (alpha=0.1)
    #[arg(long = "set", value_name = "KEY=VALUE", requires = "target")]
    set: Vec<String>,
    /// Only this material of the config, by its name
    #[arg(long, value_name = "NAME", requires = "target")]
    material: Option<String>,
    #[command(flatten)]
    threads: ThreadArgs,
    #[command(flatten)]
    output: OutputArgs,
}

impl Claims {
    pub(super) fn run(self) -> Result<(), Error> {
        self.threads.apply()?;
        self.output.check()?;
        let failed = |e| Error::Internal(format!("claims: {e}"));
        let mut claims = analysis::on_test_functions().map_err(failed)?;
        let outcome = match self.target.clone() {
            Some(target) => {
                let brdf = BrdfArgs::new(target, self.set.clone(), self.material.clone());
                brdf.each(self.output.place(), |material, brdf| {
                    claims.extend(analysis::on_material(&material.name, brdf).map_err(failed)?);
                    Ok(())
                })
            }
            None => {
                let why = "no material named, so the claims on materials are left out";
                note(&format!("gonio: {why}: gonio claims CONFIG|BRDF"));
                Ok(())
            }
        };
        claims.extend(analysis::on_materials(&claims));
        // Rows of the materials that could be built are worth keeping.
        if matches!(outcome, Ok(()) | Err(Error::JobsFailed { .. })) {
            self.output
                .write(&claims[..], claims_table, claims_csv, claims_json)?;
        }
        outcome
    }
}
