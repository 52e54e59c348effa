//! Parts of a page: numbers, deflated and in base64, each in an element that no browser runs.

use crate::report::in_memory;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use flate2::Compression;
use flate2::write::DeflateEncoder;
use std::collections::BTreeMap;
use std::io::Write;
use std::sync::{Mutex, PoisonError};

/// Codes of values above 0.
const CODES: i64 = 65_534;

/// The first of them: 0 is no data, 1 a value of 0.
const FIRST: u16 = 2;

/// ln f between codes, at least: values err by half of it.
const STEP: f64 = 4e-4;

/// Parts by their names, so that they stand in one order whichever is there first.
#[derive(Debug, Default)]
pub(super) struct Parts(Mutex<BTreeMap<String, String>>);

impl Parts {
    /// Adds a part, and returns its name.
    pub fn add(&self, name: &str, bytes: &[u8]) -> String {
        let mut to = DeflateEncoder::new(Vec::new(), Compression::new(6));
        let packed = in_memory(to.write_all(bytes).and_then(|()| to.finish()));
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        all.insert(name.into(), STANDARD.encode(packed));
        name.into()
    }

    /// Adds numbers, as 32-bit floats.
    pub fn add_numbers(&self, name: &str, numbers: impl IntoIterator<Item = f64>) -> String {
        let bytes = numbers.into_iter().flat_map(|v| (v as f32).to_le_bytes());
        self.add(name, &bytes.collect::<Vec<u8>>())
    }

    /// Names and contents.
    pub fn into_all(self) -> BTreeMap<String, String> {
        self.0.into_inner().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Values as codes of their logarithms.
pub(super) struct Coded {
    /// ln f of the first code.
    pub low: f64,
    /// ln f from code to code.
    pub step: f64,
    codes: Vec<u16>,
}

impl Coded {
    /// Codes of values, f ≥ 0; NaN is no data, and a negative value counts as 0.
    pub fn new(values: &[f64]) -> Self {
        let above = || values.iter().copied().filter(|v| *v > 0.0);
        let least = above().fold(f64::INFINITY, f64::min);
        let most = above().fold(0.0, f64::max);
        let (low, high) = match least <= most {
            true => (least.ln(), most.ln()),
            false => (0.0, 0.0),
        };
        let step = STEP.max((high - low) / (CODES - 1) as f64);
        let code = |v: &f64| match *v {
            v if v.is_nan() => 0,
            v if v > 0.0 => FIRST + ((v.ln() - low) / step).round() as u16,
            _ => 1,
        };
        Self {
            low,
            step,
            codes: values.iter().map(code).collect(),
        }
    }

    /// Low bytes, then high bytes.
    pub fn bytes(&self) -> Vec<u8> {
        split(&self.codes)
    }

    /// The same of differences from the code before, of channels that lie behind each other: of all but the first channel less what
    /// the first differs by there. Values that are next to each other are alike, and so are channels.
    pub fn differences(&self, channels: usize) -> Vec<u8> {
        let cells = self.codes.len() / channels.max(1);
        let mut steps = vec![0; cells];
        let mut words = Vec::with_capacity(self.codes.len());
        for (channel, codes) in self.codes.chunks(cells.max(1)).enumerate() {
            let mut before = 0;
            for (cell, &code) in codes.iter().enumerate() {
                let Some(code) = code.checked_sub(FIRST) else {
                    words.push(code);
                    continue;
                };
                let code = i64::from(code);
                let step = code - before;
                before = code;
                let rest = match channel {
                    0 => step,
                    _ => step - steps[cell],
                };
                if channel == 0 {
                    steps[cell] = step;
                }
                // In [−CODES/2, CODES/2), then 0, −1, 1, −2, … as 0, 1, 2, 3, …
                let rest = (rest + CODES / 2).rem_euclid(CODES) - CODES / 2;
                let folded = (rest << 1) ^ (rest >> 63);
                words.push(FIRST + folded as u16);
            }
        }
        split(&words)
    }
}

/// Low bytes, then high bytes.
fn split(words: &[u16]) -> Vec<u8> {
    let low = words.iter().map(|w| w.to_le_bytes()[0]);
    let high = words.iter().map(|w| w.to_le_bytes()[1]);
    low.chain(high).collect()
}
