//! The picture at the top of the README is drawn here, from what the library computes:
//! `GONIO_BLESS=1 cargo test --test cli the_overview -- --ignored` writes it anew.

use super::common::{Level, levels};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::DVec3;
use gonio::brdf::{self, Brdf, Channels};
use gonio::geometry::{Direction, DirectionPair};
use gonio::instrument::{Ideal, Instrument};
use gonio::lighting::{LightingSpec, SkySpec};
use gonio::metrics::{self, Measure, MetricsSpec};
use gonio::parametrization::{self, Warps};
use gonio::reconstruct::{Cubic, Reconstruct};
use gonio::registry;
use gonio::report::SphereImage;
use gonio::report::pictures::render_spheres;
use gonio::schedule::{Grid, SampleSet, Schedule};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Pixels of a sphere, and of its side on the page.
const SPHERE: usize = 180;
const SIDE: f64 = 140.0;
const BUDGET: usize = 250;
/// Light and sensor of the sketch: polar angle and azimuth, degrees.
const LIGHT: [f64; 2] = [32.0, 180.0];
const SENSOR: [f64; 2] = [62.0, -32.0];

const ORANGE: &str = "#d55e00";
const BLUE: &str = "#0072b2";
/// Mirror images of what is blue.
const PALE: &str = "#a9cde6";
const GREY: &str = "#8a8a8a";
const DARK: &str = "#333333";

/// The glossy material of the quickstart.
fn material() -> Box<dyn Brdf> {
    let entries = brdf::all();
    let ggx = entries.iter().find(|e| e.kind == "ggx").unwrap();
    let spec = registry::read_text(ggx, "alpha = 0.05").unwrap();
    spec.build(Channels::Luminance).unwrap()
}

/// A grid of at most [`BUDGET`] poses, the copy that splines make of its readings, and how wrong it is.
struct Copy {
    name: &'static str,
    poses: Arc<Schedule>,
    brdf: Box<dyn Brdf>,
    nrmse: f64,
}

impl Copy {
    fn new(truth: &dyn Brdf, name: &'static str, kind: &str, warp: &str) -> Self {
        let entry = parametrization::find(kind).unwrap();
        let warps: Warps = serde_json::from_str(warp).unwrap();
        let form = entry.warped(truth.symmetry(), &warps).unwrap();
        let poses = Arc::new(Grid::default().plan(&form, BUDGET, 1).unwrap());
        let measurement = Ideal.measure(truth, &poses);
        let brdf = Cubic::default().reconstruct(&measurement).unwrap();
        let pairs = metrics::test_pairs(Measure::Cosine, &MetricsSpec::default()).unwrap();
        let (f, g) = (
            metrics::evaluate(truth, &pairs),
            metrics::evaluate(&*brdf, &pairs),
        );
        let nrmse = metrics::compare(&pairs, &f, &g).nrmse.unwrap();
        Self {
            name,
            poses,
            brdf,
            nrmse,
        }
    }
}

/// SVG under construction.
#[derive(Default)]
struct Drawing(String);

impl Drawing {
    fn path(&mut self, points: &[[f64; 2]], style: &str) {
        let places: Vec<_> = points
            .iter()
            .map(|[x, y]| format!("{x:.1},{y:.1}"))
            .collect();
        writeln!(
            self.0,
            "<polyline points=\"{}\" {style}/>",
            places.join(" ")
        )
        .unwrap();
    }

    fn line(&mut self, points: &[[f64; 2]], ink: &str, width: f64) {
        self.path(
            points,
            &format!("fill=\"none\" stroke=\"{ink}\" stroke-width=\"{width}\""),
        );
    }

    fn dashes(&mut self, points: &[[f64; 2]], ink: &str) {
        let dashed = "stroke-width=\"1.2\" stroke-dasharray=\"5 4\"";
        self.path(points, &format!("fill=\"none\" stroke=\"{ink}\" {dashed}"));
    }

    fn area(&mut self, points: &[[f64; 2]], fill: &str, stroke: &str) {
        self.path(
            points,
            &format!("fill=\"{fill}\" stroke=\"{stroke}\" stroke-width=\"1\""),
        );
    }

