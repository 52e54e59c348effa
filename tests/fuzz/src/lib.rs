//! Every reader of files, each with a target: a file in, and laws that hold for whatever it holds.
//!
//! * No panic, and no overflow.
//! * An answer within a second of work.
//! * No more memory than the file bears out: `Target::memory`.
//! * A refusal is a sentence: one line, of bounded length, that names the file.
//! * What is accepted is finite.
//!
//! [`all`] walks the registry of formats, so that a format has its targets when it is in the list.

mod meter;
mod recipe;
mod seeds;

pub use recipe::MARK;

use gonio::brdf::{Channels, Presence};
use gonio::experiment::moments::MaterialProfiles;
use gonio::experiment::relations::MaterialRelations;
use gonio::experiment::{AnyPlan, Record, Row, Source, load_instrument};
use gonio::files::UNPACKED_A_BYTE;
use gonio::formats::{self, READ_SCHEDULE, load_readings};
use gonio::geometry::{Direction, DirectionPair};
use gonio::instrument::{Bench, Parts};
use gonio::light_paths::surface::{HeightMapSpec, SurfaceSpec};
use gonio::measurement::Outcome;
use gonio::reconstruct::Prior;
use gonio::report::{MadeFrom, RunFolder, read_rows};
use gonio::schedule::{AngleUnit, Assume, Azimuth, Conventions, Quantity, Schedule};
use std::error::Error;
use std::f64::consts::PI;
use std::fs;
use std::path::Path;
use std::sync::OnceLock;
use std::time::Instant;
use tempfile::TempDir;

/// Longest work for a file that is only read, s.
const SECONDS: f64 = 1.0;

/// Why a file was refused: its sentence, and those behind it.
pub struct Refusal(Vec<String>);

impl<E: Error> From<E> for Refusal {
    fn from(e: E) -> Self {
        let mut sentences = vec![e.to_string()];
        let mut cause = e.source();
        while let Some(e) = cause {
            sentences.push(e.to_string());
            cause = e.source();
        }
        Self(sentences)
    }
}

type Reading = Box<dyn Fn(&Path) -> Result<(), Refusal> + Send + Sync>;

/// A reader, and how its files begin.
pub struct Target {
    /// What is read and in which format, e.g. `readings-csv`.
    pub name: String,
    /// The name of the file that is read, in a folder of its own.
    file: String,
    seeds: Box<dyn Fn() -> Vec<Vec<u8>> + Send + Sync>,
    made: OnceLock<Vec<Vec<u8>>>,
    /// Makes true what a file says of itself.
    seal: fn(&mut Vec<u8>),
    /// Bytes that a reader may hold: of any file, and for each byte of it.
    memory: [usize; 2],
    /// Longest work for one file, s.
    seconds: f64,
    read: Reading,
}

/// Bytes that reading any file may take: lists of names, buffers, the plan of an experiment.
const ANY: usize = 16 << 20;

/// Bytes for each byte of a table of rows: the shortest row (`1,2,3,4`) is a pose of 150 bytes, in a few lists.
const ROWS: usize = 100;

impl Target {
    fn new(
        name: impl Into<String>,
        file: &str,
        seeds: impl Fn() -> Vec<Vec<u8>> + Send + Sync + 'static,
        read: impl Fn(&Path) -> Result<(), Refusal> + Send + Sync + 'static,
    ) -> Self {
        Self {
            name: name.into(),
            file: file.into(),
            seeds: Box::new(seeds),
            made: OnceLock::new(),
            seal: |_| {},
            memory: [ANY, ROWS],
            seconds: SECONDS,
            read: Box::new(read),
        }
    }

    /// Inputs to begin with: files of the project's own writers, and those of the corpus.
    pub fn seeds(&self) -> &[Vec<u8>] {
        self.made.get_or_init(|| {
            let corpus = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus");
            let files = seeds::files(&corpus.join(&self.name)).into_iter();
            let files = files.filter_map(|file| fs::read(file).ok());
            (self.seeds)().into_iter().chain(files).collect()
        })
    }

    /// The file that an input stands for.
    pub fn made_of(&self, input: &[u8]) -> Vec<u8> {
        // Recipes of the corpus are no seeds of recipes.
        let seeds = self.seeds().iter().map(Vec::as_slice);
        let seeds: Vec<_> = seeds.filter(|seed| seed.first() != Some(&MARK)).collect();
        recipe::file(input, &seeds, self.seal)
    }

