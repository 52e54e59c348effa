//! ALTA text files: random pairs, written with our own parametrizations, come back.

use super::chord;
use super::common::{ISOTROPIC, random_pair, table};
use gonio::brdf::Channels;
use gonio::geometry::{DirectionPair, Symmetry, distance};
use gonio::measurement::alta::{AltaFile, is_alta, read};
use gonio::parametrization::{Coords, find};
use gonio::sampling::Random;
use gonio::schedule::Assume;
use std::f64::consts::{FRAC_PI_2, PI};

/// Random pairs at least 3° above the horizon, where square roots keep twelve digits.
fn pairs() -> Vec<DirectionPair> {
    let random = Random::new(5);
    let high = |p: &DirectionPair| p.omega_i.cos_theta() > 0.05 && p.omega_o.cos_theta() > 0.05;
    (0..400)
        .map(|i| random_pair(&random, i))
        .filter(high)
        .collect()
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
    let at = |name: &str, c: Coords| find(name).unwrap().form(ISOTROPIC).inverse(&c);
    match input {
        "SPHERICAL_TL_PL_TV_PV" => (vec![l.theta(), l.phi(), v.theta(), v.phi()], *pair),
        "ISOTROPIC_TV_TL_DPHI" => (vec![v.theta(), l.theta(), delta], *pair),
        "ISOTROPIC_TL_TV_PROJ_DPHI" => {
            let (s, c) = delta.sin_cos();
            (vec![l.theta(), v.theta() * c, v.theta() * s], *pair)
        }
        "RUSIN_TH_PH_TD_PD" => {
            let [th, ph, td, pd] = half(Symmetry::NONE);
            (vec![th, ph, td, pd + PI], *pair)
        }
        "RUSIN_TH_TD_PD" => {
            let [th, td, pd, _] = half(ISOTROPIC);
            (vec![th, td, pd - PI], *pair)
        }
        "RUSIN_TH_TD" => {
            let [th, td, ..] = half(ISOTROPIC);
            let sideways = at("half-difference", [th, td, -FRAC_PI_2, 0.0]);
            (vec![th, td], sideways.unwrap())
        }
        "STARK_3D" => (hybrid[..3].to_vec(), *pair),
        "STARK_2D" => {
            let sideways = at("hybrid", [hybrid[0], hybrid[1], FRAC_PI_2, 0.0]);
            (hybrid[..2].to_vec(), sideways.unwrap())
        }
        "NEUMANN_3D" => (flat[..3].to_vec(), *pair),
        "NEUMANN_2D" => {
            let sideways = at("orthographic", [flat[0], flat[1], FRAC_PI_2, 0.0]);
            (flat[..2].to_vec(), sideways.unwrap())
        }
        "CARTESIAN" => {
            let (l, v) = (l.vector(), v.vector());
            (vec![v.x, v.y, v.z, l.x, l.y, l.z], *pair)
        }
        other => panic!("{other}"),
    }
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
    let n = if more.contains("#VS 1") { n - 1 } else { n };
    let mut text =
        format!("#DIM {n} {p}\n#PARAM_IN  {input}\n#PARAM_OUT {output}\n{more}# by hand\n\n");
    for row in rows {
        let cells: Vec<String> = row.iter().map(f64::to_string).collect();
        text += &(cells.join("\t") + "\n");
    }
    text
}

