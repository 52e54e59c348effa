use crate::common::made;
use gonio::brdf::Brdf;
use gonio::experiment::moments::MaterialProfiles;
use gonio::geometry::Symmetry;
use gonio::moments::{Channel, Estimator, MomentsSpec, MonteCarlo, PeakResolving, Profile};
use gonio::report::{Mark, Sheet, material_sheet};

/// Components that vanish by mirror symmetry, and those that do not.
const ODD: usize = 6;
const EVEN: usize = 9;

/// Grows with y of the light by the factor.
fn tilted(factor: f64) -> impl Brdf {
    made(Symmetry::NONE, move |pair| {
        let v = pair.omega_i.vector();
        Some([1.0 + factor * v.y + 0.3 * v.x; 3])
    })
}

/// Profiles in grey and in green.
fn profiles(brdf: &dyn Brdf, estimator: &dyn Estimator) -> MaterialProfiles {
    let spec = MomentsSpec {
        views: 4,
        ..MomentsSpec::default()
    };
    let channels = [Channel::Average, Channel::Green];
    let profile = |c| Profile::new(brdf, c, &spec, estimator, 1).unwrap();
    MaterialProfiles {
        key: String::new(),
        material: "S".into(),
        material_key: String::new(),
        group: "test".into(),
        profiles: channels.map(profile).into(),
        seconds: vec![0.0; 2],
        clamping: None,
    }
}

/// Diagrams that say that they are 0, bands, and the title.
fn said(sheet: &Sheet) -> (usize, usize, &str) {
    let zeros = sheet
        .panels
        .iter()
        .filter(|p| p.title.starts_with("0 by symmetry"));
    let series = sheet.panels.iter().flat_map(|p| &p.series);
    let bands = series.filter(|s| s.mark == Mark::Area).count();
    (zeros.count(), bands, &sheet.title)
}

#[test]
fn what_vanishes_by_symmetry_says_so() {
    let exact = profiles(&tilted(0.0), &PeakResolving::default());
    let [folded, plain] = [true, false].map(|bilateral| material_sheet(&exact, bilateral));
    assert_eq!(said(&folded).0, ODD);
    assert_eq!(said(&plain).0, 0);
    // What is no mirror image of itself is drawn, whatever is declared.
    let tilted = profiles(&tilted(0.3), &PeakResolving::default());
    assert_eq!(said(&material_sheet(&tilted, true)).0, 0);
}

#[test]
fn uncertainties_are_bands_where_they_are_seen() {
    let exact = profiles(&tilted(0.0), &PeakResolving::default());
    let sheet = material_sheet(&exact, true);
    let (_, bands, title) = said(&sheet);
    assert!(bands == 0 && title.contains("within the lines"));
    let random = profiles(&tilted(0.0), &MonteCarlo { samples: 2048 });
    let sheet = material_sheet(&random, true);
    let (_, bands, title) = said(&sheet);
    assert!(
        bands >= EVEN && title.contains("bands: uncertainty"),
        "{bands} {title}"
    );
    // Channels have colours of their own, the same in all diagrams.
    for panel in &sheet.panels[..EVEN] {
        let lines = panel.series.iter().filter(|s| s.mark != Mark::Area);
        let colors: Vec<_> = lines.map(|s| (s.name.as_str(), s.color)).collect();
        assert_eq!(colors, [("average", 6), ("green", 2)]);
    }
}
