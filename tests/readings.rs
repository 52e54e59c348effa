//! Files of readings as materials: what is computed of one is what is computed of the BRDF that a
//! reconstruction makes of the file.
#![cfg(feature = "experiments")]

mod common;

use common::{form, material, member, near, planned, present, product, table, test_pairs};
use gonio::brdf::{Brdf, BrdfSpec, BuildError, Channels, Presence};
use gonio::experiment::{self, Plan, Source, material_key};
use gonio::formats::load_readings;
use gonio::geometry::Symmetry;
use gonio::instrument::{Ideal, Instrument};
use gonio::measurement::{About, Measurement, write_measurement};
use gonio::metrics::Measure;
use gonio::moments::{Channel, Component, MomentsSpec, Profile};
use gonio::reconstruct::{self, Reconstruct};
use gonio::registry;
use gonio::schedule::{Assume, ScheduleFormat, Sequence};
use std::fs;
use std::path::Path;
use tempfile::TempDir;
use toml::de::DeTable;

const GGX: &str =
    "alpha = 0.3\nfresnel = { kind = \"conductor\", eta = [0.2, 0.9, 1.5], kappa = 3.0 }";

fn spectral() -> Channels {
    common::wavelengths(&[450.0, 550.0, 650.0])
}

/// Readings of a metal by the ideal instrument.
fn measured(set: &str, channels: Channels) -> Measurement {
    let keys = match channels {
        Channels::Wavelengths(_) => "alpha = 0.3",
        _ => GGX,
    };
    let poses = planned(&form("hybrid", Symmetry::FULL), set, 200, 1);
    Ideal.measure(&*material("ggx", keys, channels), &poses)
}

fn write(measurement: &Measurement, path: &Path) {
    let mut bytes = Vec::new();
    let format = match path.extension().and_then(|e| e.to_str()) {
        Some("jsonl") => ScheduleFormat::JsonLines,
        _ => ScheduleFormat::Csv,
    };
    let about = About::default();
    write_measurement(measurement, &about, Sequence::Generated, format, &mut bytes).unwrap();
    fs::write(path, bytes).unwrap();
}

/// What a config of materials makes of the text of a material.
fn spec(text: &str) -> Result<Box<dyn BrdfSpec>, registry::ReadError> {
    let table = DeTable::parse(text).unwrap();
    registry::read("material", &experiment::materials(), table)
}

fn of(path: &Path, keys: &str) -> Box<dyn BrdfSpec> {
    spec(&format!("kind = \"readings\"\nfile = {path:?}\n{keys}")).unwrap()
}

/// The BRDF that a method makes of a file.
fn reconstructed(path: &Path, method: Option<&dyn Reconstruct>) -> Box<dyn Brdf> {
    let assume = Assume {
        otherwise: Symmetry::FULL,
        ..Assume::default()
    };
    let measurement = load_readings(path, &assume).unwrap().measurement;
    let brdf = match method {
        Some(method) => method.reconstruct(&measurement),
        None => gonio::validation::chosen(&measurement).reconstruct(&measurement),
    };
    brdf.unwrap()
}

fn values(brdf: &dyn Brdf) -> Vec<f64> {
    let pairs = test_pairs(Measure::Cosine, 500);
    let mut out = vec![0.0; pairs.len() * brdf.channels().count()];
    let mut presence = vec![Presence::Missing; pairs.len()];
    brdf.eval_batch(&pairs, &mut out, &mut presence);
    assert!(presence.iter().all(|p| *p == Presence::Present));
    let one_by_one = pairs.iter().flat_map(|pair| present(brdf, pair));
    assert!(one_by_one.eq(out.iter().copied()));
    out
}

fn profile(brdf: &dyn Brdf) -> Profile {
    let views = common::views(3, MomentsSpec::default().max_view_deg);
    let integral = common::peak_resolving(0.05);
    Profile::new(brdf, Channel::Luminance, &views, &integral, 1).unwrap()
}

