//! `gonio convert`: what goes through is told, and is what was there.

use super::Bench;
use super::common::says;
use std::fs;

const MATERIAL: &str = "budgets = [60]\n[[material]]\nkind = \"ggx\"\nalpha = 0.3\n";

/// A measurement with noise, flags and poses out of reach, in a bench.
fn measured() -> Bench {
    let bench = Bench::new();
    bench.write("a.toml", MATERIAL);
    bench.shown("gonio schedule a.toml --budget 60 -o poses.csv");
    bench.shown("gonio measure poses.csv --config a.toml --instrument cornell --skip-unreachable -o lab.csv");
    bench
}

#[test]
fn arrays_and_lines_lose_nothing() {
    let bench = measured();
    let there = bench.shown("gonio convert lab.csv lab.npz");
    says(&there, "kept: uncertainties, of type A and B");
    assert!(
        !there.contains("changed: ") && there.contains("values moved by at most 0.0e0"),
        "{there}"
    );
    bench.shown("gonio convert lab.npz lab.jsonl");
    bench.shown("gonio convert lab.jsonl again.csv");
    bench.shown("gonio convert lab.csv once.csv");
    assert_eq!(bench.read("again.csv"), bench.read("once.csv"));
    // A schedule is one before and after.
    let told = bench.shown("gonio convert poses.csv poses.npz");
    says(&told, "kept: 45 poses");
    bench.shown("gonio convert poses.npz poses.jsonl");
    bench.shown("gonio convert poses.jsonl again.csv --force");
    bench.shown("gonio convert poses.csv once.csv --force");
    assert_eq!(bench.read("again.csv"), bench.read("once.csv"));
    // What the set of the poses was called stays with the first file; the rows are the same.
    let rows = |file: &str| -> Vec<String> {
        let lines = bench.read(file);
        let lines = lines.lines().filter(|l| !l.starts_with('#'));
        lines.map(String::from).collect()
    };
    assert_eq!(rows("again.csv"), rows("poses.csv"));
}

#[test]
fn what_a_format_has_no_place_for_is_named() {
    let bench = measured();
    let told = bench.shown("gonio convert lab.csv lab.astm");
    says(
        &told,
        "changed: uncertainties, of type A and B before, none after",
    );
    says(&told, "kept: readings, ");
    // A folder of one light a file, and all of them in one again.
    let folder = bench.shown("gonio convert lab.csv scans --format pab-opto");
    let moved = folder
        .lines()
        .find(|l| l.starts_with("values moved"))
        .unwrap();
    let number = |word: usize| moved.split(' ').nth(word).unwrap().parse::<f64>().unwrap();
    assert!(number(5) < 1e-5, "{folder}");
    let files: Vec<_> = fs::read_dir(bench.path("scans")).unwrap().collect();
    assert!(files.len() > 1);
    bench.refused("convert lab.csv lab.astm", 2);
    bench.refused("convert lab.csv lab.binary", 2);
    bench.refused("convert lab.csv lab.none", 2);
    bench.refused("convert nowhere.csv b.csv", 3);
}

#[test]
fn a_table_stays_as_it_is_in_its_own_format() {
    let bench = measured();
    // A size that is not the usual one, and holes.
    let angles: Vec<String> = (0..40).map(|k| k.to_string()).collect();
    let mut values: Vec<String> = (0..40)
        .map(|k| format!("{}", 1.0 + 0.01 * f64::from(k)))
        .collect();
    values[3] = "-999".into();
    values[4] = "-0.02".into();
    values[5] = "0".into();
    let text = format!(
        "Source Measured\nSymmetry PlaneSymmetrical\nSpectralContent Monochrome\nScatterType BRDF\nSampleRotation 1\n0\n\
         AngleOfIncidence 1\n0\nScatterAzimuth 1\n0\nScatterRadial 40\n{}\nMonochrome\nDataBegin\nTIS 0.5\n{}\nDataEnd\n",
        angles.join(" "),
        values.join(" ")
    );
    bench.write("a.zbsdf", text);
    for name in ["binary", "bin", "bsdf", "xml"] {
        bench.shown(&format!("gonio tabulate a.toml -o a.{name}"));
    }
    for name in ["zbsdf", "binary", "bin", "bsdf", "xml"] {
        let [a, b] = ["a", "b"].map(|stem| format!("{stem}.{name}"));
        let told = bench.good(format!("convert {a} {b}"));
        assert!(told.ends_with("kept: the table as it is\n"), "{told}");
        assert!(bench.read_bytes(&a) == bench.read_bytes(&b), "{name}");
        bench.refused(format!("convert {a} {b}"), 2);
        bench.refuses(
            format!("convert {a} {a} --force"),
            2,
            "this file is read and was to be replaced",
        );
    }
    // What is doubtful is said, and the file is read to its end.
    let told = bench.ends("convert a.zbsdf b.zbsdf --force", 0);
    says(
        &told,
        "gonio: a.zbsdf: taken for no reading: -999 in 1 cell\n … gonio: a.zbsdf: 1 value is below 0: taken as 0\n … gonio: a.zbsdf: 1 value is 0 and all others are ",
    );
    // So it is wherever a config names the file, which may name another mark.
    let config = "budgets = [60]\nchannels = \"luminance\"\n[[material]]\nkind = \"zemax\"\npath = \"a.zbsdf\"\n";
    for (key, marks) in [
        ("", "-999 in 1 cell"),
        ("no_reading = 0", "-999 in 1 cell, 0 in 1 cell"),
    ] {
        bench.write("z.toml", format!("{config}{key}\n"));
        let told = bench.ends("check z.toml", 0);
        says(
            &told,
            &format!("gonio: a.zbsdf: taken for no reading: {marks}\n"),
        );
    }
    let told = bench.ends("convert a.zbsdf c.zbsdf --strict", 3);
    says(&told, "1 reading is lost");
    let cut = bench.read("a.zbsdf").replace("DataEnd", "");
    bench.write("cut.zbsdf", cut);
    bench.refuses(
        "convert cut.zbsdf c.zbsdf",
        3,
        "the text ends before DataEnd",
    );
    assert!(!bench.path("c.zbsdf").exists());
}

