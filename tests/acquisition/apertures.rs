//! Readings that are means over apertures: the BRDF is what is asked for, and not its mean.

use super::common::{Level, levels};
use super::{error_of, greedy, kriging, over_matte, task};
use gonio::acquisition::{Rule, acquire};
use gonio::instrument::{Optics, Tolerance, Workspace};

levels! {
    known_apertures_are_divided_out: "thorough: more lobes and readings";
}

/// The means are those of the instrument's adaptive quadrature; a kriging that is given the apertures errs less than half as much as
/// one that takes means for values.
fn known_apertures_are_divided_out(level: Level) {
    let half_angles_deg = [0.25, 0.5];
    let [source, sensor] = half_angles_deg.map(f64::to_radians);
    let optics = Optics::new(source, sensor, Tolerance::default());
    for alpha in level.of(vec![0.03], vec![0.02, 0.03, 0.05]) {
        let truth = over_matte(alpha);
        let readings = task(level.of(96, 256));
        let mut means = acquire(&greedy(Rule::Adaptive), &readings, &*truth).unwrap();
        let mut work = Workspace::default();
        for (value, pose) in means.values.iter_mut().zip(&means.schedule.poses) {
            let mean = optics.average(&*truth, &pose.pair, &mut work);
            *value = mean.unwrap().value[0];
        }
        let error = |half_angles_deg| {
            let mut m = means.clone();
            m.half_angles_deg = half_angles_deg;
            error_of(&*kriging(&m), &*truth)
        };
        let (unknown, known) = (error([0.0; 2]), error(half_angles_deg));
        assert!(known < 0.5 * unknown, "{alpha}: {known} {unknown}");
    }
}
