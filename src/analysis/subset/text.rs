//! Text form of a box: `h_bar=0..0.2, k=0.5..0.7, delta=30..60`.

use super::Subset;
use crate::error::{ParameterError, one_of};
use crate::parametrization::{Axis, Parametrization, Unit};
use std::sync::Arc;

impl Subset {
    /// Reads a box: `symbol=low..high`, separated by commas; angles in degrees; axes that are not
    /// named are free.
    ///
    /// # Errors
    /// An axis that the form does not have, one named twice, a range that is no `low..high` with
    /// low < high, or leaves the axis.
    ///
    /// # Panics
    /// If the form has four axes.
    ///
    /// ```
    /// use gonio::analysis::Subset;
    /// use gonio::geometry::Symmetry;
    /// let form = gonio::parametrization::find("hybrid").unwrap().form(Symmetry::FULL);
    /// let subset = Subset::read(form, "h_bar=0..0.2, delta=30..60")?;
    /// assert_eq!(subset.ranges()[1], [0.0, 1.0]);
    /// # Ok::<(), gonio::error::ParameterError>(())
    /// ```
    pub fn read(form: Arc<dyn Parametrization>, text: &str) -> Result<Self, ParameterError> {
        let axes = form.axes().to_vec();
        assert_eq!(axes.len(), 3, "subsets are those of an isotropic form");
        let mut ranges = [0, 1, 2].map(|i| axes[i].range);
        let mut named = [false; 3];
        for part in text.split(',').map(str::trim).filter(|p| !p.is_empty()) {
            let (symbol, range) = part.split_once('=').ok_or_else(|| {
                ParameterError::new(
                    "box",
                    format!("{part:?}"),
                    "axis=low..high, separated by commas, e.g. k=0.5..0.7",
                )
            })?;
            let symbol = symbol.trim();
            let Some(i) = axes.iter().position(|a| a.symbol == symbol) else {
                let symbols = one_of(symbol, axes.iter().map(|a| a.symbol));
                let allowed = format!("an axis of {}: {symbols}", form.name());
                return Err(ParameterError::new("box", format!("{symbol:?}"), allowed));
            };
            if std::mem::replace(&mut named[i], true) {
                return Err(ParameterError::new("box", part, "each axis once"));
            }
            ranges[i] = read_range(&axes[i], range.trim())?;
        }
        Ok(Self::new(form, ranges))
    }
}

fn read_range(axis: &Axis, text: &str) -> Result<[f64; 2], ParameterError> {
    let [least, most] = axis.range.map(|end| axis.file_value(end));
    let unit = match axis.unit {
        Unit::Radian => ", in degrees",
        Unit::One => "",
    };
    let refused = || {
        let allowed = format!("low..high with {least} <= low < high <= {most}{unit}");
        ParameterError::new(format!("box: {}", axis.symbol), text, allowed)
    };
    let (low, high) = text.split_once("..").ok_or_else(refused)?;
    let number = |text: &str| text.trim().parse::<f64>().ok();
    let (low, high) = (
        number(low).ok_or_else(refused)?,
        number(high).ok_or_else(refused)?,
    );
    // NaN fails.
    if !(least <= low && low < high && high <= most) {
        return Err(refused());
    }
    // The ends themselves to the bit: 90° in radians may round past π/2.
    let inside = |value: f64| match (value == least, value == most, axis.unit) {
        (true, ..) => axis.range[0],
        (_, true, _) => axis.range[1],
        (.., Unit::Radian) => value.to_radians(),
        (.., Unit::One) => value,
    };
    Ok([inside(low), inside(high)])
}
