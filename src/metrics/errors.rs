//! The metrics between a truth f and a reconstruction g at the same pairs.
//!
//! | name | definition | unit |
//! |---|---|---|
//! | `nrmse` | RMS of (g − f) cos over RMS of f cos | 1 |
//! | `log_relative` | mean \|ln((g + ε)/(f + ε))\| | 1 |
//! | `log1p` | mean \|ln(1 + g cos) − ln(1 + f cos)\| | 1 |
//! | `cbrt` | RMS of (g cos)^(1/3) − (f cos)^(1/3) | sr^(-1/3) |
//! | `energy` | mean g over mean f, less 1: signed, > 0 where light is gained | 1 |
//! | `mean_relative`, `relative_p999` | mean and 99.9 % quantile of \|g − f\| / max(f, ε) | 1 |
//!
//! cos = cos θ_i, ε = 10⁻³ sr⁻¹. All are 0 if g = f at every pair, and all but `energy` are ≥ 0. By cosine
//! pairs `energy` is the relative error of the hemisphere's albedo (within the mask): light from all of it reflected
//! into all of it.
//!
//! Undefined ones are `None`, an empty cell in a table: all of them if no pair is left to compare, `nrmse` and `energy` also
//! if the truth is black.

use super::{Judged, Quantity};
use serde::Serialize;

/// Errors, each with its column and summary: fields, columns, and columns of standard errors, in one order.
macro_rules! errors {
    ($( $field:ident: $summary:literal, )+) => {
        /// Errors of one reconstruction under one measure; `None` where undefined, never NaN or infinite.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
        pub struct Errors {
            $(
                #[doc = $summary]
                pub $field: Option<f64>,
            )+
            /// Pairs that were compared.
            pub pairs: usize,
            /// Pairs left out because the truth has no data there.
            pub pairs_missing: usize,
            /// Pairs left out because the reconstruction has no value where the truth has one.
            pub pairs_unreconstructed: usize,
        }

        /// Number of errors.
        const ERRORS: usize = [$( stringify!($field) ),+].len();

        impl Errors {
            /// Every error, in the order of columns, with its field.
            pub const QUANTITIES: [Judged<Errors>; ERRORS] =
                [$( (Quantity::real(stringify!($field), $summary), |e| e.$field) ),+];

            /// Standard errors, in the same order, with the fields of [`Tally::standard_errors`](super::Tally::standard_errors).
            pub const STANDARD_ERRORS: [Judged<Errors>; ERRORS] = [$( (
                Quantity::real(
                    concat!(stringify!($field), "_se"),
                    concat!("standard error of ", stringify!($field), ": of the choice of test pairs"),
                ),
                |e| e.$field,
            ) ),+];

            /// The errors of these values, in the order of columns, and numbers of pairs: compared, missing, unreconstructed.
            pub(super) fn new([$( $field ),+]: [Option<f64>; ERRORS], counts: [usize; 3]) -> Self {
                let [pairs, pairs_missing, pairs_unreconstructed] = counts;
                Self { $( $field, )+ pairs, pairs_missing, pairs_unreconstructed }
            }
        }
    };
}

errors! {
    nrmse: "RMS of (g − f) cos over RMS of f cos; f truth, g reconstruction, cos = cos theta_i",
    log_relative: "mean |ln((g + 1e-3)/(f + 1e-3))|",
    log1p: "mean |ln(1 + g cos) − ln(1 + f cos)|",
    cbrt: "RMS of (g cos)^(1/3) − (f cos)^(1/3)",
    mean_relative: "mean of |g − f| / max(f, 1e-3)",
    energy: "mean of g over that of f, less 1, by pairs of measure cosine that of the hemisphere's albedo; > 0 gains light",
    relative_p999: "|g − f| / max(f, 1e-3) that 99.9 % of the pairs are below",
}
