//! `gonio completions` and `gonio man`: what the command line says of itself.

use super::list::{self, Family};
use super::{Cli, make_folder, print, refuse_existing, text, write_file};
use crate::error::Error;
use clap::builder::PossibleValuesParser;
use clap::{Arg, Args, Command, CommandFactory};
use clap_complete::Shell;
use clap_mangen::Man;
use std::io::Write;
use std::path::{Path, PathBuf};

#[derive(Debug, Args)]
#[command(after_help = "\
  gonio completions bash > ~/.local/share/bash-completion/completions/gonio
  gonio completions zsh > \"${fpath[1]}/_gonio\"
  gonio completions fish > ~/.config/fish/completions/gonio.fish")]
pub(super) struct Completions {
    /// The shell they are for
    shell: Shell,
}

impl Completions {
    pub(super) fn run(self) -> Result<(), Error> {
        let mut command = with_names(Cli::command(), self.shell);
        let mut bytes = Vec::new();
        clap_complete::generate(self.shell, &mut command, "gonio", &mut bytes);
        let mut script = text(bytes)?;
        if self.shell == Shell::Zsh {
            for family in [Family::Materials, Family::Instruments] {
                let names = format!("({})", list::names(family).join(" "));
                let both = format!("{{_alternative \"names:name:{names}\" \"files:file:_files\"}}");
                script = script.replace(&names, &both);
            }
        }
        print(&script)
    }
}

/// The command with the names of members of registries as values of its arguments, for completion alone.
fn with_names(command: Command, shell: Shell) -> Command {
    let command = command.mut_args(|arg| match family(&arg) {
        // Bash completes files where no name matches, the script of zsh is changed for it; others would complete names alone.
        Some((_, true)) if !matches!(shell, Shell::Bash | Shell::Zsh) => arg,
        Some((family, _)) => arg.value_parser(PossibleValuesParser::new(list::names(family))),
        None => arg,
    });
    command.mut_subcommands(|inner| with_names(inner, shell))
}

/// The family that an argument takes a member of, and whether it takes files as well.
fn family(arg: &Arg) -> Option<(Family, bool)> {
    let of_id = match arg.get_id().as_str() {
        "parametrization" => Some(Family::Parametrizations),
        "reconstruction" => Some(Family::Reconstructions),
        "sample_set" => Some(Family::SampleSets),
        "planner" => Some(Family::Planners),
        _ => None,
    };
    let value = arg.get_value_names().and_then(|names| names.first());
    let of_value = value.and_then(|value| match value.as_str() {
        "NAME|FILE" => Some(Family::Instruments),
        value if value.starts_with("CONFIG") => Some(Family::Materials),
        _ => None,
    });
    let named = of_id.map(|family| (family, false));
    named.or_else(|| of_value.map(|family| (family, true)))
}

#[derive(Debug, Args)]
#[command(after_help = "\
  gonio man | man -l -
  gonio man -o ~/.local/share/man/man1")]
pub(super) struct ManPages {
    /// Write a page a command into this folder instead of printing the first
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Replace files that exist
    #[arg(long, requires = "output")]
    force: bool,
}

impl ManPages {
    pub(super) fn run(self) -> Result<(), Error> {
        let mut command = Cli::command();
        command.build();
        let Some(dir) = &self.output else {
            return print(&text(page(&command)?)?);
        };
        let mut pages = Vec::new();
        collect(&command, dir, &mut pages)?;
        for (path, _) in &pages {
            refuse_existing(path, self.force)?;
        }
        make_folder(dir)?;
        pages
            .iter()
            .try_for_each(|(path, bytes)| write_file(path, |out| out.write_all(bytes)))
    }
}

/// The pages of a command and of those below it; `gonio help …` says what `--help` does.
fn collect(
    command: &Command,
    dir: &Path,
    pages: &mut Vec<(PathBuf, Vec<u8>)>,
) -> Result<(), Error> {
    let name = command.get_display_name().unwrap_or(command.get_name());
    pages.push((dir.join(format!("{name}.1")), page(command)?));
    for inner in command.get_subcommands() {
        if inner.get_name() != "help" {
            collect(inner, dir, pages)?;
        }
    }
    Ok(())
}

fn page(command: &Command) -> Result<Vec<u8>, Error> {
    let mut bytes = Vec::new();
    let man = Man::new(command.clone());
    man.render(&mut bytes).map_err(Error::internal)?;
    Ok(bytes)
}
