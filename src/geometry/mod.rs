//! Directions and pairs of directions; knows nothing of reflectance.
//!
//! Local frame {t, b, n}: right-handed, n = +z. `omega_i` points towards the
//! light, `omega_o` towards the sensor; both point away from the surface.

mod direction;
mod pair;
mod symmetry;

pub use direction::{Direction, angle_between};
pub use pair::DirectionPair;
pub use symmetry::Symmetry;
