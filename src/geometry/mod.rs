//! Directions and pairs of directions.
//!
//! Local frame {t, b, n}: right-handed, n = +z. `omega_i` points towards the
//! light, `omega_o` towards the sensor; both point away from the surface.

mod block;
mod direction;
mod distance;
mod pair;
mod symmetry;

pub(crate) use block::{BLOCK, FEW, PairBlock};
pub use direction::{Direction, angle_between};
pub use distance::{distance, images};
pub use pair::DirectionPair;
pub(crate) use pair::half_and_back;
pub use symmetry::Symmetry;
