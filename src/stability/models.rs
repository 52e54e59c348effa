//! Models: every example, and roughness down to a micro-radian.

use super::cases::{self, Case, pairs};
use super::{Check, Extent, Family, Finding, Law, ROUNDING, Test, charts, values};
use crate::brdf::{self, Brdf, BrdfSpec, Channels, Presence, laws};
use crate::geometry::{Direction, DirectionPair};
use crate::registry;
use glam::{DMat3, DVec3};

pub(super) const FAMILY: Family = Family {
    name: "models",
    summary: "values against 50 digits; finite, ≥ 0, symmetric, alike one by one and in batches; no energy is made",
    checks,
};

const FINITE: Law = Law::strict("finite, not negative, 0 below the horizon");
const BATCHES: Law = Law::strict("a batch is its pairs, to the bit");
const VALUES: Law = Law::bounded("value of a pair", "relative", 16.0);
/// Both values are off by their roundings, and mirrors and turns round too.
const SYMMETRIES: Law = Law::bounded("declared symmetries", "relative", 32.0);
const ENERGY: Law = Law::bounded("albedo beyond 1 where none is declared", "albedo", 1.0);

/// Roughness from flat lobes to those of a micro-radian.
pub(super) const ALPHAS: [&str; 8] = ["10.0", "1.0", "0.1", "1e-2", "1e-3", "1e-4", "1e-5", "1e-6"];

/// Parameters at the ends of their ranges, as configs write them: lobes of a micro-radian, flat ones, and values that
/// only just are finite.
pub fn extremes() -> Vec<String> {
    let mut texts = Vec::new();
    for kind in ["ggx", "beckmann", "ward"] {
        let alphas = ALPHAS.into_iter().chain(["[1e-6, 10.0]"]);
        texts.extend(alphas.map(|alpha| format!("kind = \"{kind}\"\nalpha = {alpha}")));
    }
    for exponent in ["0.0", "1.0", "1e3", "1e6"] {
        texts.push(format!("kind = \"phong\"\nexponent = {exponent}"));
    }
    let others = [
        "kind = \"ggx\"\nalpha = 1e-5\nfresnel = { kind = \"dielectric\", ior = 1.0 }",
        "kind = \"ggx\"\nalpha = 1e-5\nfresnel = { kind = \"conductor\", eta = 1e-3, kappa = 1e3 }",
        "kind = \"oren-nayar\"\nsigma_deg = 0.0",
        "kind = \"oren-nayar\"\nsigma_deg = 90.0",
        "kind = \"sheen\"\nalpha = 0.001",
        "kind = \"retro-reflective\"\nof = { kind = \"ggx\", alpha = 1e-6 }",
        "kind = \"low-abc\"\na = 1e12\nb = 1e12\nc = 100.0\nior = 1000.0",
        "kind = \"low-abc\"\na = 1e12\nb = 0.0\nc = 0.0\nior = 1.0",
        "kind = \"low-abc-smooth\"\na = 1e12\nb = 1e12\nc = 0.0",
        "kind = \"shifted-gamma\"\nalpha = 1e-7\np = 10.0\nkap = 1e7\nrho_s = 1e3\nf0 = 1e3\nf1 = -1e3\nlambda = 0.0",
        "kind = \"shifted-gamma\"\nlambda = 0.0\nc = 1e38\nk = 1e5\ntheta0_rad = -10.0",
        "kind = \"shifted-gamma\"\nlambda = 1e9\nc = 0.0\nk = 1e5\ntheta0_rad = -10.0",
        "kind = \"shifted-gamma\"\nf0 = -1e3\nf1 = 1e3",
    ];
    texts.extend(others.map(String::from));
    texts
}

/// Every example that needs no file, and the extremes.
fn specs() -> Vec<Box<dyn BrdfSpec>> {
    let examples = cases::examples(brdf::all());
    let mut specs: Vec<_> = examples.map(|example| example.member).collect();
    specs.retain(|spec| spec.tables().files.is_empty());
    specs.extend(extremes().iter().filter_map(|text| cases::spec(text)));
    specs
}

/// A model and the keys it was built of.
struct Model {
    brdf: Box<dyn Brdf>,
    keys: registry::Keys,
}

fn checks(extent: Extent) -> Vec<Check> {
    let mut checks = Vec::new();
    for spec in specs() {
        let (name, keys) = (spec.label(), spec.resolved());
        let Ok(brdf) = spec.build(Channels::Luminance) else {
            // What is in the list is there to be built.
            checks.push(Check::new(name, FINITE, |watch| {
                watch.holds(false, &"it cannot be built");
            }));
            continue;
        };
        let mut tests: Vec<Test<Model>> = vec![
            (FINITE, finite),
            (BATCHES, batches),
            (SYMMETRIES, symmetries),
        ];
        let normal = DirectionPair::new(Direction::NORMAL, Direction::NORMAL);
        if values::exact(&keys, &charts::exactly(&normal), None).is_some() {
            tests.push((VALUES, against_exact));
        }
        if brdf.conserves_energy() && spec.tables().channel_bytes == 0 {
            tests.push((ENERGY, energy));
        }
        checks.extend(Check::each(name, Model { brdf, keys }, extent, &tests));
    }
    checks
}

