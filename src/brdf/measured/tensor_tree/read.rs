//! The XML of a tensor tree.
//!
//! What is read is what Radiance takes for reflection above the surface: the blocks `Reflection Back`. `Visible` has the
//! luminance, `CIE-u` and `CIE-v` may give it a colour; other blocks are passed over. What
//! stands for no reading is one ([`crate::brdf::Marks`]): a text in place of a value, or a number as -999 far outside all others; values below 0
//! count as 0.

use super::{Node, TensorTree, UNSEEN, WAVELENGTHS};
use crate::brdf::Channels;
use crate::brdf::marks::{Marks, is_mark, is_mark_number};
use crate::brdf::measured::TableError;
use crate::brdf::measured::doubts::Doubts;
use crate::error::excerpt;
use crate::files;
use crate::numeric::LARGEST_READING;
use std::path::Path;

/// Deepest tree: cells of 2⁻²⁰ are far below the resolution of any measurement.
const DEEPEST: usize = 20;

/// Names of the blocks, luminance first.
pub(super) const BLOCKS: [&str; 3] = ["Visible", "CIE-u", "CIE-v"];

/// Reads a file.
pub(crate) fn text(path: &Path) -> Result<String, TableError> {
    let text = files::read_foreign_text(path, files::TABLE_LIMIT);
    text.map_err(|e| TableError::Io("no access to this tensor tree", e))
}

/// Part of a text, within the whole.
#[derive(Clone, Copy)]
struct Part<'t> {
    whole: &'t str,
    from: usize,
    to: usize,
}

impl<'t> Part<'t> {
    fn text(self) -> &'t str {
        &self.whole[self.from..self.to]
    }

    /// What is between the tags of the first element of a name, and what is behind it.
    fn element(self, name: &str) -> Option<(Self, Self)> {
        let mut start = self.from;
        loop {
            let open = start + self.whole[start..self.to].find('<')? + 1;
            let close = open + self.whole[open..self.to].find('>')?;
            let tag = self.whole[open..close].split_whitespace().next();
            start = close + 1;
            if tag == Some(name) {
                let end = start + self.whole[start..self.to].find(&format!("</{name}>"))?;
                let whole = self.whole;
                let [from, to] = [start, end];
                return Some((Self { whole, from, to }, Self { from: end, ..self }));
            }
        }
    }

    /// The trimmed text of an element.
    fn word(self, name: &str) -> Option<&'t str> {
        Some(self.element(name)?.0.text().trim())
    }

    /// An error about where it begins.
    fn refuse(self, message: String) -> TableError {
        let before = &self.whole.as_bytes()[..self.from];
        TableError::line(1 + before.iter().filter(|b| **b == b'\n').count(), message)
    }

    /// Leaves out what separates braces and numbers, and returns the next letter.
    fn peek(&mut self) -> Option<u8> {
        let is_between = |c: char| c.is_whitespace() || c == ',';
        let rest = self.text().trim_start_matches(is_between);
        self.from = self.to - rest.len();
        rest.bytes().next()
    }

    /// Takes a brace.
    fn brace(&mut self, brace: u8) -> Result<(), TableError> {
        if self.peek() == Some(brace) {
            self.from += 1;
            return Ok(());
        }
        let found = excerpt(self.text().split_whitespace().next().unwrap_or("the end"));
        Err(self.refuse(format!("{found}: allowed is {}", char::from(brace))))
    }

    /// The next number; NaN, which is counted, of a text that stands for no reading.
    fn number(&mut self, most: f64, texts: &mut Marks) -> Result<f64, TableError> {
        let is_end = |c: char| c.is_whitespace() || matches!(c, ',' | '{' | '}');
        let text = self.text();
        let word = &text[..text.find(is_end).unwrap_or(text.len())];
        if is_mark(word) {
            texts.see(word);
            self.from += word.len();
            return Ok(f64::NAN);
        }
        match word.parse::<f64>() {
            Ok(value) if value.abs() <= most || is_mark_number(value) => {
                self.from += word.len();
                Ok(value)
            }
            _ => {
                let word = excerpt(word);
                let message = format!("{word}: allowed is a number of at most {most:e}");
                Err(self.refuse(message))
            }
        }
    }

    /// A tree, `depth` above the deepest, of numbers up to `most`.
    fn tree(&mut self, depth: usize, most: f64, texts: &mut Marks) -> Result<Node, TableError> {
        self.brace(b'{')?;
        let start = *self;
        if self.peek() == Some(b'{') {
            if depth == 0 {
                return Err(start.refuse(format!("a tree deeper than {DEEPEST} halvings")));
            }
            let mut parts = Box::new([const { Node::Leaf(f64::NAN) }; 8]);
            for part in parts.iter_mut() {
                *part = self.tree(depth - 1, most, texts)?;
            }
            self.brace(b'}')?;
            return Ok(Node::Parts(parts));
        }
        let mut values = Vec::new();
        while !matches!(self.peek(), None | Some(b'{' | b'}')) {
            values.push(self.number(most, texts)?);
        }
        self.brace(b'}')?;
        let Some(halvings) = (0..=depth).find(|k| values.len() == 1 << (3 * k)) else {
            let message = format!("{} numbers: allowed are 1, 8, 64, …", values.len());
            return Err(start.refuse(message));
        };
        let side = 1 << halvings;
        Ok(grid(&values, side, side, [0; 3]))
    }
}

/// The tree of a cube of values, of which the last axis runs fastest.
fn grid(values: &[f64], side: usize, size: usize, corner: [usize; 3]) -> Node {
    if size == 1 {
        return Node::Leaf(values[(corner[0] * side + corner[1]) * side + corner[2]]);
    }
    let half = size / 2;
    Node::Parts(Box::new(std::array::from_fn(|part| {
        let corner = std::array::from_fn(|k| corner[k] + (part >> k & 1) * half);
        grid(values, side, half, corner)
    })))
}

