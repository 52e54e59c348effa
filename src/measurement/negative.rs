//! Values below 0 of a file: noise, or a mark that stands for no data.

use crate::error::count;

/// The value that laboratories write where they have none.
const MARK: f64 = -1.0;

/// Rows with values below 0.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Negative {
    /// How many there are.
    pub rows: usize,
    /// Line of the first of them, from 1; 0 if there is none.
    pub first: usize,
    /// Those that are -1 and nothing else.
    pub marks: usize,
}

impl Negative {
    /// Looks at the values of a row as they are in the file.
    pub(super) fn see<I: Iterator<Item = f64>>(&mut self, line: usize, values: impl Fn() -> I) {
        if !values().any(|v| v < 0.0) {
            return;
        }
        self.rows += 1;
        if self.first == 0 {
            self.first = line;
        }
        self.marks += usize::from(values().all(|v| v == MARK));
    }

    /// The sentence that warns of them; `None` if there is none.
    pub(crate) fn warning(&self) -> Option<String> {
        let Self { rows, first, marks } = *self;
        let mut text = match rows {
            0 => return None,
            1 => format!("the value of line {first} is below 0 and counts as 0"),
            _ => format!(
                "{} have values below 0, which count as 0, the first in line {first}",
                count(rows, "row")
            ),
        };
        // A single one may be noise.
        if marks > 1 {
            text += &format!(
                "; -1 in {marks} of them may stand for no data, whose cells should be empty"
            );
        }
        Some(text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_told_from_noise() {
        let warning = |rows: &[[f64; 2]]| {
            let mut negative = Negative::default();
            for (i, row) in rows.iter().enumerate() {
                negative.see(i + 1, || row.iter().copied());
            }
            negative.warning()
        };
        assert_eq!(warning(&[[0.0, 1.0], [-0.0, 0.0]]), None);
        let one = warning(&[[0.0, 1.0], [-1.0, -1.0]]).unwrap();
        assert_eq!(one, "the value of line 2 is below 0 and counts as 0");
        let noise = warning(&[[-1e-3, 1.0], [0.0, 1.0], [-1.0, 2.0], [-1.0, -1.0]]).unwrap();
        assert!(noise.starts_with("3 rows have values below 0") && noise.ends_with("line 1"));
        let marks = warning(&[[0.0, 1.0], [-1.0, -1.0], [-1.0, -1.0], [-1.0, 0.5]]).unwrap();
        assert!(
            marks.contains("-1 in 2 of them may stand for no data"),
            "{marks}"
        );
    }
}
