//! Gauss–Legendre quadrature, the rule of the `gauss-quad` crate for any number of nodes, and a
//! Gauss–Kronrod pair.
//!
//! ∫₋₁¹ p(x) dx = Σ w_j p(x_j), exact for polynomials of degree below 2n.

use gauss_quad::GaussLegendre;

/// The `n` nodes (ascending, inside (−1, 1)) and weights (summing to 2) on [−1, 1].
///
/// ```
/// let rule = gonio::sampling::gauss_legendre(5);
/// let integral: f64 = rule.iter().map(|(x, w)| w * x.powi(8)).sum();
/// assert!((integral - 2.0 / 9.0).abs() < 1e-14);
/// ```
pub fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    match GaussLegendre::new(n) {
        Ok(rule) => {
            let mut pairs = rule.into_node_weight_pairs();
            pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
            pairs
        }
        // The crate has no rule of a single node: the midpoint rule is it.
        Err(_) if n == 1 => vec![(0.0, 2.0)],
        Err(_) => Vec::new(),
    }
}

/// The Gauss–Kronrod pair of 7 and 15 nodes on [−1, 1] (Kronrod 1965; digits of QUADPACK, Piessens
/// et al. 1983): node (ascending), weight of the 15, weight of the 7 (0 where it has no node). Exact
/// to degrees 22 and 13; the difference of both sums is the error of the 7.
pub const GAUSS_KRONROD: [[f64; 3]; 15] = mirrored(&OUTER_HALF);

/// Both parts of ranges of two axes that are cut at a place of one of them.
pub(crate) fn cut(range: [[f64; 2]; 2], axis: usize, at: f64) -> [[[f64; 2]; 2]; 2] {
    let [mut below, mut above] = [range; 2];
    (below[axis][1], above[axis][0]) = (at, at);
    [below, above]
}

/// Share of the largest error of a cell above which a cell is halved.
const WORST: f64 = 0.25;

/// Halves the cells that err most, each along the axis that it errs along most, and appends their upper parts; their number.
/// `errors` are those of each cell along either axis, and `halves` are both parts of a cell along one.
pub(crate) fn halve_worst<C>(
    cells: &mut Vec<C>,
    errors: &[[f64; 2]],
    mut halves: impl FnMut(&C, usize) -> [C; 2],
) -> usize {
    let before = cells.len();
    let largest = errors.iter().map(|e| e[0] + e[1]).fold(0.0, f64::max);
    for (i, [first, second]) in errors.iter().enumerate() {
        if first + second > WORST * largest {
            let [below, above] = halves(&cells[i], usize::from(second > first));
            cells[i] = below;
            cells.push(above);
        }
    }
    cells.len() - before
}

/// A rule that is the same on either side of its middle, from its nodes outside of it and the middle.
pub(crate) const fn mirrored<const N: usize>(outer_half: &[[f64; 3]]) -> [[f64; 3]; N] {
    let mut rule = [[0.0; 3]; N];
    let mut i = 0;
    while i < outer_half.len() {
        let [x, kronrod, gauss] = outer_half[i];
        rule[i] = [-x, kronrod, gauss];
        rule[N - 1 - i] = [x, kronrod, gauss];
        i += 1;
    }
    rule
}

/// Nodes and weights from the outermost node to the middle.
const OUTER_HALF: [[f64; 3]; 8] = [
    [0.991_455_371_120_812_6, 0.022_935_322_010_529_224, 0.0],
    [
        0.949_107_912_342_758_5,
        0.063_092_092_629_978_56,
        0.129_484_966_168_869_7,
    ],
    [0.864_864_423_359_769_1, 0.104_790_010_322_250_19, 0.0],
    [
        0.741_531_185_599_394_4,
        0.140_653_259_715_525_92,
        0.279_705_391_489_276_64,
    ],
    [0.586_087_235_467_691_1, 0.169_004_726_639_267_9, 0.0],
    [
        0.405_845_151_377_397_2,
        0.190_350_578_064_785_4,
        0.381_830_050_505_118_9,
    ],
    [0.207_784_955_007_898_47, 0.204_432_940_075_298_9, 0.0],
    [0.0, 0.209_482_141_084_727_82, 0.417_959_183_673_469_4],
];
