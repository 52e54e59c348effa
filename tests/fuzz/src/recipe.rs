//! Files that are nearly right: a seed and what is done to it. An input that begins with [`MARK`] is such a recipe, in
//! bytes that a fuzzer may turn as it likes; every other input is a file as it is.

use arbitrary::{Arbitrary, Unstructured};

/// First byte of a recipe: no file that is read begins so.
pub const MARK: u8 = 1;

/// Most bytes of a file that edits may make of a small one.
const MOST: usize = 1 << 20;

/// Bytes of a file that may be its header.
const HEADER: u16 = 1024;

/// A file to be made.
#[derive(Arbitrary, Debug)]
struct Recipe {
    seed: u8,
    /// Makes what the file says of itself (a hash) true again.
    seal: bool,
    edits: Vec<Edit>,
}

/// What is done to a file. Places are shares of it (of its numbers, of its lines), so that they mean something in every
/// seed.
#[derive(Arbitrary, Debug)]
enum Edit {
    /// A number of a text is another.
    Number { which: u16, is: Number },
    /// So many bytes of a header, the lowest first, are another number.
    Bytes { at: u16, wide: bool, is: Number },
    /// A word of a text is another.
    Word { which: u16, is: Word },
    /// Lines are left out, doubled, or swapped.
    Lines { from: u16, to: u16, how: How },
    /// The rest is left out.
    Cut { at: u16 },
    /// Bytes are put in.
    Splice { at: u16, bytes: Vec<u8> },
    /// A bit is another.
    Flip { at: u16, bit: u8 },
    /// A part comes again and again.
    Repeat { from: u16, length: u8, times: u16 },
    /// As another program would write it.
    Dress(Dress),
}

/// Numbers at which readers break.
#[derive(Arbitrary, Debug)]
enum Number {
    Any(i64),
    Real(f64),
    Power(u8),
    /// One of [`ODD`], as a share of them.
    One(u32),
}

/// Numbers as texts write them, and as headers of bytes hold them.
const ODD: [(&str, i64); 13] = [
    ("0", 0),
    ("-0", 0),
    ("-1", -1),
    ("1", 1),
    ("nan", f64::NAN.to_bits() as i64),
    ("inf", f64::INFINITY.to_bits() as i64),
    ("1e400", i32::MAX as i64 + 1),
    ("5e-324", i64::MIN),
    ("1.7976931348623157e308", i64::MAX),
    ("1000000000", 1_000_000_000),
    ("90", 90),
    ("360", 360),
    ("9999999999999999999999999999999999999999", i32::MAX as i64),
];

fn odd(of: u32) -> (&'static str, i64) {
    ODD[((u64::from(of) * ODD.len() as u64) >> 32) as usize]
}

#[derive(Arbitrary, Debug)]
enum Word {
    Number(Number),
    Nothing,
    Quote,
    Null,
    Words,
    Open,
    Long(u8),
    Control,
    Other(u16),
}

#[derive(Arbitrary, Debug)]
enum How {
    Drop,
    Double,
    Swap,
}

#[derive(Arbitrary, Debug)]
enum Dress {
    Crlf,
    Mark,
    Utf16,
    Latin1,
    Semicolons,
    Tabs,
    Blanks,
    Quoted,
    NoComments,
    NoEnd,
    Zeros(u8),
}

impl Number {
    fn text(&self) -> String {
        match self {
            Number::Any(n) => n.to_string(),
            Number::Real(x) => x.to_string(),
            Number::Power(n) => format!("{:e}", 2f64.powi(i32::from(*n) - 128)),
            Number::One(of) => odd(*of).0.into(),
        }
    }

    fn whole(&self) -> i64 {
        match self {
            Number::Any(n) => *n,
            Number::Real(x) => *x as i64,
            Number::Power(n) => 1 << (n % 64),
            Number::One(of) => odd(*of).1,
        }
    }
}

/// The ranges of bytes that are all of a kind.
fn runs(bytes: &[u8], of: impl Fn(u8) -> bool) -> Vec<(usize, usize)> {
    let mut found = Vec::new();
    let mut start = None;
    // The first part of a large file has all that differs.
    let bytes = &bytes[..bytes.len().min(MOST)];
    for (i, &b) in bytes.iter().enumerate() {
        match (of(b), start) {
            (true, None) => start = Some(i),
            (false, Some(from)) => {
                found.push((from, i));
                start = None;
            }
            _ => {}
        }
    }
    found.extend(start.map(|from| (from, bytes.len())));
    found
}

fn is_number(b: u8) -> bool {
    b.is_ascii_digit() || matches!(b, b'.' | b'-' | b'+')
}

fn is_word(b: u8) -> bool {
    b.is_ascii_alphanumeric() || matches!(b, b'.' | b'-' | b'+' | b'_')
}

/// The place of a share of so many.
fn share(of: u16, n: usize) -> usize {
    ((usize::from(of) * n) >> 16).min(n.saturating_sub(1))
}

