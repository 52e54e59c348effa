mod correlation;
mod fit;

use crate::common::{self, form, matte, model, near, planned, product};
use glam::DVec3;
use gonio::brdf::{Brdf, Channels, Lambert, Spectrum};
use gonio::geometry::{Direction, DirectionPair, Symmetry};
use gonio::instrument::{Ideal, Instrument};
use gonio::moments::{
    Batch, Channel, Clamping, Component, HorizonCopy, Kind, MomentErrors, Order, PeakResolving,
    Profile, Slice, SliceMoments, Tally, lambertian_part,
};
use gonio::parametrization::view_centered;
use gonio::reconstruct::{Multilinear, Reconstruct};
use gonio::sampling::Random;
use std::f64::consts::{FRAC_PI_4, PI};

#[test]
fn components_know_their_place() {
    for (i, c) in Component::ALL.into_iter().enumerate() {
        assert_eq!(c.index(), i);
    }
    for order in 0..=4 {
        let order = Order::new(order).unwrap();
        assert_eq!(order.components().count(), order.count());
        assert!(order.components().all(|c| c.order() <= order.get()));
    }
    assert_eq!(Component { n: 2, m: 2 }.to_string(), "kurtosis_22");
    assert!(Order::new(5).is_none());
}

#[test]
fn channels_are_those_of_the_brdf() {
    let rgb = Lambert::new(Spectrum::Rgb([0.1, 0.2, 0.6]), Channels::Rgb);
    let at = |channel| {
        let slice = Slice::new(&rgb, channel, 0.3).unwrap();
        slice.value(0.1, -0.4).unwrap() * PI
    };
    let luminance = 0.2126 * 0.1 + 0.7152 * 0.2 + 0.0722 * 0.6;
    let expected = [luminance, 0.3, 0.1, 0.2, 0.6];
    for (channel, want) in Channel::ALL.into_iter().zip(expected) {
        assert!((at(channel) - want).abs() < 1e-14);
    }
    let grey = matte(0.5);
    assert!(Slice::new(&grey, Channel::Luminance, 0.3).is_ok());
    assert!(Slice::new(&grey, Channel::Average, 0.3).is_err());
    for theta_o in [-0.1, PI / 2.0 + 1e-9, f64::NAN] {
        assert!(Slice::new(&grey, Channel::Luminance, theta_o).is_err());
    }
}

#[test]
fn what_is_below_the_diffuse_part_is_clamped() {
    let grey = matte(0.5);
    let slice = Slice::new(&grey, Channel::Luminance, 0.3).unwrap();
    for (diffuse, kind) in [(0.5, Kind::Clamped), (0.1, Kind::Value)] {
        let mut batch = Batch::default();
        let slice = slice.without(diffuse);
        batch.push(&slice, Direction::NORMAL);
        slice.evaluate(&mut batch);
        assert_eq!(batch.kinds(), [kind]);
        assert_eq!(batch.values()[0], (0.5 / PI - diffuse).max(0.0));
    }
}

#[test]
fn the_minimum_is_found_between_the_nodes() {
    let part = lambertian_part(&matte(0.3), Channel::Luminance).unwrap();
    assert!((part * PI / 0.3 - 1.0).abs() < 1e-15);
    // A lobe that is everywhere positive: its minimum over a far denser grid is no smaller.
    let ggx = model("ggx", "alpha = 0.4");
    let part = lambertian_part(&*ggx, Channel::Luminance).unwrap();
    let slice = Slice::new(&*ggx, Channel::Luminance, FRAC_PI_4).unwrap();
    let n = 700;
    let at = |i: i32| (f64::from(i) / f64::from(n) - 0.5) * PI * (1.0 - 1.0 / 128.0);
    let dense = (0..=n)
        .flat_map(|i| (0..=n).map(move |j| (i, j)))
        .filter_map(|(i, j)| slice.value(at(i), at(j)))
        .fold(f64::INFINITY, f64::min);
    assert!(part > 0.0 && part <= dense * (1.0 + 1e-6), "{part} {dense}");
}

fn profile(brdf: &dyn Brdf, views: usize, max_view_deg: f64) -> Profile {
    let (spec, estimator) = (common::views(views, max_view_deg), PeakResolving::default());
    Profile::new(brdf, Channel::Luminance, &spec, &estimator, 1).unwrap()
}

#[test]
fn a_darker_copy_errs_in_energy_alone() {
    let [truth, darker] = [0.8, 0.6].map(|albedo| profile(&matte(albedo), 3, 60.0));
    let [e, ..] = MomentErrors::between(&truth, &darker);
    assert!((e.energy.unwrap() - 0.25).abs() < 1e-12);
    let others = [e.mean, e.covariance, e.skewness, e.kurtosis];
    assert!(others.iter().all(|e| e.unwrap() < 1e-12));
}

