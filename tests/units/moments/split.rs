use gonio::brdf;
use gonio::brdf::{Channels, Lambert, Spectrum};
use gonio::moments::{Channel, Slice, lambertian_part};
use gonio::registry::read_text;
use std::f64::consts::{FRAC_PI_4, PI};

#[test]
fn all_of_lambert_is_diffuse() {
    let lambert = Lambert::new(Spectrum::Grey(0.3), Channels::Luminance);
    let part = lambertian_part(&lambert, Channel::Luminance).unwrap();
    assert!((part * PI / 0.3 - 1.0).abs() < 1e-15);
}

#[test]
fn the_minimum_is_found_between_the_nodes() {
    // A lobe that is everywhere positive: its minimum over a far denser grid is no smaller.
    let entry = brdf::all().into_iter().find(|e| e.kind == "ggx").unwrap();
    let ggx = read_text(&entry, "alpha = 0.4").unwrap();
    let ggx = ggx.build(Channels::Luminance).unwrap();
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
