//! Pictures of parametrizations, materials and reconstructions.

use super::Bench;
use std::fs;

/// Every file begins as its ending says.
fn well_formed(bench: &Bench, files: &[String]) {
    for file in files {
        let bytes = fs::read(bench.path("out").join(file)).unwrap();
        let start: &[u8] = match file.rsplit('.').next().unwrap() {
            "png" => b"\x89PNG",
            "svg" => b"<svg",
            "exr" => &[0x76, 0x2f, 0x31, 0x01],
            _ => panic!("{file}"),
        };
        assert!(bytes.starts_with(start), "{file}");
    }
}

#[test]
fn each_picture_is_one_command() {
    let bench = Bench::new();
    let commands: [&[&str]; 5] = [
        &[
            "hemispheres",
            "--view-deg",
            "30",
            "--parametrization",
            "hybrid",
        ],
        &["functions", "--phi-deg", "0", "--parametrization", "stark"],
        &["slices", "ggx", "--resolution", "24"],
        &["sphere", "ggx", "--resolution", "16", "--samples", "4"],
        &[
            "compare",
            "ggx",
            "--budget",
            "200",
            "--reconstruction",
            "thin-plate",
            "--resolution",
            "16",
            "--samples",
            "4",
            "--lighting",
            "constant",
        ],
    ];
    let mut told = Vec::new();
    for command in commands {
        let args = [&["picture"], command, &["-o", "out"]].concat();
        let said = bench.gonio(&args);
        assert!(said.status.success(), "{args:?}");
        let said = String::from_utf8(said.stderr).unwrap();
        let paths = said.lines().filter_map(|l| l.strip_prefix("out/"));
        told.extend(paths.map(str::to_owned));
        assert!(bench.refused(&args, 2).contains("--force"));
        if command[0] == "functions" {
            bench.good(&[&args[..], &["--force"]].concat());
        }
    }
    let files = bench.files("out");
    told.sort();
    assert_eq!(told, files);
    assert_eq!(
        files,
        [
            "functions.svg",
            "ggx-0.3_slices.exr",
            "ggx-0.3_slices.svg",
            "ggx-0.3_sphere.exr",
            "ggx-0.3_sphere.png",
            "ggx-0.3_thin-plate_half-difference_200.exr",
            "ggx-0.3_thin-plate_half-difference_200.png",
            "ggx-0.3_thin-plate_half-difference_200.svg",
            "hemispheres.svg",
        ]
    );
    well_formed(&bench, &files);
    // The paper's three, in its order.
    let slices = bench.read("out/ggx-0.3_slices.svg");
    let places = ["half-difference", "orthographic", "hybrid"].map(|name| slices.find(name));
    assert!(places.iter().all(Option::is_some) && places.is_sorted());
}

#[test]
fn a_comparison_takes_warps() {
    let bench = Bench::new();
    let small = [
        "--budget",
        "200",
        "--resolution",
        "16",
        "--samples",
        "4",
        "-o",
        "out",
    ];
    let error = |warps: &[&str]| -> f64 {
        let all = ["picture", "compare", "ggx", "--set", "alpha=0.05"];
        let said = bench.good(&[&all[..], &small, warps].concat());
        let title = said.lines().next().unwrap();
        assert_eq!(title.contains("theta_h:"), !warps.is_empty(), "{title}");
        let words = said.split_whitespace();
        let mut numbers = words.filter_map(|word| word.trim_end_matches(',').parse().ok());
        numbers.next_back().unwrap()
    };
    let (plain, warped) = (error(&[]), error(&["--warp", "theta_h=square-root"]));
    assert!(warped.is_finite() && warped != plain);
    error(&["--warp", "theta_h:power-0.4"]);
    let warp = |text: &str| {
        let args = ["picture", "compare", "ggx", "-o", "x", "--warp", text];
        bench.refused(&args, 2)
    };
    assert!(warp("theta_h=sqare-root").contains("did you mean square-root?"));
    assert!(warp("theta=square-root").contains("theta_h"));
    assert!(warp("theta_h").contains("AXIS=WARP"));
}

#[test]
fn what_cannot_be_pictured_is_refused() {
    let bench = Bench::new();
    let refused = |args: &[&str], parts: &[&str]| {
        let sentence = bench.refused(&[&["picture"], args, &["-o", "out"]].concat(), 2);
        for part in parts {
            assert!(sentence.contains(part), "{sentence}");
        }
        assert!(!bench.path("out").exists());
    };
    refused(
        &["hemispheres", "--parametrization", "polar"],
        &["--parametrization", "polar", "hybrid"],
    );
    refused(
        &["hemispheres", "--view-deg", "90"],
        &["--view-deg", "[0, 90)"],
    );
    refused(&["functions", "--phi-deg", "200"], &["--phi-deg", "200"]);
    refused(&["sphere", "shiny"], &["shiny", "ggx"]);
    refused(
        &["sphere", "ggx", "--lighting", "moon"],
        &["--lighting", "moon", "sky"],
    );
    refused(
        &["compare", "ggx", "--reconstruction", "magic"],
        &["--reconstruction", "magic", "cubic"],
    );
    refused(&["slices", "small.toml"], &["--material", "lambert"]);
}

#[test]
fn threads_do_not_matter() {
    let bench = Bench::new();
    let with = |threads: &str| {
        let args = ["--resolution", "20", "--samples", "8", "--threads", threads];
        bench.good(&[&["picture", "sphere", "ggx", "-o", threads], &args[..]].concat());
        fs::read(bench.path(threads).join("ggx-0.3_sphere.png")).unwrap()
    };
    assert_eq!(with("1"), with("2"));
}
