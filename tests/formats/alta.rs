//! ALTA text files: random pairs, written with our own parametrizations, come back.

use super::common::{ISOTROPIC, edited, lowest, near, random_pairs, table};
use super::{chord, refused};
use gonio::brdf::Channels;
use gonio::geometry::{DirectionPair, Symmetry, distance};
use gonio::measurement::Readings;
use gonio::measurement::alta::{is_alta, read};
use gonio::parametrization::{Coords, find};
use gonio::schedule::{Assume, FileError};
use std::f64::consts::{FRAC_PI_2, PI};

/// Random pairs at least 3° above the horizon, where square roots keep twelve digits.
fn pairs() -> Vec<DirectionPair> {
    let all = random_pairs(5).take(400);
    all.filter(|p| lowest(p) > 0.05).collect()
}

fn coords(name: &str, symmetry: Symmetry, pair: &DirectionPair) -> Coords {
    find(name).unwrap().form(symmetry).forward(pair)
}

/// The coordinates of a pair and what the reader can know of it.
fn of_pair(input: &str, pair: &DirectionPair) -> (Vec<f64>, DirectionPair) {
    let (l, v) = (pair.omega_i, pair.omega_o);
    let half = |s| coords("half-difference", s, pair);
    let hybrid = coords("hybrid", ISOTROPIC, pair);
    let flat = coords("orthographic", ISOTROPIC, pair);
    let delta = l.phi() - v.phi();
    // The pair of the same lengths or elevations at another azimuth.
    let sideways = |name: &str, [a, b, ..]: Coords, azimuth| {
        let form = find(name).unwrap().form(ISOTROPIC);
        (vec![a, b], form.inverse(&[a, b, azimuth, 0.0]).unwrap())
    };
    let coords = match input {
        "SPHERICAL_TL_PL_TV_PV" => vec![l.theta(), l.phi(), v.theta(), v.phi()],
        "ISOTROPIC_TV_TL_DPHI" => vec![v.theta(), l.theta(), delta],
        "ISOTROPIC_TL_TV_PROJ_DPHI" => {
            let (s, c) = delta.sin_cos();
            vec![l.theta(), v.theta() * c, v.theta() * s]
        }
        "RUSIN_TH_PH_TD_PD" => {
            let [th, ph, td, pd] = half(Symmetry::NONE);
            vec![th, ph, td, pd + PI]
        }
        "RUSIN_TH_TD_PD" => {
            let [th, td, pd, _] = half(ISOTROPIC);
            vec![th, td, pd - PI]
        }
        "RUSIN_TH_TD" => return sideways("half-difference", half(ISOTROPIC), -FRAC_PI_2),
        "STARK_3D" => hybrid[..3].to_vec(),
        "STARK_2D" => return sideways("hybrid", hybrid, FRAC_PI_2),
        "NEUMANN_3D" => flat[..3].to_vec(),
        "NEUMANN_2D" => return sideways("orthographic", flat, FRAC_PI_2),
        "CARTESIAN" => [v, l].iter().flat_map(|d| d.vector().to_array()).collect(),
        other => panic!("{other}"),
    };
    (coords, *pair)
}

const INPUTS: [(&str, bool); 11] = [
    ("SPHERICAL_TL_PL_TV_PV", false),
    ("ISOTROPIC_TV_TL_DPHI", true),
    ("ISOTROPIC_TL_TV_PROJ_DPHI", true),
    ("RUSIN_TH_PH_TD_PD", false),
    ("RUSIN_TH_TD_PD", true),
    ("RUSIN_TH_TD", true),
    ("STARK_3D", true),
    ("STARK_2D", true),
    ("NEUMANN_3D", true),
    ("NEUMANN_2D", true),
    ("CARTESIAN", false),
];

fn file(input: &str, output: &str, p: usize, rows: &[Vec<f64>], more: &str) -> String {
    let n = rows[0].len() - p;
    let radii = (0..3).find(|n| more.contains(&format!("#VS {n}")));
    let n = n - radii.unwrap_or(0);
    let mut text =
        format!("#DIM {n} {p}\n#PARAM_IN  {input}\n#PARAM_OUT {output}\n{more}# by hand\n\n");
    for row in rows {
        let cells: Vec<String> = row.iter().map(f64::to_string).collect();
        text += &(cells.join("\t") + "\n");
    }
    text
}

/// The note about coordinates, rows below the horizon, and rows that were averaged with others.
fn note(input: &str, below: usize, averaged: &str) -> String {
    let rows = if below == 1 { "row" } else { "rows" };
    format!("ALTA {input}: {below} {rows} below the horizon, {averaged} averaged with earlier ones")
}

fn try_read(text: &str) -> Result<Readings, FileError> {
    read(text, "a.txt", &Assume::default())
}

fn good(text: &str) -> Readings {
    assert!(is_alta(text));
    try_read(text).unwrap_or_else(|e| panic!("{e}"))
}

