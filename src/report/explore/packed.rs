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
    /// Adds a part.
    fn add(&self, name: &str, bytes: &[u8]) {
        let mut to = DeflateEncoder::new(Vec::new(), Compression::new(6));
        let packed = in_memory(to.write_all(bytes).and_then(|()| to.finish()));
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        all.insert(name.into(), STANDARD.encode(packed));
    }

    /// Adds numbers, as 32-bit floats.
    pub fn add_numbers(&self, name: &str, numbers: impl IntoIterator<Item = f64>) {
        let bytes = numbers.into_iter().flat_map(|v| (v as f32).to_le_bytes());
        self.add(name, &bytes.collect::<Vec<u8>>());
    }

    /// Adds values f ≥ 0 of channels that lie behind each other, as codes of their logarithms; NaN is no data, and a negative value
    /// counts as 0. Returns ln f of the first code, and from code to code.
    pub fn add_values(&self, name: &str, values: &[f64], channels: usize) -> [f64; 2] {
        let above = || values.iter().copied().filter(|v| *v > 0.0);
        let [least, most] = [
            above().fold(f64::INFINITY, f64::min),
            above().fold(0.0, f64::max),
        ];
        let ends = if least <= most {
            [least, most]
        } else {
            [1.0; 2]
        };
        let [low, high] = ends.map(f64::ln);
        let step = STEP.max((high - low) / (CODES - 1) as f64);
        let code = |v: &f64| match *v {
            v if v.is_nan() => 0,
            v if v > 0.0 => FIRST + ((v.ln() - low) / step).round() as u16,
            _ => 1,
        };
        let codes: Vec<u16> = values.iter().map(code).collect();
        let words = differences(&codes, values.len() / channels.max(1));
        let bytes = [0, 1].map(|part| words.iter().map(move |w| w.to_le_bytes()[part]));
        self.add(name, &bytes.into_iter().flatten().collect::<Vec<u8>>());
        [low, step]
    }

    /// Names and contents.
    pub fn into_all(self) -> BTreeMap<String, String> {
        self.0.into_inner().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Differences from the code before; of all but the first channel less what the first differs by there. Values that are next to each
/// other are alike, and so are channels.
fn differences(codes: &[u16], cells: usize) -> Vec<u16> {
    let mut steps = vec![0; cells];
    let mut words = Vec::with_capacity(codes.len());
    for (channel, codes) in codes.chunks(cells.max(1)).enumerate() {
        let mut before = 0;
        for (first, &code) in steps.iter_mut().zip(codes) {
            let Some(code) = code.checked_sub(FIRST).map(i64::from) else {
                words.push(code);
                continue;
            };
            let step = code - before;
            before = code;
            let rest = if channel == 0 { step } else { step - *first };
            if channel == 0 {
                *first = step;
            }
            // In [−CODES/2, CODES/2), then 0, −1, 1, −2, … as 0, 1, 2, 3, …
            let rest = (rest + CODES / 2).rem_euclid(CODES) - CODES / 2;
            let folded = (rest << 1) ^ (rest >> 63);
            words.push(FIRST + folded as u16);
        }
    }
    words
}
