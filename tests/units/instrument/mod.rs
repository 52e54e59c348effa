#[cfg(feature = "experiments")]
mod motion;
#[cfg(feature = "experiments")]
mod timed;
mod tour;
