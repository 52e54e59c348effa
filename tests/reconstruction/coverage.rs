//! What readings say of a pair.

use super::{form, measure, smooth_material};
use gonio::brdf::{Brdf, Presence};
use gonio::geometry::{Direction, DirectionPair, Symmetry};
use gonio::reconstruct::{Coverage, Covered, Fill, NearestReading, Reconstruct};
use gonio::schedule::SobolSet;

fn pair(theta_i: f64, theta_o: f64, phi: f64) -> DirectionPair {
    let direction =
        |theta: f64, phi: f64| Direction::from_spherical(theta.to_radians(), phi.to_radians());
    DirectionPair::new(direction(theta_i, 0.0), direction(theta_o, phi))
}

#[test]
fn a_full_set_covers_all_and_a_half_one_its_half() {
    let form = form("half-difference", Symmetry::FULL);
    let mut m = measure(&smooth_material(Symmetry::FULL), &form, &SobolSet {}, 3000);
    let brdf = NearestReading::default().reconstruct(&m).unwrap();
    let grid = || {
        let angles = (0..8).flat_map(|i| (0..8).flat_map(move |o| (0..7).map(move |a| (i, o, a))));
        angles.map(|(i, o, a)| {
            pair(
                10.0 * f64::from(i),
                10.0 * f64::from(o),
                30.0 * f64::from(a),
            )
        })
    };
    let share = |covered: &Covered<'_>, of: Coverage, keep: &dyn Fn(&DirectionPair) -> bool| {
        let pairs: Vec<_> = grid().filter(|p| keep(p)).collect();
        let found = pairs.iter().filter(|p| covered.coverage(p) == of).count();
        found as f64 / pairs.len() as f64
    };
    let covered = Covered::new(&*brdf, &m, Fill::Extrapolate).unwrap();
    assert!(share(&covered, Coverage::Interpolated, &|_| true) > 0.98);
    // Every reading is covered, and stays what it is whatever is filled in.
    for (i, pose) in m.schedule.poses.iter().enumerate().step_by(50) {
        let none = Covered::new(&*brdf, &m, Fill::None).unwrap();
        let mut out = [0.0];
        assert_eq!(none.eval(&pose.pair, &mut out), Presence::Present);
        assert_eq!(out[0], m.value(i).unwrap()[0]);
    }
    // Without the readings above 30° from the half vector to the normal.
    let axis = |p: &DirectionPair| form.forward(p)[0].to_degrees();
    for (pose, outcome) in m.schedule.poses.iter().zip(&mut m.outcomes) {
        if axis(&pose.pair) > 30.0 {
            *outcome = gonio::measurement::Outcome::NotVisited;
        }
    }
    let covered = Covered::new(&*brdf, &m, Fill::Extrapolate).unwrap();
    assert!(share(&covered, Coverage::Interpolated, &|p| axis(p) < 25.0) > 0.97);
    assert!(share(&covered, Coverage::Interpolated, &|p| axis(p) > 40.0) < 0.03);
    assert!(share(&covered, Coverage::Unknown, &|p| axis(p) > 65.0) > 0.97);
    // One reading covers what is near to it.
    m.outcomes.fill(gonio::measurement::Outcome::NotVisited);
    m.outcomes[0] = gonio::measurement::Outcome::Reading;
    let covered = Covered::new(&*brdf, &m, Fill::Extrapolate).unwrap();
    assert_eq!(
        covered.coverage(&m.schedule.poses[0].pair),
        Coverage::Interpolated
    );
    assert!(share(&covered, Coverage::Interpolated, &|_| true) < 0.1);
}
