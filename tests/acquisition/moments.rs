//! Poses that are chosen for a moment of slices.

use super::*;
use gonio::acquisition::MomentAim;
use gonio::moments::{Channel, MomentErrors, MomentsSpec, PeakResolving, Profile, Split};

/// Poses chosen for a moment without a stop, or until its error is below the level.
fn planner(aim: &str) -> Greedy {
    let aim: MomentAim = aim.parse().unwrap();
    let of_moment = Aim {
        moment: Some(aim),
        ..Aim::default()
    };
    Greedy::new(Rule::Adaptive, of_moment)
}

/// The errors of the moments of what kriging makes of readings.
fn errors(truth: &dyn Brdf, measured: &Measurement) -> [MomentErrors; 4] {
    let spec = MomentsSpec {
        views: 10,
        max_view_deg: 81.0,
        split: Split::Minimum,
        ..MomentsSpec::default()
    };
    let estimator = PeakResolving::default();
    let of = Profile::new(truth, Channel::Luminance, &spec, &estimator, 1).unwrap();
    let copy = kriging(measured);
    let copy = Profile::against(&of, &*copy, &spec, &estimator, 1).unwrap();
    MomentErrors::between(&of, &copy)
}

/// A moment's error over all views.
fn error(aim: &str, truth: &dyn Brdf, measured: &Measurement) -> f64 {
    let [band, of] = aim.parse::<MomentAim>().unwrap().position();
    let found = errors(truth, measured);
    MomentErrors::QUANTITIES[band][of].1(&found[band]).unwrap()
}

/// At as many readings poses for a moment leave less of its error than those for the BRDF, and those are better for the BRDF.
pub(super) fn poses_for_a_moment_serve_it(level: Level) {
    let aims = ["covariance=0", "energy=0", "skewness=0", "energy_70_85=0"];
    for alpha in level.of(vec![0.1], vec![0.05, 0.1, 0.3]) {
        let truth = over_matte(alpha);
        let task = task(level.of(32, 64));
        let for_brdf = acquire(&greedy(Rule::Adaptive), &task, &*truth).unwrap();
        for aim in aims.into_iter().take(level.of(1, 4)) {
            let for_moment = acquire(&planner(aim), &task, &*truth).unwrap();
            let [of_moment, of_brdf] = [&for_moment, &for_brdf].map(|m| error(aim, &*truth, m));
            assert!(
                of_moment < 0.5 * of_brdf,
                "{alpha} {aim}: {of_moment} {of_brdf}"
            );
            let [of_moment, of_brdf] =
                [&for_moment, &for_brdf].map(|m| error_of(&*kriging(m), &*truth));
            assert!(of_brdf < of_moment, "{alpha} {aim}: {of_brdf} {of_moment}");
        }
    }
}

/// Readings end once a moment is known, and for 85 % of materials the level is then held; at level 0 they go on.
pub(super) fn known_moments_end_the_readings(level: Level) {
    let lobes = ["ggx", "beckmann"].map(|kind| {
        let of = move |alpha: f64| model(kind, &format!("alpha = {alpha}"));
        level
            .of(vec![0.15], vec![0.05, 0.1, 0.2, 0.4, 0.7])
            .into_iter()
            .map(of)
    });
    let mut truths: Vec<Box<dyn Brdf>> = lobes.into_iter().flatten().collect();
    truths.extend(
        level
            .of(vec![], vec![0.05, 0.1, 0.2, 0.4])
            .into_iter()
            .map(over_matte),
    );
    for aim in ["covariance=10%", "energy=5%", "kurtosis=0.3"]
        .into_iter()
        .take(level.of(1, 3))
    {
        let most = level.of(93, 250);
        let (mut ended, mut held) = (0, 0);
        for truth in &truths {
            let measured = acquire(&planner(aim), &task(most), &**truth).unwrap();
            if measured.readings() < most {
                let parsed: MomentAim = aim.parse().unwrap();
                ended += 1;
                held += usize::from(error(aim, &**truth, &measured) <= parsed.level);
            }
        }
        assert!(
            ended > 0 && held as f64 >= 0.85 * ended as f64,
            "{aim}: {held} of {ended}"
        );
    }
    let endless = acquire(&planner("covariance=0"), &task(40), &*truths[0]).unwrap();
    assert_eq!(endless.readings(), 40);
}

#[test]
fn an_aim_is_read_back_and_mistakes_are_named() {
    for (text, read) in [
        ("variance=5%", "covariance=0.05"),
        ("covariance_40_70 = 0.1", "covariance_40_70=0.1"),
        ("mean_deg=2°", "mean_deg=2"),
        ("energy", "energy=0.01"),
        ("kurtosis_70_85", "kurtosis_70_85=0.2"),
    ] {
        let aim: MomentAim = text.parse().unwrap();
        assert_eq!(aim.to_string(), read);
        assert_eq!(read.parse::<MomentAim>().unwrap(), aim);
    }
    for (text, says) in [
        (
            "width=5%",
            "for = \"width=5%\": allowed is energy, mean_deg, mean, covariance, … kurtosis_70_85",
        ),
        (
            "variance=five",
            "for = \"variance=five\": allowed is variance=LEVEL with a level in [0, 180], as 0.05 or 5%",
        ),
        ("energy=-1", "allowed is energy=LEVEL … [0, 180]"),
        ("energy=nan", "allowed is energy=LEVEL"),
        ("mean", "allowed is mean=LEVEL: it has no level of its own"),
    ] {
        common::says(&text.parse::<MomentAim>().unwrap_err().to_string(), says);
    }
}
