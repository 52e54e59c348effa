//! The sections, one file each.

mod growth;
mod instruments;
mod moments;
mod planners;
mod reconstructions;
mod truths;

use super::Section;

/// Every section, in the order in which they run.
pub fn all() -> [&'static Section; 5] {
    [
        &moments::SECTION,
        &reconstructions::SECTION,
        &planners::SECTION,
        &instruments::SECTION,
        &growth::SECTION,
    ]
}
