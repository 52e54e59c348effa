//! Files to begin with, as the project's own writers write them.

use gonio::acquisition;
use gonio::brdf::{Brdf, Channels, Wavelengths};
use gonio::experiment::{
    self, AnyPlan, Event, Experiment, Extent, Known, Observer, RESULTS_REVISION, Record, Source,
};
use gonio::formats::{Format, Tabulation, WriteReadings, WriteSchedule, WriteTable};
use gonio::geometry::Symmetry;
use gonio::instrument::{self, Ideal, Instrument};
use gonio::lighting;
use gonio::measurement::{About, Details, Flags, Measurement};
use gonio::moments;
use gonio::parametrization::{self, Form, HalfDifference, Parametrization, Spherical};
use gonio::reconstruct;
use gonio::registry::{self, Entry};
use gonio::schedule::{self, Grid, Ratio, SampleSet, Schedule, Sequence};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Files of the project.
fn project(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../..")
        .join(name)
}

/// The files of a folder, by name; none if it is not there.
pub fn files(dir: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(dir).into_iter().flatten().flatten();
    let mut files: Vec<PathBuf> = entries.map(|e| e.path()).filter(|p| p.is_file()).collect();
    files.sort();
    files
}

/// What is in the files of folders of the project that end so.
fn texts(dirs: &[&str], ending: &str) -> Vec<Vec<u8>> {
    let files = dirs.iter().flat_map(|dir| files(&project(dir)));
    let files = files.filter(|file| file.extension().is_some_and(|e| e == ending));
    files
        .map(|file| fs::read(file).expect("a file of the project"))
        .collect()
}

fn member<T: ?Sized>(family: Vec<Entry<T>>, kind: &str, keys: &str) -> Box<T> {
    let entry = family.iter().find(|e| e.kind == kind).expect(kind);
    registry::read_text(entry, keys).expect(kind)
}

fn ggx(channels: Channels) -> Box<dyn Brdf> {
    let spec = member(experiment::materials(), "ggx", "alpha = 0.4");
    spec.build(channels).expect("a material")
}

fn schedules() -> Vec<Schedule> {
    let forms: [Arc<dyn Parametrization>; 2] = [
        Arc::new(Form::<HalfDifference>::new(Symmetry::FULL)),
        Arc::new(Form::<Spherical>::new(Symmetry::NONE)),
    ];
    let sets = ["grid", "random"].map(|kind| member(schedule::all(), kind, ""));
    let planned = |form| sets.iter().map(move |set| set.plan(form, 20, 1));
    let all = forms.iter().flat_map(planned);
    all.map(|schedule| schedule.expect("20 poses")).collect()
}

/// Schedules.
pub fn of_schedules(write: WriteSchedule) -> Vec<Vec<u8>> {
    let text = |schedule: Schedule| {
        let mut text = Vec::new();
        write(&schedule, Sequence::Generated, &mut text).expect("memory");
        text
    };
    schedules().into_iter().map(text).collect()
}

/// Readings in luminance, colours, and at wavelengths, with uncertainties and without.
pub fn of_readings(write: WriteReadings) -> Vec<Vec<u8>> {
    let nm = Wavelengths::new(&[450.0, 550.0]).expect("two wavelengths");
    let channels = [
        Channels::Luminance,
        Channels::Rgb,
        Channels::Wavelengths(nm),
    ];
    let mut texts = Vec::new();
    for (schedule, channels) in schedules().into_iter().zip(channels.into_iter().cycle()) {
        let plain = Ideal.measure(&*ggx(channels), &Arc::new(schedule));
        let detailed = Measurement {
            details: Some(Details {
                type_a: plain.values.iter().map(|v| 0.01 * v).collect(),
                type_b: plain.values.iter().map(|v| 0.02 * v).collect(),
                flags: vec![Flags::NONE; plain.outcomes.len()],
            }),
            ..plain.clone()
        };
        for measurement in [plain, detailed] {
            let (about, order, mut text) = (About::default(), Sequence::Generated, Vec::new());
            let written = write(&measurement, &about, order, &mut text);
            // Some formats have no place for wavelengths or colours, and say so.
            match written {
                Ok(()) => texts.push(text),
                Err(e) => assert!(measurement.channels != Channels::Luminance, "{e}"),
            }
        }
    }
    texts
}

/// A table.
pub fn of_table(write: WriteTable) -> Vec<Vec<u8>> {
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("table");
    write(&*ggx(Channels::Rgb), Tabulation::default(), &path).expect("a table");
    vec![fs::read(path).expect("a table")]
}

