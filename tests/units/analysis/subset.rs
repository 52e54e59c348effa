//! Sets whose measure is known, and pairs that must be in them.

use crate::common::{ISOTROPIC, ONE_SIDED, matte, model, near, says, table};
use gonio::analysis::{Estimate, Subset};
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::parametrization::find;
use std::f64::consts::{PI, TAU};

fn read(name: &str, symmetry: Symmetry, text: &str) -> Subset {
    Subset::read(find(name).unwrap().form(symmetry), text).unwrap()
}

/// A box of pairs of full symmetry.
fn full(name: &str, text: &str) -> Subset {
    read(name, Symmetry::FULL, text)
}

/// Asserts that an estimate is a number within four of its errors, and as much as that is off.
#[track_caller]
fn assert_near(found: Estimate, want: f64, off: f64) {
    let miss = (found.value - want).abs();
    assert!(miss < 4.0 * found.error + off, "{found:?} {want}");
}

#[test]
fn the_whole_box_is_every_pair() {
    for entry in crate::common::polar() {
        for symmetry in [ISOTROPIC, ONE_SIDED, Symmetry::FULL] {
            let whole = read(entry.kind, symmetry, "");
            let found = whole.quadrature().value / (TAU * TAU);
            // Edges of the domain cut panels: 3e-3 is a tenth of a panel's share of an axis.
            near(found, 1.0, 3e-3, (entry.kind, symmetry));
            let pair = DirectionPair::from_spherical(0.4, 2.0, 1.1, -1.0);
            assert!(whole.contains(&pair) && whole.contains(&pair.swapped()));
        }
    }
}

#[test]
fn spherical_boxes_have_closed_measures() {
    let text = "theta_i=10..30, theta_o=40..75, delta_phi=20..50";
    let [a, b, c, d, p] = [10_f64, 30.0, 40.0, 75.0, 30.0].map(f64::to_radians);
    let want = TAU * p * (a.cos() - b.cos()) * (c.cos() - d.cos());
    // Four images under reciprocity and the mirror, one without.
    for (symmetry, images) in [(ISOTROPIC, 1.0), (Symmetry::FULL, 4.0)] {
        let subset = read("spherical", symmetry, text);
        let measure = subset.quadrature();
        near(measure.value / (images * want), 1.0, 1e-9, symmetry);
        assert_near(subset.monte_carlo(7), measure.value, 0.0);
    }
    // A box that is its own image counts once for each image it lacks.
    let square = full("spherical", "theta_i=10..30, theta_o=10..30");
    let want = (TAU * (a.cos() - b.cos())).powi(2);
    assert!((square.quadrature().value / want - 1.0).abs() < 1e-6);
}

#[test]
fn counting_agrees_with_the_jacobian() {
    for [name, text] in table(
        "half-difference | theta_h=5..20, theta_d=30..80, phi_d=10..70
         orthographic | h_bar=0.2..0.8, k_bar=0.1..0.9, delta=40..90
         stark | alpha=0.3..0.8, delta=0..60",
    ) {
        let subset = full(name, text);
        let [exact, counted] = [subset.quadrature(), subset.monte_carlo(5)];
        assert_near(counted, exact.value, exact.error);
        assert!(counted.error < 0.02 * counted.value);
    }
}

#[test]
fn an_image_holds_the_pairs_and_the_own_one_is_the_box() {
    let subset = full("hybrid", "h_bar=0.1..0.4, k=0.3..0.6, delta=20..50");
    let measure = subset.quadrature();
    // Other pairs of the box, unlike those that images are found from.
    let members = subset.members(5000, 99);
    for entry in crate::common::polar() {
        let form = entry.form(Symmetry::FULL);
        let image = subset.image(&form, &measure).unwrap();
        let (kind, fill) = (entry.kind, image.fill.value);
        assert!(fill > 0.0 && fill <= 1.0, "{kind}: {image:?}");
        for member in &members {
            let coords = form.forward(&member.pair);
            for (i, [lo, hi]) in image.ranges.into_iter().enumerate() {
                let slack = 2e-3 * form.axes()[i].length();
                let range = lo - slack..hi + slack;
                assert!(range.contains(&coords[i]), "{kind}");
            }
        }
        if ["hybrid", "stark"].contains(&kind) {
            near(fill, 1.0, 1e-6, kind);
        }
        // Stark's axes are the squares of the hybrid ones.
        if kind == "stark" {
            near(image.ranges[0][1], 0.16, 1e-9, kind);
        }
    }
}

#[test]
fn a_pole_is_no_part_of_an_azimuth() {
    let subset = full("hybrid", "h_bar=0..0.2, k=0..0.7, delta=30..60");
    let stark = crate::common::form("stark", Symmetry::FULL);
    let image = subset.image(&stark, &subset.quadrature()).unwrap();
    for (found, want) in image.ranges[2].into_iter().zip([30.0, 60.0]) {
        near(found.to_degrees(), want, 1e-6, "delta");
    }
}

