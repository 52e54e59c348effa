//! The virtual instruments: chains, limits, presets, apertures, noise.
#![cfg(feature = "experiments")]

#[path = "../common/mod.rs"]
mod common;

mod checks;
mod kinematics;
mod limits;
mod noise;
mod optics;
mod pictures;
mod presets;

use glam::DVec3;
use gonio::geometry::{Direction, DirectionPair, angle_between};
use gonio::instrument::{self, InstrumentSpec, Machine};

/// The presets that read a pair at a stop, one of each class.
fn arms() -> Vec<InstrumentSpec> {
    let mut specs = specs();
    specs.retain(|spec| spec.picture.is_none());
    specs
}

/// The presets.
fn specs() -> Vec<InstrumentSpec> {
    let read = |preset: instrument::Preset| instrument::read(preset.text).unwrap();
    instrument::presets().into_iter().map(read).collect()
}

fn machines() -> Vec<Machine> {
    let machine = |spec: &InstrumentSpec| Machine::new(spec).unwrap();
    specs().iter().map(machine).collect()
}

/// The larger of the angles between the light directions and between the sensor directions, rad.
fn distance(a: &DirectionPair, b: &DirectionPair) -> f64 {
    let light = angle_between(a.omega_i.vector(), b.omega_i.vector());
    let sensor = angle_between(a.omega_o.vector(), b.omega_o.vector());
    light.max(sensor)
}

/// The pair turned about the normal so that the sum of its tangents, weighted to tell light from
/// sensor, falls best onto that of `other`: the closest turn of one pair to another. Mirror images
/// stay apart.
fn turned_onto(pair: &DirectionPair, other: &DirectionPair) -> DirectionPair {
    // Kabsch in the plane: the angle that maximises Σ a·R b has tan = Σ a×b / Σ a·b.
    let (mut sine, mut cosine) = (0.0, 0.0);
    for (to, from) in [(other.omega_i, pair.omega_i), (other.omega_o, pair.omega_o)] {
        let (a, b) = (to.vector(), from.vector());
        cosine += a.x * b.x + a.y * b.y;
        sine += b.x * a.y - b.y * a.x;
    }
    let length = f64::hypot(sine, cosine);
    let (s, c) = if length > 0.0 {
        (sine / length, cosine / length)
    } else {
        (0.0, 1.0)
    };
    let turn = |d: Direction| {
        let v = d.vector();
        Direction::from_unit(DVec3::new(c * v.x - s * v.y, s * v.x + c * v.y, v.z))
    };
    DirectionPair::new(turn(pair.omega_i), turn(pair.omega_o))
}
