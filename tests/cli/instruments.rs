//! Instruments: what the program lists of them, what it says of a file, and what it refuses.

use super::common::edited;
use super::{Bench, words_after};
use gonio::instrument;

#[test]
fn the_reachable_share_is_that_of_the_limits() {
    // No arm in the way and no axis short of a turn: both elevations up to θ are all that counts,
    // and of cosine-distributed directions that is sin²θ, of pairs sin⁴θ.
    let bench = Bench::new();
    let limits = "theta_i_max_deg=60 theta_o_max_deg=60 separation_min_deg=0";
    let sets = limits.split(' ').map(|l| format!(" --set limits.{l}"));
    let said = bench.good("check pgii".to_owned() + &sets.collect::<String>());
    for material in ["isotropic", "anisotropic"] {
        let row = words_after(&said, material).join(" ");
        let numbers = row.split([' ', ',']).filter_map(|word| word.parse().ok());
        let numbers: Vec<f64> = numbers.collect();
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
    let presets = instrument::presets();
    let cornell = presets.iter().find(|p| p.name == "cornell").unwrap();
    let text = edited(cornell.text, "bits = 16", "bit = 16");
    let line = text.lines().position(|line| line.contains("bit = 16"));
    let line = line.unwrap() + 1;
    bench.write("mine.toml", text);
    // An override is its own place; a preset that is none is a file that is not there.
    bench.does(&format!(
        "2 | check mine.toml | mine.toml:{line}: … unknown key detector.bit; allowed:
         2 | check rosi --set axis.0.max_deg=-200 | axis[0].min_deg = -180: allowed is a number below max_deg = -200
         2 | check rosi --set detector.bits=0 | --set detector.bits=0: detector.bits = 0
         2 | check rose | rose"
    ));
}