/// Pictures of the sky in a format.
pub fn of_environment(format: &Format) -> Vec<Vec<u8>> {
    const SIZE: [usize; 2] = [8, 4];
    let dir = tempfile::tempdir().expect("a folder");
    let path = dir.path().join("picture");
    match format.name {
        "exr" => {
            let at = |x, y| (0.1 * x as f32, 0.2 * y as f32, 0.3_f32);
            exr::prelude::write_rgb_file(&path, SIZE[0], SIZE[1], at).expect("a picture");
        }
        "hdr" => {
            // A row of runs of each byte, one of whole pixels, and one that repeats a pixel.
            let head = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\n";
            let run = |value: u8| [131, value, 5, 1, 2, 3, 4, 5];
            let runs = [&[2, 2, 0, 8][..], [90, 60, 30, 129].map(run).as_flattened()].concat();
            let whole = [100, 50, 25, 128].repeat(8);
            let repeated = [7, 8, 9, 130, 1, 1, 1, 7];
            let picture = [head.as_bytes(), &runs, &whole, &repeated, &runs].concat();
            fs::write(&path, picture).expect("a picture");
        }
        _ => return Vec::new(),
    }
    vec![fs::read(path).expect("a picture")]
}

/// Heights as OpenEXR, as PNG of 16 bits and as CSV.
pub fn height_maps() -> Vec<Vec<u8>> {
    const SIZE: [u32; 2] = [8, 5];
    let height = |x: u32, y: u32| (x * x + 3 * y) as u16;
    let dir = tempfile::tempdir().expect("a folder");
    let paths = ["map.exr", "map.png", "map.csv"].map(|name| dir.path().join(name));
    let at = |x: usize, y: usize| {
        let z = f32::from(height(x as u32, y as u32));
        (z, -z, 0.5_f32)
    };
    let [width, rows] = SIZE.map(|n| n as usize);
    exr::prelude::write_rgb_file(&paths[0], width, rows, at).expect("a picture");
    let file = fs::File::create(&paths[1]).expect("a file");
    let mut encoder = png::Encoder::new(file, SIZE[0], SIZE[1]);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    let row = |y: u32| (0..SIZE[0]).map(move |x| height(x, y));
    let samples = (0..SIZE[1]).flat_map(|y| row(y).flat_map(u16::to_be_bytes));
    let samples: Vec<u8> = samples.collect();
    let mut writer = encoder.write_header().expect("a picture");
    writer.write_image_data(&samples).expect("a picture");
    writer.finish().expect("a picture");
    let cells = |y| row(y).map(|z| z.to_string()).collect::<Vec<_>>();
    let lines: String = (0..SIZE[1]).map(|y| cells(y).join(",") + "\n").collect();
    fs::write(&paths[2], format!("# heights\n{lines}")).expect("a file");
    paths.map(|path| fs::read(path).expect("a map")).into()
}

/// The head of every small config.
const SMALL: &str = "budgets = [30]\nmeasures = [\"cosine\"]\n";
const MATERIAL: &str = "[[material]]\nkind = \"ggx\"\nalpha = 0.4\n";
const METRICS: &str = "[metrics]\npairs = 200\nmax_pairs = 1\n";

/// A config for each example of a family.
fn members<T: ?Sized>(family: Vec<Entry<T>>, head: &str, table: &str) -> Vec<Vec<u8>> {
    let examples = family.iter().flat_map(|e| {
        let examples = e.examples.iter();
        examples.map(|example| format!("{head}{table}\nkind = \"{}\"\n{example}\n", e.kind))
    });
    examples.map(String::into_bytes).collect()
}

/// The configs of the project, and one for each member of each family.
pub fn configs() -> Vec<Vec<u8>> {
    let mut all = texts(&["configs", "configs/starters"], "toml");
    let acquisition = format!("{SMALL}{METRICS}{MATERIAL}");
    let moments = format!("experiment = \"moments\"\n{MATERIAL}");
    let relations =
        format!("experiment = \"relations\"\n[relations]\nviews_deg = [30]\n{MATERIAL}");
    all.extend(members(experiment::materials(), SMALL, "[[material]]"));
    let forms = parametrization::all();
    all.extend(members(forms, &acquisition, "[[parametrization]]"));
    all.extend(members(schedule::all(), &acquisition, "[[sample_set]]"));
    all.extend(members(acquisition::all(), &acquisition, "[[sample_set]]"));
    let methods = reconstruct::all();
    all.extend(members(methods, &acquisition, "[[reconstruction]]"));
    all.extend(members(moments::all(), &moments, "[moments.estimator]"));
    all.extend(members(lighting::all(), &relations, "[[lighting]]"));
    all.extend(instruments().into_iter().map(|text| {
        // The same keys, one table deeper.
        let text = String::from_utf8(text).expect("a preset");
        let table: toml::Table = text.parse().expect("a preset");
        let spec = toml::Table::from_iter([("spec".to_owned(), table.into())]);
        let list = toml::Table::from_iter([("instrument".to_owned(), vec![spec].into())]);
        format!("{acquisition}{list}").into_bytes()
    }));
    all
}