#[test]
fn a_wider_lobe_errs_as_its_moments_do() {
    // Views at 0°, 30°, 60°.
    let [f, g] = ["alpha = 0.2", "alpha = 0.25"].map(|keys| profile(&*model("ggx", keys), 3, 60.0));
    let [errors, bands @ ..] = MomentErrors::between(&f, &g);
    // By hand, from the profiles: one loop a quantity.
    let (mut mean, mut covariance) = (0.0, 0.0);
    for (f, g) in f.slices.iter().zip(&g.slices) {
        let ([ft, fp], [gt, gp]) = (f.moments.mean().unwrap(), g.moments.mean().unwrap());
        mean += (gt - ft).abs().max((gp - fp).abs()) / 3.0;
        let [f, g] = [f, g].map(|slice| slice.moments.covariance().unwrap());
        let relative = [
            (g[0] - f[0]).abs() / f[0],
            (g[1] - f[1]).abs() / (f[0] * f[2]).sqrt(),
            (g[2] - f[2]).abs() / f[2],
        ];
        covariance += relative.into_iter().fold(0.0, f64::max) / 3.0;
    }
    assert!((errors.mean.unwrap() - mean.to_degrees()).abs() < 1e-13);
    assert!((errors.covariance.unwrap() - covariance).abs() < 1e-13);
    assert!(errors.covariance.unwrap() > 0.1);
    // Two of the views are in the first band, one in the second, none in the last.
    let [low, middle, high] = bands.map(|of| of.covariance);
    let whole = (2.0 * low.unwrap() + middle.unwrap()) / 3.0;
    assert!((errors.covariance.unwrap() - whole).abs() < 1e-13 && high.is_none());
}

/// Ends of bands belong to the band below, however views are rounded.
#[test]
fn views_on_the_end_of_a_band_are_in_the_band_below() {
    let [truth, darker] = [0.8, 0.6].map(|albedo| profile(&matte(albedo), 18, 85.0));
    for (band, views) in [18, 9, 6, 3].into_iter().enumerate() {
        let counted = (0..18).filter(|&i| {
            let mut mixed = truth.clone();
            mixed.slices[i] = darker.slices[i];
            MomentErrors::between(&truth, &mixed)[band].energy.unwrap() > 0.0
        });
        assert_eq!(counted.count(), views);
    }
}

/// A reconstruction with a kink at every reading needs no more values than leave its differences known to a fifth.
#[test]
fn differences_from_a_truth_are_known_to_a_fifth() {
    let ggx = model("ggx", "alpha = 0.2");
    let form = form("half-difference", Symmetry::FULL);
    let measured = Ideal.measure(&*ggx, &planned(&form, "grid", 200, 1));
    let copy = Multilinear::default().reconstruct(&measured).unwrap();
    let (truth, whole) = (profile(&*ggx, 4, 75.0), profile(&*copy, 4, 75.0));
    let spec = common::views(4, 75.0);
    let against = |truth| Profile::against(truth, &*copy, &spec, &PeakResolving::default(), 1);
    let less = against(&truth).unwrap();
    for ((f, g), l) in truth.slices.iter().zip(&whole.slices).zip(&less.slices) {
        assert!(l.unresolved.is_none() && l.evaluations <= g.evaluations);
        let [alpha, of_copy] = [f, l].map(|s| s.moments.get(Component::ENERGY).unwrap());
        let error = (of_copy.value - alpha.value).abs();
        assert!(of_copy.uncertainty <= f64::max(0.2 * error, 1e-4 * of_copy.value));
        for order in 0..=4 {
            let of_order = |c: &Component| c.order() == order;
            let components = || Component::ALL.into_iter().filter(of_order);
            let value = |s: &SliceMoments, c| s.moments.get(c).unwrap().value;
            let off = |a: &SliceMoments, b: &SliceMoments| {
                let off = components().map(|c| (value(a, c) - value(b, c)).abs());
                off.fold(0.0, f64::max)
            };
            // What is no difference but rounding, or quadrature, is known as well as the tolerance says.
            let known = components().map(|c| g.moments.get(c).unwrap().uncertainty);
            let known = 2.0 * known.fold(0.0, f64::max);
            let (less, all) = (off(l, g), off(f, g));
            assert!(
                less <= f64::max(0.2 * all, known),
                "{order}: {less} of {all}"
            );
        }
    }
    let values = |p: &Profile| p.slices.iter().map(|s| s.evaluations).sum::<usize>();
    assert!(values(&less) < values(&whole));
    // A copy of the truth has its moments to the tolerance.
    let same = Profile::against(&truth, &*ggx, &spec, &PeakResolving::default(), 1).unwrap();
    for ((f, g), c) in product(truth.slices.iter().zip(&same.slices), Component::ALL) {
        let [f, g] = [f, g].map(|s| s.moments.get(c).unwrap());
        assert!((f.value - g.value).abs() <= f.uncertainty + g.uncertainty);
        assert!(g.uncertainty <= 1e-4 * f.value.abs().max(5.0));
    }
}

