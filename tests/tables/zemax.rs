//! Tables of OpticStudio (Zemax): what comes back of a BRDF that was written, and what is refused.

use super::{high_pairs, nrmse};
use crate::common::{material, member, near, present, refused_edits, says, wavelengths};
use gonio::brdf::measured::zemax::{LEVELS, Level, Zemax, tabulate};
use gonio::brdf::{self, Brdf, Channels};
use gonio::geometry::{Direction, DirectionPair};
use std::f64::consts::PI;

fn zemax(brdf: &dyn Brdf, level: Level) -> String {
    let mut text = Vec::new();
    tabulate(brdf, level).unwrap().0.write(&mut text).unwrap();
    String::from_utf8(text).unwrap()
}

/// Cosine-distributed pairs up to 80°, and as many about the mirror direction.
fn pairs(count: usize) -> Vec<DirectionPair> {
    let free = high_pairs(count);
    let near = free.iter().map(|p| {
        let [theta, phi] = [p.omega_o.theta(), p.omega_o.phi()].map(|x| 0.2 * x.sin() - 0.1);
        let light = p.omega_i;
        let sensor = Direction::from_spherical(light.theta() + theta, light.phi() + PI + phi);
        DirectionPair::new(light, sensor)
    });
    let high = near.filter(|p| p.omega_o.cos_theta() > 0.17).collect();
    [free, high].concat()
}

fn error(truth: &dyn Brdf, table: &dyn Brdf, pairs: &[DirectionPair]) -> f64 {
    nrmse(pairs, |pair| [truth, table].map(|brdf| present(brdf, pair)))
}

#[test]
fn a_zemax_table_comes_back_and_finer_ones_err_less() {
    let pairs = pairs(2000);
    for (alpha, most) in [(0.3, 0.01), (0.1, 0.01)] {
        let keys = format!("alpha = {alpha}");
        let truth = material("ggx", &keys, Channels::Rgb);
        let mut last = most;
        for level in &LEVELS[..2] {
            let text = zemax(&*truth, *level);
            let table = Zemax::read(&text, Channels::Rgb).unwrap();
            let found = error(&*truth, &table, &pairs);
            assert!(found < last, "{level:?}: {found}");
            last = 0.5 * found;
        }
        // In luminance a reader takes Y.
        let grey = material("ggx", &keys, Channels::Luminance);
        let table = Zemax::read(&zemax(&*truth, LEVELS[0]), Channels::Luminance).unwrap();
        assert!(error(&*grey, &table, &pairs) < most);
    }
}

/// The mean of f_r over the hemisphere with the sensor's cosine is what the line TIS says.
#[test]
fn a_zemax_table_says_its_albedo() {
    let grey = material("lambert", "albedo = 0.5", Channels::Luminance);
    let text = zemax(&*grey, LEVELS[1]);
    let tis = text.lines().filter_map(|line| line.strip_prefix("TIS "));
    let tis: Vec<f64> = tis.map(|t| t.parse().unwrap()).collect();
    assert_eq!(tis.len(), LEVELS[1][0] + 1);
    tis.into_iter()
        .for_each(|albedo| near(albedo, 0.5, 2e-3, "TIS"));
}