/// The channels of the file, which is checked without its numbers.
pub fn check(text: &str) -> Result<Channels, TableError> {
    Ok(match blocks(text)? {
        [_, None, _] => Channels::Luminance,
        _ => Channels::Rgb,
    })
}

/// The numbers of the blocks that are there, luminance first.
fn blocks(text: &str) -> Result<[Option<Part<'_>>; 3], TableError> {
    let whole = Part {
        whole: text,
        from: 0,
        to: text.len(),
    };
    let structure = whole.word("IncidentDataStructure").unwrap_or("nothing");
    if structure != "TensorTree3" {
        let found = excerpt(structure);
        return Err(TableError::Malformed(format!(
            "IncidentDataStructure {found}: allowed is TensorTree3, of isotropic materials"
        )));
    }
    let mut found = [None; 3];
    let mut rest = whole;
    while let Some((data, behind)) = rest.element("WavelengthData") {
        rest = behind;
        let name = data.word("Wavelength");
        let Some(place) = BLOCKS.iter().position(|block| name == Some(*block)) else {
            continue;
        };
        let mut inner = data;
        while let Some((block, behind)) = inner.element("WavelengthDataBlock") {
            inner = behind;
            if block.word("WavelengthDataDirection") != Some("Reflection Back") {
                continue;
            }
            let basis = block.word("AngleBasis").unwrap_or("nothing");
            if basis != "LBNL/Shirley-Chiu" {
                let found = excerpt(basis);
                let message = format!("AngleBasis {found}: allowed is LBNL/Shirley-Chiu");
                return Err(block.refuse(message));
            }
            if found[place].is_some() {
                let message = format!("a second block of {} with Reflection Back", BLOCKS[place]);
                return Err(block.refuse(message));
            }
            found[place] = block.element("ScatteringData").map(|(numbers, _)| numbers);
        }
    }
    let end = Part {
        from: text.trim_end().len(),
        ..whole
    };
    if !text.trim_end().ends_with("</WindowElement>") {
        return Err(end.refuse("the text ends before </WindowElement>".into()));
    }
    match found {
        [Some(_), u, v] if u.is_some() == v.is_some() => Ok(found),
        [Some(_), ..] => {
            let message = "of CIE-u and CIE-v one is there; allowed: both, or none of grey";
            Err(end.refuse(message.into()))
        }
        [None, ..] => Err(TableError::Malformed("there is no block of Visible with Reflection Back, which Radiance has above the surface".into())),
    }
}

/// The luminances of the part that is looked up, but zeros where the writer here makes them.
fn doubted(luminance: &mut Node) -> Vec<f64> {
    let kept = UNSEEN.map(|place| *luminance.leaf(place));
    for (place, value) in UNSEEN.into_iter().zip(kept) {
        *luminance.leaf(place) = if value == 0.0 { f64::NAN } else { value };
    }
    let values = match luminance {
        Node::Leaf(value) => vec![*value],
        Node::Parts(parts) => parts.iter().step_by(2).flat_map(Node::values).collect(),
    };
    for (place, value) in UNSEEN.into_iter().zip(kept) {
        *luminance.leaf(place) = value;
    }
    values
}

impl TensorTree {
    /// Reads a text for a scene of luminance or R, G, B.
    pub fn read(text: &str, channels: Channels) -> Result<Self, TableError> {
        Self::read_without(text, channels, None)
    }

    /// Reads a text; `no_reading` is one more number that stands for no reading, of the luminance.
    pub(in crate::brdf::measured) fn read_without(
        text: &str,
        channels: Channels,
        no_reading: Option<f64>,
    ) -> Result<Self, TableError> {
        let blocks = blocks(text)?;
        let wanted = match channels {
            Channels::Luminance => 1,
            Channels::Rgb => 3,
            Channels::Wavelengths(_) => return Err(TableError::Channels(WAVELENGTHS)),
        };
        let mut trees = Vec::new();
        let mut doubts = Doubts::default();
        let most = [LARGEST_READING, 1.0, 1.0];
        let blocks = blocks.into_iter().zip(most).take(wanted);
        for (mut numbers, most) in blocks.filter_map(|(b, most)| Some((b?, most))) {
            let mut texts = Marks::default();
            let mut tree = numbers.tree(DEEPEST, most, &mut texts)?;
            let mut values = tree.values();
            let declared = no_reading.filter(|_| trees.is_empty());
            doubts.add(Doubts::take(&mut values, texts, declared));
            let is_unknown = values.iter().all(|v| v.is_nan());
            let mut values = values.into_iter();
            tree.for_each_leaf(&mut |leaf| *leaf = values.next().unwrap_or(f64::NAN));
            drop(values);
            if trees.is_empty() {
                doubts.look_for_zeros(doubted(&mut tree).into_iter());
            }
            // Of NaN and 0 the maximum would be 0.
            tree.for_each_leaf(&mut |leaf| *leaf = if *leaf < 0.0 { 0.0 } else { *leaf });
            if is_unknown {
                let message = "no cell of this tree holds a reading";
                return Err(TableError::NoData(message.into()));
            }
            trees.push(tree);
            if let Some(c) = numbers.peek() {
                let message = format!("{} after the tree", char::from(c));
                return Err(numbers.refuse(message));
            }
        }
        doubts.is_grey = trees.len() < wanted;
        Ok(Self {
            trees,
            channels,
            doubts,
        })
    }
}