fn good(text: &str) -> AltaFile {
    assert!(is_alta(text));
    read(text, "a.txt", &Assume::default()).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn pairs_come_back_from_every_kind_of_coordinates() {
    for (input, isotropic) in INPUTS {
        let pairs = pairs();
        let of: Vec<_> = pairs.iter().map(|p| of_pair(input, p)).collect();
        let rows: Vec<Vec<f64>> = of
            .iter()
            .enumerate()
            .map(|(i, (x, _))| [x.clone(), vec![i as f64 + 0.5]].concat())
            .collect();
        let back = good(&file(input, "INV_STERADIAN", 1, &rows, "#VS 0\n"));
        assert_eq!(back.input, input);
        assert_eq!(
            (back.rows.below_horizon, back.rows.folded.poses),
            (0, 0),
            "{input}"
        );
        let m = &back.rows.measurement;
        assert_eq!(m.channels, Channels::Luminance);
        assert_eq!(m.readings(), pairs.len());
        assert_eq!(m.schedule.parametrization.symmetry().isotropic, isotropic);
        for (i, (pose, (_, pair))) in m.schedule.poses.iter().zip(&of).enumerate() {
            let apart = if isotropic {
                distance(&pose.pair, pair, ISOTROPIC)
            } else {
                chord(&pose.pair, pair)
            };
            assert!(apart < 1e-12, "{input}: {apart:e} {pair:?}");
            assert_eq!(m.value(i), Some(&[i as f64 + 0.5][..]));
        }
    }
}

#[test]
fn values_lose_their_cosine_and_keep_their_colours() {
    let pairs = pairs();
    let rows: Vec<Vec<f64>> = pairs
        .iter()
        .map(|p| [of_pair("CARTESIAN", p).0, vec![0.1, 0.2, 0.3]].concat())
        .collect();
    for (output, cosine) in [
        ("INV_STERADIAN", false),
        ("RGB_COLOR", false),
        ("INV_STERADIAN_COSINE_FACTOR", true),
    ] {
        let back = good(&file("CARTESIAN", output, 3, &rows, ""));
        assert_eq!(back.rows.measurement.channels, Channels::Rgb);
        for (i, pair) in pairs.iter().enumerate() {
            let cos = if cosine {
                pair.omega_o.cos_theta()
            } else {
                1.0
            };
            for (value, c) in back
                .rows
                .measurement
                .value(i)
                .unwrap()
                .iter()
                .zip([0.1, 0.2, 0.3])
            {
                assert!((value * cos - c).abs() < 1e-14);
            }
        }
    }
}

#[test]
fn values_by_wavelength_need_their_wavelengths() {
    let nm = [400.0, 532.5, 700.0, 1064.0];
    let line = "#WAVELENGTHS_NM 400 532.5 700 1064\n";
    let pairs = pairs();
    let rows = |p: usize, more: &[f64]| -> Vec<Vec<f64>> {
        let values = [0.1, 0.2, 0.3, 0.4];
        let row = |pair| {
            [
                of_pair("CARTESIAN", pair).0,
                values[..p].to_vec(),
                more.to_vec(),
            ]
        };
        pairs.iter().map(|pair| row(pair).concat()).collect()
    };
    for (more, radii) in [(line.to_owned(), false), (format!("{line}#VS 1\n"), true)] {
        let radius: &[f64] = if radii { &[0.01] } else { &[] };
        let back = good(&file(
            "CARTESIAN",
            "INV_STERADIAN",
            4,
            &rows(4, radius),
            &more,
        ));
        let back = back.rows.measurement;
        let Channels::Wavelengths(found) = &back.channels else {
            panic!("{:?}", back.channels);
        };
        assert_eq!(found.nm(), nm);
        assert_eq!(back.value(1), Some(&[0.1, 0.2, 0.3, 0.4][..]));
        assert_eq!(back.details.is_some(), radii);
    }
    // As many as there are colours are wavelengths still.
    let three = "#WAVELENGTHS_NM 400 500 600\n";
    let back = good(&file("CARTESIAN", "INV_STERADIAN", 3, &rows(3, &[]), three));
    assert!(back.rows.measurement.channels.wavelengths().is_some());
    for (output, p, more, why) in [
        ("INV_STERADIAN", 4, "", "or one for each of #WAVELENGTHS_NM"),
        ("INV_STERADIAN", 3, line, "4 values of INV_STERADIAN"),
        (
            "RGB_COLOR",
            3,
            three,
            "not allowed with #PARAM_OUT RGB_COLOR",
        ),
        (
            "INV_STERADIAN",
            3,
            "#WAVELENGTHS_NM 500 400 600\n",
            "each above the one before",
        ),
        (
            "INV_STERADIAN",
            3,
            "#WAVELENGTHS_NM blue 500 600\n",
            "blue: allowed are numbers of nm",
        ),
    ] {
        let text = file("CARTESIAN", output, p, &rows(p, &[]), more);
        let error = read(&text, "a.txt", &Assume::default()).err().unwrap();
        assert!(error.to_string().contains(why), "{error}");
    }
}

#[test]
fn a_radius_and_half_of_two_ends_are_uncertainties() {
    let row = [0.1, 0.2, 0.3, 0.4, 5.0];
    let one = [row.to_vec(), vec![0.25]].concat();
    let text = file(
        "SPHERICAL_TL_PL_TV_PV",
        "INV_STERADIAN",
        1,
        &[one],
        "#VS 1\n",
    );
    let details = good(&text).rows.measurement.details.unwrap();
    assert_eq!((details.type_a[0], details.type_b[0]), (0.0, 0.25));
    let negative = text.replace("0.25\n", "-0.25\n");
    let refusal = read(&negative, "a", &Assume::default()).err().unwrap();
    let told = refusal.to_string();
    assert!(
        told.contains("radius -0.25: allowed is a number from 0"),
        "{told}"
    );
    let text = text
        .replace("#VS 1", "#VS 2")
        .replace("0.25\n", "4.75 5.5\n");
    let details = good(&text).rows.measurement.details.unwrap();
    assert_eq!((details.type_a[0], details.type_b[0]), (0.0, 0.375));
    let turned = text.replace("4.75 5.5", "5.5 4.75");
    assert!(read(&turned, "a", &Assume::default()).is_err());
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
    let back = good(&file(
        "SPHERICAL_TL_PL_TV_PV",
        "INV_STERADIAN",
        1,
        &rows,
        "",
    ));
    assert_eq!((back.rows.below_horizon, back.rows.folded.poses), (2, 2));
    assert_eq!(back.rows.measurement.values, [2.5, 2.5]);
    // Outside the domain of lengths there is no pair.
    for input in ["STARK_3D", "NEUMANN_3D"] {
        let rows = [vec![0.1, 0.2, 0.3, 1.0], vec![0.9, 0.9, 0.1, 1.0]];
        let back = good(&file(input, "INV_STERADIAN", 1, &rows, ""));
        assert_eq!(
            (back.rows.below_horizon, back.rows.measurement.readings()),
            (1, 1)
        );
    }
}

#[test]
fn a_reading_beyond_all_bounds_is_refused_with_its_line() {
    let near = 89.9_f64.to_radians();
    let read = |output: &str, row: &[f64], more: &str| {
        let rows = [vec![0.1, 0.0, 0.2, 0.0, 1.0, 1.0], row.to_vec()];
        let text = file("SPHERICAL_TL_PL_TV_PV", output, 1, &rows, more);
        read(&text, "a.txt", &Assume::default())
    };
    for (output, value, good) in [
        ("INV_STERADIAN", 1e308, false),
        ("INV_STERADIAN", -1e150, true),
        ("INV_STERADIAN_COSINE_FACTOR", 1e306, false),
        ("INV_STERADIAN_COSINE_FACTOR", 1e148, false),
        ("INV_STERADIAN_COSINE_FACTOR", 1e147, true),
    ] {
        for row in [
            [0.1, 0.0, near, 0.0, value, 0.0],
            [0.1, 0.0, near, 0.0, 0.0, value.abs()],
        ] {
            match read(output, &row, "#VS 1\n") {
                Ok(back) => {
                    assert!(good, "{value}");
                    assert!(back.rows.measurement.values.iter().all(|v| v.is_finite()));
                }
                Err(e) => {
                    assert!(!good, "{e}");
                    assert_eq!(e.line, Some(8), "{e}");
                    let start = format!("{value:e} is no reading");
                    assert!(e.message.starts_with(&start), "{e}");
                    assert!(super::chain(&e).contains("because: without the cosine"));
                }
            }
        }
    }
}

#[test]
fn what_is_not_supported_is_refused_with_its_line() {
    let row = vec![0.1, 0.2, 0.3, 0.4, 5.0];
    let text = file(
        "SPHERICAL_TL_PL_TV_PV",
        "INV_STERADIAN",
        1,
        &[row.clone(), row],
        "",
    );
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
        let line = line.parse().ok();
        let bad = text.replacen(from, to, 1);
        assert_ne!(bad, text, "{from}");
        let e = read(&bad, "a.txt", &Assume::default()).err().unwrap();
        assert_eq!(e.line, line, "{e}");
        assert!(e.message.contains(part), "{e}");
    }
    let long = file(
        "CARTESIAN",
        "INV_STERADIAN",
        1,
        &[vec![0.0, 0.0, 1.1, 0.0, 0.0, 1.0, 5.0]],
        "",
    );
    let e = read(&long, "a.txt", &Assume::default()).err().unwrap();
    assert_eq!(e.line, Some(6));
    assert!(!is_alta("theta_i_deg,phi_i_deg\n#DIM 4 1\n"));
}
