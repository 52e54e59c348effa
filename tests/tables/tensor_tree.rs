//! Tensor trees of Radiance: the text that is written, read by a reader of its own, against the BRDF that it was made of.

use super::{high_pairs, nrmse};
use crate::common::{made, material, member, near, present, product, refused_edits};
use glam::{DMat3, DVec3};
use gonio::brdf::measured::TableError;
use gonio::brdf::measured::tensor_tree::{self, MERGED, Node, TensorTree, disk, write_tensor_tree};
use gonio::brdf::{self, Brdf, Channels};
use gonio::geometry::{Direction, DirectionPair};
use gonio::sampling::Random;
use std::f64::consts::{FRAC_PI_2, PI};

fn tabulate(brdf: &dyn Brdf, level: usize) -> Result<Vec<Node>, TableError> {
    Ok(tensor_tree::tabulate(brdf, level)?.0)
}

/// A tree as the source of Radiance describes it: eight trees, or 8^k values of which the first axis runs slowest.
enum Tree {
    Grid(Vec<f64>),
    Parts(Vec<Tree>),
}

impl Tree {
    fn read(text: &mut &str) -> Tree {
        let eat = |text: &mut &str, c: char| {
            let rest = text.trim_start().strip_prefix(c)?;
            *text = rest;
            Some(())
        };
        eat(text, '{').expect("a brace");
        let mut parts = Vec::new();
        while text.trim_start().starts_with('{') {
            parts.push(Tree::read(text));
        }
        if parts.is_empty() {
            let end = text.find('}').unwrap();
            let numbers = text[..end].split_whitespace().map(|w| w.parse().unwrap());
            let numbers: Vec<f64> = numbers.collect();
            *text = &text[end + 1..];
            return Tree::Grid(numbers);
        }
        assert_eq!(parts.len(), 8);
        eat(text, '}').expect("a closing brace");
        Tree::Parts(parts)
    }

    fn at(&self, place: [f64; 3]) -> f64 {
        match self {
            Tree::Grid(values) => {
                let side = (values.len() as f64).cbrt().round() as usize;
                assert!(side.is_power_of_two() && side.pow(3) == values.len());
                let cell = |x: f64| (x * side as f64) as usize;
                values[place.iter().fold(0, |n, &x| n * side + cell(x))]
            }
            Tree::Parts(parts) => {
                let upper = place.map(|x| usize::from(x >= 0.5));
                let part = upper[0] + 2 * upper[1] + 4 * upper[2];
                parts[part].at(std::array::from_fn(|k| 2.0 * place[k] - upper[k] as f64))
            }
        }
    }
}

/// The trees of a text, by the names of their blocks.
fn trees(text: &str) -> Vec<(String, Tree)> {
    let blocks = text.split("<WavelengthData>").skip(1);
    let tree = |block: &str| {
        let between = |from: &str, to: &str| {
            let (_, rest) = block.split_once(from).unwrap();
            rest.split_once(to).unwrap().0.to_owned()
        };
        let mut numbers = &*between("<ScatteringData>", "</ScatteringData>");
        let tree = Tree::read(&mut numbers);
        assert!(numbers.trim().is_empty());
        (between("<Wavelength unit=\"Integral\">", "<"), tree)
    };
    blocks.map(tree).collect()
}

fn text(brdf: &dyn Brdf, level: usize) -> String {
    let mut text = Vec::new();
    write_tensor_tree(&tabulate(brdf, level).unwrap(), &mut text).unwrap();
    String::from_utf8(text).unwrap()
}

/// The point of the unit square of a point of the disk, by bisection of its rings.
fn square(x: f64, y: f64) -> [f64; 2] {
    let radius = x.hypot(y);
    // The side of the ring, and the share of it that was walked.
    let turn = y.atan2(x).rem_euclid(2.0 * PI) / FRAC_PI_2;
    let (side, along) = match turn + 0.5 {
        t if t >= 4.0 => (0, t - 4.5),
        t => (t as usize, t.fract() - 0.5),
    };
    let along = 2.0 * radius * along;
    let [a, b] = match side {
        0 => [radius, along],
        1 => [-along, radius],
        2 => [-radius, -along],
        _ => [along, -radius],
    };
    [(a + 1.0) / 2.0, (b + 1.0) / 2.0]
}

