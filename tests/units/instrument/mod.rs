#[cfg(feature = "experiments")]
mod motion;

mod tour;

mod ideal;
