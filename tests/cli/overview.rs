//! The picture at the top of the README shows what the library computes: a lobe, poses, spheres and errors. The rest of it is
//! drawn by hand. `GONIO_BLESS=1 cargo test --test cli the_overview -- --ignored` puts in what is computed today.

use super::common::{self, Level, levels};
use super::pages::of_repository;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::DVec3;
use gonio::brdf::Brdf;
use gonio::geometry::{Direction, DirectionPair};
use gonio::instrument::{Ideal, Instrument};
use gonio::lighting::{LightingSpec, SkySpec};
use gonio::metrics::{Measure, MetricsSpec};
use gonio::parametrization::{self, Warps};
use gonio::reconstruct::{Cubic, Reconstruct};
use gonio::report::SphereImage;
use gonio::report::pictures::render_spheres;
use gonio::schedule::{Grid, SampleSet, Schedule};
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

const ANEW: &str = "GONIO_BLESS=1 cargo test --test cli overview -- --ignored draws it anew";

/// Pixels of a sphere, and of its side on the page.
const SPHERE: usize = 180;
const SIDE: f64 = 140.0;
const BUDGET: usize = 250;

/// A grid of at most [`BUDGET`] poses, the copy that splines make of its readings, and how wrong it is.
struct Copy {
    poses: Arc<Schedule>,
    brdf: Box<dyn Brdf>,
    nrmse: f64,
}

impl Copy {
    fn new(truth: &dyn Brdf, kind: &str, warp: &str) -> Self {
        let entry = parametrization::find(kind).unwrap();
        let warps: Warps = serde_json::from_str(warp).unwrap();
        let form = entry.warped(truth.symmetry(), &warps).unwrap();
        let poses = Arc::new(Grid::default().plan(&form, BUDGET, 1).unwrap());
        let measurement = Ideal.measure(truth, &poses);
        let brdf = Cubic::default().reconstruct(&measurement).unwrap();
        let pairs = common::test_pairs(Measure::Cosine, MetricsSpec::default().pairs);
        let nrmse = common::errors(truth, &*brdf, &pairs).nrmse.unwrap();
        Self { poses, brdf, nrmse }
    }

    /// The directions of light (orange) and sensor (blue) of all poses as seen from above, the sample turned so that the light is
    /// on the left, and mirror images of the sensors (pale).
    fn dots(&self, centre: [f64; 2]) -> Vec<String> {
        let dot = |theta: f64, phi: f64, ink: &str| {
            let r = 68.0 * theta / FRAC_PI_2;
            let [x, y] = [centre[0] + r * phi.cos(), centre[1] - r * phi.sin()];
            format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"1.5\" fill=\"{ink}\"/>")
        };
        let dots = self.poses.poses.iter().flat_map(|pose| {
            let [i, o] = [pose.pair.omega_i, pose.pair.omega_o];
            let phi = o.phi() + (PI - i.phi());
            [
                dot(o.theta(), -phi, "#a9cde6"),
                dot(o.theta(), phi, "#0072b2"),
                dot(i.theta(), PI, "#d55e00"),
            ]
        });
        dots.collect()
    }
}

/// The lobe of a material for light from 32°, in the plane of incidence, as seen from before and above; radii are cube roots of
/// values, else only the peak is seen.
fn lobe(truth: &dyn Brdf) -> String {
    let direction = |theta: f64| {
        let azimuth = if theta < 0.0 { PI } else { 0.0 };
        Direction::from_spherical(theta.abs().to_radians(), azimuth)
    };
    let light = Direction::from_spherical(32f64.to_radians(), PI);
    let value = |theta: f64| {
        let pair = DirectionPair::new(light, direction(theta));
        truth.luminance(&pair).unwrap().cbrt()
    };
    let seen = |v: DVec3| {
        let (s, c) = 24f64.to_radians().sin_cos();
        let [x, y] = [190.0 + 164.0 * v.x, 236.0 - 164.0 * (c * v.z + s * v.y)];
        format!("{x:.1},{y:.1}")
    };
    let angles: Vec<f64> = (-178..=178).map(|i| 0.5 * f64::from(i)).collect();
    let highest = angles.iter().map(|a| value(*a)).fold(0.0, f64::max);
    let edge = angles.iter().map(|a| {
        let v = DVec3::new(a.to_radians().sin(), 0.0, a.to_radians().cos());
        seen(0.62 * value(*a) / highest * v)
    });
    let origin = seen(DVec3::ZERO);
    let places = [origin.clone()].into_iter().chain(edge).chain([origin]);
    let places = places.collect::<Vec<_>>().join(" ");
    let ink = "fill=\"#f7d8c4\" stroke=\"#c98a60\" stroke-width=\"1\"";
    format!("<polyline points=\"{places}\" {ink}/>")
}

