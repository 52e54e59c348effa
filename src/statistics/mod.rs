//! What figures measured on the same materials say about two choices, and how surely: paired
//! ratios, intervals, tests, orders of convergence, and which factor explains how much.
//!
//! Knows nothing of reflectance: numbers in, numbers out.