#[test]
fn the_angles_of_a_spherical_box_are_its_own() {
    let text = "theta_i=10..30, theta_o=40..75, delta_phi=20..50";
    let needs = full("spherical", text).needs().unwrap();
    let want = [
        ("theta_i", [10.0_f64, 30.0]),
        ("theta_o", [40.0, 75.0]),
        ("azimuth difference", [20.0, 50.0]),
    ];
    for ((name, got), (known, want)) in needs.into_iter().zip(want) {
        assert_eq!(name, known);
        for (got, want) in got.into_iter().zip(want) {
            assert!((got.to_degrees() - want).abs() < 1e-9, "{got} {want}");
        }
    }
    // Nothing above the horizon: both directions 60° from a half vector that is 60° off the normal.
    let none = "theta_h=60..70, theta_d=60..70, phi_d=0..10";
    let empty = full("half-difference", none);
    assert_eq!(empty.needs(), None);
    assert_eq!(empty.quadrature().value, 0.0);
}

#[test]
fn the_energy_of_a_matte_surface_is_known() {
    // ∫∫ a/π cos cos = π a over everything; over elevations below 30° of either, sin⁴ 30° of it.
    let lambert = matte(0.6);
    let whole = full("half-difference", "").energy(&lambert);
    assert!((whole.value / (0.6 * PI) - 1.0).abs() < 2e-3, "{whole:?}");
    let part = full("spherical", "theta_i=0..30, theta_o=0..30").energy(&lambert);
    let want = 0.6 * PI / 16.0;
    assert_near(part, want, 1e-6);
    assert!(part.error < 1e-3 * want);
    let share = full("hybrid", "k=0..0.5").energy_share(&lambert).unwrap();
    let rest = full("hybrid", "k=0.5..1").energy_share(&lambert).unwrap();
    let most = 4.0 * share.error.hypot(rest.error) + 1e-3;
    near(share.value + rest.value, 1.0, most, "sum");
}

#[test]
fn counting_is_told_where_quadrature_is_coarse() {
    // At the horizon: a measure from four times as many pairs as decides.
    let subset = full("stark", "alpha=0.95..1");
    let counts = (20..24).map(|seed| subset.monte_carlo(seed).value);
    let want = counts.sum::<f64>() / 4.0;
    let measure = subset.measure(1);
    let best = measure.best();
    assert!(measure.is_counted(), "{measure:?}");
    assert!(best.error < 0.02 * want, "{measure:?}");
    assert_near(best, want, 0.0);
    // Counts of nothing are no proof, and smooth integrands are for quadrature.
    let tiny = full("spherical", "theta_i=10..10.01, theta_o=20..20.01");
    let tiny = tiny.measure(1);
    assert!(!tiny.is_counted() && tiny.counted.error > 0.0, "{tiny:?}");
    // Every pair is every pair.
    let share = full("stark", "").measure(1).share();
    assert!(share.value <= 1.0 && share.value > 1.0 - 1e-5, "{share:?}");
}

#[test]
fn boxes_that_make_no_sense_are_refused() {
    for [text, parts] in table(
        r#"theta_h=0..10 | theta_h;hybrid;h_bar, k, delta
           k | "k";axis=low..high
           k=0.5 | k;0.5;low..high;0 <= low < high <= 1
           k=0.5..0.2 | 0.5..0.2
           k=0.5..NaN | NaN
           delta=0..91 | 90;degrees
           k=0..1,k=0..1 | once"#,
    ) {
        let form = crate::common::form("hybrid", Symmetry::FULL);
        let error = Subset::read(form, text).err().unwrap().to_string();
        parts.split(';').for_each(|part| says(&error, part));
    }
}

#[test]
fn the_energy_of_a_sharp_lobe_is_found() {
    let ggx = |alpha: f64| model("ggx", &format!("alpha = {alpha}"));
    // All of it, and not 8 % more.
    let share = |text: &str| full("spherical", text).energy_share(&*ggx(0.003));
    let all = share("").unwrap();
    assert!((all.value - 1.0).abs() < 1e-12, "{all:?}");
    // What is reflected stays within a degree of the mirror direction.
    let mirrored = share("delta_phi=150..180, theta_i=20..70").unwrap();
    let around = share("theta_i=20..70").unwrap();
    assert!(mirrored.resolved() && (mirrored.value / around.value - 1.0).abs() < 0.02);
    let beside = share("delta_phi=0..150, theta_i=20..70").unwrap();
    assert!(beside.value < 0.02, "{beside:?}");
    // A wide lobe is resolved by a box's own points as well: they are others.
    let wide = ggx(0.4);
    let subset = full("hybrid", "h_bar=0.1..0.5, k=0.2..0.7");
    let found = subset.energy_share(&*wide).unwrap();
    let whole = full("half-difference", "").energy(&*wide);
    let own = subset.energy(&*wide);
    let error = (own.error / own.value).hypot(whole.error / whole.value);
    let own = own.value / whole.value;
    let most = 4.0 * (own * error).hypot(found.error);
    near(own, found.value, most, "its own points");
    assert!(found.error < 0.02 * found.value);
    // So is a box that few of the others fall into.
    let small = full("hybrid", "h_bar=0.3..0.31, k=0.3..0.31, delta=40..45");
    assert!(small.energy_share(&*wide).unwrap().resolved());
    let black = matte(0.0);
    assert_eq!(subset.energy_share(&black), None);
}
