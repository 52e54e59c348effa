use super::common::table;
use gonio::brdf::measured::merl::{Merl, MerlGrid};
use gonio::brdf::measured::tensor_tree::{Node, tabulate};
use gonio::brdf::{
    self, Brdf, Channels, Favours, Lambert, ObservedBrdf, Presence, Spectrum, Wavelengths,
};
use gonio::geometry::{Direction, DirectionPair};
use gonio::registry;
use serde::Deserialize;
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::atomic::{AtomicUsize, Ordering};
use toml::de::DeTable;

fn read(text: &str) -> Result<Channels, String> {
    #[derive(Deserialize)]
    struct Config {
        channels: Channels,
    }
    toml::from_str::<Config>(&format!("channels = {text}"))
        .map(|config| config.channels)
        .map_err(|e| e.to_string())
}

#[test]
fn a_config_writes_a_list_or_steps() {
    assert_eq!(read("\"luminance\""), Ok(Channels::Luminance));
    assert_eq!(read("\"rgb\""), Ok(Channels::Rgb));
    let list = read("{ wavelengths_nm = [400, 410.5, 420] }").unwrap();
    let nm = list.wavelengths().unwrap().nm();
    assert_eq!(nm, [400.0, 410.5, 420.0]);
    let steps = read("{ wavelengths_nm = { from = 400, to = 700, step = 10 } }").unwrap();
    let nm = steps.wavelengths().unwrap().nm();
    let odd = read("{ wavelengths_nm = { from = 362.1, to = 362.4, step = 0.1 } }").unwrap();
    let odd = odd.wavelengths().unwrap().nm();
    assert_eq!(odd, [362.1, 362.2, 362.3, 362.4]);
    assert_eq!((nm.len(), nm[0], nm[30]), (31, 400.0, 700.0));
    // What is written is what was read.
    for channels in [list, steps, Channels::Rgb] {
        let text = serde_json::to_string(&channels).unwrap();
        assert_eq!(serde_json::from_str::<Channels>(&text).unwrap(), channels);
    }
}

#[test]
fn what_makes_no_sense_is_refused() {
    let many: Vec<_> = (0..513).map(|i| (400 + i).to_string()).collect();
    for (text, why) in [
        ("[]".to_owned(), "0 values"),
        (format!("[{}]", many.join(", ")), "513 values"),
        ("[500, 400]".into(), "400"),
        ("[500, 500]".into(), "500"),
        ("[99]".into(), "99"),
        ("[20001]".into(), "20001"),
        ("[nan]".into(), "NaN"),
        ("{ from = 400, to = 700, step = 7 }".into(), "whole steps"),
        ("{ from = 400, to = 700, step = 0 }".into(), "whole steps"),
        ("{ from = 400, to = 700, step = 0.1 }".into(), "whole steps"),
        ("{ from = 700, to = 400, step = 10 }".into(), "whole steps"),
        ("\"400\"".into(), "numbers of nm"),
    ] {
        let message = read(&format!("{{ wavelengths_nm = {text} }}")).unwrap_err();
        assert!(message.contains(why), "{text}: {message}");
    }
    assert!(read("\"blue\"").unwrap_err().contains("wavelengths_nm"));
}

#[test]
fn the_mean_is_exact_for_straight_lines() {
    let channels = Channels::Wavelengths(Wavelengths::new(&[400.0, 420.0, 700.0]).unwrap());
    // 2 nm − 300 between 400 and 700 nm: in the middle, 800.
    let values = [500.0, 540.0, 1100.0];
    assert!((channels.luminance(&values) - 800.0).abs() < 1e-12);
    assert_eq!(channels.rgb(&values), [channels.luminance(&values); 3]);
    let one = Channels::Wavelengths(Wavelengths::new(&[550.0]).unwrap());
    assert_eq!(one.luminance(&[0.7]), 0.7);
}

const MERL: &str = "kind = \"merl\"\npath = \"a\"";

