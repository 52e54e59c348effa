//! Long-form pages.
//!
//! Links between pages have their targets twice: in `links.md`, which comes first here, and at the end of each page, for readers of
//! the files.

/// Pages, each a module with the text of its name, and the picture of its name if it has one.
macro_rules! pages {
    ($($name:ident $(with $picture:literal)?,)*) => {
        $(
            #[doc = include_str!("links.md")]
            #[doc = include_str!(concat!(stringify!($name), ".md"))]
            $(
                #[doc = ""]
                #[doc = include_str!($picture)]
            )?
            pub mod $name {}
        )*
    };
}

pages! {
    findings,
    laboratory,
    design,
    formats,
    inputs,
    terms,
    errata,
    relations with "relations.svg",
    sampling with "sampling.svg",
    parametrizations with "parametrizations.svg",
    moments with "moments.svg",
    light_paths with "light_paths.svg",
    pictures with "pictures.svg",
    planning,
    explore,
    cluster,
    python,
    stability,
    changelog,
}