#[test]
fn the_copy_is_the_brdf_at_normal_view_and_keeps_its_shape_uncut() {
    let ggx = model("ggx", "alpha = 0.2");
    let copy = HorizonCopy::new(&*ggx);
    for (theta, phi) in [(0.3, 0.2), (-0.9, 0.5), (0.0, -1.2)] {
        let omega_i = view_centered(theta, phi);
        let normal = DirectionPair::new(omega_i, Direction::NORMAL);
        let got = copy.luminance(&normal).unwrap();
        assert!((got / ggx.luminance(&normal).unwrap() - 1.0).abs() < 1e-12);
        // Seen from 30° the same value stands 30° further.
        for azimuth in [0.0, 2.0] {
            let turn = |d: Direction| {
                let (s, c) = f64::sin_cos(azimuth);
                let v = d.vector();
                Direction::from_unit(DVec3::new(v.x * c - v.y * s, v.x * s + v.y * c, v.z))
            };
            let both = [[theta - 0.5, phi], [0.5, 0.0]];
            let [light, view] = both.map(|[theta, phi]| turn(view_centered(theta, phi)));
            let moved = DirectionPair::new(light, view);
            assert!((copy.luminance(&moved).unwrap() / got - 1.0).abs() < 1e-12);
        }
    }
}

#[test]
fn a_copy_is_explained_by_the_horizon_alone() {
    let ggx = model("ggx", "alpha = 0.3");
    let copy = HorizonCopy::new(&*ggx);
    let estimator = PeakResolving::default();
    let clamping = Clamping::of(&copy, &profile(&copy, 17, 80.0), &estimator, 1.4).unwrap();
    for c in [(1, 0), (2, 0), (3, 0), (1, 2)] {
        let index = Component { n: c.0, m: c.1 }.index();
        let explained = clamping.explained[index].unwrap();
        assert!(explained > 1.0 - 1e-4, "{c:?}: {explained}");
    }
}

#[test]
fn what_the_horizon_does_not_touch_it_does_not_explain() {
    // A lobe without tails, 1° wide and 30° from the horizon at most: it narrows across the
    // plane of incidence because half vectors do, like cos² θ_o.
    let lobe = model("beckmann", "alpha = 0.01");
    let estimator = PeakResolving::default();
    let clamping = Clamping::of(&*lobe, &profile(&*lobe, 17, 80.0), &estimator, 1.0).unwrap();
    let explained = clamping.explained[Component { n: 0, m: 2 }.index()].unwrap();
    assert!(explained.abs() < 1e-3, "{explained}");
}

/// Points around `centre` with spread `width`, weighted unevenly.
fn cloud(n: usize, centre: [f64; 2], width: f64) -> (Vec<[f64; 2]>, Vec<f64>) {
    let random = Random::new(3);
    (0..n as u64)
        .map(|i| {
            let [a, b, w] = random.point(i);
            let x = centre[0] + width * (a * a - 0.3);
            ([x, centre[1] + width * (b - 0.2 * a)], w)
        })
        .unzip()
}

#[test]
fn a_far_and_narrow_cloud_keeps_its_digits() {
    // The same cloud at the origin and at −1.57, widths down to 1e-6: raw sums would keep
    // (1e-6/1.57)² / 1e-16, that is no digits, of the variance.
    let reference = {
        let (points, weights) = cloud(4096, [0.0; 2], 1.0);
        Tally::from_points(Order::MAX, &points, &weights).values()
    };
    // Parts of any size make up the whole.
    for (width, size) in [(1.0, 1), (1.0, 999), (1e-2, 7), (1e-4, 64), (1e-6, 64)] {
        let (points, weights) = cloud(4096, [-1.57, 0.0], width);
        let mut tally = Tally::new(Order::MAX);
        for (p, w) in points.chunks(size).zip(weights.chunks(size)) {
            tally.merge(&Tally::from_points(Order::MAX, p, w));
        }
        let values = tally.values();
        for c in Component::ALL.into_iter().filter(|c| c.order() >= 2) {
            let scale = if c.order() == 2 { width * width } else { 1.0 };
            let [got, want] = [&values, &reference].map(|values| values[c.index()].unwrap());
            // What is left is the rounding of the points themselves, 2e-16/width.
            near(got / scale, want, 4e-15 / width + 1e-12, (width, c));
        }
    }
}

#[test]
fn what_has_no_weight_has_no_mean() {
    let black = Tally::from_points(Order::MAX, &[[0.1, 0.2]; 5], &[0.0; 5]);
    assert_eq!(black.values()[0], Some(0.0));
    assert!(black.values()[1..].iter().all(Option::is_none));
    let point = Tally::from_points(Order::MAX, &[[0.1, 0.2]], &[2.0]).values();
    assert_eq!((point[3], point[6]), (Some(0.0), None));
}