#[test]
fn a_truth_says_what_its_formula_favours() {
    let sum = |a: &str, b: &str| {
        format!(
            "kind = \"sum\"\ncomponent = [{{ weight = 0.5, brdf = {{ kind = \"{a}\" }} }}, \
             {{ weight = 0.5, brdf = {{ kind = \"{b}\" }} }}]"
        )
    };
    let table = |of: &str| format!("kind = \"tabulated\"\nof = {{ kind = \"{of}\" }}");
    let plain = self::table(
        "neither | lambert oren-nayar test-f test-g
         theta_h | ggx beckmann ward phong sheen shifted-gamma low-abc
         h_bar | low-abc-smooth test-s",
    );
    let plain = plain.flat_map(|[want, kinds]| {
        let kinds = kinds.split(' ');
        kinds.map(move |kind| (format!("kind = \"{kind}\""), want))
    });
    // A component without weight has no say.
    let of_test = "0.5, brdf = { kind = \"test";
    let weightless = sum("ggx", "test-s").replace(of_test, &of_test[2..].replacen('5', "0", 1));
    let retro = "kind = \"retro-reflective\"\nof = { kind = \"ggx\" }";
    let others = [
        (weightless, "theta_h"),
        (retro.into(), "neither"),
        (sum("lambert", "ggx"), "theta_h"),
        (sum("phong", "ggx"), "theta_h"),
        (sum("lambert", "low-abc-smooth"), "h_bar"),
        (sum("ggx", "low-abc-smooth"), "neither"),
        (sum("ggx", "oren-nayar"), "neither"),
        (sum("lambert", "lambert"), "neither"),
        (table("low-abc-smooth"), "half-difference table"),
        (MERL.into(), "half-difference table"),
    ];
    for (text, want) in plain.chain(others) {
        let spec = brdf::read(DeTable::parse(&text).unwrap()).unwrap();
        assert_eq!(spec.favours().name(), want, "{text}");
    }
}

/// A class is that of the whole interval of q, of a table with that of its sampling; what was interpolated keeps its own.
#[test]
fn a_measured_truth_favours_what_its_interval_does() {
    let declared = ["ggx", "low-abc-smooth", "merl"];
    for (q, error, want) in table::<3>(
        "0.1 | 0.19 | theta_h
         0.1 | 0.21 | between
         0.5 | 0 | between
         0.9 | 0.21 | between
         0.74 | 0.03 | h_bar
         -0.3 | 0.1 | theta_h",
    )
    .map(|[q, error, want]| (q.parse().unwrap(), error.parse().unwrap(), want))
    {
        for kind in declared {
            let text = match kind {
                "merl" => MERL.into(),
                kind => format!("kind = \"{kind}\""),
            };
            let spec = brdf::read(DeTable::parse(&text).unwrap()).unwrap();
            let suffix = if kind == "merl" { " table" } else { "" };
            let found = spec.favours().measured(q, error).name();
            assert_eq!(found, format!("{want}{suffix}"), "{kind} {q} {error}");
        }
        for kept in [Favours::SphericalTable, Favours::Reconstruction] {
            assert_eq!(kept.measured(q, error), kept);
        }
    }
}

#[test]
fn the_peak_is_not_snapped() {
    // theta_h from 1e-3 down to 1e-300 rad, at theta_d = 0 so that the pair is exact.
    for e in 3..300 {
        let theta = 10f64.powi(-e);
        let d = Direction::from_spherical(theta, 0.0);
        let [x, ..] = MerlGrid::RECIPROCAL.coordinates(&DirectionPair::new(d, d));
        let want = 90.0 * (theta / FRAC_PI_2).sqrt();
        assert!((x / want - 1.0).abs() < 1e-15, "{theta:e}");
    }
}

/// u' and v' of grey.
const GREY: [f64; 2] = [4.0 / 19.0, 9.0 / 19.0];

#[test]
fn what_is_constant_is_one_leaf() {
    let grey = Lambert::new(Spectrum::Grey(0.5), Channels::Rgb);
    let (trees, _) = tabulate(&grey, 4).unwrap();
    let [y, u, v] = &trees[..] else {
        panic!("{trees:?}")
    };
    // But for the two cells that keep Radiance from taking a matte part out of trees with colours.
    let level = 4;
    for (tree, value, leaves) in [
        (y, 0.5 / PI, 1 + 7 * (2 * level - 1)),
        (u, GREY[0], 1),
        (v, GREY[1], 1),
    ] {
        assert_eq!(tree.leaves(), leaves);
        assert!((tree.value_at([0.2; 3]) - value).abs() < 1e-12);
    }
    // Black has no colour of its own.
    let black = Lambert::new(Spectrum::Grey(0.0), Channels::Rgb);
    let (trees, _) = tabulate(&black, 4).unwrap();
    let expected = [0.0, GREY[0], GREY[1]].map(Node::Leaf);
    assert_eq!(trees, expected);
}

