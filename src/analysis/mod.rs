//! What can be said about a BRDF and a parametrization before anything is measured: how far the
//! isolines of one are from the axes of the other, which symmetries hold, and which pairs of
//! directions a box of coordinates stands for.
