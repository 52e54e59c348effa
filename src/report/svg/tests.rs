use super::svg;
use crate::report::{Axis, Mark, Panel, Scale, Series};

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

const ORANGE: &str = "#D55E00";

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
    for c in 0..40 {
        assert!(text.contains(&format!("\nseries {c}\n")));
        let [r, g, b] = crate::report::svg::plot::palette(c, 40);
        assert_eq!(marks(&text, &format!("#{r:02X}{g:02X}{b:02X}")), 2, "{c}");
    }
}

#[test]
fn greek_letters_have_indices_and_names_keep_their_underscores() {
    let text = |text: &str| {
        super::Canvas::draw([50.0, 20.0], |canvas| {
            let how = super::Lettering::new(10.0, super::Align::Start);
            canvas.text([0.0, 10.0], text, how);
            Ok(())
        })
        .unwrap()
    };
    let symbols = text("cos θ_i cos θ_o = 1");
    for index in ["i", "o"] {
        assert!(symbols.contains(&format!("font-size=\"70%\">{index}</tspan>")));
    }
    assert!(symbols.contains("> cos θ<") && symbols.contains("> = 1"));
    assert!(!symbols.contains('_'));
    for plain in ["theta_h_deg", "a_b θ _c", "_"] {
        assert!(text(plain).contains(plain), "{plain}");
    }
}

#[test]
fn parametrizations_differ_in_colour_for_every_eye() {
    /// What the colour-blind see of linear R, G, B (Machado, Oliveira and Fernandes 2009): all, no
    /// green, no red, no blue.
    const EYES: [[[f64; 3]; 3]; 4] = [
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        [
            [0.367_322, 0.860_646, -0.227_968],
            [0.280_085, 0.672_501, 0.047_413],
            [-0.011_820, 0.042_940, 0.968_881],
        ],
        [
            [0.152_286, 1.052_583, -0.204_868],
            [0.114_503, 0.786_281, 0.099_216],
            [-0.003_882, -0.048_116, 1.051_998],
        ],
        [
            [1.255_528, -0.076_749, -0.178_779],
            [-0.078_411, 0.930_809, 0.147_602],
            [0.004_733, 0.691_367, 0.303_900],
        ],
    ];
    let dot = |row: &[f64; 3], c: [f64; 3]| row.iter().zip(c).map(|(a, b)| a * b).sum::<f64>();
    let lab = |eye: &[[f64; 3]; 3], color: [u8; 3]| {
        let linear = color.map(|v| (f64::from(v) / 255.0).powf(2.2));
        let [r, g, b] = [0, 1, 2].map(|i| dot(&eye[i], linear).clamp(0.0, 1.0));
        let x = dot(&[0.4339, 0.3762, 0.1899], [r, g, b]);
        let y = dot(&[0.2126, 0.7152, 0.0722], [r, g, b]);
        let z = dot(&[0.0177, 0.1095, 0.8728], [r, g, b]);
        let [x, y, z] = [x, y, z].map(f64::cbrt);
        [116.0 * y, 500.0 * (x - y), 200.0 * (y - z)]
    };
    let all = crate::parametrization::all();
    let colors: Vec<[u8; 3]> = all
        .iter()
        .map(|e| super::palette(super::plot::color_of(e.kind), 0))
        .collect();
    for eye in &EYES {
        for (i, a) in colors.iter().enumerate() {
            for b in &colors[..i] {
                let [p, q] = [a, b].map(|c| lab(eye, *c));
                let far = p.iter().zip(q).map(|(p, q)| (p - q).powi(2)).sum::<f64>();
                // A just noticeable difference is about 2.
                assert!(far.sqrt() > 12.0, "{a:?} {b:?} {far}");
            }
        }
    }
}