/// The place of a pair, by turning the light to azimuth π.
fn place(pair: &DirectionPair) -> [f64; 3] {
    let turn = PI - pair.omega_i.phi();
    let sensor = Direction::from_spherical(pair.omega_o.theta(), pair.omega_o.phi() + turn);
    let [s, t] = square(sensor.vector().x, sensor.vector().y);
    [0.5 - 0.5 * pair.omega_i.sin_theta(), s, t]
}

#[test]
fn the_disk_is_mapped_and_keeps_areas() {
    let random = Random::new(5);
    for i in 0..2000 {
        let p: [f64; 2] = random.point(i);
        let [x, y] = disk(p);
        assert!(x.hypot(y) <= 1.0 + 1e-15);
        let back = square(x, y);
        let found = (back[0] - p[0]).abs() + (back[1] - p[1]).abs();
        near(found, 0.0, 1e-12, p);
        // π times the area, by differences, away from the diagonals.
        if (p[0] - p[1]).abs().min((p[0] + p[1] - 1.0).abs()) > 1e-3 {
            let d = 1e-6;
            let [u, v] = [disk([p[0] + d, p[1]]), disk([p[0], p[1] + d])];
            let area = (u[0] - x) * (v[1] - y) - (u[1] - y) * (v[0] - x);
            near(area / (d * d) / PI, 1.0, 1e-4, p);
        }
    }
}

/// A GGX of roughness .3 at 2⁷: at most .025, in less than half of the 10 MB of a full grid.
#[test]
fn a_tree_has_the_values_and_few_leaves() {
    let ggx = material("ggx", "alpha = 0.3", Channels::Luminance);
    let pairs = high_pairs(20_000);
    let mut errors = Vec::new();
    for level in [6, 7] {
        let text = text(&*ggx, level);
        let [(name, tree)] = &trees(&text)[..] else {
            panic!("one block");
        };
        assert_eq!(name, "Visible");
        let truth = |pair: &DirectionPair| ggx.luminance(pair).unwrap();
        let values = |p: &DirectionPair| [truth(p), tree.at(place(p))].map(|v| [v]);
        errors.push(nrmse(&pairs, values));
        let ours = TensorTree::read(&text, Channels::Luminance).unwrap();
        for pair in &pairs[..500] {
            // Pairs on the edge of a cell may be in the next one.
            let ratio = ours.luminance(pair).unwrap() / tree.at(place(pair));
            near(ratio, 1.0, 0.5, pair);
        }
        let is_same = |p: &&DirectionPair| ours.luminance(p) == Some(tree.at(place(p)));
        assert!(pairs[..500].iter().filter(is_same).count() > 495);
        assert!(level < 7 || text.len() < 4_500_000, "{} bytes", text.len());
    }
    let [coarse, fine] = errors[..] else { panic!() };
    assert!(fine < 0.025 && fine < 0.7 * coarse, "{coarse} {fine}");
}

