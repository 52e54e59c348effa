use gonio::report::{Axis, Mark, Panel, Scale, Series, svg};
use std::collections::BTreeSet;

fn panel(scale: Scale, series: Vec<Series>) -> Panel {
    Panel {
        title: "a < b & \"c\"".into(),
        x: Axis {
            label: "θ_o (°)".into(),
            ..Axis::default()
        },
        y: Axis {
            label: "value".into(),
            scale,
            range: None,
        },
        series,
    }
}

fn series(color: usize, mark: Mark, points: &[(f64, Option<f64>)]) -> Series {
    Series {
        name: format!("series {color}"),
        color,
        mark,
        points: points.to_vec(),
    }
}

/// Draws and checks what every sheet must be.
fn drawn(panels: &[Panel]) -> String {
    let text = svg("title", panels, 2).unwrap();
    assert_eq!(text, svg("title", panels, 2).unwrap());
    let mut open = Vec::new();
    for tag in text.split('<').skip(1) {
        let (tag, between) = tag.split_once('>').unwrap();
        assert!(!between.contains('&') || between.contains(';'));
        assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
        assert!(!tag.contains("NaN") && !tag.contains("inf"), "{tag}");
        assert!(
            !between.contains("NaN") && !between.contains("inf"),
            "{between}"
        );
        let name = tag.split_whitespace().next().unwrap();
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name));
        } else if !tag.ends_with('/') {
            open.push(name);
        }
    }
    assert!(open.is_empty(), "{open:?}");
    text
}

/// Marks of a color: lines, dots, and the legend's own.
fn marks(text: &str, color: &str) -> usize {
    let tags = text.split('<').filter(|t| !t.starts_with("text"));
    tags.filter(|t| t.contains(color)).count()
}

const BLUE: &str = "#0072B2";

#[test]
fn every_series_with_data_is_seen() {
    let wave = |f: f64| (0..90).map(move |i| (f64::from(i), Some((f * f64::from(i)).sin().abs())));
    for scale in [Scale::Linear, Scale::Log] {
        for mark in [Mark::Line, Mark::Dashed, Mark::Points] {
            let [a, b] = [0.1, 0.2].map(|f| wave(f).collect::<Vec<_>>());
            let text = drawn(&[panel(scale, vec![series(0, mark, &a), series(1, mark, &b)])]);
            assert!(marks(&text, BLUE) >= 2 && marks(&text, ORANGE) >= 2);
        }
    }
    let many: Vec<_> = (0..40)
        .map(|c| {
            series(
                c,
                Mark::Line,
                &wave(0.01 * c as f64 + 0.01).collect::<Vec<_>>(),
            )
        })
        .collect();
    let text = drawn(&[panel(Scale::Linear, many)]);
    let mut colors = BTreeSet::new();
    for c in 0..40 {
        assert!(text.contains(&format!("\nseries {c}\n")));
    }
    for part in text.split('#').skip(1) {
        colors.insert(&part[..6]);
    }
    let twice = colors
        .iter()
        .filter(|c| marks(&text, &format!("#{c}")) == 2);
    // The ink of the axes is one more.
    assert!(twice.count() > 40);
}

const ORANGE: &str = "#D55E00";

#[test]
fn gaps_are_left_open() {
    let points = [
        (0.0, Some(1.0)),
        (1.0, Some(2.0)),
        (2.0, None),
        (3.0, Some(1.0)),
        (4.0, Some(f64::NAN)),
        (5.0, Some(2.0)),
        (6.0, Some(3.0)),
    ];
    let text = drawn(&[panel(Scale::Linear, vec![series(0, Mark::Line, &points)])]);
    // Two lines, a dot for the point on its own, the legend.
    assert_eq!(marks(&text, BLUE), 4);
}

#[test]
fn odd_data_is_drawn_without_complaint() {
    let constants = [0.0, 1.0, -1e-16, 1e-320, f64::MAX, -f64::MAX, 5e-324];
    let mut odd: Vec<Vec<(f64, Option<f64>)>> = vec![
        vec![],
        vec![(1.0, None), (2.0, None)],
        vec![(45.0, Some(0.3))],
        vec![(f64::NAN, Some(1.0)), (f64::INFINITY, Some(1.0))],
        (0..9)
            .map(|i| (f64::from(i), Some(1e-16 * f64::from(i * i % 5 - 2))))
            .collect(),
        (0..9)
            .map(|i| (f64::from(i), Some(1.0 + 1e-16 * f64::from(i))))
            .collect(),
        vec![(0.0, Some(-f64::MAX)), (1.0, Some(f64::MAX))],
        vec![(0.0, Some(5e-324)), (1.0, Some(f64::MAX))],
        vec![(0.0, Some(0.11)), (1.0, Some(0.12))],
        vec![(0.0, Some(f64::INFINITY)), (1.0, Some(f64::NEG_INFINITY))],
    ];
    odd.extend(constants.map(|c| vec![(0.0, Some(c)), (1.0, Some(c))]));
    let ranges = [
        None,
        Some([0.0, 1.0]),
        Some([1.0, 1.0]),
        Some([2.0, -1.0]),
        Some([f64::NAN, 1.0]),
        Some([0.21, 0.22]),
        Some([0.5, 0.5 + 1e-15]),
        Some([-f64::MAX, f64::INFINITY]),
    ];
    for points in &odd {
        for mark in [Mark::Line, Mark::Dashed, Mark::Points] {
            for scale in [Scale::Linear, Scale::Log] {
                for range in ranges {
                    let mut panel = panel(scale, vec![series(0, mark, points)]);
                    panel.y.range = range;
                    panel.x.range = range;
                    drawn(&[panel.clone()]);
                    panel.x.range = None;
                    panel.x.scale = scale;
                    drawn(&[panel]);
                }
            }
        }
    }
    assert!(drawn(&[panel(Scale::Log, vec![])]).contains("no data"));
    drawn(&[]);
    svg("", &[], 0).unwrap();
}

