//! Plain-data line and point plots.

/// Scale of an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scale {
    /// Equal differences are equally far apart.
    #[default]
    Linear,
    /// Equal ratios are equally far apart; values not above 0 are left out.
    Log,
}

/// An axis of a panel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axis {
    /// Name of the quantity with its unit: `θ_o (°)`.
    pub label: String,
    /// Its scale.
    pub scale: Scale,
    /// Its ends; those of the data if `None`.
    pub range: Option<[f64; 2]>,
}

impl Axis {
    /// A linear axis over the data.
    pub(crate) fn linear(label: impl Into<String>) -> Self {
        Self {
            label: label.into(),
            ..Self::default()
        }
    }

    /// A logarithmic axis over the data.
    pub(crate) fn log(label: impl Into<String>) -> Self {
        Self {
            scale: Scale::Log,
            ..Self::linear(label)
        }
    }

    /// The axis with ends of its own.
    pub(crate) fn within(mut self, range: [f64; 2]) -> Self {
        self.range = Some(range);
        self
    }
}

/// Drawing of the points of a series.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mark {
    /// Joined by a line.
    #[default]
    Line,
    /// Joined by a dashed line.
    Dashed,
    /// Joined by a line of dots.
    Dotted,
    /// Joined by a line of dashes and dots in turn.
    DashDotted,
    /// Separate dots.
    Points,
    /// Corners of a tinted area.
    Area,
}

/// Points that belong together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// Name in the legend; empty: not in the legend.
    pub name: String,
    /// Place in the colour cycle; series of the same colour belong together.
    pub color: usize,
    /// Line, dashes, dots or area.
    pub mark: Mark,
    /// Points (x, y) in the units of the axes; a `None` leaves a gap.
    pub points: Vec<Point>,
}

/// A point (x, y) of a series.
pub(crate) type Point = (f64, Option<f64>);

impl Series {
    /// Points with a name in the legend.
    pub(crate) fn new(
        name: impl Into<String>,
        color: usize,
        mark: Mark,
        points: impl IntoIterator<Item = Point>,
    ) -> Self {
        Self {
            name: name.into(),
            color,
            mark,
            points: points.into_iter().collect(),
        }
    }
}

/// A diagram.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Panel {
    /// Title above the diagram.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Its series; later ones are drawn over earlier ones.
    pub series: Vec<Series>,
}

impl Panel {
    /// A diagram of series over its axes.
    pub(crate) fn new(
        title: impl Into<String>,
        [x, y]: [Axis; 2],
        series: impl IntoIterator<Item = Series>,
    ) -> Self {
        Self {
            title: title.into(),
            x,
            y,
            series: series.into_iter().collect(),
        }
    }
}

/// Ratios with their intervals, in groups.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Forest {
    /// Label of the axis of ratios.
    pub label: String,
    /// The largest ratio that is no difference, at least 1.
    pub band: f64,
    /// Its parts, from top to bottom.
    pub groups: Vec<ForestGroup>,
}

/// Ratios that belong together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ForestGroup {
    /// Name, above its first line.
    pub name: String,
    /// Place in the colour cycle.
    pub color: usize,
    /// Kind of the lines of its intervals.
    pub mark: Mark,
    /// Its parts, from top to bottom.
    pub lines: Vec<ForestLine>,
}

/// A ratio.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ForestLine {
    /// Name, to the left of the interval.
    pub name: String,
    /// Ratio, above 0.
    pub ratio: f64,
    /// Ends of its confidence interval.
    pub interval: Option<[f64; 2]>,
    /// Text to the right of the interval.
    pub note: String,
}

/// Colours that are distinct for the colour-blind, in sRGB (Okabe and Ito, without yellow, which is
/// hard to see on white).
pub(super) const CYCLE: [[u8; 3]; 7] = [
    [0x00, 0x72, 0xb2],
    [0xd5, 0x5e, 0x00],
    [0x00, 0x9e, 0x73],
    [0xcc, 0x79, 0xa7],
    [0xe6, 0x9f, 0x00],
    [0x56, 0xb4, 0xe9],
    [0x00, 0x00, 0x00],
];

/// Place of a parametrization in the colour cycle: the same in every diagram.
pub(crate) fn color_of(parametrization: &str) -> usize {
    /// The two that are compared most differ most.
    const FIRST: [&str; 4] = ["half-difference", "hybrid", "spherical", "orthographic"];
    if let Some(place) = FIRST.iter().position(|name| *name == parametrization) {
        return place;
    }
    let all = crate::parametrization::all();
    let others: Vec<_> = all.iter().filter(|e| !FIRST.contains(&e.kind)).collect();
    let place = others.iter().position(|e| e.kind == parametrization);
    // What follows no parametrization has the colour behind all of them.
    (FIRST.len() + place.unwrap_or(others.len())) % CYCLE.len()
}

/// The colour at a place of a cycle of `count`: one of a few, or a step of a scale from dark to
/// bright where there are more than that.
pub(in crate::report) fn palette(place: usize, count: usize) -> [u8; 3] {
    if count <= CYCLE.len() {
        return CYCLE[place % CYCLE.len()];
    }
    // Brighter ones cannot be seen on white.
    ramp(0.1 + 0.65 * (place as f64 / (count - 1) as f64).min(1.0))
}

/// A colour scale from dark violet (0) over blue and green to yellow (1) in sRGB: viridis (Smith and
/// van der Walt 2015). Its lightness rises evenly, so that it reads the same in grey and to the
/// colour-blind; neither white nor grey is among its colours.
pub(in crate::report) fn ramp(t: f64) -> [u8; 3] {
    /// Coefficients of R, G and B, from the constant to the sixth power: within 2 % of the table.
    const POWERS: [[f64; 3]; 7] = [
        [0.277_727, 0.005_407, 0.334_100],
        [0.105_093, 1.404_614, 1.384_590],
        [-0.330_862, 0.214_848, 0.095_095],
        [-4.634_230, -5.799_101, -19.332_441],
        [6.228_270, 14.179_933, 56.690_553],
        [4.776_385, -13.745_145, -65.353_033],
        [-5.435_456, 4.645_853, 26.312_435],
    ];
    let t = if t.is_nan() { 0.0 } else { t.clamp(0.0, 1.0) };
    let channel = |c: usize| POWERS.iter().rev().fold(0.0, |sum, p| sum * t + p[c]);
    [0, 1, 2].map(|c| (255.0 * channel(c)).round().clamp(0.0, 255.0) as u8)
}