#[test]
fn a_file_is_the_brdf_that_is_made_of_it() {
    let dir = TempDir::new().unwrap();
    let scenes = [Channels::Luminance, Channels::Rgb, spectral()];
    let files = [("a.csv", "grid"), ("b.jsonl", "sobol")];
    for ((name, set), scene) in product(files, scenes) {
        let path = dir.path().join(name);
        write(&measured(set, scene.clone()), &path);
        let named = ["thin-plate", "inverse-distance", "cubic"].map(Some);
        for kind in [None].into_iter().chain(named) {
            let of_grids = set == "sobol" && kind == Some("cubic");
            // Readings choose by all methods, which takes a second.
            if of_grids || (kind.is_none() && scene != Channels::Luminance) {
                continue;
            }
            let method = kind.map(|kind| member(reconstruct::all(), kind, ""));
            let keys = kind.map(|k| format!("reconstruction = {{ kind = \"{k}\" }}"));
            let spec = of(&path, &keys.unwrap_or_default());
            spec.check(&scene).unwrap();
            let brdf = spec.build(scene.clone()).unwrap();
            let other = reconstructed(&path, method.as_deref());
            assert_eq!(brdf.symmetry(), other.symmetry());
            assert_eq!(spec.symmetry(&scene).unwrap(), other.symmetry());
            assert_eq!(values(&*brdf), values(&*other), "{name} {scene:?} {kind:?}");
            if kind.is_none() {
                // Its moments too, whose uncertainties have those of the readings in them.
                let [a, b] = [profile(&*brdf), profile(&*other)];
                for ((a, b), c) in product(a.slices.iter().zip(&b.slices), Component::ALL) {
                    if let (Some(a), Some(b)) = (a.moments.get(c), b.moments.get(c)) {
                        assert!(a.value == b.value && a.uncertainty > b.uncertainty);
                    }
                }
                assert!(a.slices[1].moments.energy().is_some());
            }
        }
    }
}

#[test]
fn colours_have_a_luminance_and_luminance_is_grey() {
    let dir = TempDir::new().unwrap();
    let path = dir.path().join("a.csv");
    write(&measured("sobol", Channels::Rgb), &path);
    let brdf = of(&path, "").build(Channels::Luminance).unwrap();
    let colours = reconstructed(&path, None);
    let luminances = values(&*colours);
    let luminances = luminances.chunks(3).map(|v| Channels::Rgb.luminance(v));
    assert_eq!(values(&*brdf), luminances.collect::<Vec<_>>());
    assert_eq!(*brdf.channels(), Channels::Luminance);

    // Of wavelengths it is their mean.
    write(&measured("sobol", spectral()), &path);
    let mean = of(&path, "").build(Channels::Luminance).unwrap();
    let each = values(&*reconstructed(&path, None));
    let width = spectral().count();
    let means = each.chunks(width).map(|v| spectral().luminance(v));
    assert_eq!(values(&*mean), means.collect::<Vec<_>>());

    write(&measured("sobol", Channels::Luminance), &path);
    let brdf = of(&path, "").build(Channels::Rgb).unwrap();
    let grey = values(&*reconstructed(&path, None));
    let grey: Vec<f64> = grey.iter().flat_map(|v| [*v; 3]).collect();
    assert_eq!(values(&*brdf), grey);
}

#[test]
fn readings_stand_where_a_material_stands() {
    let dir = TempDir::new().unwrap();
    let path = dir.path().join("a.csv");
    write(&measured("sobol", Channels::Luminance), &path);
    let inner = format!("kind = \"readings\", file = {path:?}");
    let own = reconstructed(&path, None);
    let half = format!("component = [{{ weight = 0.5, brdf = {{ {inner} }} }}]");
    let sum = spec(&format!("kind = \"sum\"\n{half}")).unwrap();
    assert_eq!(sum.tables().files, [path.as_path()]);
    let halves = values(&*sum.build(Channels::Luminance).unwrap());
    let expected: Vec<f64> = values(&*own).iter().map(|v| 0.5 * v).collect();
    assert_eq!(halves, expected);
    // A written material is read back as itself.
    for text in [
        format!("kind = \"tabulated\"\nof = {{ {inner} }}"),
        format!("kind = \"retro-reflective\"\nof = {{ {inner} }}"),
        format!(
            "{}\nquantity = \"percent\"\nangles = \"rad\"\ncolumns = {{ value = \"R\" }}\n\
                 symmetries = {{ isotropic = true, reciprocal = false, bilateral = true }}\n\
                 reconstruction = {{ kind = \"nearest\" }}",
            inner.replace(", ", "\n")
        ),
    ] {
        let once = spec(&text).unwrap().resolved();
        assert_eq!(spec(&once.to_string()).unwrap().resolved(), once, "{text}");
    }
}