/// A table by hand: values that tell where they are. Azimuth 0 is towards the normal.
#[test]
fn angles_are_about_the_mirror_direction() {
    let text = "# a sample\nSource  Measured\nSymmetry  PlaneSymmetrical\nSpectralContent  Monochrome\n\
                ScatterType  BRDF\nSampleRotation  1\n0\nAngleOfIncidence 2\n30 60\nScatterAzimuth 3\n0\t90\t180\n\
                ScatterRadial 3\n0 10 20\n\nMonochrome\nDataBegin\nTIS 0.1\n1 2 3\n1 4 5\n1 6 7\n\
                TIS 0.1\n11 12 13\n11 14 15\n11 16 17\nDataEnd\n";
    let table = Zemax::read(text, Channels::Luminance).unwrap();
    assert!(table.symmetry().isotropic && table.symmetry().bilateral);
    let at = |i: f64, o: f64| {
        let [i, o] = [i, o].map(f64::to_radians);
        table.luminance(&DirectionPair::from_spherical(i, 0.7, o, 0.7 + PI))
    };
    // Elevations of light and sensor, and the value.
    let low = [[30.0, 30.0, 1.0], [30.0, 20.0, 2.0], [30.0, 10.0, 3.0]];
    let high = [[30.0, 40.0, 6.0], [30.0, 50.0, 7.0], [60.0, 60.0, 11.0]];
    let between = [[60.0, 70.0, 16.0], [45.0, 45.0, 6.0], [45.0, 40.0, 6.5]];
    for [i, o, want] in [low, high, between].concat() {
        near(at(i, o).unwrap(), want, 1e-9, (i, o));
    }
    // Nothing is made up: not below 30°, nor 20° from the mirror direction.
    for (i, o) in [(29.0, 29.0), (61.0, 61.0), (30.0, 51.0)] {
        assert_eq!(at(i, o), None, "{i} {o}");
    }
    // Across the plane of incidence, on both sides.
    let mirror = Direction::from_spherical(30f64.to_radians(), PI).vector();
    for side in [1.0, -1.0] {
        let (sin, cos) = 10f64.to_radians().sin_cos();
        let o = Direction::from_unit(cos * mirror + glam::DVec3::new(0.0, side * sin, 0.0));
        let pair = DirectionPair::new(Direction::from_spherical(30f64.to_radians(), 0.0), o);
        near(table.luminance(&pair).unwrap(), 4.0, 1e-9, side);
    }
    refused_edits(
        text,
        r"
        Measured\n | Measured\nWhat | line 3: WhatSymmetry: allowed is Symmetry
        BRDF | BTDF | line 5: BTDF: allowed are BRDF
        30 60 | 60 30 | line 9: 30: allowed are degrees from 0 to 90
        SampleRotation  1\n0 | SampleRotation  2\n0 90 | DataEnd: allowed is TIS
        1 4 5 | 1 4 x | line 19: x: allowed is a number of at most 1e150
        DataEnd | 17 DataEnd | 17: allowed is DataEnd
        16 17\nDataEnd\n | 16 17\nDataEnd\n# more\nTIS 0.2\n | TIS: allowed is nothing behind the last DataEnd
        16 17\nDataEnd\n | 16 | the text ends before the last value",
        |text| Zemax::read(text, Channels::Luminance),
    );
}

/// Blocks of several rotations of the sample: at each the light has another azimuth on it.
#[test]
fn rotations_of_the_sample_are_azimuths_of_the_light() {
    let block = |x: f64| {
        let [a, b, c, d] = [1.0, 2.0, 3.0, 4.0].map(|more| x + more);
        format!("TIS 0.1\n{x} {a} {b}\n{x} {c} {d}\n")
    };
    let text = |rotations: &str, values: &[f64]| {
        let blocks: String = values.iter().map(|x| block(*x)).collect();
        format!(
            "Source Measured\nSymmetry PlaneSymmetrical\nSpectralContent Monochrome\nScatterType BRDF\n\
             SampleRotation {}\n{rotations}\nAngleOfIncidence 1\n30\nScatterAzimuth 2\n0 180\nScatterRadial 3\n0 10 20\n\
             Monochrome\nDataBegin\n{blocks}DataEnd\n",
            values.len()
        )
    };
    let table = |rotations: &str, values: &[f64]| {
        Zemax::read(&text(rotations, values), Channels::Luminance).unwrap()
    };
    let at = |table: &Zemax, phi: f64, o: f64| {
        let [i, o, phi] = [30.0, o, phi].map(f64::to_radians);
        table.luminance(&DirectionPair::from_spherical(i, phi, o, phi + PI))
    };
    let whole = table("0 90 180 270", &[10.0, 20.0, 30.0, 40.0]);
    assert!(!whole.symmetry().isotropic);
    // The sample was turned by 90°: the light comes from -90° of it. Between rotations and over the end of the circle values are linear.
    let at_rotations = [(0.0, 10.0), (-90.0, 20.0), (180.0, 30.0), (90.0, 40.0)];
    for (phi, first) in at_rotations
        .into_iter()
        .chain([(-45.0, 15.0), (45.0, 25.0)])
    {
        for (o, more) in [(30.0, 0.0), (20.0, 1.0), (40.0, 3.0)] {
            near(at(&whole, phi, o).unwrap(), first + more, 1e-9, (phi, o));
        }
    }
    let part = table("0 45 90", &[10.0, 20.0, 30.0]);
    assert_eq!(at(&part, 10.0, 30.0), None);
    near(at(&part, -22.5, 30.0).unwrap(), 15.0, 1e-9, "inside");
}

