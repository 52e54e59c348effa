//! `gonio convert`: what goes through is told, and is what was there.

use super::common::says;
use super::{Bench, READINGS, words_after};

const MATERIAL: &str = "budgets = [60]\nmaterial = [{ kind = \"ggx\", alpha = 0.3 }]\n";

/// A measurement with noise, flags and poses out of reach, in a bench.
fn measured() -> Bench {
    let bench = Bench::new();
    bench.write("a.toml", MATERIAL);
    bench.does(
        "0 | schedule a.toml --budget 60 -o poses.csv
         0 | measure poses.csv --config a.toml --instrument cornell --skip-unreachable -o lab.csv",
    );
    bench
}

#[test]
fn arrays_and_lines_lose_nothing() {
    let bench = measured();
    let kept = "kept: uncertainties, of type A and B … values moved by at most 0.0e0";
    let there = bench.tells("convert lab.csv lab.npz", kept);
    assert!(!there.contains("changed: "), "{there}");
    // A schedule is one before and after.
    bench.does(
        "0 | convert lab.npz lab.jsonl
         0 | convert lab.jsonl again.csv
         0 | convert lab.csv once.csv
         0 | convert poses.csv poses.npz | kept: 45 poses
         0 | convert poses.npz poses.jsonl
         0 | convert poses.jsonl poses-again.csv
         0 | convert poses.csv poses-once.csv",
    );
    for of in ["", "poses-"] {
        let [again, once] = ["again", "once"].map(|file| bench.read(&format!("{of}{file}.csv")));
        assert_eq!(again, once);
    }
    // What the set of the poses was called stays with the first file; the rows are the same.
    assert_eq!(bench.lines("poses-again.csv"), bench.lines("poses.csv"));
}

#[test]
fn what_a_format_has_no_place_for_is_named() {
    let bench = measured();
    let told = "kept: readings,  … changed: uncertainties, of type A and B before, none after";
    bench.tells("convert lab.csv lab.astm", told);
    // A folder of one light a file, and all of them in one again.
    let folder = bench.good("convert lab.csv scans --format pab-opto");
    let moved = words_after(&folder, "values moved by at most ");
    assert!(moved[0].parse::<f64>().unwrap() < 1e-5, "{folder}");
    assert!(bench.files("scans").len() > 1);
    bench.does(
        "2 | convert lab.csv lab.astm
         2 | convert lab.csv lab.binary
         2 | convert lab.csv lab.none
         3 | convert nowhere.csv b.csv",
    );
}

#[test]
fn a_table_stays_as_it_is_in_its_own_format() {
    let bench = measured();
    // A size that is not the usual one, and holes.
    let angles: Vec<String> = (0..40).map(|k| k.to_string()).collect();
    let value = |k: i32| match k {
        3 => "-999".into(),
        4 => "-0.02".into(),
        5 => "0".into(),
        k => format!("{}", 1.0 + 0.01 * f64::from(k)),
    };
    let values: Vec<String> = (0..40).map(value).collect();
    let text = format!(
        "Source Measured\nSymmetry PlaneSymmetrical\nSpectralContent Monochrome\nScatterType BRDF\nSampleRotation 1\n0\n\
         AngleOfIncidence 1\n0\nScatterAzimuth 1\n0\nScatterRadial 40\n{}\nMonochrome\nDataBegin\nTIS 0.5\n{}\nDataEnd\n",
        angles.join(" "),
        values.join(" ")
    );
    bench.write("a.zbsdf", text);
    for name in ["binary", "bin", "bsdf", "xml"] {
        bench.good(format!("tabulate a.toml -o a.{name}"));
    }
    for name in ["zbsdf", "binary", "bin", "bsdf", "xml"] {
        let [a, b] = ["a", "b"].map(|stem| format!("{stem}.{name}"));
        let told = bench.good(format!("convert {a} {b}"));
        assert!(told.ends_with("kept: the table as it is\n"), "{told}");
        assert!(bench.read_bytes(&a) == bench.read_bytes(&b), "{name}");
        bench.does(&format!(
            "2 | convert {a} {b}
             2 | convert {a} {a} --force | this file is read and was to be replaced"
        ));
    }
    let cut = bench.read("a.zbsdf").replace("DataEnd", "");
    bench.write("cut.zbsdf", cut);
    bench.does(
        "3+ | convert a.zbsdf c.zbsdf --strict | 1 reading is lost
         3 | convert cut.zbsdf c.zbsdf | the text ends before DataEnd",
    );
    assert!(!bench.path("c.zbsdf").exists());
}

