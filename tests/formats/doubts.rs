//! Readings that are taken, and doubted in a warning.

use super::common::{form, model, near, planned, product, says, table};
use super::{ALTA, ANGLES, bare, measurements, read, try_read};
use gonio::brdf::{self, Brdf, BrdfSpec, Channels};
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::instrument::{Ideal, Instrument};
use gonio::measurement::{About, retro_peak};
use gonio::parametrization::Parametrization;
use gonio::registry::{self, Entry};
use gonio::schedule::{Azimuth, Conventions, Quantity, UncertaintyUnit};
use gonio::schedule::{Schedule, ScheduleFormat, Sequence};
use std::f64::consts::PI;
use std::sync::Arc;

/// Sheets of constant incidence.
fn sheets(form: &Arc<dyn Parametrization>, elevations: &[f64], step: usize) -> Arc<Schedule> {
    let sensors = product((2..90).step_by(step), (0..360).step_by(2 * step));
    let pair = |(theta_i, (theta_o, phi)): (f64, (i32, i32))| {
        let [a, b, c] = [theta_i, theta_o.into(), phi.into()].map(f64::to_radians);
        DirectionPair::from_spherical(a, 0.0, b, c)
    };
    let pairs = product(elevations.iter().copied(), sensors).into_iter();
    Arc::new(Schedule::of_pairs(Arc::clone(form), pairs.map(pair)))
}

#[test]
fn only_a_single_peak_at_the_light_is_doubted() {
    let [form, halves] = ["spherical", "half-difference"].map(|name| form(name, Symmetry::NONE));
    let layouts = [
        sheets(&form, &[15.0, 30.0, 60.0], 4),
        sheets(&form, &[0.0, 20.0, 40.0, 60.0, 80.0], 10),
        planned(&form, "sobol", 20_000, 1),
        planned(&halves, "grid", 2000, 1),
    ];
    let of_entry = |entry: Entry<dyn BrdfSpec>| entry.examples.iter().map(move |e| (entry, e));
    let examples: Vec<_> = brdf::all().into_iter().flat_map(of_entry).collect();
    let mut doubted = 0;
    for layout in &layouts {
        let peak = |brdf: &dyn Brdf| retro_peak(&Ideal.measure(brdf, layout));
        for (entry, example) in &examples {
            let spec = registry::read_text(entry, example).unwrap();
            // Tables of files are not there.
            let Ok(brdf) = spec.build(Channels::Luminance) else {
                continue;
            };
            let (found, kind) = (peak(&*brdf), entry.kind);
            let may_be = found.is_none() || kind == "retro-reflective";
            assert!(may_be, "{kind} {example}: {found:?}");
            doubted += usize::from(found.is_some());
        }
        // A lobe turned to the light is seen; a rough one has no peak that is so near.
        for [keys, ratio] in table(
            r#"kind = "ggx", alpha = 0.1 | 3
            kind = "ggx", alpha = 0.3 | 3
            kind = "phong" | 3
            kind = "ggx", alpha = 0.6, fresnel = { kind = "none" } | 1.5"#,
        ) {
            let found = peak(&*model("retro-reflective", &format!("of = {{ {keys} }}")));
            let ratio: f64 = ratio.parse().unwrap();
            let is_seen = found.as_ref().is_some_and(|f| f.retro >= ratio * f.mirror);
            assert!(is_seen, "{keys}: {found:?}");
        }
        // Both peaks, of any weights; a matte one with a lobe at the light.
        for (mirror, back) in [(1.0, 1.0), (0.1, 0.9), (0.5, 0.5)] {
            let both = format!(
                "component = [{{ weight = {back}, brdf = {{ kind = \"retro-reflective\", \
                 of = {{ kind = \"ggx\", alpha = 0.2 }} }} }}, \
                 {{ weight = {mirror}, brdf = {{ kind = \"ggx\", alpha = 0.1 }} }}]"
            );
            let found = peak(&*model("sum", &both));
            assert!(found.is_none(), "{mirror} {back}: {found:?}");
        }
    }
    assert!(doubted >= layouts.len(), "{doubted}");
    // A file whose azimuths were turned is doubted; one with an option is not, nor ours.
    let retro = model("retro-reflective", "of = { kind = \"ggx\", alpha = 0.2 }");
    let m = Ideal.measure(&*retro, &layouts[0]);
    let (about, order) = (About::default(), Sequence::Generated);
    let ours = measurements::text(&m, &about, order, ScheduleFormat::Csv);
    let bare = bare(&ours);
    assert!(read(&ours, "").warnings.is_empty());
    let warnings = read(&bare, "").warnings;
    assert_eq!(warnings.len(), 1);
    let peak = format!("{:.3e} 1/sr", retro_peak(&m).unwrap().retro);
    for part in [&peak, "--azimuth mirror", "if "] {
        says(&warnings[0], part);
    }
    for azimuth in Azimuth::ALL {
        let back = read(&bare, &format!("azimuth={}", azimuth.name));
        assert!(back.warnings.is_empty());
        // Turned, the peak is at the mirror direction.
        let turned = matches!(azimuth.name, "mirror" | "propagation");
        assert_eq!(retro_peak(&back.measurement).is_none(), turned);
    }
}

