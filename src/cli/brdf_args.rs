//! The argument CONFIG|BRDF of commands that look at materials.

use super::config_args::keys_of_material;
use super::{Progress, build, choose_material, detail, keep_named, say, set_below};
use crate::brdf::{Brdf, Channels};
use crate::error::{Error, excerpt, one_of};
use crate::experiment::moments::MomentsPlan;
use crate::experiment::{AnyPlan, Kind, Material, Source, materials};
use crate::formats::{self, READ_READINGS, READ_TABLE};
use clap::Args;
use std::path::Path;

/// Keys of a config of kind `moments` that `--set` does not take for keys of the BRDF.
const TABLES: [&str; 3] = ["moments", "seeds", "material"];

/// True if CONFIG|BRDF names a config.
pub(super) fn is_config(target: &str) -> bool {
    Path::new(target).extension().is_some_and(|e| e == "toml")
}

/// A config, or one material without a config.
#[derive(Debug, Args)]
pub(super) struct BrdfArgs {
    #[arg(value_name = "CONFIG|BRDF",
        help = format!("A config (*.toml), a table ({}), a folder of MERL tables, readings ({}), or a kind of material (see `gonio list materials`)",
            READ_TABLE.extensions("*."), READ_READINGS.extensions("*.")))]
    pub(super) target: String,
    /// Override a key of the config, or set one of the material (alpha=0.1) or of its moments
    /// (moments.views=30)
    #[arg(long = "set", value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Only this material of the config, by its name
    #[arg(long, value_name = "NAME")]
    material: Option<String>,
}

impl BrdfArgs {
    /// Arguments from their values, for commands where the target is optional.
    pub(super) fn new(target: String, set: Vec<String>, material: Option<String>) -> Self {
        Self {
            target,
            set,
            material,
        }
    }

    /// The config: the one that is named, or one that holds nothing but the material.
    pub(super) fn source(&self) -> Result<Source, Error> {
        let path = Path::new(&self.target);
        let of_keys = |keys: String| {
            let text = format!("experiment = \"moments\"\n{keys}\n");
            Source::new(self.target.as_str(), text)
        };
        let of_config = is_config(&self.target);
        let is_table = formats::of_file(path).is_some_and(|f| f.table.read.is_some());
        let of_dir = !is_table && path.is_dir();
        let mut source = match keys_of_material(path) {
            _ if of_config => {
                detail(|| format!("gonio: reads {}", path.display()));
                Source::read(path)?
            }
            _ if of_dir => {
                let dir = toml::Value::from(path.to_string_lossy().into_owned());
                of_keys(format!("materials_dir = {dir}"))
            }
            Some(keys) => of_keys(format!("\n[[material]]\n{keys}")),
            None => {
                let message = format!(
                    "this is neither a config (*.toml), a table ({}), a folder of them, readings ({}) nor \
                     a kind of material; allowed kinds: {}",
                    READ_TABLE.extensions("*."),
                    READ_READINGS.extensions("*."),
                    one_of(&self.target, materials().into_iter().map(|e| e.kind))
                );
                return Err(Error::config(excerpt(&self.target), message));
            }
        };
        set_below(&mut source, &self.set, |first| match first {
            first if of_config || TABLES.contains(&first) => "",
            _ if of_dir => "merl.",
            _ => "material.0.",
        })?;
        if !Kind::of_config(&source)?.has_profiles() {
            // Its own run may not want moments; this command does.
            source.set("quantities=[\"moments\"]", "quantities".into())?;
        }
        Ok(source)
    }

    /// The materials, each with its BRDF in luminance, or in the wavelengths of its scene: `visit` is called for one after the other.
    /// One that cannot be built is reported on stderr, and left out if there are others. Errors: what `visit` returns; the reason, if
    /// the only material cannot be built; else how many cannot.
    pub(super) fn each(
        &self,
        results: &Path,
        mut visit: impl FnMut(&Material, &dyn Brdf) -> Result<(), Error>,
    ) -> Result<(), Error> {
        let plan = self.plan()?;
        let (channels, materials) = (plan.seen_in(Channels::Luminance), plan.materials);
        let mut failed = 0;
        Progress::over(&materials, |material, progress| {
            match build(material, channels.clone()) {
                Ok(brdf) => visit(material, &*brdf)?,
                Err(e) if materials.len() == 1 => return Err(e),
                Err(e) => {
                    progress.suspend(|| say(&format!("gonio: {}: {e}", material.name)));
                    failed += 1;
                }
            }
            Ok(())
        })?;
        if failed == 0 {
            return Ok(());
        }
        Err(Error::JobsFailed {
            failed,
            jobs: materials.len(),
            path: results.to_owned(),
        })
    }

    /// The only material, and its BRDF in some channels, or in the wavelengths of its scene.
    pub(super) fn one(&self, channels: Channels) -> Result<(Material, Box<dyn Brdf>), Error> {
        let mut plan = self.plan()?;
        let material = choose_material(&plan.materials, None)?;
        let brdf = build(material, plan.seen_in(channels))?;
        Ok((plan.materials.swap_remove(0), brdf))
    }

    /// The materials and the settings of their moments.
    pub(super) fn plan(&self) -> Result<MomentsPlan, Error> {
        let mut plan = AnyPlan::read(&self.source()?)?.into_moments();
        let only = self.material.as_deref();
        keep_named("--material", only, &mut plan.materials, |m| &m.name)?;
        super::remark(&plan.materials);
        Ok(plan)
    }
}
