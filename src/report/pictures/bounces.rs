//! Light of one facet, of two, of more over the first two axes of parametrizations.

use super::plates::Grid;
use super::plot::{Plane, Plot, Swatch, coordinate, swatches, text};
use crate::analysis::bounces::{ChartBounces, MAP_CELLS, Map};
use crate::brdf::CLASSES;
use crate::parametrization;
use crate::report::svg::canvas::{BLACK, Canvas, Ink};

const GRID: Grid = Grid::new(180.0, 48.0);

const WHITE: Ink = [255; 3];

/// Inks of the classes of scattering order: dark blue, bright yellow, red between them, which differ in grey too (Paul Tol's high contrast).
const INKS: [Ink; CLASSES] = [[0x00, 0x44, 0x88], [0xdd, 0xaa, 0x33], [0xbb, 0x55, 0x66]];

/// Grey beside white lines.
const EDGE: Ink = [110; 3];

/// Light that the white line holds.
const MOST: f64 = 0.9;

/// Pixels of a cell along either side: a viewer that blurs pixels leaves cells sharp.
const PIXELS: usize = 4;

/// Averages over neighbours before the line about most of the light is drawn, and before those where classes exchange the lead:
/// of n the standard deviation is √(n/2) cells.
const SMOOTHED: [usize; 2] = [2, 8];

/// A row per parametrization, a column per map: cells have the classes' colours, mixed by their shares, black lines are where
/// two of them exchange the lead, and a white line holds most of the light.
pub(in crate::report) fn bounces_svg(title: &str, charts: &[ChartBounces]) -> String {
    let columns = charts.iter().map(|c| c.maps.len()).max().unwrap_or(0);
    let [width, below] = GRID.size([charts.len(), columns.max(3)]);
    Canvas::titled(title, [width, below + 64.0], 22.0, |canvas| {
        for (j, chart) in charts.iter().enumerate() {
            let Some(entry) = parametrization::find(chart.name) else {
                continue;
            };
            let plane = Plane::new(&entry);
            for (i, map) in chart.maps.iter().enumerate() {
                let title = match map.azimuth {
                    None => format!("every {}", plane.azimuth),
                    Some(about) => {
                        let [middle, half] = about.map(|x| coordinate(&chart.map_axes[2], x));
                        format!("{} = {middle} ± {half}", plane.azimuth)
                    }
                };
                let plot = GRID.plot(canvas, [j, i], (plane.name, &title, 11.0));
                draw(canvas, &plot, map);
                plot.axes(canvas, &plane, map.azimuth.map(|[middle, _]| middle));
            }
        }
        let all = [
            Swatch::new(INKS[0], "one facet"),
            Swatch::new(INKS[1], "two facets"),
            Swatch::new(INKS[2], "three facets and more"),
            Swatch::new(WHITE, "too few paths"),
            Swatch::OUTSIDE,
        ];
        swatches(canvas, [0.5 * width, below + 12.0], &all);
        let says = "colours are mixed by the shares of the light in a cell; black lines: two numbers of facets exchange the \
                    lead (light averaged over two cells); white lines: inside lies 90 % of the light of a map, where it is densest";
        text(canvas, [0.5 * width, below + 38.0], says, 11.5, false);
    })
}

/// Cells, row after row from the top.
fn from_top() -> impl Iterator<Item = usize> {
    let row = |j: usize| (0..MAP_CELLS).map(move |i| j * MAP_CELLS + i);
    (0..MAP_CELLS).rev().flat_map(row)
}

fn draw(canvas: &mut Canvas, plot: &Plot, map: &Map) {
    let side = PIXELS * MAP_CELLS;
    let cell = |pixel: usize| {
        let [column, row] = [pixel % side, side - 1 - pixel / side];
        row / PIXELS * MAP_CELLS + column / PIXELS
    };
    let ink = |pixel: usize| map.shares(cell(pixel)).map_or(WHITE, mixed);
    plot.raster(canvas, &(0..side * side).map(ink).collect::<Vec<_>>());
    let [near, far] = SMOOTHED.map(|times| smooth(&map.light, times));
    let light = from_top().map(|cell| Some(near[cell].iter().sum()));
    let light: Vec<Option<f64>> = light.collect();
    if let Some(level) = level(&light) {
        // Seen on white cells too.
        plot.isolines(canvas, &light, level, EDGE, 3.4);
        plot.isolines(canvas, &light, level, WHITE, 2.2);
    }
    // Between three classes there is a line wherever the first, or the last, leads or does not.
    for class in [0, CLASSES - 1] {
        let lead = |cell: usize| {
            map.shares(cell)?;
            let light = far[cell];
            let others = (0..CLASSES).filter(|c| *c != class).map(|c| light[c]);
            Some((light[class] - others.fold(0.0, f64::max)) / light.iter().sum::<f64>())
        };
        let lead: Vec<Option<f64>> = from_top().map(lead).collect();
        plot.isolines(canvas, &lead, 0.0, BLACK, 1.8);
    }
}

/// A colour of shares that add up to 1.
fn mixed(shares: [f64; CLASSES]) -> Ink {
    [0, 1, 2].map(|k| {
        let parts = (0..CLASSES).map(|c| shares[c] * f64::from(INKS[c][k]));
        parts.sum::<f64>().round() as u8
    })
}

/// Light of each cell averaged with its neighbours, weighed 1 : 2 : 1 along either axis, some times: lines follow light and not
/// chance.
fn smooth(light: &[[f64; CLASSES]], times: usize) -> Vec<[f64; CLASSES]> {
    let mut light = light.to_vec();
    for _ in 0..times {
        for stride in [1, MAP_CELLS] {
            let before = light.clone();
            for (cell, light) in light.iter_mut().enumerate() {
                let place = cell / stride % MAP_CELLS;
                let low = cell - stride * usize::from(place > 0);
                let high = cell + stride * usize::from(place + 1 < MAP_CELLS);
                *light = std::array::from_fn(|c| {
                    0.25 * before[low][c] + 0.5 * before[cell][c] + 0.25 * before[high][c]
                });
            }
        }
    }
    light
}

/// The level above which lies [`MOST`] of the light; `None` of none.
fn level(light: &[Option<f64>]) -> Option<f64> {
    let mut sorted: Vec<f64> = light.iter().flatten().copied().collect();
    sorted.sort_unstable_by(|a, b| b.total_cmp(a));
    let total: f64 = sorted.iter().sum();
    let mut sum = 0.0;
    sorted.into_iter().find(|light| {
        sum += light;
        sum >= MOST * total && total > 0.0
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn averages_keep_the_light_and_lines_hold_most_of_it() {
        let cells = MAP_CELLS * MAP_CELLS;
        let mut light = vec![[0.0; CLASSES]; cells];
        light[0] = [1.0, 0.0, 0.5];
        light[MAP_CELLS + 7] = [0.0, 2.0, 0.0];
        for (c, all) in [1.0, 2.0, 0.5].into_iter().enumerate() {
            let kept: f64 = smooth(&light, 5).iter().map(|l| l[c]).sum();
            assert!((kept - all).abs() < 1e-12, "{kept}");
        }
        let steps: Vec<Option<f64>> = (0..100).map(|i| Some(f64::from(i))).collect();
        let Some(level) = level(&steps) else {
            panic!("there is light");
        };
        let inside: f64 = steps.iter().flatten().filter(|l| **l >= level).sum();
        assert!(inside >= 0.9 * 4950.0 && inside - level < 0.9 * 4950.0);
        assert_eq!(mixed([0.0, 1.0, 0.0]), INKS[1]);
    }
}
