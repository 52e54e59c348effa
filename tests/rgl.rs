//! RGL tables: the bytes, the map that makes normals uniform, and what comes back of a BRDF that was written.
#![cfg(feature = "experiments")]

mod common;

use common::{Level as Size, levels, made, material};
use gonio::brdf::measured::rgl::file::{Colours, Head};
use gonio::brdf::measured::rgl::warp::{Densities, Grids, Weighted};
use gonio::brdf::measured::rgl::{Fields, LEVELS, Level, Rgl, tabulate};
use gonio::brdf::{self, Brdf, Channels, Presence, Wavelengths};
use gonio::geometry::DirectionPair;
use gonio::registry;
use std::f64::consts::{FRAC_PI_2, PI};
use std::io::Cursor;

levels! {
    half_and_quarter_circles_are_mirrored: "thorough: more azimuths";
}

const USUAL: Level = LEVELS[0];

/// Half as many nodes.
const COARSE: Level = Level {
    nodes: 32,
    elevations: 16,
    azimuths: 17,
};

fn bytes(fields: &Fields) -> Vec<u8> {
    let mut bytes = Vec::new();
    fields.write(&mut bytes).unwrap();
    bytes
}

fn read(bytes: &[u8]) -> Result<Fields, String> {
    let head = Head::read(Cursor::new(bytes), bytes.len() as u64);
    head.and_then(Head::load).map_err(|e| e.to_string())
}

