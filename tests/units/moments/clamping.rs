use glam::DVec3;
use gonio::brdf;
use gonio::brdf::{Brdf, Channels};
use gonio::geometry::{Direction, DirectionPair};
use gonio::moments::{
    Channel, Clamping, Component, HorizonCopy, MomentsSpec, PeakResolving, Profile,
};
use gonio::parametrization::view_centered;
use gonio::registry::read_text;

fn microfacet(kind: &str, alpha: f64) -> Box<dyn Brdf> {
    let entry = brdf::all().into_iter().find(|e| e.kind == kind).unwrap();
    let spec = read_text(&entry, &format!("alpha = {alpha}")).unwrap();
    spec.build(Channels::Luminance).unwrap()
}

fn profile(brdf: &dyn Brdf) -> Profile {
    let spec = MomentsSpec {
        views: 17,
        max_view_deg: 80.0,
        ..MomentsSpec::default()
    };
    let estimator = PeakResolving::default();
    Profile::new(brdf, Channel::Luminance, &spec, &estimator, 1).unwrap()
}

#[test]
fn the_copy_is_the_brdf_at_normal_view_and_keeps_its_shape_uncut() {
    let ggx = microfacet("ggx", 0.2);
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
            let moved = DirectionPair::new(
                turn(view_centered(theta - 0.5, phi)),
                turn(view_centered(0.5, 0.0)),
            );
            assert!((copy.luminance(&moved).unwrap() / got - 1.0).abs() < 1e-12);
        }
    }
}

#[test]
fn a_copy_is_explained_by_the_horizon_alone() {
    let ggx = microfacet("ggx", 0.3);
    let copy = HorizonCopy::new(&*ggx);
    let estimator = PeakResolving::default();
    let clamping = Clamping::of(&copy, &profile(&copy), &estimator, 1.4).unwrap();
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
    let lobe = microfacet("beckmann", 0.01);
    let estimator = PeakResolving::default();
    let clamping = Clamping::of(&*lobe, &profile(&*lobe), &estimator, 1.0).unwrap();
    let explained = clamping.explained[Component { n: 0, m: 2 }.index()].unwrap();
    assert!(explained.abs() < 1e-3, "{explained}");
}
