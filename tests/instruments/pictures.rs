//! Instruments that read a picture at a stop.

use crate::common::{form, material, near, planned, preset, refused_edits};
use gonio::brdf::Channels;
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::instrument::{self, Bench, Instrument, InstrumentSpec, Order, Parts};
use gonio::measurement::Measurement;
use gonio::schedule::{Pictures, SampleSet, Schedule};
use std::collections::BTreeSet;
use std::sync::Arc;

const WITHOUT_NOISE: Parts = Parts {
    limits: true,
    apertures: false,
    noise: false,
};

/// So many pictures of a sphere.
fn pictures(nodes: usize, angles_deg: &[f64]) -> Arc<Schedule> {
    let set = Pictures {
        nodes,
        angles_deg: angles_deg.to_vec(),
        ..Pictures::default()
    };
    let form = form("half-difference", Symmetry::FULL);
    Arc::new(set.plan(&form, nodes * angles_deg.len(), 1).unwrap())
}

fn read(spec: &InstrumentSpec, parts: Parts, schedule: &Arc<Schedule>, seed: u64) -> Measurement {
    let brdf = material("ggx", "alpha = 0.4", Channels::Luminance);
    let bench = Bench::new(spec, parts, seed).unwrap();
    let itinerary = bench.plan(schedule, Order::TwoOpt);
    bench.session(&itinerary, seed).measure(&*brdf, schedule)
}

#[test]
fn a_stop_reads_all_that_the_axes_beside_its_picture_share() {
    let angles = |pair: &DirectionPair| [pair.separation(), pair.omega_i.theta()];
    for (name, coordinates, which) in [
        ("sphere-camera", "half-difference", 0),
        ("mirror-camera", "spherical", 1),
    ] {
        let spec = preset(name);
        let schedule = planned(&form(coordinates, Symmetry::FULL), "grid", 500, 1);
        let bench = Bench::new(&spec, Parts::ALL, 1).unwrap();
        let angle = |pose: u32| angles(&schedule.poses[pose as usize].pair)[which];
        for order in [Order::AsGenerated, Order::Sorted, Order::TwoOpt] {
            let itinerary = bench.plan(&schedule, order);
            let poses: BTreeSet<u32> = itinerary.visits.iter().map(|v| v.pose).collect();
            let all = itinerary.visits.len() + itinerary.unreachable.len();
            assert_eq!(
                (poses.len(), all),
                (itinerary.visits.len(), schedule.poses.len())
            );
            let distinct = poses.iter().map(|&pose| (angle(pose) * 1e6).round() as i64);
            let distinct: BTreeSet<i64> = distinct.collect();
            assert_eq!(itinerary.stops(), distinct.len(), "{name} {}", order.name());
            assert!(itinerary.stops() < all / 10);
            let mut last = None;
            for visit in &itinerary.visits {
                let is_new = last != Some(visit.stop);
                assert_eq!(is_new, visit.exposure_seconds > 0.0);
                assert_eq!(is_new, visit.seconds > 0.0);
                assert!(last.is_none_or(|last| visit.stop == last || visit.stop == last + 1));
                last = Some(visit.stop);
            }
        }
    }
}

#[test]
fn without_errors_a_smooth_material_is_read_as_it_is() {
    let schedule = pictures(60, &[5.0, 30.0, 60.0]);
    let spec = preset("sphere-camera");
    let measured = read(&spec, WITHOUT_NOISE, &schedule, 1);
    let brdf = material("ggx", "alpha = 0.4", Channels::Luminance);
    assert!(measured.readings() > 150);
    for (i, pose) in schedule.poses.iter().enumerate() {
        if let Some(value) = measured.value(i) {
            // A patch has a radius of up to 1.7°, over which f cos bends most at grazing.
            let right = brdf.luminance(&pose.pair).unwrap();
            near(value[0] / right, 1.0, 1e-2, pose.pair);
        }
    }
}