impl Edit {
    fn apply(&self, file: &mut Vec<u8>) {
        match self {
            Edit::Number { which, is } => {
                replace(file, runs(file, is_number), *which, &is.text());
            }
            Edit::Word { which, is } => {
                let words = runs(file, is_word);
                let text = match is {
                    Word::Number(number) => number.text(),
                    Word::Nothing => String::new(),
                    Word::Quote => "\"".into(),
                    Word::Null => "null".into(),
                    Word::Words => "a word, another".into(),
                    Word::Open => "[[{".repeat(100),
                    Word::Long(n) => "x".repeat(usize::from(*n) * 100),
                    Word::Control => "\u{1b}[31m\u{7}\u{0}".into(),
                    Word::Other(other) if !words.is_empty() => {
                        let (from, to) = words[share(*other, words.len())];
                        String::from_utf8_lossy(&file[from..to]).into_owned()
                    }
                    Word::Other(_) => String::new(),
                };
                replace(file, words, *which, &text);
            }
            Edit::Bytes { at, wide, is } => {
                let bytes = is.whole().to_le_bytes();
                let bytes = &bytes[..if *wide { 8 } else { 4 }];
                let at = usize::from(*at % HEADER);
                if let Some(place) = file.get_mut(at..at + bytes.len()) {
                    place.copy_from_slice(bytes);
                }
            }
            Edit::Lines { from, to, how } => {
                let lines = runs(file, |b| b != b'\n');
                if lines.is_empty() {
                    return;
                }
                let [a, b] = [from, to].map(|s| share(*s, lines.len()));
                let (a, b) = (a.min(b), a.max(b));
                let (start, end) = (lines[a].0, lines[b].1);
                let part = file[start..end].to_vec();
                match how {
                    How::Drop => drop(file.drain(start..end)),
                    How::Double => insert(file, end, &[b"\n", &part[..]].concat()),
                    How::Swap => {
                        let lines: Vec<&[u8]> = part.split(|b| *b == b'\n').rev().collect();
                        file.splice(start..end, lines.join(&b'\n'));
                    }
                }
            }
            Edit::Cut { at } => file.truncate(share(*at, file.len())),
            Edit::Splice { at, bytes } => insert(file, share(*at, file.len()), bytes),
            Edit::Flip { at, bit } => {
                let at = share(*at, file.len());
                if let Some(byte) = file.get_mut(at) {
                    *byte ^= 1 << (bit % 8);
                }
            }
            Edit::Repeat {
                from,
                length,
                times,
            } => {
                let from = share(*from, file.len());
                let to = (from + usize::from(*length)).min(file.len());
                let part = file[from..to].repeat(usize::from(*times));
                insert(file, to, &part);
            }
            Edit::Dress(dress) => dress.apply(file),
        }
    }
}

fn insert(file: &mut Vec<u8>, at: usize, bytes: &[u8]) {
    if file.len() + bytes.len() <= MOST.max(file.len()) {
        file.splice(at..at, bytes.iter().copied());
    }
}

fn replace(file: &mut Vec<u8>, runs: Vec<(usize, usize)>, which: u16, with: &str) {
    if !runs.is_empty() {
        let (from, to) = runs[share(which, runs.len())];
        file.splice(from..to, with.bytes());
    }
}

impl Dress {
    fn apply(&self, file: &mut Vec<u8>) {
        let Ok(text) = std::str::from_utf8(file) else {
            return;
        };
        if text.len() > MOST {
            return;
        }
        // The lines of cells are changed.
        let cells = |of: &dyn Fn(&str) -> String| {
            let line = |line: &str| match line.starts_with('#') {
                true => line.to_owned() + "\n",
                false => of(line) + "\n",
            };
            text.lines().map(line).collect::<String>().into_bytes()
        };
        let new = match self {
            Dress::Crlf => text.replace('\n', "\r\n").into_bytes(),
            Dress::Mark => [b"\xef\xbb\xbf", text.as_bytes()].concat(),
            Dress::Utf16 => text.encode_utf16().flat_map(u16::to_le_bytes).collect(),
            Dress::Latin1 => [text.as_bytes(), b"# 45\xb0\n"].concat(),
            Dress::Semicolons => cells(&|line| line.replace(',', ";").replace('.', ",")),
            Dress::Tabs => cells(&|line| line.replace(',', "\t")),
            Dress::Blanks => cells(&|line| format!(" {} \t", line.replace(',', " , "))),
            Dress::Quoted => cells(&|line| format!("\"{}\"", line.replace(',', "\",\""))),
            Dress::NoComments => {
                let kept = text.lines().filter(|line| !line.starts_with('#'));
                let kept: String = kept.flat_map(|line| [line, "\n"]).collect();
                kept.into_bytes()
            }
            Dress::NoEnd => text.trim_end().as_bytes().to_vec(),
            Dress::Zeros(n) => [text.as_bytes(), &vec![0; usize::from(*n)]].concat(),
        };
        *file = new;
    }
}

/// The file of an input.
pub fn file(input: &[u8], seeds: &[&[u8]], seal: fn(&mut Vec<u8>)) -> Vec<u8> {
    let [MARK, rest @ ..] = input else {
        return input.to_vec();
    };
    let Ok(recipe) = Recipe::arbitrary_take_rest(Unstructured::new(rest)) else {
        return Vec::new();
    };
    let mut file = match seeds.len() {
        0 => Vec::new(),
        n => seeds[usize::from(recipe.seed) % n].to_vec(),
    };
    recipe.edits.iter().for_each(|edit| edit.apply(&mut file));
    if recipe.seal {
        seal(&mut file);
    }
    file
}
