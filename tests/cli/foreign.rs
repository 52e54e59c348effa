//! Files that gonio did not write, and what is no file: one sentence with the place and what is wrong, the right exit
//! code, soon, and no more memory than the file bears out.

use super::common::says;
use super::{Bench, Line};
use std::fs;
use std::process::{Command, Output};
use std::time::{Duration, Instant};

const HEAD: &str = "theta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value";

/// A few readings with this dress.
fn rows(dress: impl Fn(&str) -> String) -> Vec<u8> {
    let mut rows = HEAD.to_owned() + "\n";
    for i in 0..5 {
        for j in 0..5 {
            rows += &format!("{}.5,0,{}.5,{},0.25\n", 10 * i, 15 * j, 40 * j);
        }
    }
    dress(&rows).into_bytes()
}

/// Cells that are not those of the header.
fn cells(text: &str, of: impl Fn(&str) -> String) -> String {
    let lines = text.lines().map(|line| of(line) + "\n");
    lines.collect()
}

const RECONSTRUCT: &str = "--reconstruction nearest";

#[test]
fn readings_are_taken_in_every_dress() {
    let bench = Bench::new();
    let swapped = |line: &str| {
        let mut cells: Vec<&str> = line.split(',').collect();
        cells.reverse();
        cells.join(",")
    };
    for (name, bytes) in [
        ("crlf", rows(|t| t.replace('\n', "\r\n"))),
        ("mark", rows(|t| format!("\u{feff}{t}"))),
        ("tabs", rows(|t| t.replace(',', "\t"))),
        (
            "semicolons",
            rows(|t| t.replace(',', ";").replace('.', ",")),
        ),
        (
            "blanks",
            rows(|t| cells(t, |line| format!("  {}  ", line.replace(',', " , ")))),
        ),
        (
            "quotes",
            rows(|t| cells(t, |line| format!("\"{}\"", line.replace(',', "\",\"")))),
        ),
        ("order", rows(|t| cells(t, swapped))),
        ("no-end", rows(|t| t.trim_end().into())),
        ("below", rows(|t| format!("{t}\n\n,,,,\n"))),
        ("degrees", rows(|t| format!("# angles in °\n{t}"))),
    ] {
        let file = format!("{name}.csv");
        bench.write(&file, bytes);
        bench.tells(format!("reconstruct {file} {RECONSTRUCT}"), "25 poses");
    }
}

#[test]
fn text_that_is_none_and_numbers_that_are_none_are_refused() {
    let bench = Bench::new();
    let utf_16 = |t: &str| -> Vec<u8> { t.encode_utf16().flat_map(u16::to_le_bytes).collect() };
    let text = String::from_utf8(rows(str::to_owned)).unwrap();
    let row = |cells: &str| format!("{HEAD}\n1,2,3,4,5\n{cells}\n").into_bytes();
    for (bytes, place, part) in [
        (Vec::new(), "f.csv", "no line that names the columns"),
        (utf_16(&text), "f.csv", "line 1 has a zero byte"),
        (
            [b"\xff\xfe", &utf_16(&text)[..]].concat(),
            "f.csv",
            "line 1 has a zero byte",
        ),
        (
            [text.as_bytes(), b"# \xb0\n"].concat(),
            "f.csv",
            "line 27 is no UTF-8",
        ),
        (
            [text.as_bytes(), &[0; 99]].concat(),
            "f.csv",
            "line 27 has a zero byte",
        ),
        (row("1,2,3,4,1e400"), "f.csv:3", "value = 1e400"),
        (row("1,2,3,4,inf"), "f.csv:3", "value = inf"),
        (row("1,2,3,4,1e300"), "f.csv:3", "is no reading"),
        (row("1,2,3,4,0x10"), "f.csv:3", "value = 0x10"),
        (row("1,2,3,4,\"5"), "f.csv:3", "a quote is not closed"),
        (
            row("1,2,3,4,\u{1b}[31m5\u{7}"),
            "f.csv:3",
            "value = \u{fffd}[31m5\u{fffd}: allowed",
        ),
        (
            text.replace("phi_o_deg", "value").into_bytes(),
            "f.csv:1",
            "column \"value\" is there twice",
        ),
    ] {
        bench.write("f.csv", bytes);
        let sentence = bench.refused("reconstruct f.csv", 3);
        assert!(
            sentence.starts_with(&format!("gonio: {place}: ")),
            "{sentence}"
        );
        says(&sentence, part);
        assert!(
            !sentence.contains(|c: char| c.is_control() && c != '\n'),
            "{sentence:?}"
        );
    }
    let mut config = b"budgets = [9]\n".to_vec();
    config.extend([0; 9]);
    bench.write("c.toml", config);
    bench.refuses("check c.toml", 2, "line 2 has a zero byte");
}