#[test]
fn a_near_camera_reads_other_angles_beside_the_centre_and_they_are_recorded() {
    let schedule = pictures(400, &[15.0]);
    let mut spec = preset("sphere-camera");
    let picture = spec.picture.as_mut().unwrap();
    (picture.camera_radii, picture.patch_px) = (10.0, 0.5);
    (spec.limits.theta_i_max_deg, spec.limits.theta_o_max_deg) = (90.0, 90.0);
    let measured = read(&spec, WITHOUT_NOISE, &schedule, 1);
    let brdf = material("ggx", "alpha = 0.4", Channels::Luminance);
    assert!(measured.schedule.lattice.is_none());
    let (mut least, mut most) = (90.0_f64, 0.0_f64);
    for (i, pose) in measured.schedule.poses.iter().enumerate() {
        let Some(value) = measured.value(i) else {
            continue;
        };
        // Towards the edge half a pixel is degrees of the normal.
        if pose
            .pair
            .omega_i
            .cos_theta()
            .min(pose.pair.omega_o.cos_theta())
            > 0.1
        {
            let right = brdf.luminance(&pose.pair).unwrap();
            near(value[0] / right, 1.0, 3e-3, pose.pair);
        }
        let theta_d = 0.5 * pose.pair.separation().to_degrees();
        (least, most) = (least.min(theta_d), most.max(theta_d));
    }
    // A trace of rays over the whole sphere has 12.4 to 17.9; poses are on the half of it that the symmetries leave.
    assert!(
        least > 12.4 && most < 17.9 && most - least > 2.0,
        "{least} {most}"
    );
}

#[test]
fn uncertainties_of_pixels_are_those_of_other_pictures_and_instruments() {
    let schedule = pictures(8, &[10.0, 35.0, 60.0]);
    for name in ["sphere-camera", "mirror-camera"] {
        let spec = preset(name);
        let noise = Parts {
            apertures: false,
            ..Parts::ALL
        };
        let right = read(&spec, WITHOUT_NOISE, &schedule, 1);
        let (mut sum, mut count) = (0.0, 0);
        for seed in 0..80 {
            let measured = read(&spec, noise, &schedule, seed);
            let details = measured.details.as_ref().unwrap();
            for i in 0..schedule.poses.len() {
                let (Some(found), Some(right)) = (measured.value(i), right.value(i)) else {
                    continue;
                };
                let stated = details.type_a[i].hypot(details.type_b[i]);
                sum += ((found[0] - right[0]) / stated).powi(2);
                count += 1;
            }
        }
        let ratio = (sum / f64::from(count)).sqrt();
        assert!((0.85..1.15).contains(&ratio), "{name}: {ratio} of {count}");
    }
}

#[test]
fn what_is_no_picture_is_refused() {
    let sphere = instrument::presets()
        .into_iter()
        .find(|p| p.name == "sphere-camera");
    let text = sphere.unwrap().text;
    refused_edits(
        text,
        r#"
        radius_px = 256 | radius_px = 4 | picture.radius_px … [8, 100000]
        patch_px = 8 | patch_px = 0 | picture.patch_px … above 0
        patch_px = 8 | patch_px = 8\ncamera_radii = 1 | picture.camera_radii … [1.5, 1e6]
        centre_px = 0.5 | centre_px = -0.5 | picture.centre_px … at least 0
        scale = 0.005 | scale = 1 | picture.scale … [0, 1)
        separation_min_deg = 8 | separation_min_deg = 0.1 | limits.separation_min_deg … in front of the camera
        imaged = true | imaged = false | axis[1].imaged … true, as axis[2].imaged
        imaged = true | imaged = true\nbias_deg = 1 | axis[1].bias_deg … 0 of an imaged axis
        resolution_deg = 0.001 | imaged = true | axis[0].imaged … sample_tilt of fixed-detector-3-axis
        scan = "stop" | scan = "fly"\nsample_rate_hz = 1 | timing.scan … "stop"
        [picture] | [picture2] | picture2"#,
        instrument::read,
    );
}
