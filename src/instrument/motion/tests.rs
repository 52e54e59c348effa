use super::*;
use crate::sampling::Random;
use std::f64::consts::TAU;

fn axis(speed: f64, acceleration: f64) -> AxisMotion {
    AxisMotion {
        speed,
        acceleration,
        wraps: false,
    }
}

#[test]
fn the_time_to_a_box_is_the_time_to_its_nearest_point() {
    let travel = Travel::new(&[
        axis(0.5, 1.0),
        AxisMotion {
            wraps: true,
            ..axis(0.3, 2.0)
        },
    ]);
    let random = Random::new(8);
    let longest = |squares: Positions| squares.into_iter().fold(0.0, f64::max).sqrt();
    for i in 0..300 {
        let x: [f64; 6] = random.point(i);
        let x = x.map(|x| (x - 0.5) * TAU);
        let low = [x[0].min(x[2]), x[1].min(x[3]), 0.0, 0.0];
        let high = [x[0].max(x[2]), x[1].max(x[3]), 0.0, 0.0];
        let from = [x[4], x[5], 0.0, 0.0];
        let bound = longest(travel.squares_to_box(&from, &low, &high));
        let mut nearest = f64::INFINITY;
        for k in 0..=200 {
            for l in 0..=200 {
                let inside = |j: usize, k: i32| low[j] + (high[j] - low[j]) * f64::from(k) / 200.0;
                let t = travel.seconds(&from, &[inside(0, k), inside(1, l), 0.0, 0.0]);
                assert!(t >= bound * (1.0 - 1e-12));
                nearest = nearest.min(t);
            }
        }
        // A box is at most a turn wide: the nearest of the points is half a 200th of that away.
        let step = longest(travel.squares(&[0.0; 4], &[TAU / 400.0, TAU / 400.0, 0.0, 0.0]));
        assert!(nearest <= bound + step, "{nearest} {bound}");
    }
}

#[test]
fn exposures_are_in_equal_ratios() {
    let mut detector = DetectorSpec {
        half_angle_deg: 0.5,
        view_mm: 10.0,
        reference_rate: 1e6,
        full_scale: 1e5,
        bits: 16,
        read_noise: 10.0,
        dark_rate: 1.0,
        shot_noise: true,
        outliers: 0.0,
        exposures: 4,
        exposure_min_s: 0.001,
        exposure_max_s: 1.0,
    };
    let all: Vec<f64> = exposures(&detector).collect();
    for (t, expected) in all.iter().zip([0.001, 0.01, 0.1, 1.0]) {
        assert!((t / expected - 1.0).abs() < 1e-14);
    }
    assert_eq!(all.len(), 4);
    detector.exposures = 1;
    assert_eq!(exposures(&detector).collect::<Vec<_>>(), [0.001]);
}
