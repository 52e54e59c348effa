//! What the instrument files say.

use super::{arms, specs};
use gonio::instrument::{self, Tag};
use std::fs;
use std::path::Path;

#[test]
fn there_is_one_preset_a_class_and_every_file_is_one() {
    let presets = instrument::presets();
    let classes = instrument::classes();
    let used: Vec<_> = arms().into_iter().map(|spec| spec.class).collect();
    let names: Vec<_> = classes.iter().map(|class| class.name).collect();
    assert_eq!(used, names);
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/instruments");
    let files = fs::read_dir(folder).unwrap();
    let mut found = 0;
    for file in files {
        let path = file.unwrap().path();
        let stem = path.file_stem().unwrap().to_str().unwrap();
        let preset = presets.iter().find(|preset| preset.name == stem).unwrap();
        assert_eq!(fs::read_to_string(&path).unwrap(), preset.text);
        assert_eq!(instrument::read(preset.text).unwrap().name, stem);
        found += 1;
    }
    assert_eq!(found, presets.len());
}

#[test]
fn a_preset_written_out_reads_back() {
    for spec in specs() {
        let text = toml::to_string(&spec).unwrap();
        assert_eq!(instrument::read(&text).unwrap(), spec, "{text}");
    }
}

#[test]
fn every_number_has_a_provenance_and_every_provenance_a_number() {
    for spec in specs() {
        let origins = spec.origins();
        // Nine a axis at least, of which wraps, parent and name are none; some thirty others.
        assert!(origins.len() > 8 * spec.axis.len() + 20, "{}", spec.name);
        for (key, entry) in &origins {
            assert!(entry.is_some(), "{}: {key} comes from nowhere", spec.name);
        }
        for entry in &spec.provenance {
            let about = |(_, found): &&(String, Option<_>)| *found == Some(entry);
            let is_about = origins.iter().filter(about).count() > 0;
            assert!(
                is_about,
                "{}: {:?} is about nothing",
                spec.name, entry.fields
            );
            if entry.tag == Tag::Published {
                // A publication has a year, or the institute whose page or data it is.
                let year = |word: &str| word.len() == 4 && word.parse::<u16>().is_ok();
                let source = &entry.source;
                let mut words = source.split(|c: char| !c.is_alphanumeric());
                let named = ["rgl.epfl.ch", "UTIA", "NIST", "pab"];
                let is_named = named.iter().any(|name| source.contains(name));
                assert!(is_named || words.any(year), "{}: {source}", spec.name);
            }
            // Each field by itself, too: a mistyped one would hide behind its neighbours.
            for field in &entry.fields {
                let mut alone = spec.clone();
                let mut only = entry.clone();
                only.fields = vec![field.clone()];
                alone.provenance = vec![only];
                let is_covered = alone.origins().iter().any(|(_, e)| e.is_some());
                assert!(is_covered, "{}: {field}", spec.name);
            }
        }
    }
}

#[test]
fn a_field_is_about_the_keys_it_names() {
    let mut spec = specs().remove(3);
    let entry = |fields: &[&str], tag| instrument::Provenance {
        fields: fields.iter().map(|f| (*f).to_owned()).collect(),
        tag,
        source: "here".into(),
    };
    spec.provenance = vec![
        entry(&["axis.ring.min_deg"], Tag::Published),
        entry(&["axis.*.min_deg", "timing.*"], Tag::Generic),
        entry(&["limits.collision.1.*"], Tag::Recalled),
    ];
    let origins = spec.origins();
    let tag = |key: &str| {
        let (_, entry) = origins.iter().find(|(k, _)| k == key).unwrap();
        entry.map(|e| e.tag)
    };
    for (key, expected) in [
        ("axis.ring.min_deg", Some(Tag::Published)),
        ("axis.robot_yaw.min_deg", Some(Tag::Generic)),
        ("axis.ring.max_deg", None),
        ("timing.settle_s", Some(Tag::Generic)),
        ("limits.collision.0.angle_min_deg", None),
        ("limits.collision.1.angle_min_deg", Some(Tag::Recalled)),
        ("body.link.direction", None),
    ] {
        assert_eq!(tag(key), expected, "{key}");
    }
    // No number, no key.
    assert!(origins.iter().all(|(key, _)| key != "timing.scan"));
}

/// The middle exposure of three is the geometric mean of the ends.
#[test]
fn exposures_suit_a_diffuse_sample_and_its_lobes() {
    for spec in arms() {
        let d = &spec.detector;
        assert_eq!(d.exposures, 3);
        let middle = (d.exposure_min_s * d.exposure_max_s).sqrt();
        let electrons = |f_ratio: f64, seconds: f64| f_ratio * d.reference_rate * seconds;
        // The tile in the longest: within the range, shot noise below 1 %.
        let white = electrons(1.0, d.exposure_max_s);
        assert!(white > 1e4 && white < 0.5 * d.full_scale, "{}", spec.name);
        // A lobe of alpha = 0.05: f cos theta_i ≤ 1/(4 π alpha² cos theta_o), 365/sr at 85°.
        let lobe = electrons(365.0 * std::f64::consts::PI, d.exposure_min_s);
        assert!(lobe < 0.5 * d.full_scale, "{}", spec.name);
        // Black paper, a twentieth, stands out of the read noise tenfold.
        let black = electrons(0.05, d.exposure_max_s);
        assert!(black > 10.0 * d.read_noise, "{}", spec.name);
        let range = d.full_scale / d.read_noise * d.exposure_max_s / d.exposure_min_s;
        assert!(
            (0.999e6..1.001e7).contains(&range),
            "{}: {range:e}",
            spec.name
        );
        if let Some(rate) = spec.timing.sample_rate_hz {
            assert!(d.exposure_min_s + middle + d.exposure_max_s < 1.0 / rate);
        }
    }
}
