//! `gonio completions` and `gonio man`: what the command line says of itself.

use super::list::{self, Family};
use super::reconstruct::AUTO;
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
        let script = text(bytes)?;
        print(&match self.shell {
            Shell::Bash => bash_with_files(&script),
            Shell::Zsh => zsh_with_files(&script),
            _ => script,
        })
    }
}

/// What an argument takes: names of members of registries, and files or not.
struct Taken {
    names: Vec<String>,
    files: bool,
}

impl Taken {
    /// What an argument takes of the command of this name; `None` if it is anything else.
    fn new(command: &str, arg: &Arg) -> Option<Self> {
        let value = || arg.get_value_names()?.first();
        let (mut names, files) = match arg.get_id().as_str() {
            "parametrization" | "error_map_in" => (list::names(Family::Parametrizations), false),
            "sample_set" => (list::names(Family::SampleSets), false),
            "planner" => (list::names(Family::Planners), false),
            "reconstruction" => (list::names(Family::Reconstructions), false),
            _ => match value()?.as_str() {
                "NAME|FILE" => (list::names(Family::Instruments), true),
                value if value.starts_with("CONFIG") => (list::kinds_alone(), true),
                _ => return None,
            },
        };
        match command {
            "check" if files => names.extend(list::names(Family::Instruments)),
            "reconstruct" if arg.get_id() == "reconstruction" => names.push(AUTO.into()),
            _ => {}
        }
        Some(Self { names, files })
    }

    /// The lists of names beside which there may be files, of a command and all below it.
    fn beside_files(command: &Command) -> Vec<String> {
        let arguments = command.get_arguments();
        let own = arguments.filter_map(|a| Self::new(command.get_name(), a));
        let own = own.filter(|taken| taken.files);
        let own = own.map(|taken| taken.names.join(" "));
        let below = command.get_subcommands().flat_map(Self::beside_files);
        let mut all: Vec<String> = own.chain(below).collect();
        all.sort();
        all.dedup();
        all
    }
}

/// The command with names of members of registries as values of its arguments, for completion alone.
fn with_names(command: Command, shell: Shell) -> Command {
    let name = command.get_name().to_owned();
    let command = command.mut_args(|arg| match Taken::new(&name, &arg) {
        // The scripts of these two are changed so that they complete files too; others would complete names alone.
        Some(taken) if taken.files && !matches!(shell, Shell::Bash | Shell::Zsh) => arg,
        Some(taken) => arg.value_parser(PossibleValuesParser::new(taken.names)),
        None => arg,
    });
    command.mut_subcommands(|inner| with_names(inner, shell))
}

/// Adds files to what begins as a word does.
const BASH_FILES: &str = r#"_gonio_files() {
    local file
    compopt -o filenames 2>/dev/null
    while IFS= read -r file; do COMPREPLY+=("${file}"); done < <(compgen -f -- "${cur}")
}

"#;

/// A script for bash that completes files beside names where an argument takes both.
fn bash_with_files(script: &str) -> String {
    let lists = Taken::beside_files(&Cli::command());
    let (mut out, mut of_files) = (BASH_FILES.to_owned(), false);
    for line in script.lines() {
        let has = || lists.iter().any(|names| line.contains(names));
        let code = line.trim_start();
        if code.starts_with("opts=") {
            of_files = has();
        }
        out += line;
        out += match code.starts_with("COMPREPLY=(") {
            true if code.contains("${opts}") && of_files => {
                "; [[ ${cur} == -* ]] || _gonio_files\n"
            }
            true if has() => "; _gonio_files\n",
            _ => "\n",
        };
    }
    out
}

/// A script for zsh that completes files beside names where an argument takes both.
fn zsh_with_files(script: &str) -> String {
    let (mut script, mut functions) = (script.to_owned(), String::new());
    for (i, names) in Taken::beside_files(&Cli::command()).iter().enumerate() {
        let function = format!("_gonio_{i}");
        script = script.replace(&format!("({names})"), &function);
        functions += &format!(
            "{function}() {{ _alternative 'names:name:({names})' 'files:file:_files' }}\n"
        );
    }
    // The first line says what the file completes.
    match script.split_once('\n') {
        Some((first, rest)) => format!("{first}\n\n{functions}{rest}"),
        None => script,
    }
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
        let pages = pages(&command, dir)?;
        for (path, _) in &pages {
            refuse_existing(path, self.force)?;
        }
        make_folder(dir)?;
        let mut pages = pages.iter();
        pages.try_for_each(|(path, bytes)| write_file(path, |out| out.write_all(bytes)))
    }
}

/// The pages of a command and of those below it; `gonio help …` says what `--help` does.
fn pages(command: &Command, dir: &Path) -> Result<Vec<(PathBuf, Vec<u8>)>, Error> {
    let name = command.get_display_name().unwrap_or(command.get_name());
    let mut all = vec![(dir.join(format!("{name}.1")), page(command)?)];
    for inner in command.get_subcommands().filter(|c| c.get_name() != "help") {
        all.extend(pages(inner, dir)?);
    }
    Ok(all)
}

fn page(command: &Command) -> Result<Vec<u8>, Error> {
    let mut bytes = Vec::new();
    let man = Man::new(command.clone());
    man.render(&mut bytes).map_err(Error::internal)?;
    Ok(bytes)
}
