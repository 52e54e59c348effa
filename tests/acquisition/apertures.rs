//! Readings that are means over apertures: the BRDF is what is asked for, and not its mean.

use super::common::{Level, levels};
use super::{error_of, over_matte, task};
use gonio::acquisition::{Aim, Greedy, Rule, acquire};
use gonio::instrument::{Optics, Tolerance, Workspace};
use gonio::reconstruct::{Kriging, Reconstruct};

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
        let planner = Greedy::new(Rule::Adaptive, Aim::default());
        let mut means = acquire(&planner, &task(level.of(96, 256)), &*truth).unwrap();
        let mut work = Workspace::default();
        for (value, pose) in means.values.iter_mut().zip(&means.schedule.poses) {
            *value = optics
                .average(&*truth, &pose.pair, &mut work)
                .unwrap()
                .value[0];
        }
        let error = |half_angles_deg| {
            let mut m = means.clone();
            m.half_angles_deg = half_angles_deg;
            error_of(&*Kriging::default().reconstruct(&m).unwrap(), &*truth)
        };
        let (unknown, known) = (error([0.0; 2]), error(half_angles_deg));
        println!("{alpha}: {unknown:.4} {known:.4}");
        assert!(known < 0.5 * unknown, "{alpha}: {known} {unknown}");
    }
}