/// A table of one light and one azimuth by hand, of thirty angles from the mirror direction.
fn row(values: &[String]) -> String {
    assert_eq!(values.len(), 30);
    let angles: Vec<String> = (0..30).map(|k| k.to_string()).collect();
    format!(
        "Source Measured\nSymmetry PlaneSymmetrical\nSpectralContent Monochrome\nScatterType BRDF\nSampleRotation 1\n0\n\
         AngleOfIncidence 1\n0\nScatterAzimuth 1\n0\nScatterRadial 30\n{}\nMonochrome\nDataBegin\nTIS n.a.\n{}\nDataEnd\n",
        angles.join(" "),
        values.join(" ")
    )
}

#[test]
fn what_stands_for_no_reading_is_none() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.zbsdf");
    let table = |values: &[(usize, &str)], keys: &str| {
        let whole = (0..30).map(|k| (1.0 + 0.1 * f64::from(k)).to_string());
        let mut all: Vec<String> = whole.collect();
        values
            .iter()
            .for_each(|(k, value)| all[*k] = (*value).into());
        std::fs::write(&path, row(&all)).unwrap();
        let spec = member(brdf::all(), "zemax", &format!("path = {path:?}\n{keys}"));
        let table = spec.build(spec.widest_channels().unwrap()).unwrap();
        (table.remarks(), table)
    };
    // The azimuth of the table is the light's own: at the normal, any.
    let at = |table: &dyn Brdf, radial: f64| {
        let pair = DirectionPair::from_spherical(0.0, 0.0, radial.to_radians(), 0.0);
        table.luminance(&pair)
    };
    let marks = [(3, "-999"), (4, "NaN"), (9, "-0.01"), (20, "-999")];
    let (remarks, marked) = table(&marks, "");
    let told = "taken for no reading: -999 in 2 cells, NaN in 1 cell";
    assert_eq!(remarks, [told, "1 value is below 0: taken as 0"]);
    // 20 has neighbours with a reading, 3.5 has none.
    assert_eq!([3.5, 20.0].map(|radial| at(&*marked, radial)), [None; 2]);
    for (radial, want) in [(20.4, 3.1), (2.7, 1.2), (9.0, 0.0), (8.5, 0.9)] {
        near(at(&*marked, radial).unwrap(), want, 1e-9, radial);
    }
    assert_eq!(marked.cells_without_reading(), 3);

    // Zeros where nothing is near 0 are doubted, and holes if the config says so.
    let (remarks, zeros) = table(&[(5, "0"), (6, "0")], "");
    says(&remarks[0], "2 values are 0 and all others are 1 and more");
    near(at(&*zeros, 5.0).unwrap(), 0.0, 1e-9, 5);
    let (remarks, holes) = table(&[(5, "0"), (6, "0")], "no_reading = 0");
    assert_eq!(remarks, ["taken for no reading: 0 in 2 cells"]);
    assert_eq!(at(&*holes, 5.5), None);
    // -1 among values of its size is noise.
    let (remarks, _) = table(&[(3, "-1")], "");
    assert_eq!(remarks, ["1 value is below 0: taken as 0"]);
    let none = row(&vec!["n.a.".into(); 30]);
    let told = Zemax::read(&none, Channels::Luminance).unwrap_err();
    assert_eq!(told.to_string(), "no cell of this table holds a reading");
}

/// One wavelength is a comment of the text: the reader gives it.
#[test]
fn one_wavelength_is_held() {
    let one = material("lambert", "albedo = 0.5", wavelengths(&[632.8]));
    let text = zemax(&*one, LEVELS[0]);
    assert!(text.contains("# at 632.8 nm\n"));
    let table = Zemax::read(&text, one.channels().clone()).unwrap();
    let pair = DirectionPair::from_spherical(0.3, 0.0, 0.5, 1.0);
    near(present(&table, &pair)[0] * PI, 0.5, 1e-6, pair);
    assert!(Zemax::read(&text, wavelengths(&[450.0, 550.0])).is_err());
}