    fn dot(&mut self, [x, y]: [f64; 2], radius: f64, ink: &str) {
        writeln!(
            self.0,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\" fill=\"{ink}\"/>"
        )
        .unwrap();
    }

    fn text(&mut self, [x, y]: [f64; 2], size: f64, how: &str, text: &str) {
        writeln!(
            self.0,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{size}\" {how}>{text}</text>"
        )
        .unwrap();
    }

    fn label(&mut self, at: [f64; 2], ink: &str, text: &str) {
        self.text(at, 14.0, &format!("fill=\"{ink}\""), text);
    }

    fn middle(&mut self, at: [f64; 2], size: f64, text: &str) {
        self.text(
            at,
            size,
            &format!("fill=\"{DARK}\" text-anchor=\"middle\""),
            text,
        );
    }

    fn heading(&mut self, at: [f64; 2], text: &str) {
        let how = format!("fill=\"{DARK}\" text-anchor=\"middle\" font-weight=\"bold\"");
        self.text(at, 15.0, &how, text);
    }

    fn sphere(&mut self, [x, y]: [f64; 2], image: &SphereImage, white: f64) {
        let mut png = Vec::new();
        image.write_png(white, &mut png).unwrap();
        let (x, y) = (x - SIDE / 2.0, y - SIDE / 2.0);
        let data = STANDARD.encode(png);
        writeln!(
            self.0,
            "<image x=\"{x:.1}\" y=\"{y:.1}\" width=\"{SIDE}\" height=\"{SIDE}\" \
            href=\"data:image/png;base64,{data}\"/>"
        )
        .unwrap();
    }
}

fn direction([theta, phi]: [f64; 2]) -> DVec3 {
    Direction::from_spherical(theta.to_radians(), phi.to_radians()).vector()
}

/// Where a point of the laboratory is seen, from before and above.
fn seen(v: DVec3) -> [f64; 2] {
    const CENTRE: [f64; 2] = [190.0, 236.0];
    const REACH: f64 = 164.0;
    let (s, c) = 24f64.to_radians().sin_cos();
    [
        CENTRE[0] + REACH * v.x,
        CENTRE[1] - REACH * (c * v.z + s * v.y),
    ]
}

/// Points along an arc from `a` to `b`, `radius` away.
fn arc(a: DVec3, b: DVec3, radius: f64) -> Vec<[f64; 2]> {
    let angle = a.angle_between(b);
    let at = |i: i32| {
        let t = f64::from(i) / 24.0;
        let v = (((1.0 - t) * angle).sin() * a + (t * angle).sin() * b) / angle.sin();
        seen(radius * v)
    };
    (0..=24).map(at).collect()
}

