//! Rows: one rung each.

use super::{Judged, Times};

/// What was measured on a rung.
#[derive(Clone, Debug)]
pub struct Row {
    /// Its names, in the order of the section's.
    pub names: Vec<String>,
    /// Times of its passes.
    pub times: Times,
    /// How good it is.
    pub judged: Judged,
}

impl Row {
    /// What it is compared within.
    pub(crate) fn case(&self) -> &str {
        self.names.first().map_or("", String::as_str)
    }

    /// The choice: its names between the case and the rung.
    pub fn choice(&self) -> &[String] {
        let last = self.names.len().saturating_sub(1);
        &self.names[last.min(1)..last]
    }
}

/// Rows by what they are compared within, in their order.
pub(super) fn cases(rows: &[Row]) -> Vec<Vec<&Row>> {
    grouped(rows.iter(), |row| row.case().to_owned())
}

/// Rows of like keys, in the order of the first of each.
pub(super) fn grouped<'a, K: PartialEq>(
    rows: impl Iterator<Item = &'a Row>,
    key: impl Fn(&Row) -> K,
) -> Vec<Vec<&'a Row>> {
    let mut groups: Vec<(K, Vec<&Row>)> = Vec::new();
    for row in rows {
        let key = key(row);
        match groups.iter_mut().find(|(k, _)| *k == key) {
            Some((_, group)) => group.push(row),
            None => groups.push((key, vec![row])),
        }
    }
    groups.into_iter().map(|(_, group)| group).collect()
}
