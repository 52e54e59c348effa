use crate::common::{made, says, views};
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
    let spec = views(4, MomentsSpec::default().max_view_deg);
    let channels = [Channel::Average, Channel::Green];
    let profile = |c| Profile::new(brdf, c, &spec, estimator, 1).unwrap();
    MaterialProfiles {
        key: String::new(),
        material: "S".into(),
        material_key: String::new(),
        group: "test".into(),
        profiles: channels.map(profile).into(),
        further: Vec::new(),
        seconds: vec![0.0; 2],
        clamping: None,
    }
}

/// The number of bands of a sheet.
fn bands(sheet: &Sheet) -> usize {
    let series = sheet.panels.iter().flat_map(|p| &p.series);
    series.filter(|s| s.mark == Mark::Area).count()
}

#[test]
fn what_vanishes_by_symmetry_is_named_and_has_no_diagram() {
    let said = "\n0 by symmetry: mean 01, covariance 11, skewness 21, skewness 03, excess kurtosis 31, excess kurtosis 13";
    let exact = profiles(&tilted(0.0), &PeakResolving::default());
    let folded = material_sheet(&exact, true);
    assert_eq!(folded.panels.len(), EVEN);
    assert!(folded.title.contains(said), "{}", folded.title);
    // Random estimates of what is 0 are noise, whatever its size.
    let random = profiles(&tilted(0.0), &MonteCarlo { samples: 64 });
    let noisy = material_sheet(&random, true);
    assert!(noisy.title.contains(said), "{}", noisy.title);
    // What is no mirror image of itself is drawn, whatever is declared.
    let tilted = profiles(&tilted(0.3), &PeakResolving::default());
    let tilted = material_sheet(&tilted, true);
    assert_eq!(tilted.panels.len(), EVEN + ODD);
    assert!(!tilted.title.contains("0 by symmetry"));
}

#[test]
fn uncertainties_are_bands_where_they_are_seen() {
    let exact = profiles(&tilted(0.0), &PeakResolving::default());
    let sheet = material_sheet(&exact, true);
    assert!(bands(&sheet) == 0 && sheet.title.contains("within the lines"));
    let random = profiles(&tilted(0.0), &MonteCarlo { samples: 2048 });
    let sheet = material_sheet(&random, true);
    assert!(bands(&sheet) >= sheet.panels.len());
    says(&sheet.title, "bands: uncertainty");
    // Channels have colours of their own, the same in all diagrams.
    for panel in &sheet.panels {
        let lines = panel.series.iter().filter(|s| s.mark != Mark::Area);
        let colors: Vec<_> = lines.map(|s| (s.name.as_str(), s.color)).collect();
        assert_eq!(colors, [("average", 6), ("green", 2)]);
    }
}
