//! Plain-data line and point plots.

/// How an axis is divided.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    /// Equal differences are equally far apart.
    #[default]
    Linear,
    /// Equal ratios are equally far apart; what is not above 0 is left out.
    Log,
}

/// An axis of a panel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axis {
    /// What is shown, with its unit: `theta_o (deg)`.
    pub label: String,
    /// How it is divided.
    pub scale: Scale,
    /// Its ends; those of the data if `None`.
    pub range: Option<[f64; 2]>,
}

/// How the points of a series are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mark {
    /// Joined by a line.
    #[default]
    Line,
    /// Joined by a dashed line.
    Dashed,
    /// Each by itself.
    Points,
}

/// Points that belong together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// For the legend; empty for none.
    pub name: String,
    /// Place in the colour cycle; series of the same colour belong together.
    pub color: usize,
    /// How they are drawn.
    pub mark: Mark,
    /// x, y; a `None` leaves a gap.
    pub points: Vec<(f64, Option<f64>)>,
}

/// One diagram.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Panel {
    /// Above it.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Later ones are drawn over earlier ones.
    pub series: Vec<Series>,
}
