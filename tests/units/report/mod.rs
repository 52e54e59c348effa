mod acquisition;
mod analysis;
mod columns;
#[cfg(feature = "pictures")]
mod moments;
#[cfg(feature = "pictures")]
mod pictures;
#[cfg(feature = "pictures")]
mod svg;