    /// Reads what an input stands for; true if it was accepted.
    ///
    /// # Panics
    /// If a law is broken.
    pub fn run(&self, input: &[u8]) -> bool {
        static FOLDER: OnceLock<TempDir> = OnceLock::new();
        let folder = FOLDER.get_or_init(|| {
            // Memory, where there is a file system of it.
            let memory = tempfile::tempdir_in("/dev/shm");
            memory.or_else(|_| tempfile::tempdir()).expect("a folder")
        });
        let path = folder.path().join(&self.file);
        let file = self.made_of(input);
        fs::write(&path, &file).expect("room for a file");
        let mut fastest = f64::INFINITY;
        // What is made once is made by the first.
        for _ in 0..3 {
            let held = meter::reset();
            let start = cpu_time();
            let result = (self.read)(&path);
            let elapsed = cpu_time() - start;
            let taken = meter::peak() - held;
            let (length, [any, each]) = (file.len(), self.memory);
            let allowed = any + each * length;
            assert!(
                taken <= allowed,
                "{taken} bytes were held for a file of {length}; allowed: {allowed}"
            );
            fastest = fastest.min(elapsed);
            if fastest <= self.seconds {
                return result.map_err(|refusal| refusal.check(&path)).is_ok();
            }
        }
        panic!("it took {fastest:.1} s; allowed: {}", self.seconds);
    }
}

/// Time that this process has worked, s: others may have the machine too.
fn cpu_time() -> f64 {
    static START: OnceLock<Instant> = OnceLock::new();
    let ticks = || {
        let stat = fs::read_to_string("/proc/self/stat").ok()?;
        // After the name, which may hold anything: user and system time are the 12th and 13th.
        let fields = stat.rsplit(')').next()?.split_whitespace();
        let ticks = fields.skip(11).take(2).map(|n| n.parse::<f64>().ok());
        ticks.sum::<Option<f64>>()
    };
    match ticks() {
        Some(ticks) => ticks / 100.0,
        None => START.get_or_init(Instant::now).elapsed().as_secs_f64(),
    }
}

/// Longest sentence: names of everything that is allowed, and a path.
const SENTENCE: usize = 3000;

impl Refusal {
    /// Checks that it is a sentence about a file.
    fn check(&self, path: &Path) {
        let place = path.display().to_string();
        assert!(self.0[0].contains(&place), "no place: {:?}", self.0);
        self.0.iter().for_each(|text| check_sentence(text));
    }
}

fn check_sentence(text: &str) {
    let fits = !text.is_empty() && text.len() < SENTENCE;
    assert!(fits && !text.contains(char::is_control), "{text:?}");
}

/// Every target.
pub fn all() -> Vec<Target> {
    let mut all = Vec::new();
    for format in formats::all() {
        let name = |what: &str| format!("{what}-{}", format.name);
        let file = format!("input.{}", format.extension());
        if let Some(read) = format.table.read {
            let seeds = move || format.table.write.map_or(Vec::new(), seeds::of_table);
            let read = move |path: &Path| table(&*read(path.to_owned()));
            // A table is held as it is in the file, and its planes are read one after the other.
            all.push(Target {
                memory: [ANY, 3],
                ..Target::new(name("table"), &file, seeds, read)
            });
        }
        if format.read_schedule.is_some() {
            let write = format.write_schedule;
            let seeds = move || write.map_or(Vec::new(), seeds::of_schedules);
            all.push(Target {
                seal: seeds::seal_schedule,
                ..Target::new(name("schedule"), &file, seeds, schedule)
            });
        }
        if format.read_readings.is_some() {
            let seeds = move || format.write_readings.map_or(Vec::new(), seeds::of_readings);
            all.push(Target::new(name("readings"), &file, seeds, readings));
        }
        if let Some(read) = format.read_environment {
            let seeds = move || seeds::of_environment(&format);
            let read = move |path: &Path| environment(&*read(path.to_owned()));
            // What is packed, as the file has it and in R, G, B.
            all.push(Target {
                memory: [ANY, 5 * UNPACKED_A_BYTE as usize],
                ..Target::new(name("environment"), &file, seeds, read)
            });
        }
    }
    // A plan has models, priors and what was tuned, and asks its planners for a few poses in all coordinates.
    all.push(Target {
        memory: [4 * ANY, ROWS],
        seconds: 10.0 * SECONDS,
        ..Target::new("config", "input.toml", seeds::configs, config)
    });
    let instruments = seeds::instruments;
    all.push(Target::new(
        "instrument",
        "input.toml",
        instruments,
        instrument,
    ));
    all.push(Target {
        seal: seeds::seal_prior,
        ..Target::new("prior", "input.gonio", seeds::prior, |path| {
            let named = |e| std::io::Error::other(format!("{}: {e}", path.display()));
            // As its users do, who name the file.
            Prior::read(path).map(drop).map_err(named)?;
            Ok(())
        })
    });
    // All formats of heights: the first bytes say which. A sample is held in the file's width, and as a height.
    all.push(Target {
        memory: [ANY, 5 * UNPACKED_A_BYTE as usize],
        ..Target::new(
            "surface-height-map",
            "input.map",
            seeds::height_maps,
            height_map,
        )
    });
    all.push(records::<Row>("acquisition"));
    all.push(records::<MaterialProfiles>("moments"));
    all.push(records::<MaterialRelations>("relations"));
    all.push(Target::new("manifest", "manifest.json", Vec::new, |path| {
        MadeFrom::read(path.parent().expect("a folder"));
        Ok(())
    }));
    all
}

