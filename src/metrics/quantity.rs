//! Numbers by which reconstructions are judged.

/// A number by which a reconstruction is judged: a column of results. Less is better, 0 is exact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Quantity {
    /// Name of its column, snake case.
    pub name: &'static str,
    /// One-line description for lists and docs.
    pub summary: &'static str,
    /// True of whole numbers.
    pub is_count: bool,
}

/// A quantity, and its value in a struct `T` of several; `None` where it is not defined.
pub type Judged<T> = (Quantity, fn(&T) -> Option<f64>);

/// Rows of [`Judged`]: the name of a column, the field of the struct, and the summary of each.
macro_rules! quantities {
    ($( $name:literal: $($field:ident).+ $([$i:literal])?, $summary:literal; )+) => {
        [$( ($crate::metrics::Quantity::real($name, $summary), |of| of.$($field).+ $([$i])?) ),+]
    };
}
pub(crate) use quantities;

impl Quantity {
    pub(crate) const fn real(name: &'static str, summary: &'static str) -> Self {
        Self {
            name,
            summary,
            is_count: false,
        }
    }

    pub(crate) const fn count(name: &'static str, summary: &'static str) -> Self {
        Self {
            name,
            summary,
            is_count: true,
        }
    }
}
