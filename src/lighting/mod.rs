//! Distant light: radiance as a function of the direction it comes from.

use crate::geometry::Direction;

/// Radiance that arrives from far away, the same at every point of a scene.
pub trait Lighting: Send + Sync {
    /// Radiance (linear R, G, B, each finite and ≥ 0, in arbitrary but equal units) from a
    /// direction on the whole sphere; z is up.
    fn radiance(&self, omega: Direction) -> [f64; 3];
}