#[test]
fn what_leaves_the_range_is_cut_off() {
    let points = [
        (0.0, Some(0.5)),
        (1.0, Some(1e9)),
        (2.0, Some(0.5)),
        (3.0, Some(-4.0)),
    ];
    let mut panel = panel(Scale::Linear, vec![series(0, Mark::Line, &points)]);
    panel.y.range = Some([0.0, 1.0]);
    let text = drawn(&[panel]);
    let line = |t: &&str| t.starts_with("path") && t.contains(BLUE);
    let mut count = 0;
    for tag in text.split('<').filter(line) {
        let steps = tag.split(" d=\"").nth(1).unwrap();
        for part in steps.split('"').next().unwrap().split('M').skip(1) {
            let [mut x, mut y] = [0, 0];
            for step in part
                .replace('-', " -")
                .replace('l', " ")
                .split_whitespace()
                .collect::<Vec<_>>()
                .chunks(2)
            {
                let [dx, dy] = [step[0], step[1]].map(|v| v.parse::<i32>().unwrap());
                (x, y) = (x + dx, y + dy);
                assert!((0..8000).contains(&x) && (0..5000).contains(&y), "{x} {y}");
            }
            count += 1;
        }
    }
    // Up, down, and the legend.
    assert_eq!(count, 3);
}

#[test]
fn one_legend_serves_panels_that_share_it() {
    let points = [(0.0, Some(1.0)), (1.0, Some(2.0))];
    let one = panel(Scale::Linear, vec![series(0, Mark::Line, &points)]);
    let other = panel(Scale::Linear, vec![series(1, Mark::Line, &points)]);
    let names = |text: &str| text.matches("\nseries").count();
    assert_eq!(names(&drawn(&[one.clone(), one.clone(), one.clone()])), 1);
    assert_eq!(names(&drawn(&[one.clone(), other])), 2);
}

mod forest {
    use gonio::report::{Forest, ForestGroup, ForestLine, Mark, forest_svg};

    #[test]
    fn a_ratio_lies_where_its_axis_says() {
        let line = |ratio: f64, interval| ForestLine {
            name: format!("{ratio}"),
            ratio,
            interval,
            note: "a < b".into(),
        };
        let forest = Forest {
            label: "ratio".into(),
            band: 1.01,
            groups: vec![ForestGroup {
                name: "one".into(),
                color: 0,
                mark: Mark::Line,
                lines: vec![
                    line(0.1, None),
                    line(1.0, Some([0.5, 2.0])),
                    line(10.0, None),
                ],
            }],
        };
        let text = forest_svg(&forest).unwrap();
        let dots: Vec<f64> = text
            .split("<circle cx=\"")
            .skip(1)
            .map(|t| t.split('"').next().unwrap().parse().unwrap())
            .collect();
        let [a, b, c] = dots[..] else {
            panic!("{dots:?}")
        };
        // 0.1, 1 and 10 are equally far apart; tenths of a pixel are rounded.
        assert!((b - a - (c - b)).abs() <= 2.0 && b > a + 1000.0, "{dots:?}");
        assert!(text.contains("a &lt; b"));
        forest_svg(&Forest::default()).unwrap();
    }
}

mod labelled {
    use gonio::report::{Mark, Panel, Series, labelled};

    #[test]
    fn every_line_has_its_name() {
        let series = |name: &str, color, last| Series {
            name: name.into(),
            color,
            mark: Mark::Line,
            points: vec![(1.0, Some(2.0)), (3.0, last)],
        };
        let panel = Panel {
            series: vec![
                series("one", 0, Some(1.0)),
                series("two", 1, None),
                series("<three>", 2, Some(1.0)),
            ],
            ..Panel::default()
        };
        let text = labelled(&panel).unwrap();
        for name in ["\none\n", "\ntwo\n", "\n&lt;three&gt;\n"] {
            assert_eq!(text.matches(name).count(), 1, "{name}");
        }
        // A line without a name has none, and nothing leads there.
        let paths = |name: &str| {
            let panel = Panel {
                series: vec![series(name, 0, Some(1.0))],
                ..Panel::default()
            };
            labelled(&panel).unwrap().matches("<path").count()
        };
        assert_eq!(paths("one"), paths("") + 1);
        // The one above 1 keeps clear of axes alone.
        assert!(labelled(&Panel::default()).unwrap().contains("no data"));
    }
}
