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
    let commands = [
        "hemispheres --view-deg 30 --parametrization hybrid",
        "functions --phi-deg 0 --parametrization stark",
        "slices ggx --resolution 24",
        "sphere ggx --resolution 16 --samples 4",
        "compare ggx --budget 200 --reconstruction thin-plate --resolution 16 --samples 4 --lighting constant",
    ];
    let mut told = Vec::new();
    for command in commands {
        let args = format!("picture {command} -o out");
        let said = bench.ends(&args, 0);
        let paths = said.lines().filter_map(|l| l.strip_prefix("out/"));
        told.extend(paths.map(str::to_owned));
        bench.refuses(&args, 2, "--force");
        if command.starts_with("functions") {
            bench.good(format!("{args} --force"));
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
    let small = "--budget 200 --resolution 16 --samples 4 -o out";
    let error = |warps: &str| -> f64 {
        let all = "picture compare ggx --set alpha=0.05";
        let said = bench.good(format!("{all} {small} {warps}"));
        let title = said.lines().next().unwrap();
        assert_eq!(title.contains("theta_h:"), !warps.is_empty(), "{title}");
        let words = said.split_whitespace();
        let mut numbers = words.filter_map(|word| word.trim_end_matches(',').parse().ok());
        numbers.next_back().unwrap()
    };
    let (plain, warped) = (error(""), error("--warp theta_h=square-root"));
    assert!(warped.is_finite() && warped != plain);
    error("--warp theta_h:power-0.4");
}

#[test]
fn what_cannot_be_pictured_is_refused() {
    let bench = Bench::new();
    bench.refuses_all(
        "2 | picture hemispheres -o out --parametrization polar | --parametrization … polar … hybrid
         2 | picture hemispheres -o out --view-deg 90 | --view-deg … [0, 90)
         2 | picture functions -o out --phi-deg 200 | --phi-deg … 200
         2 | picture sphere shiny -o out | shiny … ggx
         2 | picture sphere ggx -o out --lighting moon | --lighting … moon … sky
         2 | picture compare ggx -o out --reconstruction magic | --reconstruction … magic … cubic
         2 | picture slices small.toml -o out | --material … lambert
         2 | picture compare ggx -o out --warp theta_h=sqare-root | did you mean square-root?
         2 | picture compare ggx -o out --warp theta=square-root | theta_h
         2 | picture compare ggx -o out --warp theta_h | AXIS=WARP
         2 | slice ggx -o out --view-deg 90 | --view-deg … 90 … [0, 90)
         2 | slice ggx -o out --view-deg NaN | --view-deg
         2 | slice shiny -o out --view-deg 0 | shiny … ggx
         2 | slice ggx -o out --set alpha=-1 --view-deg 0 | alpha
         2 | slice small.toml -o out --view-deg 0 | --material … lambert",
    );
    assert!(!bench.path("out").exists());
}
