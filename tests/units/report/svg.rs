use crate::common::product;
use gonio::report::{
    Axis, Forest, ForestGroup, ForestLine, Mark, Panel, Scale, Series, forest_svg, labelled, svg,
};
use std::collections::BTreeSet;

fn panel(scale: Scale, series: Vec<Series>) -> Panel {
    let axis = |label: &str, scale| Axis {
        label: label.into(),
        scale,
        range: None,
    };
    Panel {
        title: "a < b & \"c\"".into(),
        x: axis("θ_o (°)", Scale::Linear),
        y: axis("value", scale),
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
    let text = svg("title", panels, 2);
    assert_eq!(text, svg("title", panels, 2));
    let mut open = Vec::new();
    for tag in text.split('<').skip(1) {
        let (tag, between) = tag.split_once('>').unwrap();
        assert!(!between.contains('&') || between.contains(';'));
        assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
        for text in [tag, between] {
            assert!(!text.contains("NaN") && !text.contains("inf"), "{text}");
        }
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

const ORANGE: &str = "#D55E00";

const MARKS: [Mark; 3] = [Mark::Line, Mark::Dashed, Mark::Points];

#[test]
fn every_series_with_data_is_seen() {
    let wave = |f: f64| (0..90).map(move |i| (f64::from(i), Some((f * f64::from(i)).sin().abs())));
    for (scale, mark) in product([Scale::Linear, Scale::Log], MARKS) {
        let [a, b] = [0.1, 0.2].map(|f| wave(f).collect::<Vec<_>>());
        let text = drawn(&[panel(scale, vec![series(0, mark, &a), series(1, mark, &b)])]);
        assert!(marks(&text, BLUE) >= 2 && marks(&text, ORANGE) >= 2);
    }
    let many = (0..40).map(|c| {
        let points: Vec<_> = wave(0.01 * c as f64 + 0.01).collect();
        series(c, Mark::Line, &points)
    });
    let text = drawn(&[panel(Scale::Linear, many.collect())]);
    for c in 0..40 {
        assert!(text.contains(&format!("\nseries {c}\n")));
    }
    let colors: BTreeSet<_> = text.split('#').skip(1).map(|part| &part[..6]).collect();
    // A line, its key, and marks on both.
    let is_line = |c: &&&str| (4..50).contains(&marks(&text, &format!("#{c}")));
    assert!(colors.iter().filter(is_line).count() >= 40);
}

#[test]
fn gaps_are_left_open() {
    let values = [1.0, 2.0, f64::INFINITY, 1.0, f64::NAN, 2.0, 3.0];
    let value = |v: f64| Some(v).filter(|v| !v.is_infinite());
    let points: Vec<_> = (0..7).map(|i| (i as f64, value(values[i]))).collect();
    let text = drawn(&[panel(Scale::Linear, vec![series(0, Mark::Line, &points)])]);
    // Two lines, a dot for the point on its own, the legend.
    assert_eq!(marks(&text, BLUE), 4);
}

#[test]
fn odd_data_is_drawn_without_complaint() {
    let constants = [0.0, 1.0, -1e-16, 1e-320, f64::MAX, -f64::MAX, 5e-324];
    let bumps = |value: &dyn Fn(i32) -> f64| -> Vec<(f64, Option<f64>)> {
        let points = (0..9).map(|i| (f64::from(i), Some(1e-16 * value(i))));
        points.collect()
    };
    let ends = [
        [Some(-f64::MAX), Some(f64::MAX)],
        [Some(5e-324), Some(f64::MAX)],
        [Some(0.11), Some(0.12)],
        [Some(f64::INFINITY), Some(f64::NEG_INFINITY)],
        [None, None],
    ];
    let mut odd: Vec<Vec<(f64, Option<f64>)>> = vec![
        vec![],
        vec![(45.0, Some(0.3))],
        vec![(f64::NAN, Some(1.0)), (f64::INFINITY, Some(1.0))],
        bumps(&|i| f64::from(i * i % 5 - 2)),
        bumps(&|i| 1e16 + f64::from(i)),
    ];
    odd.extend(ends.map(|[a, b]| vec![(0.0, a), (1.0, b)]));
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
    let looks = product(MARKS, [Scale::Linear, Scale::Log]);
    for ((mark, scale), (points, range)) in product(looks, product(&odd, ranges)) {
        let mut panel = panel(scale, vec![series(0, mark, points)]);
        panel.y.range = range;
        panel.x.range = range;
        drawn(&[panel.clone()]);
        panel.x.range = None;
        panel.x.scale = scale;
        drawn(&[panel]);
    }
    assert!(drawn(&[panel(Scale::Log, vec![])]).contains("no data"));
    drawn(&[]);
    svg("", &[], 0);
}

#[test]
fn what_leaves_the_range_is_cut_off() {
    let points = [(0.0, 0.5), (1.0, 1e9), (2.0, 0.5), (3.0, -4.0)].map(|(x, y)| (x, Some(y)));
    let mut panel = panel(Scale::Linear, vec![series(0, Mark::Line, &points)]);
    panel.y.range = Some([0.0, 1.0]);
    let text = drawn(&[panel]);
    let line = |t: &&str| t.starts_with("path") && t.contains(BLUE);
    let mut count = 0;
    for tag in text.split('<').filter(line) {
        let steps = tag.split(" d=\"").nth(1).unwrap();
        for part in steps.split('"').next().unwrap().split('M').skip(1) {
            let [mut x, mut y] = [0, 0];
            let steps = part.replace('-', " -").replace('l', " ");
            for step in steps.split_whitespace().collect::<Vec<_>>().chunks(2) {
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
fn rounding_has_no_axis_of_its_own() {
    let text = |size: f64| {
        let wave = [0, 1, 2, 3, 4, 5, 6, 7, 8].map(f64::from);
        let wave = wave.map(|x| (x, Some(size * x.sin())));
        drawn(&[panel(Scale::Linear, vec![series(0, Mark::Line, &wave)])])
    };
    let [small, rounding] = [1e-9, 1e-17].map(text);
    assert!(small.contains("·10⁻") && !rounding.contains("·10⁻"));
    assert!(rounding.contains("\n1.0\n") && rounding.contains("\n−1.0\n"));
}

#[test]
fn lines_of_one_panel_have_marks_of_their_own() {
    let points = (0..40).map(|i| (f64::from(i), Some(f64::from(i))));
    let points: Vec<_> = points.collect();
    let two = [0, 1].map(|c| series(c, Mark::Line, &points)).to_vec();
    let [one, two] = [two[..1].to_vec(), two].map(|s| drawn(&[panel(Scale::Linear, s)]));
    // Circles on the first, squares on the second, at a few of its points, and in the legend.
    for shape in ["<circle", "z\"/>"] {
        let count = two.matches(shape).count();
        assert!((4..15).contains(&count), "{shape}: {count}");
    }
    assert!(!one.contains("<circle"));
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

#[test]
fn a_ratio_lies_where_its_axis_says() {
    let line = |ratio: f64, interval| ForestLine {
        name: format!("{ratio}"),
        ratio,
        interval,
        note: "a < b".into(),
    };
    let interval = Some([0.5, 2.0]);
    let forest = Forest {
        label: "ratio".into(),
        band: 1.01,
        groups: vec![ForestGroup {
            name: "one".into(),
            color: 0,
            mark: Mark::Line,
            lines: vec![line(0.1, None), line(1.0, interval), line(10.0, None)],
        }],
    };
    let text = forest_svg(&forest);
    let dots = text.split("<circle cx=\"").skip(1);
    let dots = dots.map(|t| t.split('"').next().unwrap().parse().unwrap());
    let dots: Vec<f64> = dots.collect();
    let [a, b, c] = dots[..].try_into().unwrap();
    // 0.1, 1 and 10 are equally far apart; tenths of a pixel are rounded.
    assert!((b - a - (c - b)).abs() <= 2.0 && b > a + 1000.0, "{dots:?}");
    assert!(text.contains("a &lt; b"));
    forest_svg(&Forest::default());
}

#[test]
fn every_line_has_its_name() {
    let labelled = |names: &[(&str, Option<f64>)]| {
        let line = |(c, (name, last)): (usize, &(&str, Option<f64>))| Series {
            name: (*name).into(),
            ..series(c, Mark::Line, &[(1.0, Some(2.0)), (3.0, *last)])
        };
        let panel = Panel {
            series: names.iter().enumerate().map(line).collect(),
            ..Panel::default()
        };
        labelled(&panel)
    };
    let text = labelled(&[("one", Some(1.0)), ("two", None), ("<three>", Some(1.0))]);
    for name in ["\none\n", "\ntwo\n", "\n&lt;three&gt;\n"] {
        assert_eq!(text.matches(name).count(), 1, "{name}");
    }
    // A line without a name has none, and nothing leads there.
    let paths = |name: &str| labelled(&[(name, Some(1.0))]).matches("<path").count();
    assert_eq!(paths("one"), paths("") + 1);
    // The one above 1 keeps clear of axes alone.
    assert!(labelled(&[]).contains("no data"));
}
