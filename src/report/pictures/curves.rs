//! What an error costs: in configurations, in seconds of computing, in minutes of an instrument.

use crate::report::{Axis, Mark, Panel, Scale, Series};

/// What one choice reaches.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curve {
    /// The choice, for the legend.
    pub name: String,
    /// What it costs, and the error that is left; both above 0, what is not is left out.
    pub points: Vec<(f64, f64)>,
}

/// What an error is set against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cost {
    /// Distinct physical configurations.
    Budget,
    /// Seconds of computing.
    Seconds,
    /// Minutes of an instrument.
    Minutes,
}

impl Cost {
    /// The label of the axis.
    pub fn label(self) -> &'static str {
        match self {
            Cost::Budget => "budget (configurations)",
            Cost::Seconds => "computing (s)",
            Cost::Minutes => "instrument (min)",
        }
    }
}

/// A log-log diagram with one line a choice, in the order of costs; colours in the order of
/// `curves`.
pub fn error_curves(title: &str, cost: Cost, error: &str, curves: &[Curve]) -> Panel {
    let axis = |label: &str| Axis {
        label: label.into(),
        scale: Scale::Log,
        range: None,
    };
    let series = curves.iter().enumerate().map(|(color, curve)| {
        let mut points: Vec<_> = curve.points.clone();
        points.retain(|(x, y)| *x > 0.0 && *y > 0.0);
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        Series {
            name: curve.name.clone(),
            color,
            mark: Mark::Line,
            points: points.into_iter().map(|(x, y)| (x, Some(y))).collect(),
        }
    });
    // Dots on the lines say where there are rows; they need no name of their own.
    let lines: Vec<Series> = series.collect();
    let dots = lines.iter().map(|line| Series {
        name: String::new(),
        mark: Mark::Points,
        ..line.clone()
    });
    Panel {
        title: title.into(),
        x: axis(cost.label()),
        y: axis(error),
        series: lines.iter().cloned().chain(dots).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn costs_rise_and_what_has_no_logarithm_is_left_out() {
        let curve = Curve {
            name: "hybrid".into(),
            points: vec![(1000.0, 0.1), (250.0, 0.4), (0.0, 1.0), (4000.0, 0.0)],
        };
        let panel = error_curves("paint", Cost::Minutes, "nrmse", &[curve]);
        let [line, dots] = &panel.series[..] else {
            panic!("two series");
        };
        assert_eq!(line.points, [(250.0, Some(0.4)), (1000.0, Some(0.1))]);
        assert_eq!(line.points, dots.points);
        assert_eq!((panel.x.scale, panel.y.scale), (Scale::Log, Scale::Log));
        assert!(panel.x.label.contains("(min)") && dots.name.is_empty());
    }
}
