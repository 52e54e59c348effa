//! Shapes of the points of series: they differ where colours do not.

use super::canvas::{Canvas, Ink};
use std::f64::consts::{PI, TAU};

/// A shape about a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::report) enum Shape {
    Circle,
    Square,
    Triangle,
    Diamond,
    Cross,
    Plus,
    Wedge,
}

impl Shape {
    /// As many as there are colours in their cycle.
    const ALL: [Self; 7] = [
        Self::Circle,
        Self::Square,
        Self::Triangle,
        Self::Diamond,
        Self::Cross,
        Self::Wedge,
        Self::Plus,
    ];

    /// The shape of a place in the colour cycle.
    pub(crate) const fn of(color: usize) -> Self {
        Self::ALL[color % Self::ALL.len()]
    }

    /// Corners about the origin, y down, of the area of a circle of radius 1 or a little less; none of a circle.
    fn corners(self) -> Vec<[f64; 2]> {
        let polygon = |count: usize, first: f64, radius: f64| -> Vec<[f64; 2]> {
            let angle = |i: usize| first + TAU * i as f64 / count as f64;
            let at = |i| {
                let (s, c) = f64::sin_cos(angle(i));
                [radius * c, radius * s]
            };
            (0..count).map(at).collect()
        };
        let turned = |first: f64| -> Vec<[f64; 2]> {
            // Arms of half the width 0.4 and the length 1.35.
            const PLUS: [[f64; 2]; 3] = [[1.35, -0.4], [1.35, 0.4], [0.4, 0.4]];
            let arm = |i: usize| {
                let (s, c) = (first + 0.5 * PI * i as f64).sin_cos();
                PLUS.map(|[x, y]| [c * x - s * y, s * x + c * y])
            };
            (0..4).flat_map(arm).collect()
        };
        match self {
            Self::Circle => Vec::new(),
            Self::Square => polygon(4, 0.25 * PI, 1.25),
            Self::Diamond => polygon(4, 0.0, 1.35),
            Self::Triangle => polygon(3, -0.5 * PI, 1.45),
            Self::Wedge => polygon(3, 0.5 * PI, 1.45),
            Self::Plus => turned(0.0),
            Self::Cross => turned(0.25 * PI),
        }
    }
}

impl Canvas {
    /// A filled shape as large as a disk of this radius.
    pub(crate) fn marker(&mut self, shape: Shape, centre: [f64; 2], radius: f64, ink: Ink) {
        if shape == Shape::Circle {
            return self.dot(centre, radius, ink);
        }
        let place = |p: [f64; 2]| [0, 1].map(|i| centre[i] + radius * p[i]);
        let corners: Vec<_> = shape.corners().into_iter().map(place).collect();
        self.area(&corners, ink, 1.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_are_about_as_large_and_all_differ() {
        let all = (0..7).map(|color| Shape::of(color).corners());
        let all: Vec<_> = all.collect();
        for (i, corners) in all.iter().enumerate() {
            assert!(all[..i].iter().all(|other| other != corners));
            // Twice the area, by the shoelace formula.
            let next = corners.iter().cycle().skip(1);
            let twice = corners
                .iter()
                .zip(next)
                .map(|(a, b)| a[0] * b[1] - a[1] * b[0]);
            let area = 0.5 * twice.sum::<f64>();
            assert!(corners.is_empty() || (2.5..4.5).contains(&area), "{area}");
        }
    }
}