fn finite(Model { brdf, .. }: &Model, extent: Extent, watch: &mut Finding) {
    let mut all: Vec<DirectionPair> = pairs().into_iter().map(|case| case.pair).collect();
    all.extend(laws::edge_pairs());
    for pair in extent.subset(all, 3) {
        let found = laws::positivity(&**brdf, &[pair]);
        watch.spent(1);
        let at = format!("{:?}", found.worst);
        watch.holds(found.holds(), &at);
    }
}

fn batches(Model { brdf, .. }: &Model, extent: Extent, watch: &mut Finding) {
    let cases = extent.subset(pairs(), 3);
    let all: Vec<DirectionPair> = cases.iter().map(|case| case.pair).collect();
    let mut values = vec![f64::NAN; all.len()];
    let mut presence = vec![Presence::Missing; all.len()];
    brdf.eval_batch(&all, &mut values, &mut presence);
    watch.spent(2 * all.len());
    for (k, case) in cases.iter().enumerate() {
        let mut one = [f64::NAN];
        let there = brdf.eval(&case.pair, &mut one);
        let same = there == presence[k] && one[0].to_bits() == values[k].to_bits();
        watch.holds(same, &case.name);
    }
}

/// The pairs that a component differs in by its last bit, one by one.
pub(super) fn neighbours(pair: &DirectionPair) -> impl Iterator<Item = DirectionPair> {
    let [i, o] = pair.vectors();
    (0..6).flat_map(move |d| {
        [1.0 + f64::EPSILON, 1.0 - f64::EPSILON].map(|by| {
            let mut both = [i, o];
            both[d / 3][d % 3] *= by;
            DirectionPair::from_unit(both)
        })
    })
}

fn symmetries(Model { brdf, .. }: &Model, extent: Extent, watch: &mut Finding) {
    let symmetry = brdf.symmetry();
    for Case { name, pair } in extent.subset(pairs(), 3) {
        let Some(f) = brdf.luminance(&pair) else {
            continue;
        };
        let mut images = Vec::new();
        if symmetry.reciprocal {
            images.push(pair.swapped());
        }
        if symmetry.bilateral {
            images.push(pair.map(|v| v * DVec3::new(1.0, -1.0, 1.0)));
        }
        if symmetry.isotropic {
            let turn = DMat3::from_rotation_z(0.7);
            images.push(pair.map(|v| turn * v));
        }
        // What a mirror or a turn rounds differs by the place.
        let moved = |pair: &DirectionPair, f: f64| -> f64 {
            let near = neighbours(pair).filter_map(|p| brdf.luminance(&p));
            near.map(|g| (g - f).abs()).sum()
        };
        let here = moved(&pair, f);
        watch.spent(13 + 13 * images.len());
        for image in images {
            let g = brdf.luminance(&image).unwrap_or(f64::NAN);
            let size = f.max(g).max(f64::MIN_POSITIVE);
            let conditioning = (here + moved(&image, g)) / size + ROUNDING;
            watch.see((f - g).abs() / size, conditioning, &name);
        }
    }
}

fn against_exact(Model { brdf, keys }: &Model, extent: Extent, watch: &mut Finding) {
    for Case { name, pair } in extent.subset(pairs(), 7) {
        let got = brdf.luminance(&pair).unwrap_or(f64::NAN);
        watch.spent(1);
        let with = |pair: &charts::Pair, nudge| {
            values::exact(keys, pair, nudge).map_or(f64::NAN, |f| f.to_f64())
        };
        let at = charts::exactly(&pair);
        let want = with(&at, None);
        // Guarded denominators hold a value finite that is none.
        if !(want < 1e90) {
            continue;
        }
        let nudged = (0..6).filter_map(|d| charts::nudged(&pair, d));
        let of_pair = nudged.map(|p| with(&p, None));
        let of_half = (0..3).map(|d| with(&at, Some(d)));
        let moved: f64 = of_pair.chain(of_half).map(|f| (f - want).abs()).sum();
        // Of exponentials that underflow a few digits are left.
        let size = want.max(1e-280);
        watch.see((got - want).abs() / size, moved / size + ROUNDING, &name);
    }
}

fn energy(Model { brdf, .. }: &Model, extent: Extent, watch: &mut Finding) {
    let elevations = [0.0, 1e-6, 0.5, 1.0, 1.4, 1.55, 1.57];
    for theta in extent.subset(elevations.to_vec(), 3) {
        let albedo = laws::directional_albedo(&**brdf, Direction::from_spherical(theta, 0.3));
        let beyond = (albedo.max() - 1.0).max(0.0);
        let conditioning = albedo.error + 8.0 * ROUNDING;
        watch.see(beyond, conditioning, &format_args!("{theta} rad"));
    }
}
