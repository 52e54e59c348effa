//! The targets without a fuzzer: replays what is known, and makes up files for a while.
//!
//! ```text
//! gonio-fuzz SECONDS [TARGET…]     each target for so long, as many at a time as there are cores
//! gonio-fuzz --from SEED SECONDS [TARGET…]  the same with other inputs; SEED is a hexadecimal number
//! gonio-fuzz --replay TARGET FILE… these inputs, e.g. what a fuzzer found
//! gonio-fuzz --make TARGET INPUT   prints the file that an input stands for
//! gonio-fuzz --seeds DIR           writes what a fuzzer begins with, a folder for each target
//! gonio-fuzz --list                names of the targets
//! ```

use gonio_fuzz::{MARK, Target, all, find};
use std::collections::VecDeque;
use std::env;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::sync::Mutex;
use std::thread;
use std::time::{Duration, Instant};

fn main() -> ExitCode {
    let args: Vec<String> = env::args().skip(1).collect();
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    let good = match args.as_slice() {
        ["--list"] => {
            all().iter().for_each(|target| println!("{}", target.name));
            true
        }
        ["--seeds", dir] => {
            let dir = Path::new(dir);
            all().iter().for_each(|target| write_seeds(target, dir));
            true
        }
        ["--make", name, input] => {
            let file = named(name).made_of(&read(input));
            std::io::stdout().write_all(&file).expect("stdout");
            true
        }
        ["--replay", name, files @ ..] => {
            let target = named(name);
            for file in files {
                let accepted = target.run(&read(file));
                println!("{file}: {}", if accepted { "accepted" } else { "refused" });
            }
            true
        }
        // One target, in a process of its own: what it holds is counted.
        ["--alone", seed, name, seconds, input] => {
            let (seed, seconds) = (hexadecimal(seed), number(seconds));
            alone(&named(name), seed, seconds, Path::new(input));
            true
        }
        ["--from", seed, seconds, names @ ..] => {
            together(hexadecimal(seed), number(seconds), names)
        }
        [seconds, names @ ..] => together(0, number(seconds), names),
        [] => {
            eprintln!(
                "gonio-fuzz [--from SEED] SECONDS [TARGET…], --replay, --make, --seeds, --list"
            );
            false
        }
    };
    match good {
        true => ExitCode::SUCCESS,
        false => ExitCode::FAILURE,
    }
}

fn named(name: &str) -> Target {
    find(name).unwrap_or_else(|| panic!("{name} is no target; allowed: those of --list"))
}

fn read(file: &str) -> Vec<u8> {
    fs::read(file).unwrap_or_else(|e| panic!("{file}: {e}"))
}

fn number(seconds: &str) -> f64 {
    seconds.parse().expect("a number of seconds")
}

fn hexadecimal(seed: &str) -> u64 {
    u64::from_str_radix(seed, 16).expect("a hexadecimal number of 64 bits")
}

/// Inputs of a fuzzer are small: a larger seed is reached by recipes.
const LARGEST: usize = 1 << 17;

fn write_seeds(target: &Target, dir: &Path) {
    let dir = dir.join(&target.name);
    fs::create_dir_all(&dir).expect("a folder");
    // Recipes of every seed.
    let recipes = (0..target.seeds().len().min(256)).map(|i| vec![MARK, i as u8, 0, 0, 0, 0]);
    let small = target.seeds().iter().filter(|seed| seed.len() <= LARGEST);
    for (i, input) in small.cloned().chain(recipes).enumerate() {
        fs::write(dir.join(format!("{i:03}")), input).expect("room for a file");
    }
}

/// Numbers that look random and are the same for the same seed.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        // Marsaglia's xorshift.
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn recipe(&mut self) -> Vec<u8> {
        let length = 8 + self.next() % 120;
        let bytes = (0..length).map(|_| self.next() as u8);
        std::iter::once(MARK).chain(bytes).collect()
    }
}

/// Runs what is known and then, for a while, what is made up; the input that is tried is in a file, should this process
/// end with it.
fn alone(target: &Target, from: u64, seconds: f64, input: &Path) {
    let read = target.seeds().iter().filter(|seed| {
        fs::write(input, seed).expect("room for a file");
        target.run(seed)
    });
    let (read, known) = (read.count(), target.seeds().len());
    // Manifests have no reader that refuses, and the corpus may be all there is.
    assert!(known == 0 || read > 0, "none of {known} seeds is accepted");
    let name = blake3::hash(target.name.as_bytes());
    let seed = name.as_bytes().first_chunk();
    let seed = seed.map_or(1, |b| u64::from_le_bytes(*b));
    let mut random = Random((seed ^ from) | 1);
    let (start, mut tried, mut accepted) = (Instant::now(), 0, 0);
    while start.elapsed().as_secs_f64() < seconds {
        let recipe = random.recipe();
        fs::write(input, &recipe).expect("room for a file");
        accepted += usize::from(target.run(&recipe));
        tried += 1;
    }
    println!(
        "{:24} {read} of {known} seeds, {accepted} of {tried} others accepted",
        target.name
    );
}

/// Runs targets side by side, each in a process of its own.
fn together(from: u64, seconds: f64, names: &[&str]) -> bool {
    let targets = all().into_iter().map(|target| target.name);
    let targets = targets.filter(|name| names.is_empty() || names.contains(&name.as_str()));
    let targets: Mutex<VecDeque<String>> = Mutex::new(targets.collect());
    let failed: Mutex<Vec<String>> = Mutex::new(Vec::new());
    let program = env::current_exe().expect("the path of this program");
    let out = env::temp_dir().join(format!("gonio-fuzz-{}", std::process::id()));
    fs::create_dir_all(&out).expect("a folder");
    let next = || targets.lock().expect("no thread panics").pop_front();
    let cores = thread::available_parallelism().map_or(1, usize::from);
    thread::scope(|scope| {
        for _ in 0..cores {
            scope.spawn(|| {
                while let Some(name) = next() {
                    let input = out.join(&name);
                    if run(&program, from, &name, seconds, &input) {
                        // What ended well is of no more use.
                        let _ = fs::remove_file(&input);
                    } else {
                        failed.lock().expect("no thread panics").push(name);
                    }
                }
            });
        }
    });
    let failed = failed.into_inner().expect("no thread panics");
    for name in &failed {
        println!(
            "{name} broke a law: gonio-fuzz --replay {name} {}",
            out.join(name).display()
        );
    }
    let _ = fs::remove_dir(&out);
    failed.is_empty()
}

/// True if a target ended well, and in time.
fn run(program: &Path, from: u64, name: &str, seconds: f64, input: &PathBuf) -> bool {
    let mut alone = Command::new(program);
    alone
        .args(["--alone", &format!("{from:x}"), name, &seconds.to_string()])
        .arg(input);
    // One thread each: two targets run side by side.
    alone.env("RAYON_NUM_THREADS", "1");
    let mut alone = alone.spawn().expect("this program");
    let start = Instant::now();
    loop {
        match alone.try_wait().expect("a process") {
            Some(status) => return status.success(),
            None if start.elapsed().as_secs_f64() > 3.0 * seconds + 60.0 => {
                alone.kill().expect("a process");
                println!("{name}: one input took too long");
                return false;
            }
            None => thread::sleep(Duration::from_millis(50)),
        }
    }
}