#[test]
fn a_line_may_have_any_number_of_columns() {
    let bench = Bench::new();
    let columns: Vec<String> = (0..100_000).map(|nm| format!("value_{nm}nm")).collect();
    bench.write("f.csv", format!("{HEAD},{}\n", columns.join(",")));
    for args in [
        &["reconstruct", "f.csv"][..],
        &["reconstruct", "f.csv", "--columns", "value=none"],
    ] {
        let sentence = bench.refused(args, 3);
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
    for name in [&b"a\nb.csv"[..], b"a\x1b[31mb.csv", b"a\xe9b.csv"] {
        let name = OsStr::from_bytes(name);
        fs::write(bench.path("").join(name), "no columns\n").unwrap();
        let output = bench.command("reconstruct").arg(name).output().unwrap();
        let sentence = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(3), "{sentence}");
        assert_eq!(sentence.lines().count(), 1, "{sentence}");
        assert!(
            !sentence.trim_end().contains(char::is_control),
            "{sentence:?}"
        );
    }
    // Where names are texts.
    let name = OsStr::from_bytes(b"a\xe9b.csv");
    let output = bench.command("moments").arg(name).output().unwrap();
    let sentence = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{sentence}");
    assert_eq!(
        sentence,
        "gonio: a\u{fffd}b.csv: this argument is no UTF-8; allowed: another name\n"
    );
}

/// What a config names of a kind of file, or a command line, and the exit code of what is none.
const NAMING: [(&str, i32); 6] = [
    (
        "budgets = [9]\n[[material]]\nkind = \"merl\"\npath = 'FILE'\n",
        3,
    ),
    (
        "budgets = [9]\n[[material]]\nkind = \"utia\"\npath = 'FILE'\n",
        3,
    ),
    (
        "budgets = [9]\n[[material]]\nkind = \"readings\"\nfile = 'FILE'\n",
        3,
    ),
    (
        "budgets = [9]\n[[material]]\nkind = \"lambert\"\n[[reconstruction]]\nkind = \"kriging\"\nprior = 'FILE'\n",
        2,
    ),
    (
        "budgets = [9]\n[[material]]\nkind = \"lambert\"\n[[instrument]]\nfile = 'FILE'\n",
        2,
    ),
    (
        "experiment = \"relations\"\n[[material]]\nkind = \"lambert\"\n[[lighting]]\nkind = \"map\"\npath = 'FILE'\n",
        3,
    ),
];

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
    for name in [
        "folder",
        "circle",
        "pipe",
        "hole",
        "empty",
        "/dev/zero",
        "none",
    ] {
        if name == "pipe" && !pipe {
            eprintln!("skipped: there is no mkfifo here");
            continue;
        }
        bench.refused(format!("reconstruct {name}"), 3);
        let check = bench.gonio(format!("check {name}"));
        assert!(
            [Some(2), Some(3)].contains(&check.status.code()),
            "{check:?}"
        );
        for (config, code) in NAMING {
            bench.write("c.toml", config.replace("FILE", name));
            bench.refuses("check c.toml", code, name);
        }
        // In the place of the files of a run.
        if ["folder", "pipe"].contains(&name) {
            for file in ["results.jsonl", "config.toml", "manifest.json"] {
                fs::create_dir_all(bench.path("run")).unwrap();
                let [from, to] = [bench.path(name), bench.path("run").join(file)];
                if fs::rename(&from, &to).is_err() {
                    continue;
                }
                bench.write("c.toml", super::SMALL);
                let start = Instant::now();
                let output = bench.gonio("run c.toml -q -o run");
                let told = String::from_utf8_lossy(&output.stderr).into_owned();
                assert_eq!(output.status.code(), Some(2), "{name} {file}: {told}");
                assert!(start.elapsed() < Duration::from_secs(5), "{name} {file}");
                fs::rename(&to, &from).unwrap();
                fs::remove_dir_all(bench.path("run")).unwrap();
            }
        }
    }
}