/// Whoever asks a watched BRDF gets what the BRDF itself says, and is seen once a pair.
#[test]
fn nothing_changes_but_that_it_is_seen() {
    let at = |theta, phi| Direction::from_spherical(theta, phi);
    let pairs: Vec<DirectionPair> = (0..70)
        .map(|i| DirectionPair::new(at(0.02 * f64::from(i), 0.3), at(0.7, f64::from(i))))
        .collect();
    let (mut samplers, mut tables) = (0, 0);
    for entry in brdf::all() {
        for text in entry.examples {
            let spec = registry::read_text(&entry, text).unwrap();
            let brdf = spec.build(Channels::Luminance).unwrap();
            let count = AtomicUsize::new(0);
            let seen = |values: &[f64], of: &[Presence]| {
                assert_eq!(values.len(), of.len());
                count.fetch_add(of.len(), Ordering::Relaxed);
            };
            let watched = ObservedBrdf::new(&*brdf, seen);
            assert_eq!(watched.symmetry(), brdf.symmetry());
            assert_eq!(watched.conserves_energy(), brdf.conserves_energy());
            assert_eq!(watched.remarks(), brdf.remarks());
            let both: [&dyn Brdf; 2] = [&watched, &*brdf];
            let [got, own] = both.map(|f| {
                let mut values = vec![0.0; pairs.len()];
                let mut presence = vec![Presence::Missing; pairs.len()];
                f.eval_batch(&pairs, &mut values, &mut presence);
                (values, presence, f.luminance(&pairs[3]))
            });
            assert_eq!(got, own, "{} {text}", entry.kind);
            let same = |a: Option<&Merl>, b: Option<&Merl>| match (a, b) {
                (Some(a), Some(b)) => std::ptr::eq(a, b),
                (a, b) => a.is_none() && b.is_none(),
            };
            assert!(same(watched.as_merl(), brdf.as_merl()));
            tables += usize::from(brdf.as_merl().is_some());
            let [got, own] = both.map(|f| {
                let of = f.as_sample()?;
                let sample = of.sample(at(0.4, 0.0), [0.3, 0.6]);
                Some((sample.map(|d| d.vector()), of.pdf(&pairs[5])))
            });
            assert_eq!(got, own, "{} {text}", entry.kind);
            samplers += usize::from(own.is_some());
            assert_eq!(count.into_inner(), pairs.len() + 1);
        }
    }
    assert!(samplers > 3 && tables > 0);
}

/// From the moment that somebody wants to stop no pair is looked at, and the pairs before are as they were.
#[test]
fn who_is_stopped_is_done_soon() {
    let brdf = Lambert::new(Spectrum::Grey(0.5), Channels::Luminance);
    let (asked, looks) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let inner = ObservedBrdf::new(&brdf, |_: &[f64], of: &[Presence]| {
        looks.fetch_add(of.len(), Ordering::Relaxed);
    });
    let stopped = || asked.fetch_add(1, Ordering::Relaxed) >= 2;
    let watched = ObservedBrdf::new(&inner, |_: &[f64], _: &[Presence]| ()).until(&stopped);
    let up = Direction::from_spherical(0.3, 0.0);
    let pairs = vec![DirectionPair::new(up, up); 1000];
    let mut values = vec![7.0; 1000];
    let mut presence = vec![Presence::Missing; 1000];
    watched.eval_batch(&pairs, &mut values, &mut presence);
    let n = looks.load(Ordering::Relaxed);
    assert_eq!(n, 2 * 256);
    let present = presence.iter().filter(|p| **p == Presence::Present);
    assert_eq!(present.count(), n);
    assert!(presence[..n].iter().all(|p| *p == Presence::Present));
    assert!(values[n..].iter().all(|v| *v == 0.0) && values[0] > 0.1);
    assert_eq!(watched.luminance(&pairs[0]), None);
}