/// Numbers in [0, 1) without a pattern.
fn numbers(seed: usize) -> impl Iterator<Item = f64> {
    (0..).map(move |i: usize| {
        let x = ((i + seed) as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        ((x ^ (x >> 31)).wrapping_mul(0xBF58_476D_1CE4_E5B9) >> 11) as f64 / (1u64 << 53) as f64
    })
}

/// Pairs with elevations up to `most`, uniform in cosine, from every side.
fn pairs(count: usize, most: f64) -> Vec<DirectionPair> {
    let numbers: Vec<f64> = numbers(1).take(4 * count).collect();
    let pair = |u: &[f64]| {
        let theta = |u: f64| (1.0 - u * (1.0 - most.cos())).acos();
        DirectionPair::from_spherical(theta(u[0]), 7.0 * u[1], theta(u[2]), 7.0 * u[3])
    };
    numbers.chunks(4).map(pair).collect()
}

/// Root mean square of differences over that of the truth, and the median relative difference.
fn errors(truth: &dyn Brdf, table: &dyn Brdf, pairs: &[DirectionPair]) -> [f64; 2] {
    let mut all = Vec::new();
    let [mut sum, mut square] = [0.0; 2];
    for pair in pairs {
        let (t, r) = (
            truth.luminance(pair).unwrap(),
            table.luminance(pair).unwrap(),
        );
        let weight = pair.omega_i.cos_theta() * pair.omega_o.cos_theta();
        sum += weight * (t - r).powi(2);
        square += weight * t * t;
        all.push((r / t - 1.0).abs());
    }
    all.sort_by(f64::total_cmp);
    [(sum / square).sqrt(), all[all.len() / 2]]
}

#[test]
fn a_file_comes_back_to_the_bit() {
    for (kind, keys, level) in [
        ("ggx", "alpha = 0.2", COARSE),
        (
            "ward",
            "alpha = [0.1, 0.3]",
            Level {
                azimuths: 5,
                elevations: 4,
                nodes: 8,
            },
        ),
    ] {
        let fields = tabulate(&*material(kind, keys, Channels::Rgb), level).unwrap();
        let file = bytes(&fields);
        let again = read(&file).unwrap();
        assert_eq!(bytes(&again), file, "{kind}");
        // The bytes that other readers look for.
        assert_eq!(&file[..14], b"tensor_file\0\x01\x00");
        assert!(again.jacobian);
        assert_eq!(again.phi_i.len() > 2, kind == "ward");
    }
}

/// The inverse of the inverse, and the area of a small square against its density.
#[test]
fn the_map_makes_normals_uniform() {
    let values = |seed| numbers(seed).map(|u| (u * u * u) as f32).take(7 * 5);
    let grids = Grids {
        size: [7, 5],
        values: values(3).chain(values(99)).collect(),
    };
    let densities = Densities::new(grids).unwrap();
    for grid in 0..2 {
        let own = Weighted::from_elem((grid, 1.0), 1);
        let points: Vec<f64> = numbers(7).take(400).collect();
        for p in points.chunks(2) {
            let there = densities.place(grid, [p[0], p[1]]);
            let (back, density) = densities.uniform(&own, there);
            assert!(
                (back[0] - p[0]).abs() + (back[1] - p[1]).abs() < 1e-12,
                "{p:?} {back:?}"
            );
            // d(s, t) / d(x, y), by differences within the cell.
            let d = 1e-6;
            let inside = [0, 1].map(|k| (there[k] * [6.0, 4.0][k]).fract() > 1e-4);
            if there.iter().all(|x| *x < 1.0 - 2.0 * d) && inside == [true; 2] {
                let moved =
                    |dx: f64, dy: f64| densities.uniform(&own, [there[0] + dx, there[1] + dy]).0;
                let [a, b] = [moved(d, 0.0), moved(0.0, d)];
                let area =
                    (a[0] - back[0]) * (b[1] - back[1]) - (a[1] - back[1]) * (b[0] - back[0]);
                assert!(
                    (area / (d * d) - density).abs() < 1e-3 * (1.0 + density),
                    "{there:?}"
                );
            }
        }
    }
    // Between two the distribution is that of the mixture.
    let both: Weighted = [(0, 0.25), (1, 0.75)].into_iter().collect();
    let ([s, t], _) = densities.uniform(&both, [1.0, 1.0]);
    assert!((s - 1.0).abs() < 1e-12 && (t - 1.0).abs() < 1e-12);
    let black = Grids {
        size: [2, 2],
        values: vec![0.0; 4],
    };
    assert!(Densities::new(black).is_none());
}

#[test]
fn lobes_come_back_and_more_nodes_come_nearer() {
    let pairs = pairs(2000, 80f64.to_radians());
    for alpha in [1.0, 0.3, 0.1] {
        let truth = material("ggx", &format!("alpha = {alpha}"), Channels::Rgb);
        let error = |level| {
            let fields = read(&bytes(&tabulate(&*truth, level).unwrap())).unwrap();
            let table = Rgl::new(fields, Channels::Rgb).unwrap();
            errors(&*truth, &table, &pairs)
        };
        let [coarse, fine] = [COARSE, USUAL].map(error);
        assert!(fine[0] < 2e-3 && fine[1] < 1e-3, "{alpha}: {fine:?}");
        // Linear between nodes: of twice as many a quarter, but for distributions, which are as fine in both.
        assert!(fine[0] < 0.5 * coarse[0], "{alpha}: {coarse:?} {fine:?}");
    }
}

#[test]
#[ignore = "thorough: a table of full size"]
fn brushed_metal_comes_back() {
    let truth = material("ggx", "alpha = [0.2, 0.5]", Channels::Luminance);
    let fields = tabulate(&*truth, USUAL).unwrap();
    let table = Rgl::new(fields, Channels::Luminance).unwrap();
    assert!(!table.symmetry().isotropic);
    let [nrmse, median] = errors(&*truth, &table, &pairs(1000, 80f64.to_radians()));
    assert!(nrmse < 0.02 && median < 0.02, "{nrmse} {median}");
}

#[test]
fn a_matte_table_is_matte_and_grey() {
    let white = material("lambert", "albedo = 0.5", Channels::Luminance);
    let fields = tabulate(&*white, USUAL).unwrap();
    let table = Rgl::new(fields, Channels::Rgb).unwrap();
    let pairs = pairs(500, 80f64.to_radians());
    let [nrmse, median] = errors(&*white, &table, &pairs);
    assert!(nrmse < 0.01 && median < 2e-3, "{nrmse} {median}");
    for pair in pairs {
        let mut out = [0.0; 3];
        assert_eq!(table.eval(&pair, &mut out), Presence::Present);
        assert_eq!((out[0], out[1]), (out[1], out[2]));
    }
}

#[test]
fn wavelengths_are_met_between_those_of_the_file() {
    let nm = |nm: &[f64]| Channels::Wavelengths(Wavelengths::new(nm).unwrap());
    let keys = "albedo = { nm = [400, 700], values = [0.1, 0.7] }";
    let red = material("lambert", keys, nm(&[400.0, 500.0, 700.0]));
    let file = bytes(&tabulate(&*red, COARSE).unwrap());
    let table = Rgl::new(read(&file).unwrap(), nm(&[450.0, 600.0])).unwrap();
    let pair = DirectionPair::from_spherical(0.3, 0.1, 0.5, 2.0);
    let mut out = [0.0; 2];
    let _ = table.eval(&pair, &mut out);
    for (out, albedo) in out.into_iter().zip([0.2, 0.5]) {
        assert!((out * PI / albedo - 1.0).abs() < 0.01, "{out}");
    }
    for wrong in [Channels::Rgb, Channels::Luminance] {
        let refused = Rgl::new(read(&file).unwrap(), wrong).unwrap_err();
        assert!(refused.to_string().contains("wavelengths"), "{refused}");
    }
}

#[test]
fn beyond_the_last_light_there_is_no_data() {
    let mut fields = tabulate(&*material("ggx", "alpha = 0.3", Channels::Rgb), COARSE).unwrap();
    let most = 1.0;
    let share = most / fields.theta_i[fields.theta_i.len() - 1];
    fields.theta_i.iter_mut().for_each(|t| *t *= share);
    let table = Rgl::new(fields, Channels::Rgb).unwrap();
    let at = |light: f64, sensor: f64| {
        table.luminance(&DirectionPair::from_spherical(light, 0.0, sensor, 1.0))
    };
    assert!(at(0.99, 1.5).is_some() && at(1.01, 0.2).is_none());
    assert_eq!(at(FRAC_PI_2 + 0.1, 0.2), Some(0.0));
}

/// A table that is cut to a part of the circle is the whole one, also at the seams.
fn half_and_quarter_circles_are_mirrored(size: Size) {
    let azimuths = size.of([13, 7, 4], [25, 13, 7]);
    let truth = material("ggx", "alpha = [0.1, 0.4]", Channels::Luminance);
    let level = Level {
        azimuths: azimuths[0],
        ..COARSE
    };
    let whole = tabulate(&*truth, level).unwrap();
    let table = |count: usize| {
        let mut fields = whole.clone();
        let share = |grids: &mut Grids| {
            let length = grids.values.len() / azimuths[0] * count;
            grids.values.truncate(length);
        };
        fields.phi_i.truncate(count);
        share(&mut fields.vndf);
        share(&mut fields.luminance);
        share(&mut fields.values);
        let fields = read(&bytes(&fields)).unwrap();
        Rgl::new(fields, Channels::Luminance).unwrap()
    };
    let [whole, half, quarter] = azimuths.map(table);
    for turn in [0.0, 0.3, 0.5, 1.0, 1.25, 1.5, 1.9] {
        for sensor in [0.0, 0.4, 0.9, 1.1, 1.7] {
            let phi = turn * PI;
            let pair = DirectionPair::from_spherical(0.7, phi, 0.6, phi + sensor * PI);
            let [w, h, q] = [&whole, &half, &quarter].map(|t| t.luminance(&pair).unwrap());
            assert!((h / w - 1.0).abs() < 0.02, "{turn} {sensor}: {h} {w}");
            assert!((q / w - 1.0).abs() < 0.02, "{turn} {sensor}: {q} {w}");
        }
    }
}

/// A matte table to 75° with a hole: nothing is made up beyond, and the hole has what is around it.
#[test]
fn tables_that_end_and_have_holes() {
    let cut = made(gonio::geometry::Symmetry::FULL, |pair| {
        let most = pair.omega_i.theta().max(pair.omega_o.theta());
        let has_data = most <= 75f64.to_radians() && pair.separation() > 0.1;
        has_data.then_some([0.25])
    });
    let fields = tabulate(&cut, USUAL).unwrap();
    let table = Rgl::new(fields, Channels::Luminance).unwrap();
    let at = |light: f64, sensor: f64, phi: f64| {
        let [light, sensor] = [light, sensor].map(f64::to_radians);
        table.luminance(&DirectionPair::from_spherical(
            light,
            0.2,
            sensor,
            0.2 + phi,
        ))
    };
    for light in [10.0, 40.0, 74.0, 74.99] {
        // Near the horizon a matte table has few nodes, and cells that cross it.
        for (sensor, phi) in [(30.0, 0.3), (60.0, 2.0), (f64::min(light, 50.0) + 1.0, 0.0)] {
            let value = at(light, sensor, phi).unwrap();
            assert!(
                (value / 0.25 - 1.0).abs() < 0.03,
                "{light} {sensor} {phi}: {value}"
            );
        }
        assert_eq!(at(75.1, light, 1.0), None);
    }
}

/// A wavelength without a reading is none, and a cell without one has what is around it.
#[test]
fn one_bad_wavelength_or_cell_spoils_itself_only() {
    let level = Level {
        azimuths: 5,
        elevations: 3,
        nodes: 8,
    };
    let nm = Wavelengths::new(&[450.0, 500.0, 550.0, 600.0]).unwrap();
    let whole = tabulate(
        &*material("lambert", "albedo = 0.5", Channels::Wavelengths(nm)),
        level,
    );
    let whole = whole.unwrap();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.bsdf");
    let entry = brdf::all().into_iter().find(|e| e.kind == "rgl").unwrap();
    let spec = registry::read_text(&entry, &format!("path = {path:?}")).unwrap();
    let write = |change: &dyn Fn(&mut Fields)| {
        let mut fields = whole.clone();
        change(&mut fields);
        std::fs::write(&path, bytes(&fields)).unwrap();
    };
    let pair = DirectionPair::from_spherical(0.5, 0.0, 0.8, 2.0);
    let values = |nm: &[f64]| {
        let channels = Channels::Wavelengths(Wavelengths::new(nm).unwrap());
        let table = spec.build(channels).map_err(|e| e.to_string())?;
        let mut out = vec![0.0; nm.len()];
        assert_eq!(table.eval(&pair, &mut out), Presence::Present);
        Ok::<_, String>(out)
    };
    write(&|_| ());
    let before = values(&[450.0, 600.0]).unwrap();
    let remarks = || {
        spec.build(spec.widest_channels().unwrap())
            .unwrap()
            .remarks()
    };
    assert!(remarks().is_empty());
    let left = Channels::Wavelengths(Wavelengths::new(&[450.0, 550.0, 600.0]).unwrap());
    for name_is_bad in [false, true] {
        write(&|f| {
            let grid = level.nodes.pow(2);
            if let (true, Colours::Wavelengths(nm)) = (name_is_bad, &mut f.colours) {
                nm[1] = f32::NAN;
                return;
            }
            for incidence in f.values.values.chunks_exact_mut(4 * grid) {
                incidence[grid..2 * grid].fill(f32::NAN);
            }
        });
        spec.check(&left).unwrap();
        assert_eq!(spec.held_channels().unwrap(), Some(left.clone()));
        let told = if name_is_bad { "NaN" } else { "500" };
        let told = format!("the wavelength {told} nm has no reading: passed over");
        assert_eq!(remarks()[0], told);
        assert_eq!(values(&[450.0, 600.0]).unwrap(), before);
    }
    // The last one is missed where it is asked for.
    write(&|f| {
        let grid = level.nodes.pow(2);
        for incidence in f.values.values.chunks_exact_mut(4 * grid) {
            incidence[3 * grid..].fill(-999.0);
        }
    });
    assert!(values(&[600.0]).unwrap_err().contains("from 450 to 550 nm"));
    let cells = level.elevations * level.nodes.pow(2);
    assert!(remarks()[1].ends_with(&format!("no reading: -999 in {cells} cells")));
    values(&[550.0]).unwrap();
    // Of a matte table the hole of a cell has what is around it, to what nodes are apart.
    for node in 0..level.nodes.pow(2) {
        write(&|f| {
            for incidence in f.values.values.chunks_exact_mut(4 * level.nodes.pow(2)) {
                incidence[node] = f32::NAN;
            }
        });
        let after = values(&[450.0]).unwrap()[0];
        assert!((after / before[0] - 1.0).abs() < 0.4, "{node}: {after}");
        assert_eq!(
            spec.build(left.clone()).unwrap().cells_without_reading(),
            level.elevations
        );
    }
}

#[test]
fn damaged_files_are_refused_by_name() {
    let level = Level {
        azimuths: 5,
        elevations: 2,
        nodes: 4,
    };
    let whole = tabulate(&*material("ggx", "alpha = 0.5", Channels::Rgb), level).unwrap();
    let file = bytes(&whole);
    for cut in [0, 5, 14, 17, 40, 300, file.len() / 2, file.len() - 1] {
        assert!(read(&file[..cut]).is_err(), "{cut}");
    }
    let mut other = file.clone();
    other[0] = b'T';
    assert!(read(&other).unwrap_err().contains("tensor_file"));
    let broken = |change: &dyn Fn(&mut Fields)| {
        let mut fields = whole.clone();
        change(&mut fields);
        read(&bytes(&fields)).map(drop).unwrap_err()
    };
    type Change<'a> = &'a dyn Fn(&mut Fields);
    let cases: [(Change<'_>, &str); 4] = [
        (&|f| f.theta_i.reverse(), "theta_i"),
        (
            &|f| f.ndf.values[7] = f32::NAN,
            "\"ndf\" holds NaN at place 7",
        ),
        (&|f| f.vndf.values[3] = -1.0, "\"vndf\" holds -1 at place 3"),
        (&|f| f.phi_i[0] = 100.0, "phi_i"),
    ];
    for (change, why) in cases {
        let message = broken(change);
        assert!(message.contains(why), "{message}");
    }
    let mut black = whole;
    black.vndf.values.fill(0.0);
    assert!(
        Rgl::new(black, Channels::Rgb)
            .unwrap_err()
            .to_string()
            .contains("vndf")
    );
}