/// Percent of a white tile, polar angles from the surface, azimuths from the mirror direction.
#[test]
fn a_laboratory_s_table_is_read_as_its_keys_say() {
    let dir = TempDir::new().unwrap();
    let [ours, lab] = ["ours.csv", "lab.csv"].map(|name| dir.path().join(name));
    let measurement = measured("sobol", Channels::Luminance);
    write(&measurement, &ours);
    let mut text = "in,out,az,R\n".to_owned();
    for (pose, value) in measurement.schedule.poses.iter().zip(&measurement.values) {
        let [i, o] = [pose.pair.omega_i, pose.pair.omega_o];
        let az = (o.phi() - i.phi()).to_degrees() - 180.0;
        let [i, o] = [i, o].map(|d| 90.0 - d.theta().to_degrees());
        let percent = 100.0 * std::f64::consts::PI * value;
        text += &format!("{i},{o},{az},{percent}\n");
    }
    fs::write(&lab, text).unwrap();
    let keys = "columns = { theta_i = \"in\", theta_o = \"out\", phi_o = \"az\", value = \"R\" }\n\
                angles = \"deg\"\nelevation = true\nazimuth = \"mirror\"\nquantity = \"percent\"\n\
                parametrization = \"hybrid\"";
    let method = "reconstruction = { kind = \"inverse-distance\" }\n";
    let [a, b] = [of(&ours, method), of(&lab, &(method.to_owned() + keys))];
    let [a, b] = [a, b].map(|spec| values(&*spec.build(Channels::Luminance).unwrap()));
    for (a, b) in a.iter().zip(&b) {
        near(a / b, 1.0, 1e-6, b);
    }
    // Otherwise the file has no column that is known.
    let refused = of(&lab, method).check(&Channels::Luminance).unwrap_err();
    assert!(matches!(refused, BuildError::Data { .. }), "{refused}");
}

#[test]
fn keys_are_of_the_readings_and_not_of_their_place() {
    let dir = TempDir::new().unwrap();
    let [a, b] = ["a.csv", "b.csv"].map(|name| dir.path().join(name));
    let key = |path: &Path| {
        let text = format!("[[material]]\nkind = \"readings\"\nname = \"m\"\nfile = {path:?}\n");
        let plan = Plan::read(&Source::new("c.toml", text)).unwrap();
        material_key(&plan.materials[0]).unwrap()
    };
    let mut measurement = measured("sobol", Channels::Luminance);
    write(&measurement, &a);
    fs::copy(&a, &b).unwrap();
    let first = key(&a);
    assert_eq!(first, key(&b));
    measurement.values[7] *= 1.01;
    write(&measurement, &b);
    assert_ne!(first, key(&b));
}

#[test]
fn what_cannot_be_used_is_refused_by_who_must_act() {
    let dir = TempDir::new().unwrap();
    let [file, colours, spectrum, text] =
        ["l.csv", "c.csv", "s.csv", "t.csv"].map(|name| dir.path().join(name));
    write(&measured("sobol", Channels::Luminance), &file);
    write(&measured("sobol", Channels::Rgb), &colours);
    write(&measured("sobol", spectral()), &spectrum);
    fs::write(&text, "Dear colleague,\nthe readings are attached.\n").unwrap();
    let picture = dir.path().join("sky.hdr");
    fs::write(&picture, "#?RADIANCE\n").unwrap();
    let missing = dir.path().join("nothing.csv");
    let two = common::wavelengths(&[450.0, 550.0]);
    let refused = |path: &Path, keys: &str, scene: Channels| {
        let spec = of(path, keys);
        let checked = spec.check(&scene).unwrap_err();
        let built = spec.build(scene).err().unwrap();
        assert_eq!(checked.to_string(), built.to_string());
        checked
    };
    let grey = || Channels::Luminance;
    let of_keys = table(
        r#"
        parametrization = "hybird"                              | parametrization           | hybrid
        reconstruction = { kind = "cubic" }                     | reconstruction.kind       | grid
        reconstruction = { kind = "thin-plate", neighbours = 1 } | reconstruction.neighbours | [6, 256]"#,
    );
    let of_keys = of_keys.map(|[keys, key, word]| (&file, keys, grey(), key, word));
    let of_files = [
        // Of the data, and of the config.
        (&missing, "", grey(), "", "cannot read this file"),
        (&text, "", grey(), "", "column"),
        (&picture, "", grey(), "", "readings"),
        (&file, "", spectral(), "file", "luminance"),
        (&colours, "", spectral(), "file", "R, G, B"),
        (&spectrum, "", Channels::Rgb, "file", "450"),
        (&spectrum, "", two, "file", "650"),
    ];
    for (path, keys, scene, key, word) in of_files.into_iter().chain(of_keys) {
        match refused(path, keys, scene) {
            BuildError::Data { message, .. } => {
                assert!(key.is_empty() && message.contains(word), "{message}");
            }
            BuildError::Parameter(e) => {
                assert_eq!(e.key, key);
                assert!(e.allowed.contains(word), "{e}");
            }
            e => panic!("{e}"),
        }
    }
    for [keys, word] in table(
        r#"
        | file
        file = "a"\nquantity = "lux" | percent
        file = "a"\ninterpolation = "nearest" | reconstruction
        file = "a"\nreconstruction = { kind = "spline" } | thin-plate
        file = "a"\nreconstruction = "cubic" | a table"#,
    ) {
        let error = spec(&format!("kind = \"readings\"\n{keys}")).err().unwrap();
        assert!(error.message.contains(word), "{keys}: {error}");
    }
}