/// A file of the four angles and one value, 1/sr.
fn spherical(rows: &[Vec<f64>], more: &str) -> String {
    file("SPHERICAL_TL_PL_TV_PV", "INV_STERADIAN", 1, rows, more)
}

/// Pairs as coordinates, each with these values.
fn cartesian(values: &[f64]) -> Vec<Vec<f64>> {
    let row = |pair| [of_pair("CARTESIAN", pair).0, values.to_vec()].concat();
    pairs().iter().map(row).collect()
}

#[test]
fn pairs_come_back_from_every_kind_of_coordinates() {
    for (input, isotropic) in INPUTS {
        let pairs = pairs();
        let of: Vec<_> = pairs.iter().map(|p| of_pair(input, p)).collect();
        let places = of.iter().map(|(x, _)| x.clone()).enumerate();
        let rows = places.map(|(i, x)| [x, vec![i as f64 + 0.5]].concat());
        let rows: Vec<_> = rows.collect();
        let back = good(&file(input, "INV_STERADIAN", 1, &rows, "#VS 0\n"));
        assert_eq!(back.notes, [note(input, 0, "0 rows")]);
        let m = &back.measurement;
        assert_eq!(m.channels, Channels::Luminance);
        assert_eq!(m.readings(), pairs.len());
        assert_eq!(m.schedule.parametrization.symmetry().isotropic, isotropic);
        for (i, (pose, (_, pair))) in m.schedule.poses.iter().zip(&of).enumerate() {
            let apart = match isotropic {
                true => distance(&pose.pair, pair, ISOTROPIC),
                false => chord(&pose.pair, pair),
            };
            near(apart, 0.0, 1e-12, (input, pair));
            assert_eq!(m.value(i), Some(&[i as f64 + 0.5][..]));
        }
    }
}

#[test]
fn values_lose_their_cosine_and_keep_their_colours() {
    let rows = cartesian(&[0.1, 0.2, 0.3]);
    for output in ["INV_STERADIAN", "RGB_COLOR", "INV_STERADIAN_COSINE_FACTOR"] {
        let has_cosine = output.contains("COSINE");
        let back = good(&file("CARTESIAN", output, 3, &rows, ""));
        assert_eq!(back.measurement.channels, Channels::Rgb);
        for (i, pair) in pairs().iter().enumerate() {
            let cosine = pair.omega_o.cos_theta();
            let cos = if has_cosine { cosine } else { 1.0 };
            let values = back.measurement.value(i).unwrap();
            for (value, c) in values.iter().zip([0.1, 0.2, 0.3]) {
                near(value * cos, c, 1e-14, output);
            }
        }
    }
}

#[test]
fn values_by_wavelength_need_their_wavelengths() {
    let values = [0.1, 0.2, 0.3, 0.4];
    let line = "#WAVELENGTHS_NM 400 532.5 700 1064\n";
    let with_radii = cartesian(&[0.1, 0.2, 0.3, 0.4, 0.01]);
    let plain = cartesian(&values);
    for (rows, more, has_radii) in [(plain, "", false), (with_radii, "#VS 1\n", true)] {
        let more = format!("{line}{more}");
        let back = good(&file("CARTESIAN", "INV_STERADIAN", 4, &rows, &more));
        let back = back.measurement;
        let found = back.channels.wavelengths().unwrap();
        assert_eq!(found.nm(), [400.0, 532.5, 700.0, 1064.0]);
        assert_eq!(back.value(1), Some(&values[..]));
        assert_eq!(back.details.is_some(), has_radii);
    }
    // As many as there are colours are wavelengths still.
    let three = "#WAVELENGTHS_NM 400 500 600\n";
    let rows = cartesian(&values[..3]);
    let back = good(&file("CARTESIAN", "INV_STERADIAN", 3, &rows, three));
    assert!(back.measurement.channels.wavelengths().is_some());
    for [output, p, nm, line, part] in table(
        "
        INV_STERADIAN | 4 |                    | 1 | or one for each of #WAVELENGTHS_NM
        INV_STERADIAN | 3 | 400 532.5 700 1064 | 1 | 4 values of INV_STERADIAN
        RGB_COLOR     | 3 | 400 500 600        | 4 | not allowed with #PARAM_OUT RGB_COLOR
        INV_STERADIAN | 3 | 500 400 600        | 4 | each above the one before
        INV_STERADIAN | 3 | blue 500 600       | 4 | blue: allowed are numbers of nm",
    ) {
        let p = p.parse().unwrap();
        let more = format!("#WAVELENGTHS_NM {nm}\n");
        let more = if nm.is_empty() { "" } else { &more };
        let text = file("CARTESIAN", output, p, &cartesian(&values[..p]), more);
        refused(try_read(&text), line, part);
    }
}