/// Merging keeps means: the mean over the disk, which is albedo / π, is that of the midpoints.
#[test]
fn merging_adds_what_it_says_and_no_energy() {
    let (level, cells) = (5, 32);
    let ggx = material("ggx", "alpha = 0.2", Channels::Luminance);
    let nodes = tabulate(&*ggx, level).unwrap();
    assert!(nodes[0].leaves() < cells * cells * cells / 2);
    let ([mut error, mut square], mut means) = ([0.0; 2], [0.0; 2]);
    for (x, (s, t)) in product(0..cells / 2, product(0..cells, 0..cells)) {
        let place = [x, s, t].map(|k| (k as f64 + 0.5) / cells as f64);
        let [a, b] = disk([place[1], place[2]]);
        let light = Direction::from_spherical((1.0 - 2.0 * place[0]).asin(), PI);
        let sensor = Direction::from_spherical(a.hypot(b).asin(), b.atan2(a));
        let truth = ggx.luminance(&DirectionPair::new(light, sensor)).unwrap();
        let held = nodes[0].value_at(place);
        let weight = light.sin_theta() * light.cos_theta().powi(2);
        error += weight * (held - truth).powi(2);
        square += weight * truth * truth;
        means = [means[0] + held, means[1] + truth];
    }
    let error = (error / square).sqrt();
    assert!(error <= MERGED, "{error}");
    near(means[0] / means[1], 1.0, 1e-9, means);
}

/// R, G, B come back of luminance and chromaticity as Radiance shows them: by its primaries, found here of their
/// chromaticities.
#[test]
fn colours_are_those_of_radiance() {
    let red = material("lambert", "albedo = [0.6, 0.3, 0.1]", Channels::Rgb);
    let text = text(&*red, 4);
    let trees = trees(&text);
    let names: Vec<&str> = trees.iter().map(|(name, _)| &**name).collect();
    assert_eq!(names, ["Visible", "CIE-u", "CIE-v"]);
    let [y, u, v] = [0, 1, 2].map(|k| trees[k].1.at([0.2, 0.3, 0.4]));
    let xyz = y * DVec3::new(9.0 * u, 4.0 * v, 12.0 - 3.0 * u - 20.0 * v) / (4.0 * v);
    let primaries = [[0.64, 0.33], [0.29, 0.60], [0.15, 0.06]];
    let primaries = primaries.map(|[x, y]| DVec3::new(x, y, 1.0 - x - y));
    let [r, g, b] = primaries;
    let scales = DMat3::from_cols(r, g, b).inverse() * DVec3::ONE;
    let shown = DMat3::from_cols(r * scales.x, g * scales.y, b * scales.z).inverse() * xyz;
    let ours = TensorTree::read(&text, Channels::Rgb).unwrap();
    let rgb = present(&ours, &DirectionPair::from_spherical(0.3, 0.1, 0.7, 2.0));
    for (c, want) in [0.6, 0.3, 0.1].into_iter().enumerate() {
        near(shown.to_array()[c] * PI, want, 1e-3, c);
        near(rgb[c] * PI, want, 1e-3, c);
    }
    // Where the least luminance is above .01 / π Radiance spoils colours: here it is 0, in two cells of 2¹¹.
    let cells = |count: f64| (0..16).map(move |i| (i as f64 + 0.5) / count);
    let places = product(cells(32.0), product(cells(16.0), cells(16.0)));
    let places = places.into_iter().map(|(x, (s, t))| [x, s, t]);
    // Light and sensor at azimuth π, at the horizon.
    let black: Vec<_> = places.filter(|p| trees[0].1.at(*p) == 0.0).collect();
    assert_eq!(black.len(), 2 * 2, "{black:?}");
    let is_there = |[x, s, t]: &[f64; 3]| x.max(*s).max((t - 0.5).abs()) < 1.0 / 16.0;
    assert!(black.iter().all(is_there), "{black:?}");
}

/// A BRDF that ends at an elevation of the light has data beyond where light and sensor are exchanged: a tree is as near to it there
/// as if it did not end, and nearer the deeper it is.
#[test]
fn reciprocity_fills_holes() {
    let ggx = material("ggx", "alpha = 0.3", Channels::Luminance);
    let ends = made(ggx.symmetry(), |pair| {
        (pair.omega_i.theta() < 1.0).then(|| [ggx.luminance(pair).unwrap()])
    });
    let mut pairs = high_pairs(20_000);
    pairs.retain(|p| p.omega_i.theta() > 1.05 && p.omega_o.theta() < 0.9);
    assert!(pairs.len() > 500);
    let mut last = f64::INFINITY;
    for level in [4, 5, 6] {
        // Root mean square of the logarithm of the ratio.
        let [filled, whole] = [&ends, &*ggx].map(|brdf: &dyn Brdf| {
            let tree = tabulate(brdf, level).unwrap();
            let ratio = |p| tree[0].value_at(place(p)) / ggx.luminance(p).unwrap();
            let squares = pairs.iter().map(|p| ratio(p).ln().powi(2));
            (squares.sum::<f64>() / pairs.len() as f64).sqrt()
        });
        let is_as_near = filled < 1.05 * whole && filled < 0.75 * last;
        assert!(is_as_near, "2^{level}: {filled} {whole}, before {last}");
        last = filled;
    }
}

