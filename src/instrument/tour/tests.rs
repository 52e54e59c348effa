use super::super::motion::AxisMotion;
use super::*;
use crate::geometry::{DirectionPair, Symmetry};
use crate::numeric::wrap_angle;
use crate::parametrization;
use crate::schedule::{RandomSet, SampleSet};

const REST: Positions = [0.0; 4];

/// Axes of 30°/s and 60°/s².
fn travel(wraps: &[bool]) -> Travel {
    let axis = |&wraps: &bool| AxisMotion {
        speed: 30_f64.to_radians(),
        acceleration: 60_f64.to_radians(),
        wraps,
    };
    Travel::new(&wraps.iter().map(axis).collect::<Vec<_>>())
}

/// Positions of random pairs that are uniform in half/difference coordinates.
fn random(n: usize, seed: u64, place: fn(&DirectionPair) -> Positions) -> Vec<Positions> {
    let form = parametrization::find("half-difference")
        .unwrap()
        .form(Symmetry::NONE);
    let schedule = RandomSet {}.plan(&form, n, seed).unwrap();
    schedule.poses.iter().map(|p| place(&p.pair)).collect()
}

/// Three axes: elevations of light and sensor, azimuth between them.
fn three(pair: &DirectionPair) -> Positions {
    let (i, o) = (pair.omega_i, pair.omega_o);
    [i.theta(), o.theta(), wrap_angle(o.phi() - i.phi()), 0.0]
}

/// Four axes: both directions.
fn four(pair: &DirectionPair) -> Positions {
    let (i, o) = (pair.omega_i, pair.omega_o);
    [i.theta(), i.phi(), o.theta(), o.phi()]
}

const THREE: [bool; 3] = [false, false, true];

const FOUR: [bool; 4] = [false, true, false, true];

#[test]
fn the_tree_finds_what_a_search_of_all_finds() {
    for (wraps, positions) in [
        (&THREE[..], random(700, 4, three)),
        (&FOUR[..], random(700, 4, four)),
    ] {
        let travel = travel(wraps);
        let mut tree = Tree::new(&travel, &positions);
        let nearest = |from: &Positions, but: &dyn Fn(usize) -> bool| {
            let mut all: Vec<usize> = (0..positions.len()).filter(|&i| !but(i)).collect();
            all.sort_by(|&a, &b| {
                let [x, y] = [a, b].map(|i| travel.seconds(from, &positions[i]));
                x.total_cmp(&y).then(a.cmp(&b))
            });
            all
        };
        for of in (0..700).step_by(7) {
            let found: Vec<u32> = tree.neighbours::<10>(of as u32).collect();
            let direct = nearest(&positions[of], &|i| i == of);
            assert!(found.iter().zip(&direct).all(|(&a, &b)| a as usize == b));
            assert_eq!(found.len(), 10);
        }
        let mut gone = [false; 700];
        for k in 0..700 {
            let from = positions[k];
            let found = tree.nearest(&from).unwrap() as usize;
            let direct = nearest(&from, &|i| gone[i])[0];
            assert_eq!(found, direct);
            tree.remove(found as u32);
            gone[found] = true;
        }
        assert_eq!(tree.nearest(&REST), None);
    }
}
