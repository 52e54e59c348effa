use gonio::analysis::{Cell, Shares};

fn cells(n: [usize; 2], keep: impl Fn(f64, f64) -> bool, f: impl Fn(f64, f64) -> f64) -> Vec<Cell> {
    let mut cells = Vec::new();
    for i in 0..n[0] {
        for j in 0..n[1] {
            let [x, y] = [(i, n[0]), (j, n[1])].map(|(i, n)| (i as f64 + 0.5) / n as f64);
            if keep(x, y) {
                cells.push(Cell {
                    place: [i, j],
                    weight: 1.0 + x,
                    value: f(x, y),
                });
            }
        }
    }
    cells
}

#[test]
fn sums_are_additive_on_any_domain() {
    // A triangle, and two parts that share no line.
    let triangle = |x: f64, y: f64| x + y < 1.0;
    let apart = |x: f64, y: f64| (x < 0.4) == (y < 0.4);
    for keep in [&triangle as &dyn Fn(f64, f64) -> bool, &apart] {
        let f = |x: f64, y: f64| x.exp() - 3.0 * y * y;
        let shares = Shares::of([30, 20], &cells([30, 20], keep, f)).unwrap();
        assert!((shares.additive - 1.0).abs() < 1e-12, "{shares:?}");
        assert!((shares.both - 1.0).abs() < 1e-12);
        assert!(shares.axis.iter().all(|s| *s > 0.01 && *s < 0.99));
    }
}

#[test]
fn one_axis_explains_its_own_functions() {
    let triangle = |x: f64, y: f64| x + y < 1.0;
    let n = [25, 40];
    let along_y = Shares::of(n, &cells(n, triangle, |_, y| y.cos())).unwrap();
    assert!((along_y.axis[1] - 1.0).abs() < 1e-13 && along_y.axis[0] < 0.5);
    let along_x = Shares::of(n, &cells(n, triangle, |x, _| x * x)).unwrap();
    assert!((along_x.axis[0] - 1.0).abs() < 1e-13 && along_x.axis[1] < 0.5);
}

#[test]
fn a_product_on_a_box_has_the_shares_of_its_factors() {
    // v = x y with independent x and y of mean m and variance s: Var = m²s_y + m²s_x + s_x s_y.
    let n = [20, 20];
    let mut all = cells(n, |_, _| true, |x, y| x * y);
    all.iter_mut().for_each(|c| c.weight = 1.0);
    let (m, s) = (0.5, (400.0 - 1.0) / 400.0 / 12.0);
    let variance = 2.0 * m * m * s + s * s;
    let shares = Shares::of(n, &all).unwrap();
    for share in shares.axis {
        assert!((share - m * m * s / variance).abs() < 1e-13, "{share}");
    }
    assert!((shares.additive - 2.0 * m * m * s / variance).abs() < 1e-12);
}

#[test]
fn constants_have_no_shares() {
    for value in [0.0, 0.1, 1e300, 1e-300] {
        let n = [9, 7];
        assert_eq!(
            Shares::of(n, &cells(n, |_, _| true, |_, _| value)),
            None,
            "{value}"
        );
    }
    assert_eq!(Shares::of([3, 3], &[]), None);
}
