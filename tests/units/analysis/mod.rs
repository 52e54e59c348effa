#[cfg(feature = "experiments")]
mod alignment;
mod anisotropy;
mod claims;
mod distortion;
mod reduction;
mod shares;
mod subset;
mod symmetry;