#[test]
fn a_radius_and_half_of_two_ends_are_uncertainties() {
    let text = |vs: usize, cells: &[f64]| {
        let row = [&[0.1, 0.2, 0.3, 0.4, 5.0], cells].concat();
        spherical(&[row], &format!("#VS {vs}\n"))
    };
    for (vs, cells, want) in [(1, &[0.25][..], 0.25), (2, &[4.75, 5.5], 0.375)] {
        let details = good(&text(vs, cells)).measurement.details.unwrap();
        assert_eq!((details.type_a[0], details.type_b[0]), (0.0, want));
    }
    let negative = "radius -0.25: allowed is a number from 0";
    refused(try_read(&text(1, &[-0.25])), "7", negative);
    assert!(try_read(&text(2, &[5.5, 4.75])).is_err());
}

#[test]
fn rows_below_the_horizon_are_counted_and_rows_of_one_pose_averaged() {
    let rows = [
        vec![0.1, 0.0, 0.3, 0.0, 1.0],
        vec![1.6, 0.0, 0.3, 0.0, 7.0],
        vec![0.1, 0.0, FRAC_PI_2, 0.0, 7.0],
        vec![0.1, 0.0, 0.3, 0.0, 4.0],
        vec![0.0, 0.5, 0.3, 0.0, 2.0],
        vec![0.0, 1.5, 0.3, 0.0, 3.0],
    ];
    let back = good(&spherical(&rows, ""));
    assert_eq!(back.notes, [note("SPHERICAL_TL_PL_TV_PV", 2, "2 rows")]);
    assert_eq!(back.measurement.values, [2.5, 2.5]);
    // Outside the domain of lengths there is no pair.
    for input in ["STARK_3D", "NEUMANN_3D"] {
        let rows = [vec![0.1, 0.2, 0.3, 1.0], vec![0.9, 0.9, 0.1, 1.0]];
        let back = good(&file(input, "INV_STERADIAN", 1, &rows, ""));
        assert_eq!(back.notes, [note(input, 1, "0 rows")]);
        assert_eq!(back.measurement.readings(), 1);
    }
}

#[test]
fn a_reading_beyond_all_bounds_is_refused_with_its_line() {
    let near_horizon = 89.9_f64.to_radians();
    for (output, value, is_good) in [
        ("INV_STERADIAN", 1e308_f64, false),
        ("INV_STERADIAN", -1e150, true),
        ("INV_STERADIAN_COSINE_FACTOR", 1e306, false),
        ("INV_STERADIAN_COSINE_FACTOR", 1e148, false),
        ("INV_STERADIAN_COSINE_FACTOR", 1e147, true),
    ] {
        for cells in [[value, 0.0], [0.0, value.abs()]] {
            let first = vec![0.1, 0.0, 0.2, 0.0, 1.0, 1.0];
            let rows = [first, [&[0.1, 0.0, near_horizon, 0.0], &cells[..]].concat()];
            let text = file("SPHERICAL_TL_PL_TV_PV", output, 1, &rows, "#VS 1\n");
            if is_good {
                let values = good(&text).measurement.values;
                assert!(values.iter().all(|v| v.is_finite()));
                continue;
            }
            let told = format!("a.txt:8: {value:e} is no reading … because: without the cosine");
            refused(try_read(&text), "8", &told);
        }
    }
}

#[test]
fn what_is_not_supported_is_refused_with_its_line() {
    let row = vec![0.1, 0.2, 0.3, 0.4, 5.0];
    let text = spherical(&[row.clone(), row], "");
    for [from, to, line, part] in table(
        r"
        SPHERICAL_TL_PL_TV_PV | COS_TH | 2 | #PARAM_IN COS_TH: allowed are SPHERICAL
        INV_STERADIAN | XYZ_COLOR | 3 | #PARAM_OUT XYZ_COLOR: allowed are INV_STERADIAN,
        #DIM 4 1 | #DIM 3 1 | 1 | #DIM 3 1: allowed are 4 coordinates
        #DIM 4 1 | #DIM 4 2 | 1 | 1 or 3 values
        #PARAM_IN | #PARAM | - | #PARAM_IN is missing
        # by hand | #VS 3 | 4 | #VS 3: allowed are 0, 1 and 2
        # by hand | #VS 1 | 6 | 5 cells where #DIM and #VS ask for 6
        # by hand | #FORMAT binary | 4 | #FORMAT binary: allowed is text
        0.4\t5\n | 0.4\tnan\n | 6 | nan: allowed is a finite number
        0.4\t5\n | 0.4\n | 6 | 4 cells where",
    ) {
        refused(try_read(&edited(&text, from, to)), line, part);
    }
    let long = [vec![0.0, 0.0, 1.1, 0.0, 0.0, 1.0, 5.0]];
    let long = file("CARTESIAN", "INV_STERADIAN", 1, &long, "");
    refused(try_read(&long), "6", "a.txt");
    assert!(!is_alta("theta_i_deg,phi_i_deg\n#DIM 4 1\n"));
}
