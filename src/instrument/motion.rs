//! Motion and time.
mod travel;
pub use travel::{AxisMotion, Travel};
