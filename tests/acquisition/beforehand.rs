//! Planners that scan first, and then follow what they found.

use super::common::{made, near};
use super::{lobe, task};
use gonio::acquisition::{Retro, Slices, acquire};
use gonio::geometry::{Direction, Symmetry};
use gonio::schedule::{Pose, SampleSet};

#[test]
fn a_scan_comes_first_and_lights_then_reflect_the_view() {
    let task = task(64);
    let measured = acquire(&Retro::default(), &task, &lobe(0.1)).unwrap();
    let poses = &measured.schedule.poses;
    assert_eq!(poses.len(), 64);
    assert!(poses[..8].iter().all(|pose| pose.pair.separation() < 1e-6));
    // Nearly all normals of this lobe are within 15 degrees of the mean.
    let theta = |pose: &Pose| Direction::try_new(pose.pair.half()).unwrap().theta();
    assert!(poses[8..].iter().filter(|pose| theta(pose) < 0.26).count() > 48);
    let mut retro = Retro {
        separation_deg: 7.0,
    };
    let measured = acquire(&retro, &task, &lobe(0.1)).unwrap();
    for pose in &measured.schedule.poses[..8] {
        near(pose.pair.separation().to_degrees(), 7.0, 1e-9, pose);
    }
    retro.separation_deg = -1.0;
    assert!(retro.check(&[]).is_err());
}

#[test]
fn a_narrow_lobe_is_read_at_its_peak() {
    let of = |width: f64| {
        let lobe = made(Symmetry::FULL, move |pair| {
            let h = pair.half();
            let tan = h.x.hypot(h.y) / h.z;
            Some([0.1 + (-(tan / width).powi(2)).exp()])
        });
        let measured = acquire(&Slices {}, &task(60), &lobe).unwrap();
        let poses = measured.schedule.poses.iter();
        let near = poses.filter(|pose| (0.001..0.5).contains(&pose.coords[0]));
        near.count()
    };
    let [narrow, flat] = [0.1, 1e3].map(of);
    assert!(narrow > 25 && flat < narrow - 5, "{narrow} {flat}");
}
