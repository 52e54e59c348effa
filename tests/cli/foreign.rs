//! Files that gonio did not write, and what is no file: one sentence with the place and what is wrong, the right exit
//! code, soon, and no more memory than the file bears out.

use super::Bench;
use super::common::{product, says};
#[cfg(target_os = "linux")]
use super::faults::by_shell;
use std::fs;
use std::process::{Command, Output};

const HEAD: &str = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value";

/// A few readings.
fn rows() -> String {
    let mut rows = HEAD.to_owned() + "\n";
    for (i, j) in product(0..5, 0..5) {
        rows += &format!("{}.5,0,{}.5,{},0.25\n", 10 * i, 15 * j, 40 * j);
    }
    rows
}

#[test]
fn text_that_is_none_and_numbers_that_are_none_are_refused() {
    let bench = Bench::new();
    let utf_16 = |t: &[u8]| -> Vec<u8> { t.iter().flat_map(|byte| [*byte, 0]).collect() };
    let text = rows();
    let row = |cells: &str| format!("{HEAD}\n1,2,3,4,5\n{cells}\n").into_bytes();
    let zeros = [text.as_bytes(), &[0; 99]].concat();
    let twice = text.replace("phi_o_deg", "value").into_bytes();
    for (bytes, told) in [
        (Vec::new(), "f.csv: there is no line that names the columns"),
        (utf_16(&row("1,2,3,4,x")), "f.csv:3: … value = x"),
        (
            zeros,
            "f.csv: cannot read this file: line 27 has a zero byte",
        ),
        (row("1,2,3,4,1e400"), "f.csv:3: … value = 1e400"),
        (row("1,2,3,4,0x10"), "f.csv:3: … value = 0x10"),
        (row("1,2,3,4,\"5"), "f.csv:3: … a quote is not closed"),
        (
            row("1,2,3,4,\u{1b}[31m5\u{7}"),
            "f.csv:3: … value = \u{fffd}[31m5\u{fffd}: allowed",
        ),
        (twice, "f.csv:1: … column \"value\" is there twice"),
    ] {
        bench.write("f.csv", bytes);
        let sentence = bench.refused("reconstruct f.csv", 3);
        let is_control = |c: char| c.is_control() && c != '\n';
        assert!(!sentence.contains(is_control), "{sentence:?}");
        says(&sentence, &format!("gonio: {told}"));
    }
    bench.write("c.toml", "budgets = [9]\n\0\0\0");
    bench.refuses("check c.toml", 2, "line 2 has a zero byte");
}

#[test]
fn a_line_may_have_any_number_of_columns() {
    let bench = Bench::new();
    let columns: Vec<String> = (0..100_000).map(|nm| format!("value_{nm}nm")).collect();
    bench.write("f.csv", format!("{HEAD},{}\n", columns.join(",")));
    for more in ["", "--columns value=none"] {
        let sentence = bench.refused(format!("reconstruct f.csv {more}"), 3);
        assert!(sentence.starts_with("gonio: f.csv:"), "{sentence}");
        assert!(sentence.len() < 1000, "{sentence}");
    }
}

#[test]
#[cfg(unix)]
fn names_of_any_bytes_are_names() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let bench = Bench::new();
    let told = |command: &str, name: &OsStr| {
        let output = bench.command(command).arg(name).output().unwrap();
        (
            output.status.code(),
            String::from_utf8(output.stderr).unwrap(),
        )
    };
    for name in [&b"a\nb.csv"[..], b"a\x1b[31mb.csv", b"a\xe9b.csv"] {
        let name = OsStr::from_bytes(name);
        fs::write(bench.path("").join(name), "no columns\n").unwrap();
        let (code, sentence) = told("reconstruct", name);
        assert_eq!(code, Some(3), "{sentence}");
        let line = sentence.strip_suffix('\n').unwrap();
        assert!(!line.contains(char::is_control), "{sentence:?}");
    }
    // Where names are texts.
    let (code, sentence) = told("moments", OsStr::from_bytes(b"a\xe9b.csv"));
    assert_eq!(code, Some(2), "{sentence}");
    let told = "gonio: a\u{fffd}b.csv: this argument is no UTF-8; allowed: another name\n";
    assert_eq!(sentence, told);
}

const PRIOR: &str = "LAMBERT\nreconstruction = [{ kind = \"kriging\", prior = 'FILE' }]";

/// What a config names of a kind of file, and the exit code of what is none.
const NAMING: [(&str, i32); 6] = [
    ("material = [{ kind = \"merl\", path = 'FILE' }]", 3),
    ("material = [{ kind = \"utia\", path = 'FILE' }]", 3),
    ("material = [{ kind = \"readings\", file = 'FILE' }]", 3),
    (PRIOR, 2),
    ("LAMBERT\ninstrument = [{ file = 'FILE' }]", 2),
    ("LAMBERT\nlighting = [{ kind = \"map\", path = 'FILE' }]", 3),
];

/// The config of one of them and a file.
fn naming(text: &str, file: &str) -> String {
    let kind = match text.contains("lighting") {
        true => "experiment = \"relations\"",
        false => "budgets = [9]",
    };
    let lambert = "material = [{ kind = \"lambert\" }]";
    let text = text.replace("LAMBERT", lambert).replace("FILE", file);
    format!("{kind}\n{text}\n")
}

