//! RGL tables: the bytes, the map that makes normals uniform, and what comes back of a BRDF that was written.

use super::nrmse;
use crate::common::{
    Level as Size, levels, lowest, made, material, member, near, present, product, random_pairs,
    says, wavelengths,
};
use gonio::brdf::measured::TableError;
use gonio::brdf::measured::rgl::file::{Colours, Head};
use gonio::brdf::measured::rgl::warp::{Densities, Grids, Weighted};
use gonio::brdf::measured::rgl::{self, Fields, LEVELS, Level, Rgl};
use gonio::brdf::{self, Brdf, Channels};
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::sampling::Random;
use std::f64::consts::{FRAC_PI_2, PI};
use std::io::Cursor;

levels! {
    half_and_quarter_circles_are_mirrored: "thorough: more azimuths";
}

const USUAL: Level = LEVELS[0];

fn tabulate(brdf: &dyn Brdf, level: Level) -> Result<Fields, TableError> {
    Ok(rgl::tabulate(brdf, level)?.0)
}

/// Half as many nodes.
const COARSE: Level = level(17, 16, 32);

const fn level(azimuths: usize, elevations: usize, nodes: usize) -> Level {
    [nodes, elevations, azimuths]
}

fn bytes(fields: &Fields) -> Vec<u8> {
    let mut bytes = Vec::new();
    fields.write(&mut bytes).unwrap();
    bytes
}

fn read(bytes: &[u8]) -> Result<Fields, String> {
    let head = Head::read(Cursor::new(bytes), bytes.len() as u64);
    head.and_then(Head::load).map_err(|e| e.to_string())
}

/// Pairs of elevations up to 80°, uniform in their cosines.
fn pairs(count: usize) -> Vec<DirectionPair> {
    let high = random_pairs(1).filter(|p| lowest(p) > 80f64.to_radians().cos());
    high.take(count).collect()
}

/// Root mean square of differences of the luminance over that of the truth, and the median relative difference.
fn errors(truth: &dyn Brdf, table: &dyn Brdf, pairs: &[DirectionPair]) -> [f64; 2] {
    let values = |pair: &DirectionPair| [truth, table].map(|b| b.luminance(pair).unwrap());
    let relative = pairs.iter().map(values).map(|[t, r]| (r / t - 1.0).abs());
    let mut relative: Vec<f64> = relative.collect();
    relative.sort_by(f64::total_cmp);
    let nrmse = nrmse(pairs, |pair| values(pair).map(|v| [v]));
    [nrmse, relative[relative.len() / 2]]
}