fn instrument(drawing: &mut Drawing, truth: &dyn Brdf) {
    let ring = |radius: f64| -> Vec<_> {
        let at = |i: i32| direction([90.0, f64::from(i) * 5.0]);
        (0..=72).map(|i| seen(radius * at(i))).collect()
    };
    drawing.heading([190.0, 24.0], "1. Light and sensor go round a sample");
    drawing.area(&ring(1.0), "#f4f4f4", "#c4c4c4");
    let (light, sensor, normal) = (direction(LIGHT), direction(SENSOR), DVec3::Z);
    // The lobe in the plane of light and normal; radii are cube roots, else only the peak is seen.
    let omega_i = Direction::from_unit(light);
    let value = |degrees: f64| {
        let omega_o = Direction::from_unit(direction([
            degrees.abs(),
            if degrees < 0.0 { 180.0 } else { 0.0 },
        ]));
        let mut f = [0.0];
        let _ = truth.eval(&DirectionPair::new(omega_i, omega_o), &mut f);
        f[0].cbrt()
    };
    let angles: Vec<f64> = (-178..=178).map(|i| 0.5 * f64::from(i)).collect();
    let highest = angles.iter().map(|a| value(*a)).fold(0.0, f64::max);
    let mut lobe = vec![seen(DVec3::ZERO)];
    for a in &angles {
        let v = DVec3::new(a.to_radians().sin(), 0.0, a.to_radians().cos());
        lobe.push(seen(0.62 * value(*a) / highest * v));
    }
    lobe.push(seen(DVec3::ZERO));
    drawing.area(&ring(0.3), "#dcdcdc", GREY);
    drawing.area(&lobe, "#f7d8c4", "#c98a60");
    for (place, ink, [_, azimuth]) in [(light, ORANGE, LIGHT), (sensor, BLUE, SENSOR)] {
        let foot = direction([90.0, azimuth]);
        drawing.line(&arc(foot, place, 1.0), ink, 5.0);
        drawing.dot(seen(foot), 5.0, ink);
        drawing.line(&[seen(DVec3::ZERO), seen(0.97 * place)], ink, 1.4);
        drawing.line(&arc(normal, place, 0.34), ink, 1.2);
        drawing.dot(seen(place), 10.0, ink);
    }
    let half = (light + sensor).normalize();
    drawing.dashes(&[seen(DVec3::ZERO), seen(0.98 * normal)], DARK);
    drawing.dashes(&[seen(DVec3::ZERO), seen(0.86 * half)], "#7a3e9d");
    let by = |v: DVec3, [x, y]: [f64; 2]| {
        let at = seen(v);
        [at[0] + x, at[1] + y]
    };
    drawing.label(by(normal, [-5.0, -2.0]), DARK, "n");
    drawing.label(by(0.86 * half, [-2.0, -6.0]), "#7a3e9d", "h");
    drawing.label(by(light, [-62.0, -12.0]), ORANGE, "light ω_i");
    drawing.label(by(sensor, [-24.0, -18.0]), BLUE, "sensor ω_o");
    drawing.label(
        by(0.44 * (normal + light).normalize(), [-14.0, 2.0]),
        ORANGE,
        "θ_i",
    );
    drawing.label(
        by(0.44 * (normal + sensor).normalize(), [9.0, -4.0]),
        BLUE,
        "θ_o",
    );
    for (line, text) in [
        "Brown: f_r^(1/3) of the material for this light, in one plane.",
        "Right: sensors of all poses (blue) seen from above, the sample",
        "turned so that the light (orange) is on the left; by symmetry a",
        "reading stands for its mirror image too (pale).",
    ]
    .into_iter()
    .enumerate()
    {
        drawing.text(
            [14.0, 350.0 + 17.0 * line as f64],
            12.0,
            &format!("fill=\"{DARK}\""),
            text,
        );
    }
}

/// The sensors of all poses as seen from above, the sample turned so that the light is on the left.
fn poses(drawing: &mut Drawing, centre: [f64; 2], copy: &Copy) {
    const RADIUS: f64 = 68.0;
    let at = |theta: f64, phi: f64| {
        let r = RADIUS * theta / FRAC_PI_2;
        [centre[0] + r * phi.cos(), centre[1] - r * phi.sin()]
    };
    for ring in 1..=3 {
        let theta = FRAC_PI_2 * f64::from(ring) / 3.0;
        let points: Vec<_> = (0..=72)
            .map(|i| at(theta, TAU * f64::from(i) / 72.0))
            .collect();
        drawing.line(&points, "#cccccc", 0.8);
    }
    for pose in &copy.poses.poses {
        let [i, o] = [pose.pair.omega_i, pose.pair.omega_o];
        let turn = PI - i.phi();
        let phi = o.phi() + turn;
        drawing.dot(at(o.theta(), -phi), 1.5, PALE);
        drawing.dot(at(o.theta(), phi), 1.5, BLUE);
        drawing.dot(at(i.theta(), PI), 1.5, ORANGE);
    }
    for ring in 1..=3 {
        let [x, y] = at(FRAC_PI_2 * f64::from(ring) / 3.0, -FRAC_PI_2);
        let halo = "stroke=\"#ffffff\" stroke-width=\"3\" paint-order=\"stroke\"";
        let how = format!("fill=\"{DARK}\" text-anchor=\"middle\" {halo}");
        drawing.text([x, y - 2.0], 9.0, &how, &format!("{}°", 30 * ring));
    }
}