/// Files of instruments.
pub fn instruments() -> Vec<Vec<u8>> {
    let presets = instrument::presets().into_iter();
    presets.map(|preset| preset.text.into()).collect()
}

struct Keep<R>(Vec<R>);

impl<R: Record> Observer<R> for Keep<R> {
    fn observe(&mut self, event: &Event<'_, R>) -> Result<(), gonio::Error> {
        if let Event::Made(rows) = event {
            self.0.extend_from_slice(rows);
        }
        Ok(())
    }
}

fn records<E: Experiment>(plan: &E) -> Vec<u8> {
    let mut keep = Keep(Vec::new());
    plan.run(&Extent::default(), &Known::default(), &mut keep)
        .expect("a run");
    let line = |r| serde_json::to_string(r).expect("a record") + "\n";
    let lines = keep.0.iter().map(line);
    lines.collect::<String>().into_bytes()
}

/// Records of a run of a kind.
pub fn of_run(kind: &str) -> Vec<Vec<u8>> {
    let text = match kind {
        "acquisition" => format!("{SMALL}{METRICS}{MATERIAL}"),
        kind => {
            let light = match kind {
                "relations" => "[relations]\nviews_deg = [30]\n[[lighting]]\nkind = \"sky\"\n",
                _ => "",
            };
            let few = "[moments]\nviews = 5\n";
            format!("experiment = \"{kind}\"\n{few}{MATERIAL}{light}")
        }
    };
    let plan = AnyPlan::read(&Source::new("seed", text)).expect("a plan");
    let mut file = match plan {
        AnyPlan::Acquisition(plan) => records(&*plan),
        AnyPlan::Moments(plan) => records(&*plan),
        AnyPlan::Relations(plan) => records(&*plan),
    };
    seal_rows(&mut file);
    vec![file]
}

/// Makes the seals of records true.
pub fn seal_rows(file: &mut Vec<u8>) {
    let Ok(text) = std::str::from_utf8(file) else {
        return;
    };
    let line = |line: &str| {
        let body = line.split(",\"seal\":").next().unwrap_or(line);
        let body = body.strip_suffix('}').unwrap_or(body);
        let hash = blake3::hash(body.as_bytes()).to_hex();
        format!("{body},\"seal\":\"{RESULTS_REVISION}:{}\"}}\n", &hash[..16])
    };
    *file = text.lines().map(line).collect::<String>().into_bytes();
}

/// A prior of the smallest lattice, which is 0 everywhere.
pub fn prior() -> Vec<Vec<u8>> {
    let grid = Grid {
        ratio: Some(Ratio::Numbers(vec![6.0, 4.0, 3.0])),
        ..Grid::default()
    };
    let form = parametrization::usual_form(Symmetry::FULL);
    let nodes = grid.plan(&form, 500, 0).expect("a grid").poses.len();
    let line = "{\"gonio_prior\":2,\"blake3\":\"\",\"nodes\":500,\"functions\":1,\"scale\":0.1,\"share\":0.1,\
                \"centres\":2,\"materials\":[]}\n";
    let mut file = [line.as_bytes(), &vec![0; 2 * (3 * nodes + 2)]].concat();
    seal_prior(&mut file);
    vec![file]
}

/// Makes the hash of a prior true, see its format.
pub fn seal_prior(file: &mut Vec<u8>) {
    let end = file.iter().position(|b| *b == b'\n').unwrap_or(file.len());
    let line: Result<serde_json::Value, _> = serde_json::from_slice(&file[..end]);
    let Ok(serde_json::Value::Object(mut about)) = line else {
        return;
    };
    about.insert("blake3".into(), "".into());
    // As the program writes it: keys in their order, numbers as they are.
    let order = "gonio_prior blake3 nodes functions scale share centres materials";
    let mut write = |hash: &str| {
        about.insert("blake3".into(), hash.into());
        let part = |key| Some(format!("\"{key}\":{}", about.get(key)?));
        let parts = order.split(' ').filter_map(part);
        format!("{{{}}}", parts.collect::<Vec<_>>().join(","))
    };
    let body = file.get(end + 1..).unwrap_or_default().to_vec();
    let hash = blake3::hash(&[write("").as_bytes(), &body].concat());
    *file = [write(&hash.to_hex()).as_bytes(), b"\n", &body].concat();
}

/// Makes the hash of a schedule true.
pub fn seal_schedule(file: &mut Vec<u8>) {
    let Ok(text) = std::str::from_utf8(file) else {
        return;
    };
    let (old, prefix) = ("schedule_hash", "# schedule_hash = ");
    let lines: Vec<&str> = text.lines().filter(|line| !line.contains(old)).collect();
    let bare = lines.join("\n") + "\n";
    if let Ok(read) = schedule::read_schedule(&bare, "seal", &schedule::Assume::default()) {
        *file = format!("{prefix}\"{}\"\n{bare}", read.hash).into_bytes();
    }
}
