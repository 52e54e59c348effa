//! Poses that are chosen for a moment of slices.

use super::*;
use gonio::acquisition::MomentAim;
use gonio::moments::{Channel, MomentErrors, PeakResolving, Profile, Split};
use gonio::schedule::SampleSet;

/// Poses chosen for a moment without a stop, or until its error is below the level.
fn planner(aim: &str) -> Greedy {
    aimed(Rule::Adaptive, |to| to.moment = Some(aim.parse().unwrap()))
}

/// The errors of the moments of what kriging makes of readings.
fn errors(truth: &dyn Brdf, measured: &Measurement) -> [MomentErrors; 4] {
    let mut spec = common::views(10, 81.0);
    spec.split = Split::Minimum;
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

/// At as many readings poses for a covariance leave less of its error than those for the BRDF, and those are better for the BRDF.
pub(super) fn poses_for_a_moment_serve_it(level: Level) {
    let aims = ["covariance=0", "covariance_70_85=0"];
    for alpha in level.of(vec![0.1], vec![0.05, 0.1, 0.3]) {
        let truth = over_matte(alpha);
        let task = task(level.of(20, 41));
        let for_brdf = acquire(&greedy(Rule::Adaptive), &task, &*truth).unwrap();
        for aim in aims.into_iter().take(level.of(1, 2)) {
            let for_moment = acquire(&planner(aim), &task, &*truth).unwrap();
            let [of_moment, of_brdf] = [&for_moment, &for_brdf].map(|m| error(aim, &*truth, m));
            assert!(
                of_moment < 0.5 * of_brdf,
                "{alpha} {aim}: {of_moment} {of_brdf}"
            );
            let of = |m: &Measurement| error_of(&*kriging(m), &*truth);
            let [of_moment, of_brdf] = [&for_moment, &for_brdf].map(of);
            assert!(of_brdf < of_moment, "{alpha}: {of_brdf} {of_moment}");
        }
    }
}

/// Readings end once a moment is known, and for 85 % of materials the level is then held; at level 0 they go on.
pub(super) fn known_moments_end_the_readings(level: Level) {
    let kinds = level.of(vec!["ggx"], vec!["ggx", "beckmann"]);
    let alphas = level.of(vec![0.15], vec![0.05, 0.1, 0.2, 0.4, 0.7]);
    let lobes = common::product(kinds, alphas).into_iter();
    let lobes = lobes.map(|(kind, alpha)| model(kind, &format!("alpha = {alpha}")));
    let mut truths: Vec<Box<dyn Brdf>> = lobes.collect();
    let mixed = level.of(vec![], vec![0.05, 0.1, 0.2, 0.4]);
    truths.extend(mixed.into_iter().map(over_matte));
    for aim in level.of(vec!["covariance=20%"], vec!["covariance=20%", "energy=5%"]) {
        let most = level.of(62, 140);
        let (mut ended, mut held) = (0, 0);
        for truth in &truths {
            let measured = acquire(&planner(aim), &task(most), &**truth).unwrap();
            if measured.readings() < most {
                let parsed: MomentAim = aim.parse().unwrap();
                ended += 1;
                held += usize::from(error(aim, &**truth, &measured) <= parsed.level);
            }
        }
        let is_held = ended > 0 && held as f64 >= 0.85 * ended as f64;
        assert!(is_held, "{aim}: {held} of {ended}");
    }
    let endless = acquire(&planner("covariance=0"), &task(12), &*truths[0]).unwrap();
    assert_eq!(endless.readings(), 12);
}

#[test]
fn an_aim_is_read_back_and_mistakes_are_named() {
    for [text, read] in common::table(
        "
        variance=5%            | covariance=0.05
        covariance_40_70 = 0.1 | covariance_40_70=0.1
        mean_deg=2°            | mean_deg=2
        energy                 | energy=0.01
        kurtosis_70_85         | kurtosis_70_85=0.2",
    ) {
        let aim: MomentAim = text.parse().unwrap();
        assert_eq!(aim.to_string(), read);
        assert_eq!(read.parse::<MomentAim>().unwrap(), aim);
    }
    for [text, says] in common::table(
        r#"
        width=5%      | for = "width=5%": allowed is variance, energy, mean_deg, mean, covariance, … kurtosis_70_85
        variance=five | allowed is variance=LEVEL, a number from 0 to 1, as 0.05 or 5%
        variance=5    | a number from 0 to 1
        energy=-1     | allowed is energy=LEVEL
        energy=5deg   | allowed is energy=LEVEL
        energy=nan    | allowed is energy=LEVEL
        mean_deg=1%   | allowed is mean_deg=LEVEL, a number from 0 to 90
        mean          | allowed is mean=LEVEL: it has no level of its own"#,
    ) {
        common::says(&text.parse::<MomentAim>().unwrap_err().to_string(), says);
    }
    assert_eq!("energy=57%".parse::<MomentAim>().unwrap().level, 0.57);
    let moment = "variance=5%".parse().unwrap();
    let a_priori = aimed(Rule::AOptimal, |aim| aim.moment = Some(moment));
    let refused = a_priori.check(&[]).unwrap_err().to_string();
    common::says(
        &refused,
        "for = \"covariance=0.05\": allowed is covariance=0:",
    );
}

/// By `uncertainty` a moment ends the readings and chooses none; a matte material has no moment, and poses are those for its BRDF.
#[test]
fn a_moment_is_no_reason_for_other_poses_where_there_is_none() {
    let of = |rule: Rule, moment: Option<&str>| {
        let moment = moment.map(|text| text.parse().unwrap());
        aimed(rule, |aim| aim.moment = moment)
    };
    let poses = |planner: &Greedy, truth: &dyn Brdf| {
        bits(&acquire(planner, &task(16), truth).unwrap().schedule)
    };
    let lobe = lobe(0.2);
    let [plain, with] = [None, Some("energy=0")].map(|aim| of(Rule::Uncertainty, aim));
    assert_eq!(poses(&plain, &lobe), poses(&with, &lobe));
    let matte = model("lambert", "albedo = 0.4");
    let planner = of(Rule::Adaptive, Some("energy=50%"));
    let measured = acquire(&planner, &task(20), &*matte).unwrap();
    let forecast = planner.forecast(&task(20), &measured, &[]).unwrap();
    assert_eq!((forecast.moment, measured.readings()), (None, 20));
}