fn sphere([x, y]: [f64; 2], image: &SphereImage, white: f64) -> String {
    let png = image.png(white);
    let (x, y) = (x - SIDE / 2.0, y - SIDE / 2.0);
    let data = STANDARD.encode(png);
    let place = format!("x=\"{x:.1}\" y=\"{y:.1}\" width=\"{SIDE}\" height=\"{SIDE}\"");
    format!("<image {place} href=\"data:image/png;base64,{data}\"/>")
}

fn caption([x, y]: [f64; 2], text: &str) -> String {
    let place = format!("x=\"{x:.1}\" y=\"{y:.1}\"");
    let look = "font-size=\"12.5\" fill=\"#333333\" text-anchor=\"middle\"";
    format!("<text {place} {look}>{text}</text>")
}

/// The lines of the picture that are computed, in their order; spheres by so many samples a pixel.
fn computed(samples: usize) -> Vec<String> {
    let truth = common::model("ggx", "alpha = 0.05");
    let copies = [
        Copy::new(&*truth, "spherical", "{}"),
        Copy::new(&*truth, "half-difference", r#"{"theta_h":"square-root"}"#),
    ];
    let light = SkySpec::default().build().unwrap();
    let brdfs = [&*copies[0].brdf, &*copies[1].brdf];
    let spheres = render_spheres(&*truth, &brdfs, &*light, SPHERE, samples);
    let original = &spheres[0].images[0];
    let white = original.white();
    let mut lines = vec![lobe(&*truth)];
    for ((copy, image), y) in copies.iter().zip(&spheres).zip([112.0, 302.0]) {
        lines.extend(copy.dots([497.0, y]));
        lines.push(sphere([690.0, y], &image.images[1], white));
        let n = copy.poses.poses.len();
        let (readings, error) = (format!("{n} readings, uniform in"), copy.nrmse);
        lines.push(caption([497.0, y + 86.0], &readings));
        lines.push(caption([690.0, y + 86.0], &format!("nrmse {error:.3}")));
    }
    lines.push(sphere([873.0, 207.0], original, white));
    lines
}

/// True for the lines of the picture that [`computed`] makes.
fn is_computed(line: &str) -> bool {
    let marks = ["#c98a60", "r=\"1.5\"", "<image", "readings, uniform in<"];
    marks.iter().any(|mark| line.contains(mark)) || line.contains(">nrmse ")
}

levels! {
    the_overview_is_drawn_of_what_is_computed: "thorough: its spheres too";
}

/// The picture of today; GONIO_BLESS=1 writes it. In the quick level the colours of spheres are not looked at.
fn the_overview_is_drawn_of_what_is_computed(level: Level) {
    let path = of_repository("src/docs/overview.svg");
    let mut picture = std::fs::read_to_string(&path).unwrap();
    let now = computed(level.of(1, 256));
    if level == Level::Thorough && std::env::var_os("GONIO_BLESS").is_some() {
        let mut rest = now.iter();
        let lines = picture.lines().map(|line| match is_computed(line) {
            true => rest.next().expect("as many lines as before"),
            false => line,
        });
        picture = lines.map(|line| format!("{line}\n")).collect();
        std::fs::write(&path, &picture).unwrap();
    }
    let then: Vec<_> = picture.lines().filter(|line| is_computed(line)).collect();
    assert_eq!(then.len(), now.len());
    for (then, now) in then.into_iter().zip(&now) {
        match (pixels(then), pixels(now)) {
            // Colours are rounded: on another machine one may fall to the other side.
            (Some(_), Some(_)) if level == Level::Quick => {}
            (Some(then), Some(now)) => {
                assert_eq!(then.len(), now.len());
                let far = |(a, b): (&u8, &u8)| a.abs_diff(*b) > 2;
                let far = then.iter().zip(&now).filter(|p| far(*p)).count();
                assert!(far < now.len() / 1000, "{far} pixels are others");
            }
            _ => assert_eq!(then, now, "{ANEW}"),
        }
    }
}

/// The colours of an embedded picture.
fn pixels(line: &str) -> Option<Vec<u8>> {
    let (_, data) = line.split_once("base64,")?;
    let (data, _) = data.split_once('"')?;
    let (_, pixels) = common::png::pixels(&STANDARD.decode(data).unwrap());
    let colours = pixels.iter().flat_map(|p| &p[..3]);
    Some(colours.copied().collect())
}
