#[cfg(feature = "pictures")]
mod acquisition;
mod columns;
#[cfg(feature = "pictures")]
mod explore;
#[cfg(feature = "pictures")]
mod moments;
#[cfg(feature = "parquet")]
mod parquet;
#[cfg(feature = "pictures")]
mod pictures;
#[cfg(feature = "pictures")]
mod svg;
