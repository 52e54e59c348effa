//! Instruments: what the program lists of them, what it says of a file, and what it refuses.

use super::Bench;
use gonio::instrument;
use std::fs;

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
fn the_list_names_presets_axes_and_classes() {
    let bench = Bench::new();
    let list = bench.good(&["list", "instruments"]);
    for preset in instrument::presets() {
        let spec = instrument::read(preset.text).unwrap();
        let heading = list
            .lines()
            .find(|l| l.trim_start().starts_with(preset.name));
        assert!(heading.unwrap().contains(&spec.about), "{list}");
        for axis in &spec.axis {
            let range = format!(
                "{}° to {}°, {} °/s",
                axis.min_deg, axis.max_deg, axis.speed_deg_per_s
            );
            let row = |l: &&str| l.contains(&axis.name) && l.contains(&range);
            assert!(list.lines().any(|l| row(&l)), "{}: {list}", axis.name);
        }
    }
    for class in instrument::classes() {
        assert!(list.contains(class.summary()), "{}", class.name());
        for axis in class.axes() {
            assert!(list.contains(axis.role), "{}", axis.role);
        }
    }
    assert!(
        list.contains("half angles: light 0.25°, sensor 0.5°"),
        "{list}"
    );
    assert!(list.contains("separation at least 7.5°"), "{list}");
    assert!(bench.good(&["list"]).contains(&list));
}

#[test]
fn a_preset_and_its_file_say_the_same() {
    let bench = Bench::new();
    for preset in instrument::presets() {
        let said = bench.good(&["check", preset.name]);
        fs::write(bench.path("mine.toml"), preset.text).unwrap();
        assert_eq!(bench.good(&["check", "mine.toml"]), said);
        let spec = instrument::read(preset.text).unwrap();
        for word in [&spec.about, &spec.class]
            .into_iter()
            .chain(spec.axis.iter().map(|a| &a.name))
        {
            assert!(said.contains(word.as_str()), "{word}: {said}");
        }
        assert!(said.contains(", 0 without provenance\n"), "{said}");
        // Another seed draws other pairs, of which about as many are reachable.
        let share = |said: &str| -> f64 {
            let (_, after) = said.split_once("isotropic    reachable ").unwrap();
            after.split_once(" %").unwrap().0.parse().unwrap()
        };
        let other = bench.good(&["check", preset.name, "--seed", "2"]);
        assert_ne!(other, said);
        // Five standard deviations of the difference of two shares of 10⁴, at most 0.7 %.
        assert!((share(&said) - share(&other)).abs() < 3.5);
    }
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
    let said = bench.good(&["check", "cornell"]);
    assert!(!said.contains("anisotropic"), "{said}");
}

#[test]
fn wrong_files_are_refused_with_their_line() {
    let bench = Bench::new();
    let ring = |key: &str| format!("name = \"ring\"\nparent = \"base\"\nvector = [0, 1, 0]\n{key}");
    for (name, from, to, written, says) in [
        // min > max.
        (
            "rosi",
            ring("min_deg = -180"),
            ring("min_deg = 200"),
            "min_deg = 200",
            "axis[0].min_deg = 200: allowed is a number below max_deg = 180",
        ),
        (
            "pgii",
            "speed_deg_per_s = 170".into(),
            "speed_deg_per_s = 0".into(),
            "speed_deg_per_s = 0",
            "axis[2].speed_deg_per_s = 0: allowed is a finite number above 0",
        ),
        (
            "utia",
            "read_noise = 10".into(),
            "read_noise = -1".into(),
            "read_noise = -1",
            "detector.read_noise = -1: allowed is a finite number, at least 0",
        ),
        // A loop.
        (
            "cornell",
            "name = \"sample_yaw\"\nparent = \"base\"".into(),
            "name = \"sample_yaw\"\nparent = \"sample_tilt\"".into(),
            "parent = \"sample_tilt\"",
            "axis[1].parent = \"sample_tilt\": allowed is a chain that ends at base: sample_yaw would hang from itself",
        ),
        (
            "cornell",
            "class = \"fixed-detector-3-axis\"".into(),
            "class = \"fixed-detector\"".into(),
            "class = \"fixed-detector\"",
            "class = \"fixed-detector\": allowed is one of fixed-detector-3-axis, ",
        ),
        (
            "cornell",
            "bits = 16".into(),
            "bits = \"many\"".into(),
            "bits = ",
            "detector.bits is string \"many\"; allowed: a whole number, at least 0",
        ),
        (
            "cornell",
            "bits = 16".into(),
            "bit = 16".into(),
            "bit = 16",
            "unknown key detector.bit; allowed: ",
        ),
        (
            "cornell",
            "scan = \"stop\"".into(),
            "scan = \"fly\"".into(),
            "[timing]",
            "timing.sample_rate_hz = nothing: allowed is a finite number above 0",
        ),
        (
            "cornell",
            "class = \"fixed-detector-3-axis\"".into(),
            "class = \"robot-sample\"".into(),
            "[[axis]]",
            "axis = 3 axes: allowed is the 4 axes of robot-sample: ring on base",
        ),
        (
            "cornell",
            "class = \"fixed-detector-3-axis\"\n".into(),
            String::new(),
            "",
            "class",
        ),
    ] {
        let text = edited(name, &from, &to);
        fs::write(bench.path("mine.toml"), &text).unwrap();
        let sentence = bench.refused(&["check", "mine.toml"], 2);
        assert!(sentence.contains(says), "{sentence}");
        if !written.is_empty() {
            let place = format!("mine.toml:{}: ", line_of(&text, written));
            assert!(sentence.contains(&place), "{place}: {sentence}");
        }
    }
    // An override is its own place; a preset that is none is a file that is not there.
    let set = "axis.0.max_deg=-200";
    let sentence = bench.refused(&["check", "rosi", "--set", set], 2);
    assert!(
        sentence.contains("axis[0].min_deg = -180: allowed is a number below max_deg = -200"),
        "{sentence}"
    );
    let sentence = bench.refused(&["check", "rosi", "--set", "detector.bits=0"], 2);
    assert!(
        sentence.contains("--set detector.bits=0: detector.bits = 0"),
        "{sentence}"
    );
    let sentence = bench.refused(&["check", "rose"], 2);
    assert!(sentence.contains("rose"), "{sentence}");
}