/// Runs a command that may have so much memory beside the program.
#[cfg(target_os = "linux")]
fn within(bench: &Bench, megabytes: usize, line: &str) -> Output {
    let limited = format!("ulimit -v {}; exec \"$0\" \"$@\"", megabytes << 10);
    let mut command = Command::new("sh");
    command
        .args(["-c", &limited, env!("CARGO_BIN_EXE_gonio")])
        .args(line.words());
    command.env("RAYON_NUM_THREADS", "1");
    command.current_dir(bench.path("")).output().unwrap()
}

#[test]
#[cfg(target_os = "linux")]
fn a_promise_is_not_paid_before_the_rows_are_there() {
    let bench = Bench::new();
    // What the program takes for itself: maps of its own file, and a stack a thread.
    bench.write("small.csv", rows(str::to_owned));
    let takes = |megabytes: usize| {
        let args = format!("reconstruct small.csv {RECONSTRUCT}");
        within(&bench, megabytes, &args).status.success()
    };
    let own = (1..200).map(|n| 8 * n).find(|n| takes(*n)).unwrap();
    let lattice = |n: u64| {
        let axis =
            |name| format!("{{\"n\":{n},\"origin\":0.001,\"step\":1e-9,\"periodic\":{name}}}");
        format!(
            "# sample_set = \"grid\"\n# parametrization = \"half-difference\"\n# symmetry = {{\"isotropic\":true,\"reciprocal\":true,\"bilateral\":true}}\n\
             # poses = {n}\n# lattice = [{},{},{}]\nindex,{HEAD}\n0,1,2,3,4,5\n1,2,3,4,5,6\n2,3,4,5,6,7\n",
            axis("false"),
            axis("false"),
            axis("false")
        )
    };
    let text = String::from_utf8(rows(str::to_owned)).unwrap();
    let three: String = text.lines().take(4).map(|l| l.to_owned() + "\n").collect();
    let promise = "{\"header\":{\"sample_set\":\"grid\",\"rows\":1000000000,\"columns\":{}}}\n";
    // 2^30 × 2^29 pixels; what is unpacked would have zeros only.
    let hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 536870912 +X 1073741824\n\x02\x02\x7f\xff"
        .to_vec();
    for (name, bytes) in [
        (
            "rows.csv",
            format!("# sample_set = \"grid\"\n# rows = 1000000000\n{three}").into_bytes(),
        ),
        ("rows.jsonl", promise.into()),
        ("lattice.csv", lattice(1_000_000_000).into_bytes()),
        ("lattice-1000.csv", lattice(1000).into_bytes()),
        ("nodes.csv", lattice(100).into_bytes()),
        (
            "many.alta",
            b"#DIM 1000000000 1000000000\n#PARAM_IN CARTESIAN\n#PARAM_OUT INV_STERADIAN\n1 2 3\n"
                .to_vec(),
        ),
        (
            "long.binary",
            [90i32, 90, 180]
                .iter()
                .flat_map(|n| n.to_le_bytes())
                .collect(),
        ),
        (
            "vast.binary",
            [i32::MAX; 3].iter().flat_map(|n| n.to_le_bytes()).collect(),
        ),
        ("short.bin", vec![0; 24]),
        ("bomb.hdr", hdr),
    ] {
        bench.write(name, bytes);
        let (kind, key) = match name.rsplit('.').next().unwrap() {
            "binary" => ("merl", "path"),
            "bin" => ("utia", "path"),
            "hdr" => ("map", "path"),
            _ => ("readings", "file"),
        };
        let head = match kind {
            "map" => "experiment = \"relations\"\n[[material]]\nkind = \"lambert\"\n[[lighting]]",
            _ => "budgets = [9]\n[[material]]",
        };
        let config = format!("{head}\nkind = \"{kind}\"\n{key} = '{name}'\n");
        bench.write("c.toml", config);
        let output = within(&bench, own + 16, "check c.toml");
        let told = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(3), "{name}: {told}");
        says(&told, name);
    }
}
