//! What `gonio check` says of an instrument.

use crate::cli::list::{apertures, limits};
use crate::cli::listed;
use crate::error::Error;
use crate::geometry::DirectionPair;
use crate::instrument::{InstrumentSpec, Machine, Tag, footprint};
use crate::report::Columns;
use crate::sampling::{Random, cosine_hemisphere};
use crate::schedule::Unreachable;
use serde_json::{Map, Value as Json, json};
use std::f64::consts::PI;

/// Pairs that the reachable share is counted on: it is then good to half a percent.
const PAIRS: u64 = 10_000;

/// Elevations of light and sensor, degrees, at which the spots on the sample are stated.
const SPOTS_DEG: [[f64; 2]; 4] = [[0.0, 0.0], [60.0, 0.0], [0.0, 60.0], [60.0, 60.0]];

/// Provenances of numbers.
const PROVENANCES: [(&str, Option<Tag>); 4] = [
    ("published", Some(Tag::Published)),
    ("recalled", Some(Tag::Recalled)),
    ("generic", Some(Tag::Generic)),
    ("without_provenance", None),
];

/// What is known of an instrument without a config, for people and for programs.
pub(super) fn described(spec: &InstrumentSpec, seed: u64) -> Result<(String, Json), Error> {
    let machine = Machine::new(spec).map_err(Error::internal)?;
    let class = machine.class();
    let (name, about, of, meaning) = (&spec.name, &spec.about, &spec.class, class.summary);
    let mut out = format!("{name}: {about}\nclass: {of}, {meaning}\n\naxes\n");
    let mut axes =
        Columns::new("  name\ton\t>range °\t>°/s\t>°/s²\t>resolution\t>repeatability\t>bias\t");
    for axis in &spec.axis {
        axes.row(&format!(
            "  {}\t{}\t{} to {}\t{}\t{}\t{}\t{}\t{}\t{}",
            axis.name,
            axis.parent,
            axis.min_deg,
            axis.max_deg,
            axis.speed_deg_per_s,
            axis.acceleration_deg_per_s2,
            axis.resolution_deg,
            axis.repeatability_deg,
            axis.bias_deg,
            match (axis.wraps, axis.imaged) {
                (true, _) => "wraps",
                (_, true) => "imaged",
                _ => "",
            },
        ));
    }
    out += &axes.to_string();
    let detector = &spec.detector;
    out += &format!(
        "\n{}\n{}\nexposures: {} from {} s to {} s, {} bits\n",
        apertures(spec),
        limits(spec),
        detector.exposures,
        detector.exposure_min_s,
        detector.exposure_max_s,
        detector.bits,
    );
    if let Some(picture) = &spec.picture {
        let distance = |of: &str, radii: f64| match radii > 0.0 {
            true => format!("{of} at {radii} radii"),
            false => format!("{of} far away"),
        };
        out += &format!(
            "pictures: radius {} px, {}, {}; readings of up to {} px; errors: centre {} px, map {} px, light {}°, scale {} %\n",
            picture.radius_px,
            distance("camera", picture.camera_radii),
            distance("lamp", picture.lamp_radii),
            picture.patch_px,
            picture.centre_px,
            picture.map_px,
            picture.lamp_deg,
            100.0 * picture.scale,
        );
    }
    out += "\nspots on the sample, long axes\n";
    let mut spots = Vec::new();
    for [theta_i, theta_o] in SPOTS_DEG {
        let [i, o] = [theta_i, theta_o].map(f64::to_radians);
        let spot = footprint(spec, &DirectionPair::from_spherical(i, 0.0, o, PI));
        let (lit, seen, filling) = (spot.lit_mm, spot.seen_mm, spot.filling.name());
        out += &format!(
            "  theta_i {theta_i:>2}°, theta_o {theta_o:>2}°  lit {lit:>5.1} mm, seen {seen:>5.1} mm: {filling}\n"
        );
        spots.push(json!({
            "theta_i_deg": theta_i,
            "theta_o_deg": theta_o,
            "lit_mm": lit,
            "seen_mm": seen,
            "filling": filling,
        }));
    }
    out += &format!("\nof {PAIRS} cosine-distributed pairs\n");
    let mut reach = Vec::new();
    let all = [("isotropic", true), ("anisotropic", false)];
    for (material, turn_freely) in all.into_iter().take(2 - usize::from(class.isotropic_only)) {
        let (percent, kept_out) = reached(&machine, seed, turn_freely);
        out += &format!("  {material:<12} reachable {percent:.2} %");
        for (name, percent) in &kept_out {
            out += &format!(", {name} {percent:.2} %");
        }
        out += "\n";
        reach.push(json!({"material": material, "percent": percent, "kept_out_percent": kept_out}));
    }
    let tags = spec.origins().into_iter();
    let tags: Vec<Option<Tag>> = tags.map(|(_, entry)| Some(entry?.tag)).collect();
    let numbers = PROVENANCES.map(|(name, tag)| (name, tags.iter().filter(|&&t| t == tag).count()));
    let texts = numbers.map(|(name, n)| format!("{n} {}", name.replace('_', " ")));
    out += &format!("\nnumbers: {}\n", listed(texts));
    let numbers = numbers.map(|(name, n)| (name.to_owned(), n.into()));
    let object = json!({
        "instrument": serde_json::to_value(spec).map_err(Error::internal)?,
        "class_summary": class.summary,
        "spots": spots,
        "reach": reach,
        "numbers": Map::from_iter(numbers),
    });
    Ok((out, object))
}

/// The share of pairs that a machine reaches, and the share that each reason keeps out, percent.
fn reached(machine: &Machine, seed: u64, turn_freely: bool) -> (f64, Vec<(&'static str, f64)>) {
    let random = Random::new(seed);
    let mut reached = 0;
    let mut kept_out = Unreachable::NAMES.map(|name| (name, 0));
    for i in 0..PAIRS {
        let [a, b, c, d] = random.point(i);
        let pair = DirectionPair::new(cosine_hemisphere([a, b]), cosine_hemisphere([c, d]));
        match machine.place(&pair, turn_freely) {
            Ok(_) => reached += 1,
            Err(reason) => {
                let kept_out = kept_out.iter_mut().find(|(name, _)| *name == reason.name());
                kept_out.into_iter().for_each(|(_, n)| *n += 1);
            }
        }
    }
    let percent = |count: u64| 100.0 * count as f64 / PAIRS as f64;
    let kept_out = kept_out.map(|(name, n)| (name, percent(n)));
    (percent(reached), kept_out.into())
}
