//! Instruments: what the program lists of them, what it says of a file, and what it refuses.

use super::Bench;
use gonio::instrument;

/// The text of a preset with one edit.
fn edited(name: &str, from: &str, to: &str) -> String {
    let presets = instrument::presets();
    let text = presets.iter().find(|p| p.name == name).unwrap().text;
    assert!(text.contains(from), "{name}: {from}");
    text.replacen(from, to, 1)
}

/// The number of the first line that holds a text, from 1.
fn line_of(text: &str, part: &str) -> usize {
    1 + text.lines().position(|line| line.contains(part)).unwrap()
}

#[test]
fn the_reachable_share_is_that_of_the_limits() {
    // No arm in the way and no axis short of a turn: both elevations up to θ are all that counts,
    // and of cosine-distributed directions that is sin²θ, of pairs sin⁴θ.
    let bench = Bench::new();
    let sets = [
        "limits.theta_i_max_deg=60",
        "limits.theta_o_max_deg=60",
        "limits.separation_min_deg=0",
    ];
    let mut args = vec!["check", "pgii"];
    for set in &sets {
        args.extend(["--set", set]);
    }
    let said = bench.good(&args);
    for material in ["isotropic", "anisotropic"] {
        let row = said
            .lines()
            .find(|l| l.trim_start().starts_with(material))
            .unwrap();
        let numbers: Vec<f64> = row
            .split([' ', ','])
            .filter_map(|word| word.parse().ok())
            .collect();
        // sin²60° = 3/4. One standard deviation of 10⁴ draws is at most 0.5 %.
        for (found, expected) in numbers.iter().zip([56.25, 25.0, 18.75, 0.0, 0.0, 0.0]) {
            assert!((found - expected).abs() < 2.0, "{row}");
        }
        assert_eq!(numbers.len(), 6, "{row}");
        assert_eq!(numbers[3..], [0.0; 3], "{row}");
    }
    // Isotropic materials only: nothing is said of others.
    let said = bench.good("check cornell");
    assert!(!said.contains("anisotropic"), "{said}");
}

#[test]
fn wrong_files_are_refused_with_their_line() {
    let bench = Bench::new();
    let ring = |key: &str| format!("name = \"ring\"\nparent = \"base\"\nvector = [0, 1, 0]\n{key}");
    for (name, from, to, part) in [
        (
            "rosi",
            ring("min_deg = -180"),
            ring("min_deg = 200"),
            "axis[0].min_deg = 200: allowed is a number below max_deg = 180",
        ),
        (
            "cornell",
            "bits = 16".into(),
            "bit = 16".into(),
            "unknown key detector.bit; allowed: ",
        ),
    ] {
        let text = edited(name, &from, &to);
        bench.write("mine.toml", &text);
        let written = to.lines().last().unwrap();
        let place = format!("mine.toml:{}: … {part}", line_of(&text, written));
        bench.refuses("check mine.toml", 2, &place);
    }
    // An override is its own place; a preset that is none is a file that is not there.
    let set = "axis.0.max_deg=-200";
    bench.refuses(
        format!("check rosi --set '{set}'"),
        2,
        "axis[0].min_deg = -180: allowed is a number below max_deg = -200",
    );
    bench.refuses(
        "check rosi --set detector.bits=0",
        2,
        "--set detector.bits=0: detector.bits = 0",
    );
    bench.refuses("check rose", 2, "rose");
}