/// Four lights × sensors by hand; the other half of the first axis is not read.
#[test]
fn what_stands_for_no_reading_is_none() {
    let text = |values: [&str; 4]| {
        let zero = Node::Parts(Box::new(std::array::from_fn(|_| Node::Leaf(0.0))));
        let mut text = Vec::new();
        write_tensor_tree(&[zero], &mut text).unwrap();
        let values = format!("{{{} 0 0 0 0}}", values.join(" "));
        (String::from_utf8(text).unwrap()).replace("{0 0 0 0 0 0 0 0}", &values)
    };
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.xml");
    let spec = member(brdf::all(), "tensor-tree", &format!("path = {path:?}"));
    std::fs::write(&path, text(["0.5", "-999", "n.a.", "-0.01"])).unwrap();
    assert_eq!(spec.widest_channels().unwrap(), Channels::Luminance);
    let table = spec.build(Channels::Luminance).unwrap();
    let marks = "taken for no reading: -999 in 1 cell, n.a. in 1 cell";
    assert_eq!(table.remarks(), [marks, "1 value is below 0: taken as 0"]);
    assert_eq!(table.cells_without_reading(), 2);
    // Which quarter a sensor is in is found by the map of the other tests.
    let mut seen = std::collections::BTreeSet::new();
    for pair in high_pairs(200) {
        let [_, s, t] = place(&pair);
        let quarter = 2 * usize::from(s >= 0.5) + usize::from(t >= 0.5);
        seen.insert(quarter);
        let want = [Some(0.5), None, None, Some(0.0)][quarter];
        assert_eq!(table.luminance(&pair), want);
    }
    assert_eq!(seen.len(), 4);
    let none = text(["-"; 4]).replace(" 0 0 0 0}", " - - - -}");
    let refusal = TensorTree::read(&none, Channels::Luminance).unwrap_err();
    assert_eq!(refusal.to_string(), "no cell of this tree holds a reading");
}

#[test]
fn a_text_that_is_no_tree_is_refused() {
    let grey = material("lambert", "albedo = 0.5", Channels::Luminance);
    let whole = text(&*grey, 4);
    let block = whole.find("<WavelengthData>").unwrap()..whole.find("</Layer>").unwrap();
    let block = format!("{}</Layer>", &whole[block]);
    refused_edits(
        &whole,
        "
        TensorTree3        | TensorTree4      | IncidentDataStructure TensorTree4: allowed is TensorTree3
        Reflection Back    | Reflection Front | no block of Visible with Reflection Back
        LBNL/Shirley-Chiu  | LBNL/Klems Full  | AngleBasis LBNL/Klems Full: allowed is LBNL/Shirley-Chiu
        {.1592}            | {.1592 1}        | line 20: 2 numbers: allowed are 1, 8, 64, …
        {.1592}            | {.1592           | allowed is }
        {.1592}            | {x}              | line 20: x: allowed is a number
        {.1592}            | {.1592}}         | } after the tree
        {.1592}            | {{{{{{{{{{{{{{{{{{{{{{{{{{{{{{ | deeper than 20 halvings
        </Layer>           | BLOCK            | a second block of Visible with Reflection Back
        ",
        |text| TensorTree::read(&text.replace("BLOCK", &block), Channels::Luminance),
    );
}