#[test]
fn what_can_hardly_be_meant_is_doubted() {
    for [text, warning] in table(
        r"
        FOUR,value\nGOOD |
        FOUR,value\nGOOD10,0,40,180,-1 | the value of line 5 is below 0 and counts as 0
        FOUR,value\nGOOD10,0,40,180,-1\n10,0,50,180,-1\n10,0,60,180,-1e-9 | 3 rows have values below 0, which count as 0, the first in line 5; -1 in 2 of them may stand for no data, whose cells should be empty
        #DIM 2 1\n#PARAM_IN RUSIN_TH_TD\n#PARAM_OUT INV_STERADIAN\n0.1 0.2 .5\n0.2 0.2 -1\n0.3 0.2 -1 | the first in line 5; -1 in 2 of them
        FOUR,value\n0.1,0,1.2,3.14,1\n0.1,0,1.5,3.14,1 | no polar angle is above 1.50°, as if radians
        RADIANS,value\n0.1,0,1.2,3.14,1\n0.1,0,1.5,3.14,1 |
        FOUR,value\n0.1,0,1.2,3.14,1\n0.1,0,1.5,3.14,1\n10,0,20,180,1 |
        ALTA0.5 0 0.3 3.1 1\n0.5 0 0.4 3.1 1 |
        ALTA30 0 20 180 1\n1 0 1 180 1 | as if degrees were read as radians",
    ) {
        let text = text.replace("GOOD", "10,0,20,180,1\n10,0,30,180,0\n10,0,35,180,-0.0\n");
        let text = text.replace("ALTA", &format!("{ALTA}#PARAM_OUT INV_STERADIAN\n"));
        let text = text.replace("RADIANS", &ANGLES.replace("_deg", "_rad"));
        let warnings = read(&(text.replace("FOUR", ANGLES) + "\n"), "").warnings;
        assert_eq!(warnings.is_empty(), warning.is_empty(), "{warnings:?}");
        says(&warnings.join("\n"), warning);
    }
}

#[test]
fn elevations_and_percents_that_nothing_names_are_doubted() {
    let file = |is_elevation: bool, uncertainty: f64| {
        let polar = |theta: i32| if is_elevation { 90 - theta } else { theta };
        let mut text = format!("{ANGLES},value,uncertainty\n");
        for (light, sensor) in product([0, 20, 40], (0..80).step_by(10)) {
            let (i, o) = (polar(light), polar(sensor));
            text += &format!("{i},0,{o},180,0.3,{uncertainty}\n");
        }
        text
    };
    let percent = file(false, 2.0);
    for (text, words, warning) in [
        (&file(false, 0.006), "", None),
        (&file(true, 0.006), "", Some("--elevation")),
        (&file(true, 0.006), "elevation", None),
        (&percent, "", Some("--uncertainties percent")),
    ] {
        let warnings = read(text, words).warnings;
        let count = usize::from(warning.is_some());
        assert_eq!(warnings.len(), count, "{warnings:?}");
        says(&warnings.concat(), warning.unwrap_or_default());
    }
    // Two percent of .3 are .006 1/sr, whatever the unit of the values.
    use UncertaintyUnit::{Percent, Relative, Value};
    for (uncertainty, unit, quantity, want) in [
        (0.006, Value, Quantity::Brdf, 0.006),
        (2.0, Percent, Quantity::Brdf, 0.006),
        (0.02, Relative, Quantity::Brdf, 0.006),
        (2.0, Percent, Quantity::ReflectanceFactor, 0.006 / PI),
    ] {
        let conventions = Conventions {
            uncertainties: Some(unit),
            quantity: Some(quantity),
            ..Conventions::default()
        };
        let back = try_read(&file(false, uncertainty), conventions).unwrap();
        assert!(back.warnings.is_empty(), "{:?}", back.warnings);
        let u = back.measurement.details.unwrap().type_b[0];
        near(u / want, 1.0, 1e-12, (unit, quantity));
    }
}