#[test]
fn a_file_comes_back_to_the_bit() {
    let ward = ("ward", "alpha = [0.1, 0.3]", level(5, 4, 8));
    for (kind, keys, level) in [("ggx", "alpha = 0.2", COARSE), ward] {
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
    let random = Random::new(3);
    let values = (0..2 * 7 * 5).map(|i| random.point::<1>(i)[0].powi(3) as f32);
    let (size, values) = ([7, 5], values.collect());
    let densities = Densities::new(Grids { size, values }).unwrap();
    for grid in 0..2 {
        let own = Weighted::from_elem((grid, 1.0), 1);
        for p in (100..300).map(|i| random.point::<2>(i)) {
            let there = densities.place(grid, p);
            let (back, density) = densities.uniform(&own, there);
            let found = (back[0] - p[0]).abs() + (back[1] - p[1]).abs();
            near(found, 0.0, 1e-12, p);
            // d(s, t) / d(x, y), by differences within the cell.
            let d = 1e-6;
            let inside = [0, 1].map(|k| (there[k] * [6.0, 4.0][k]).fract() > 1e-4);
            if there.iter().all(|x| *x < 1.0 - 2.0 * d) && inside == [true; 2] {
                let [x, y] = there;
                let [a, b] = [[x + d, y], [x, y + d]].map(|moved| {
                    let there = densities.uniform(&own, moved).0;
                    [0, 1].map(|k| there[k] - back[k])
                });
                near(
                    (a[0] * b[1] - a[1] * b[0]) / (d * d),
                    density,
                    1e-3 * (1.0 + density),
                    there,
                );
            }
        }
    }
    // Between two the distribution is that of the mixture.
    let both: Weighted = [(0, 0.25), (1, 0.75)].into_iter().collect();
    let ([s, t], _) = densities.uniform(&both, [1.0, 1.0]);
    near(
        (s - 1.0).abs().max((t - 1.0).abs()),
        0.0,
        1e-12,
        "the far corner",
    );
    let (size, values) = ([2, 2], vec![0.0; 4]);
    assert!(Densities::new(Grids { size, values }).is_none());
}

#[test]
fn lobes_come_back_and_more_nodes_come_nearer() {
    let pairs = pairs(2000);
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
    let [nrmse, median] = errors(&*truth, &table, &pairs(1000));
    assert!(nrmse < 0.02 && median < 0.02, "{nrmse} {median}");
}

#[test]
fn a_matte_table_is_matte_and_grey() {
    let white = material("lambert", "albedo = 0.5", Channels::Luminance);
    let fields = tabulate(&*white, USUAL).unwrap();
    let table = Rgl::new(fields, Channels::Rgb).unwrap();
    let pairs = pairs(500);
    let [nrmse, median] = errors(&*white, &table, &pairs);
    assert!(nrmse < 0.01 && median < 2e-3, "{nrmse} {median}");
    for pair in pairs {
        let out = present(&table, &pair);
        assert_eq!((out[0], out[1]), (out[1], out[2]));
    }
}

#[test]
fn wavelengths_are_met_between_those_of_the_file() {
    let keys = "albedo = { nm = [400, 700], values = [0.1, 0.7] }";
    let red = material("lambert", keys, wavelengths(&[400.0, 500.0, 700.0]));
    let file = bytes(&tabulate(&*red, COARSE).unwrap());
    let table = Rgl::new(read(&file).unwrap(), wavelengths(&[450.0, 600.0])).unwrap();
    let pair = DirectionPair::from_spherical(0.3, 0.1, 0.5, 2.0);
    for (out, albedo) in present(&table, &pair).into_iter().zip([0.2, 0.5]) {
        near(out * PI / albedo, 1.0, 0.01, albedo);
    }
    for wrong in [Channels::Rgb, Channels::Luminance] {
        let refusal = Rgl::new(read(&file).unwrap(), wrong).unwrap_err();
        says(&refusal.to_string(), "wavelengths");
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
    let whole = tabulate(&*truth, level(azimuths[0], 16, 32)).unwrap();
    let table = |count: usize| {
        let mut fields = whole.clone();
        fields.phi_i.truncate(count);
        for grids in [&mut fields.vndf, &mut fields.luminance, &mut fields.values] {
            let length = grids.values.len() / azimuths[0] * count;
            grids.values.truncate(length);
        }
        let fields = read(&bytes(&fields)).unwrap();
        Rgl::new(fields, Channels::Luminance).unwrap()
    };
    let [whole, half, quarter] = azimuths.map(table);
    let turns = [0.0, 0.3, 0.5, 1.0, 1.25, 1.5, 1.9];
    for (turn, sensor) in product(turns, [0.0, 0.4, 0.9, 1.1, 1.7]) {
        let phi = turn * PI;
        let pair = DirectionPair::from_spherical(0.7, phi, 0.6, phi + sensor * PI);
        let [w, h, q] = [&whole, &half, &quarter].map(|t| t.luminance(&pair).unwrap());
        near(h / w, 1.0, 0.02, ("half", turn, sensor));
        near(q / w, 1.0, 0.02, ("quarter", turn, sensor));
    }
}

/// A matte table to 75° with a hole: nothing is made up beyond, and the hole has what is around it.
#[test]
fn tables_that_end_and_have_holes() {
    let cut = made(Symmetry::FULL, |pair| {
        let most = pair.omega_i.theta().max(pair.omega_o.theta());
        let has_data = most <= 75f64.to_radians() && pair.separation() > 0.1;
        has_data.then_some([0.25])
    });
    let fields = tabulate(&cut, USUAL).unwrap();
    let table = Rgl::new(fields, Channels::Luminance).unwrap();
    let at = |light: f64, sensor: f64, phi: f64| {
        let [light, sensor] = [light, sensor].map(f64::to_radians);
        let pair = DirectionPair::from_spherical(light, 0.2, sensor, 0.2 + phi);
        table.luminance(&pair)
    };
    for light in [10.0, 40.0, 74.0, 74.99] {
        // Near the horizon a matte table has few nodes, and cells that cross it.
        for (sensor, phi) in [(30.0, 0.3), (60.0, 2.0), (f64::min(light, 50.0) + 1.0, 0.0)] {
            let value = at(light, sensor, phi).unwrap();
            near(value / 0.25, 1.0, 0.03, (light, sensor, phi));
        }
        assert_eq!(at(75.1, light, 1.0), None);
    }
}

/// A wavelength without a reading is none, and a cell without one has what is around it.
#[test]
fn one_bad_wavelength_or_cell_spoils_itself_only() {
    let level = level(5, 3, 8);
    let grid = level[0].pow(2);
    let nm = wavelengths(&[450.0, 500.0, 550.0, 600.0]);
    let whole = tabulate(&*material("lambert", "albedo = 0.5", nm), level).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.bsdf");
    let spec = member(brdf::all(), "rgl", &format!("path = {path:?}"));
    let write = |change: &dyn Fn(&mut Fields)| {
        let mut fields = whole.clone();
        change(&mut fields);
        std::fs::write(&path, bytes(&fields)).unwrap();
    };
    // Sets a range of the values of every incidence.
    let fill = |range: std::ops::Range<usize>, value: f32| {
        write(&|fields| {
            let incidences = fields.values.values.chunks_exact_mut(4 * grid);
            incidences.for_each(|values| values[range.clone()].fill(value));
        });
    };
    let pair = DirectionPair::from_spherical(0.5, 0.0, 0.8, 2.0);
    let values = |nm: &[f64]| {
        let table = spec.build(wavelengths(nm)).map_err(|e| e.to_string())?;
        Ok::<_, String>(present(&*table, &pair))
    };
    write(&|_| ());
    let before = values(&[450.0, 600.0]).unwrap();
    let widest = || spec.build(spec.widest_channels().unwrap()).unwrap();
    assert!(widest().remarks().is_empty());
    let left = wavelengths(&[450.0, 550.0, 600.0]);
    for bad in ["500", "NaN"] {
        match bad {
            "500" => fill(grid..2 * grid, f32::NAN),
            _ => write(&|fields| {
                if let Colours::Wavelengths(nm) = &mut fields.colours {
                    nm[1] = f32::NAN;
                }
            }),
        }
        spec.check(&left).unwrap();
        assert_eq!(spec.held_channels().unwrap(), Some(left.clone()));
        let remark = format!("the wavelength {bad} nm has no reading: passed over");
        assert_eq!(widest().remarks()[0], remark);
        assert_eq!(values(&[450.0, 600.0]).unwrap(), before);
    }
    // The last one is missed where it is asked for.
    fill(3 * grid..4 * grid, -999.0);
    says(&values(&[600.0]).unwrap_err(), "from 450 to 550 nm");
    let cells = level[1] * grid;
    let told = format!("no reading: -999 in {cells} cells");
    says(&widest().remarks()[1], &told);
    values(&[550.0]).unwrap();
    // Of a matte table the hole of a cell has what is around it, to what nodes are apart.
    for node in 0..grid {
        fill(node..node + 1, f32::NAN);
        let after = values(&[450.0]).unwrap()[0];
        near(after / before[0], 1.0, 0.4, node);
        let holes = spec.build(left.clone()).unwrap().cells_without_reading();
        assert_eq!(holes, level[1]);
    }
}

#[test]
fn damaged_files_are_refused_by_name() {
    let ggx = material("ggx", "alpha = 0.5", Channels::Rgb);
    let whole = tabulate(&*ggx, level(5, 2, 4)).unwrap();
    let file = bytes(&whole);
    for cut in [0, 5, 14, 17, 40, 300, file.len() / 2, file.len() - 1] {
        assert!(read(&file[..cut]).is_err(), "{cut}");
    }
    let mut other = file.clone();
    other[0] = b'T';
    says(&read(&other).unwrap_err(), "tensor_file");
    type Change<'a> = &'a dyn Fn(&mut Fields);
    let cases: [(Change<'_>, &str); 5] = [
        (&|f| f.theta_i.reverse(), "theta_i"),
        (
            &|f| f.ndf.values[7] = f32::NAN,
            "ndf\" holds NaN at place 7",
        ),
        (&|f| f.vndf.values[3] = -1.0, "\"vndf\" holds -1 at place 3"),
        (&|f| f.phi_i[0] = 100.0, "phi_i"),
        (&|f| f.vndf.values.fill(0.0), "vndf"),
    ];
    for (change, why) in cases {
        let mut fields = whole.clone();
        change(&mut fields);
        let table = read(&bytes(&fields))
            .and_then(|fields| Rgl::new(fields, Channels::Rgb).map_err(|e| e.to_string()));
        says(&table.expect_err(why), why);
    }
}