/// The whole picture; spheres by so many samples a pixel.
fn overview(samples: usize) -> String {
    let truth = material();
    let copies = [
        Copy::new(&*truth, "spherical coordinates", "spherical", "{}"),
        Copy::new(
            &*truth,
            "half/difference, θ_h spread to the peak",
            "half-difference",
            r#"{"theta_h":"square-root"}"#,
        ),
    ];
    let light = SkySpec::default().build().unwrap();
    let brdfs = [&*copies[0].brdf, &*copies[1].brdf];
    let spheres = render_spheres(&*truth, &brdfs, &*light, SPHERE, samples);
    let original = &spheres[0].images[0];
    let white = original.white();
    let mut drawing = Drawing::default();
    instrument(&mut drawing, &*truth);
    drawing.heading([497.0, 24.0], "2. It is read on a grid");
    drawing.heading([690.0, 24.0], "3. A copy is made");
    for ((copy, sphere), y) in copies.iter().zip(&spheres).zip([112.0, 302.0]) {
        poses(&mut drawing, [497.0, y], copy);
        drawing.sphere([690.0, y], &sphere.images[1], white);
        let n = copy.poses.poses.len();
        let uniform = format!("{n} readings, uniform in");
        drawing.middle([497.0, y + 86.0], 12.5, &uniform);
        drawing.middle([497.0, y + 102.0], 12.5, copy.name);
        drawing.middle([690.0, y + 86.0], 12.5, &format!("nrmse {:.3}", copy.nrmse));
    }
    drawing.heading([873.0, 118.0], "The material");
    drawing.sphere([873.0, 207.0], original, white);
    drawing.middle([873.0, 293.0], 12.5, "GGX, α = 0.05");
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"960\" height=\"414\" viewBox=\"0 0 960 414\" \
         font-family=\"sans-serif\" stroke-linejoin=\"round\" stroke-linecap=\"round\">\n\
         <rect width=\"960\" height=\"414\" fill=\"#ffffff\"/>\n{}</svg>\n",
        drawing.0
    )
}

levels! {
    the_overview_is_drawn_of_what_is_computed: "thorough: its spheres too";
}

/// The picture of today; GONIO_BLESS=1 writes it. In the quick level the colours of spheres are not looked at.
fn the_overview_is_drawn_of_what_is_computed(level: Level) {
    let path: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/docs/overview.svg");
    let now = overview(level.of(1, 256));
    if level == Level::Thorough && std::env::var_os("GONIO_BLESS").is_some() {
        std::fs::write(&path, &now).unwrap();
    }
    let then = std::fs::read_to_string(&path).unwrap();
    assert_eq!(then.lines().count(), now.lines().count());
    for (then, now) in then.lines().zip(now.lines()) {
        match (pixels(then), pixels(now)) {
            // Colours are rounded: on another machine one may fall to the other side.
            (Some(_), Some(_)) if level == Level::Quick => {}
            (Some(then), Some(now)) => {
                assert_eq!(then.len(), now.len());
                let far = |(a, b): (&u8, &u8)| a.abs_diff(*b) > 2;
                let far = then.iter().zip(&now).filter(|p| far(*p)).count();
                assert!(far < now.len() / 1000, "{far} pixels are others");
            }
            _ => assert_eq!(
                then, now,
                "GONIO_BLESS=1 cargo test --test cli overview -- --ignored draws it anew"
            ),
        }
    }
}

/// The colours of an embedded picture.
fn pixels(line: &str) -> Option<Vec<u8>> {
    let (_, data) = line.split_once("base64,")?;
    let (data, _) = data.split_once('"')?;
    let png = STANDARD.decode(data).unwrap();
    let (_, pixels) = crate::common::png::pixels(&png);
    Some(
        pixels
            .into_iter()
            .flat_map(|p| [p[0], p[1], p[2]])
            .collect(),
    )
}