/// The target of this name.
pub fn find(name: &str) -> Option<Target> {
    all().into_iter().find(|target| target.name == name)
}

/// Pairs all over both hemispheres, with the normal, the horizon, mirror and retro directions.
fn pairs() -> Vec<DirectionPair> {
    let mut pairs = Vec::new();
    for k in 0..144 {
        let [i, o] = [k / 12, k % 12].map(|n| f64::from(n) * 0.1428);
        let turned = |phi| DirectionPair::from_spherical(i, 0.3, o, 0.3 + phi);
        pairs.extend([0.0, 1.0, PI, -2.0].map(turned));
    }
    pairs
}

fn table(spec: &dyn gonio::brdf::BrdfSpec) -> Result<(), Refusal> {
    for channels in [Channels::Luminance, Channels::Rgb] {
        spec.check(&channels)?;
        spec.symmetry(&channels)?;
        let brdf = spec.build(channels)?;
        let (n, pairs) = (brdf.channels().count(), pairs());
        let mut all = vec![f64::NAN; n * pairs.len()];
        let mut presences = vec![Presence::Missing; pairs.len()];
        brdf.eval_batch(&pairs, &mut all, &mut presences);
        for ((pair, presence), values) in pairs.iter().zip(&presences).zip(all.chunks(n)) {
            let mut one = vec![f64::NAN; n];
            assert_eq!(brdf.eval(pair, &mut one), *presence);
            assert_eq!(one, values, "one by one");
            assert!(one.iter().all(|v| v.is_finite() && *v >= 0.0), "{one:?}");
            assert!(*presence == Presence::Present || one.iter().all(|v| *v == 0.0));
        }
    }
    Ok(())
}

/// Assumptions about a file, others for every length.
fn assumed(path: &Path) -> Assume {
    let length = fs::metadata(path).map_or(0, |file| file.len());
    let conventions = match length % 8 {
        1 => Conventions {
            angles: Some(AngleUnit::Radians),
            partial: true,
            ..Conventions::default()
        },
        2 => Conventions {
            elevation: true,
            quantity: Some(Quantity::Percent),
            ..Conventions::default()
        },
        3 => Conventions {
            columns: vec![("theta_i".into(), "phi_i_deg".into())],
            azimuth: Some(Azimuth::Propagation),
            ..Conventions::default()
        },
        4 => Conventions {
            azimuth: Some(Azimuth::Mirror),
            quantity: Some(Quantity::BrdfCosine),
            ..Conventions::default()
        },
        _ => Conventions::default(),
    };
    Assume {
        conventions,
        ..Assume::default()
    }
}

fn check_schedule(schedule: &Schedule) {
    assert!(!schedule.poses.is_empty());
    for pose in &schedule.poses {
        for d in [pose.pair.omega_i, pose.pair.omega_o] {
            let off = (d.vector().length() - 1.0).abs();
            assert!(off < 1e-9 && d.cos_theta() > 0.0, "{pose:?}");
        }
        assert!(pose.coords.iter().all(|c| c.is_finite()), "{pose:?}");
    }
    assert!((0.0..=1.0).contains(&schedule.unphysical_share));
}

