use super::super::motion::AxisMotion;
use super::*;
use crate::sampling::Random;
use std::f64::consts::TAU;

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

/// Positions anywhere on so many axes, within half a turn of 0.
fn random(n: u64, axes: usize) -> Vec<Positions> {
    let random = Random::new(4);
    let place = |i: u64| {
        let mut place: Positions = random.point(i).map(|u| (u - 0.5) * TAU);
        place[axes..].fill(0.0);
        place
    };
    (0..n).map(place).collect()
}

const THREE: [bool; 3] = [false, false, true];

const FOUR: [bool; 4] = [false, true, false, true];

#[test]
fn the_tree_finds_what_a_search_of_all_finds() {
    for (wraps, positions) in [(&THREE[..], random(700, 3)), (&FOUR[..], random(700, 4))] {
        let travel = travel(wraps);
        let mut tree = Tree::new(&travel, &positions);
        let (leaves, mut near) = (tree.leaves(), Vec::new());
        let nearest = |from: &Positions, but: &dyn Fn(usize) -> bool| {
            let mut all: Vec<usize> = (0..positions.len()).filter(|&i| !but(i)).collect();
            all.sort_by(|&a, &b| {
                let [x, y] = [a, b].map(|i| travel.seconds(from, &positions[i]));
                x.total_cmp(&y).then(a.cmp(&b))
            });
            all
        };
        for of in (0..700).step_by(7) {
            let direct = nearest(&positions[of], &|i| i == of);
            // Few, which are kept sorted, and more.
            for count in [11, 45] {
                tree.nearest(&positions[of], count, FAR, &mut near);
                let found = near.iter().map(|near| near.number);
                let found: Vec<u32> = found.filter(|&n| n as usize != of).collect();
                assert!(found.iter().zip(&direct).all(|(&a, &b)| a as usize == b));
                assert_eq!(found.len(), count - 1);
            }
        }
        let mut gone = [false; 700];
        for k in 0..700 {
            let from = positions[k];
            let found = tree.nearest_one(&from, FAR).unwrap();
            let direct = nearest(&from, &|i| gone[i])[0];
            assert_eq!(found as usize, direct);
            tree.remove(found, leaves[direct]);
            gone[direct] = true;
        }
        assert_eq!(tree.nearest_one(&REST, FAR), None);
    }
}
