mod height_map;

use crate::common::{near, says};
use gonio::brdf::Channels;
use gonio::brdf::microfacet::{FresnelSpec, fresnel};
use gonio::light_paths::surface::{HeightField, all};
use gonio::light_paths::{FacetsSpec, facets};
use gonio::registry::{self, Entry, Keys};
use std::fmt::Debug;

/// The keys as they are written, without the kind.
fn written(mut keys: Keys) -> String {
    keys.remove("kind");
    toml::to_string(&keys).unwrap()
}

#[test]
fn heights_that_are_none_are_refused() {
    let field = |size, heights: &[f64]| HeightField::new(size, heights).map(|_| ());
    for (size, heights, why) in [
        ([2, 2], &[0.0, 1.0, f64::NAN, 0.0][..], "NaN"),
        ([1, 1], &[0.0], "2 to 8192"),
    ] {
        says(&field(size, heights).unwrap_err().to_string(), why);
    }
    assert!(field([2, 2], &[1.0; 4]).is_ok());
}

#[test]
fn every_example_reads_builds_and_resolves_to_itself() {
    for entry in all() {
        // A kind without examples needs a file.
        assert!(!entry.examples.is_empty() || entry.kind == "height-map");
        for example in entry.examples {
            let spec = registry::read_text(&entry, example).unwrap();
            spec.check().unwrap();
            let field = spec.build(0).unwrap();
            let again = registry::read_text(&entry, &written(spec.resolved())).unwrap();
            assert_eq!(again.resolved(), spec.resolved());
            let same = again.build(0).unwrap();
            assert!(field.heights().eq(same.heights()), "{}", entry.kind);
        }
    }
}

/// Rms slopes of many seeds, and 1/e of the correlation at the correlation length.
#[test]
fn statistics_are_those_asked_for() {
    let (size, length) = (128, 6);
    for (kind, slope, asked) in [
        ("gaussian", "0.2", [0.2; 2]),
        ("gaussian", "[0.3, 0.1]", [0.3, 0.1]),
        ("exponential", "0.2", [0.2; 2]),
    ] {
        let entry = all().into_iter().find(|entry| entry.kind == kind).unwrap();
        let (mut slopes, mut products) = ([0.0; 2], [0.0; 2]);
        let seeds = 40;
        for seed in 0..seeds {
            let size_of = format!("correlation = {length}\nsize = {size}\nseed = {seed}");
            let text = format!("rms_slope = {slope}\n{size_of}");
            let field = registry::read_text(&entry, &text).unwrap();
            let field = field.build(0).unwrap();
            for s in field.all_slopes() {
                slopes[0] += s[0] * s[0];
                slopes[1] += s[1] * s[1];
            }
            let heights: Vec<f64> = field.heights().collect();
            for (i, h) in heights.iter().enumerate() {
                let (x, y) = (i % size, i / size);
                products[0] += h * h;
                products[1] += h * heights[y * size + (x + length) % size];
            }
        }
        let count = (2 * size * size * seeds as usize) as f64;
        for axis in 0..2 {
            let rms = (slopes[axis] / count).sqrt();
            // 40 tiles of some 450 independent squares each; along y the ratio holds for waves, and for differences of
            // neighbours up to (π/12 l)².
            near(rms / asked[axis], 1.0, 0.03, (kind, axis, rms));
        }
        if kind == "gaussian" {
            let correlation = products[1] / products[0];
            near(correlation, (-1.0f64).exp(), 0.03, kind);
        }
    }
}

/// Every example reads, and what it resolves to is read as the same.
fn assert_come_back<T: PartialEq + Debug>(entries: Vec<Entry<T>>, resolved: fn(&T) -> Keys) {
    for entry in entries {
        for example in entry.examples {
            let spec = registry::read_text(&entry, example).unwrap();
            let again = registry::read_text(&entry, &written(resolved(&spec))).unwrap();
            assert_eq!(again, spec, "{}", entry.kind);
        }
    }
}

#[test]
fn facets_and_fresnel_terms_resolve_to_themselves() {
    assert_come_back(facets(), |facets: &FacetsSpec| {
        facets.check(&Channels::Luminance).unwrap();
        facets.resolved()
    });
    assert_come_back(fresnel::all(), |fresnel: &FresnelSpec| {
        fresnel.check(&Channels::Luminance).unwrap();
        fresnel.resolved()
    });
}