/// What a table does not have is not in another one, unless that has no empty cells or is asked to have none.
#[test]
fn pairs_without_data_stay_without() {
    let bench = measured();
    bench.shown("gonio tabulate a.toml -o full.bin");
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
    // Beyond 75° there is nothing that this format could leave out.
    let told = bench.good("convert holes.bin a.bsdf");
    assert!(filled(&told) > 0);
    bench.refuses(
        "convert holes.bin b.bsdf --fill",
        2,
        "allowed: --fill with merl, utia",
    );
}

#[test]
fn a_table_goes_into_another_format() {
    let bench = measured();
    bench.shown("gonio tabulate a.toml -o a.binary");
    let told = bench.shown("gonio convert a.binary a.bsdf");
    says(
        &told,
        "table: R, G, B, isotropic … errors of the table, cosine pairs … reciprocity,  … pairs without data: ",
    );
    bench.refused("convert a.binary b.bin --tolerance 1e-9 -q", 6);
    bench.refused("convert a.binary a.csv", 2);
    bench.refused("convert a.binary a.bsdf c.binary", 2);
    // Wavelengths of a table are those of its copy, or refused by one that has none.
    bench.write(
        "red.toml",
        "[[material]]\nkind = \"lambert\"\nalbedo = { nm = [400, 700], values = [0.1, 0.7] }\n",
    );
    bench
        .shown("gonio tabulate red.toml --set channels={wavelengths_nm=[450,550,650]} -o red.bsdf");
    let told = bench.shown("gonio convert red.bsdf again.bsdf");
    assert!(told.starts_with("table: 450, 550, 650 nm"), "{told}");
    bench.refused("convert red.bsdf red.binary", 2);
}

/// A copy of readings that do not say their symmetries does not say them either: what is made of it is the same. Keys of the
/// header that are lost are named.
#[test]
fn copies_of_bare_readings_are_reconstructed_alike() {
    let bench = Bench::new();
    let mut rows =
        "# operator = Kim\n# Tuesday\n# rows = 5\n# axes = 4\ntheta_i_deg,phi_i_deg,theta_o_deg,phi_o_deg,value\n"
            .to_owned();
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
        let text = bench.shown(&format!("gonio reconstruct {file}"));
        text.replace(file, "FILE")
    };
    let first = answer("bare.csv");
    says(&first, "isotropic");
    assert_eq!(answer("turned.csv"), first);
    for copy in ["copy.csv", "copy.jsonl", "copy.npz"] {
        let said = bench.shown(&format!("gonio convert bare.csv {copy}"));
        says(
            &said,
            "left out of the header: operator, rows, axes, 1 comment",
        );
        assert_eq!(answer(copy), first, "{copy}");
    }
    // A part of the poses is in both files.
    let lines: Vec<&str> = rows.lines().collect();
    for (file, [from, to]) in [("one.csv", [5, 60]), ("other.csv", [40, 95])] {
        let part = [&lines[4..5], &lines[from..to]].concat();
        bench.write(file, part.join("\n") + "\n");
    }
    let same = |text: &str| {
        text.lines()
            .filter(|l| !l.contains("averaged"))
            .map(String::from)
            .collect::<Vec<_>>()
    };
    let both = answer("one.csv other.csv");
    says(&both, " poses averaged with those of files before");
    assert_eq!(same(&both), same(&first));
}