/// What a table does not have is not in another one, unless that has no empty cells or is asked to have none.
#[test]
fn pairs_without_data_stay_without() {
    let bench = measured();
    bench.good("tabulate a.toml -o full.bin");
    // All sensors of lights at 60° and 75°: the last two of six elevations, of 48 azimuths each.
    let mut bytes = bench.read_bytes("full.bin");
    let of_light = 8 * 288;
    for plane in bytes.chunks_exact_mut(6 * 48 * of_light) {
        for value in plane[4 * 48 * of_light..].as_chunks_mut::<8>().0 {
            *value = f64::NAN.to_le_bytes();
        }
    }
    bench.write("holes.bin", &bytes);
    let nan = |name: &str| {
        let bytes = bench.read_bytes(name);
        let values = bytes.as_chunks::<8>().0.iter();
        values.filter(|v| f64::from_le_bytes(**v).is_nan()).count()
    };
    bench.good("convert holes.bin kept.bin");
    assert_eq!(nan("kept.bin"), 3 * 96 * 288);
    let told = bench.good("convert holes.bin filled.bin --fill");
    let filled = |told: &str| -> usize {
        let line = told.lines().find_map(|l| l.strip_prefix("filled: "));
        let (filled, rest) = line.unwrap().split_once(" of ").unwrap();
        assert!(rest.ends_with(" pairs, which had no data"), "{told}");
        filled.parse().unwrap()
    };
    // A light at 60° may have what one just above it has.
    assert!((48 * 288..=96 * 288).contains(&filled(&told)), "{told}");
    assert_eq!(nan("filled.bin"), 0);
    // Of the halfway's last elevations nothing is known, which this format could not leave out.
    bench.good("tabulate a.toml -o full.binary -q");
    let mut bytes = bench.read_bytes("full.binary");
    for plane in bytes[12..].chunks_exact_mut(8 * 90 * 90 * 180) {
        for value in plane[8 * 80 * 90 * 180..].as_chunks_mut::<8>().0 {
            *value = (-1.0f64).to_le_bytes();
        }
    }
    bench.write("holes.binary", &bytes);
    let told = bench.good("convert holes.binary a.bsdf");
    assert!(filled(&told) > 0);
    bench.does("2 | convert holes.bin b.bsdf --fill | allowed: --fill with merl, utia");
}

#[test]
fn a_table_goes_into_another_format() {
    let bench = measured();
    bench.good("tabulate a.toml -o a.binary");
    let told = "table: R, G, B, isotropic … errors of the table, cosine pairs … reciprocity,  … pairs without data: ";
    bench.tells("convert a.binary a.bsdf", told);
    // Wavelengths of a table are those of its copy, or refused by one that has none.
    let albedo = "{ nm = [400, 700], values = [0.1, 0.7] }";
    let red = format!("material = [{{ kind = \"lambert\", albedo = {albedo} }}]\n");
    bench.write("red.toml", red);
    bench.does(
        "6 | convert a.binary b.bin --tolerance 1e-9 -q
         2 | convert a.binary a.csv
         2 | convert a.binary a.bsdf c.binary
         0 | tabulate red.toml --set channels={wavelengths_nm=[450,550,650]} -o red.bsdf
         0 | convert red.bsdf again.bsdf | table: 450, 550, 650 nm
         2 | convert red.bsdf red.binary",
    );
}

/// A copy of readings that do not say their symmetries does not say them either: what is made of it is the same. Keys of the
/// header that are lost are named.
#[test]
fn copies_of_bare_readings_are_reconstructed_alike() {
    let bench = Bench::new();
    let mut rows = format!("# operator = Kim\n# Tuesday\n# rows = 5\n# axes = 4\n{READINGS}");
    for k in 0..90 {
        let (i, o, phi) = (2 + 7 * (k % 9), 1 + 9 * (k % 7), 40 * (k % 11) - 170);
        let value = 0.1 + 0.001 * f64::from(i + o);
        rows += &format!("{i},{},{o},{phi},{value}\n", 30 * (k % 5));
    }
    bench.write("bare.csv", &rows);
    // The order of rows is nothing that is measured.
    let mut turned: Vec<&str> = rows.lines().collect();
    turned[5..].reverse();
    bench.write("turned.csv", turned.join("\n") + "\n");
    let answer = |file: &str| {
        let said = bench.good(format!("reconstruct {file}"));
        said.replace(file, "FILE")
    };
    let first = answer("bare.csv");
    says(&first, "isotropic");
    assert_eq!(answer("turned.csv"), first);
    for copy in ["copy.csv", "copy.jsonl", "copy.npz"] {
        let lost = "left out of the header: operator, rows, axes, 1 comment";
        bench.tells(format!("convert bare.csv {copy}"), lost);
        assert_eq!(answer(copy), first, "{copy}");
    }
}