fn schedule(path: &Path) -> Result<(), Refusal> {
    let (text, read) = READ_SCHEDULE.open(path)?;
    let file = read(&text, &path.display().to_string(), &assumed(path))?;
    check_schedule(&file.schedule);
    let poses = file.schedule.poses.len();
    let unreachable = file.unreachable.iter().map(|(pose, _)| pose);
    let mut all = file.order.iter().chain(unreachable);
    assert!(all.all(|&pose| (pose as usize) < poses));
    assert!(file.positions.iter().flatten().all(|at| at.is_finite()));
    Ok(())
}

fn readings(path: &Path) -> Result<(), Refusal> {
    let read = load_readings(path, &assumed(path))?;
    for text in read.notes.iter().chain(&read.warnings) {
        check_sentence(text);
    }
    let all = &read.measurement;
    check_schedule(&all.schedule);
    let n = all.channels.count();
    assert_eq!(all.outcomes.len(), all.schedule.poses.len());
    assert_eq!(all.values.len(), n * all.outcomes.len());
    for (i, outcome) in all.outcomes.iter().enumerate() {
        let of = i * n..(i + 1) * n;
        if *outcome == Outcome::Reading {
            assert!(all.values[of.clone()].iter().all(|v| v.is_finite()));
            for parts in all.details.iter().flat_map(|d| [&d.type_a, &d.type_b]) {
                assert!(parts[of.clone()].iter().all(|u| u.is_finite() && *u >= 0.0));
            }
        }
    }
    Ok(())
}

fn environment(spec: &dyn gonio::lighting::LightingSpec) -> Result<(), Refusal> {
    spec.check()?;
    let light = spec.build()?;
    for k in 0..400 {
        let [i, j] = [k / 20, k % 20].map(f64::from);
        let radiance = light.radiance(Direction::from_spherical(0.16534 * i, 0.331 * j));
        let is_good = radiance.iter().all(|v| v.is_finite() && *v >= 0.0);
        assert!(is_good, "{radiance:?}");
    }
    Ok(())
}

fn height_map(path: &Path) -> Result<(), Refusal> {
    let spec = HeightMapSpec {
        file: path.to_owned(),
        pitch_um: 0.5,
        height_um: Some(10.0),
    };
    let field = spec.build(0)?;
    assert!(field.size().iter().all(|n| (2..=8192).contains(n)));
    assert!(field.heights().all(f64::is_finite));
    spec.remarks(&field)
        .iter()
        .for_each(|remark| check_sentence(remark));
    Ok(())
}

fn config(path: &Path) -> Result<(), Refusal> {
    match AnyPlan::read(&Source::read(path)?) {
        // A file that the config names is the place of what is wrong with it.
        Err(e @ gonio::Error::Data { .. }) if !e.to_string().contains(&*path.to_string_lossy()) => {
            Ok(())
        }
        plan => Ok(plan.map(drop)?),
    }
}

fn instrument(path: &Path) -> Result<(), Refusal> {
    let spec = load_instrument(&path.display().to_string())?;
    Bench::new(&spec, Parts::ALL, 1).expect("what was read was checked");
    Ok(())
}

fn records<R: Record>(kind: &'static str) -> Target {
    let target = Target::new(
        format!("records-{kind}"),
        R::FILE,
        || seeds::of_run(kind),
        |path| {
            let dir = path.parent().expect("a folder");
            let rows = read_rows::<R>(dir)?;
            let lines = fs::read(path).expect("a file");
            assert!(rows.len() <= lines.iter().filter(|b| **b == b'\n').count());
            for row in &rows {
                assert!(row.agrees(row));
                assert!(!row.label().contains('\n') || row.label().len() < lines.len());
            }
            let table = toml::Table::new();
            // What is there is of another config; the file stays as it is, up to what is cut off its end.
            let folder = RunFolder::<R>::open(dir, false, &table)?;
            assert!(folder.known().len() <= rows.len());
            Ok(())
        },
    );
    Target {
        seal: seeds::seal_rows,
        ..target
    }
}
