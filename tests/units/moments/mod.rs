mod clamping;
mod component;
mod correlation;
mod errors;
mod fit;
mod slice;
mod split;
mod tally;