#[test]
#[cfg(unix)]
fn what_is_no_file_is_refused_and_not_waited_for() {
    let bench = Bench::new();
    fs::create_dir(bench.path("folder")).unwrap();
    std::os::unix::fs::symlink("circle", bench.path("circle")).unwrap();
    let made = Command::new("mkfifo").arg(bench.path("pipe")).status();
    let pipe = made.is_ok_and(|made| made.success());
    let hole = fs::File::create(bench.path("hole")).unwrap();
    hole.set_len(2 << 30).unwrap();
    bench.write("empty", "");
    for name in "folder circle pipe hole empty /dev/zero none".split(' ') {
        if name == "pipe" && !pipe {
            eprintln!("skipped: there is no mkfifo here");
            continue;
        }
        bench.refused(format!("reconstruct {name}"), 3);
        let (code, _, told) = bench.output(format!("check {name}"));
        assert!([Some(2), Some(3)].contains(&code), "{told}");
        for (config, code) in NAMING {
            bench.write("c.toml", naming(config, name));
            bench.refuses("check c.toml", code, name);
        }
        // In the place of the files of a run.
        for file in ["results.jsonl", "config.toml", "manifest.json"] {
            fs::create_dir_all(bench.path("run")).unwrap();
            let [from, to] = [bench.path(name), bench.path("run").join(file)];
            if !["folder", "pipe"].contains(&name) || fs::rename(&from, &to).is_err() {
                continue;
            }
            bench.write("c.toml", super::SMALL);
            bench.refused("run c.toml -q -o run", 2);
            fs::rename(&to, &from).unwrap();
            fs::remove_dir_all(bench.path("run")).unwrap();
        }
    }
}

/// Runs a command that may have so much memory beside the program.
#[cfg(target_os = "linux")]
fn within(bench: &Bench, megabytes: usize, line: &str) -> Output {
    let limited = format!("ulimit -v {}; exec \"$0\" \"$@\"", megabytes << 10);
    let mut command = by_shell(bench, &limited, line);
    command.env("RAYON_NUM_THREADS", "1").output().unwrap()
}

#[test]
#[cfg(target_os = "linux")]
fn a_promise_is_not_paid_before_the_rows_are_there() {
    let bench = Bench::new();
    // What the program takes for itself: maps of its own file, and a stack a thread.
    bench.write("small.csv", rows());
    let takes = |megabytes: usize| {
        let args = "reconstruct small.csv --reconstruction nearest";
        within(&bench, megabytes, args).status.success()
    };
    let own = (1..200).map(|n| 8 * n).find(|n| takes(*n)).unwrap();
    let lattice = |n: u64| {
        let axis = format!("{{\"n\":{n},\"origin\":0.001,\"step\":1e-9,\"periodic\":false}}");
        let symmetry = "{\"isotropic\":true,\"reciprocal\":true,\"bilateral\":true}";
        format!(
            "# sample_set = \"grid\"\n# parametrization = \"half-difference\"\n# symmetry = {symmetry}\n# poses = {n}\n\
             # lattice = [{axis},{axis},{axis}]\nindex,{HEAD}\n0,1,2,3,4,5\n1,2,3,4,5,6\n2,3,4,5,6,7\n"
        )
    };
    let text = rows();
    let three: String = text.split_inclusive('\n').take(4).collect();
    let rows = format!("# sample_set = \"grid\"\n# rows = 1000000000\n{three}");
    let promise = "{\"header\":{\"sample_set\":\"grid\",\"rows\":1000000000,\"columns\":{}}}\n";
    // 2^30 × 2^29 pixels; what is unpacked would have zeros only.
    let hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 536870912 +X 1073741824\n\x02\x02\x7f\xff";
    let alta = "#DIM 1000000000 1000000000\n#PARAM_IN CARTESIAN\n#PARAM_OUT INV_STERADIAN\n1 2 3\n";
    let dimensions = |of: [i32; 3]| of.map(i32::to_le_bytes).concat();
    for (name, bytes) in [
        ("rows.csv", rows.into_bytes()),
        ("rows.jsonl", promise.into()),
        ("lattice.csv", lattice(1_000_000_000).into_bytes()),
        ("lattice-1000.csv", lattice(1000).into_bytes()),
        ("nodes.csv", lattice(100).into_bytes()),
        ("many.alta", alta.into()),
        ("long.binary", dimensions([90, 90, 180])),
        ("vast.binary", dimensions([i32::MAX; 3])),
        ("short.bin", vec![0; 24]),
        ("bomb.hdr", hdr.to_vec()),
    ] {
        bench.write(name, bytes);
        let (text, _) = match name.rsplit('.').next().unwrap() {
            "binary" => NAMING[0],
            "bin" => NAMING[1],
            "hdr" => NAMING[5],
            _ => NAMING[2],
        };
        bench.write("c.toml", naming(text, name));
        let output = within(&bench, own + 16, "check c.toml");
        let told = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(3), "{name}: {told}");
        says(&told, name);
    }
}
