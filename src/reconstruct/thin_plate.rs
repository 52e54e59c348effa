//! Local thin-plate spline over the k nearest readings.
//!
//! Around each query x the k nearest points of the embedding (see [`super::scattered`]) are
//! interpolated by Σ c_j φ(|x − x_j|) plus a linear polynomial, φ(r) = r² ln r (Duchon 1977), under
//! the usual side conditions. r² ln r is conditionally positive definite of order 2 in every
//! dimension, so with d + 1 of the points taken as Lagrange points of the polynomial part, the
//! *reduced* kernel
//!
//! κ(x, y) = φ(x − y) − Σ p_i(x) φ(ξ_i − y) − Σ p_j(y) φ(x − ξ_j) + ΣΣ p_i(x) p_j(y) φ(ξ_i − ξ_j)
//!
//! is positive definite on the others (Wendland, *Scattered Data Approximation*, §8.5) and one
//! Cholesky factorisation of size k − d − 1 gives the weights of the k readings: half the work of
//! the indefinite system, and no pivoting. Neighbours that lie in a plane (or on a line) span fewer
//! polynomials; those are found by the pivots, and the polynomial part is constant along the normal.
//! Should the factorisation fail (points that agree to rounding), the
//! query falls back to inverse-distance weights.
//!
//! Made for scattered readings. On a grid much finer along some axes than along others the k
//! nearest may all lie in one sheet of it; the spline is then constant across the sheet, and of
//! first order there: a grid's own interpolants are better, and so is an even ratio.

use super::coordinates::{Coordinates, ReconstructionCoordinates};
use super::inverse_distance::Shepard;
use super::scattered::{Cloud, Nearest, ScatteredInterpolant, ScatteredRule};
use super::transform::{EPSILON, Values};
use super::{Interpolant, Readings, Reconstruct, ReconstructError, STRETCH, check_neighbours};
use crate::error::ParameterError;
use crate::registry::{self, Entry};
use nalgebra::{Cholesky, DMatrix, DVector};
use serde::{Deserialize, Serialize};
use std::num::NonZeroUsize;

const KIND: &str = "thin-plate";

/// The registry entry.
pub(super) const ENTRY: Entry<dyn Reconstruct> = Entry {
    kind: KIND,
    summary: "local thin-plate spline over the k nearest readings",
    examples: &["neighbours = 30", "coordinates = { kind = \"hybrid\" }"],
    read: |table| Ok(Box::new(registry::parse::<ThinPlate>(table)?)),
};

/// The thin-plate spline, as a config writes it.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ThinPlate {
    /// Function of f_r that is interpolated.
    pub values: Values,
    /// Offset of the logarithm, sr⁻¹.
    pub epsilon: f64,
    /// Number of neighbours (readings and their mirror images).
    pub neighbours: usize,
    /// Coordinates to interpolate in; by default those of the schedule.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coordinates: Option<Coordinates>,
    /// Weight of the first radial axis against the second.
    pub stretch: f64,
}

impl Default for ThinPlate {
    fn default() -> Self {
        Self {
            values: Values::Log,
            epsilon: EPSILON,
            neighbours: 30,
            coordinates: None,
            stretch: STRETCH,
        }
    }
}

/// Fewest neighbours: one more than the polynomials of the 4-D embedding.
const FEWEST: usize = 6;

impl ThinPlate {
    fn search(&self) -> ReconstructionCoordinates<'_> {
        ReconstructionCoordinates {
            coordinates: self.coordinates.as_ref(),
            stretch: self.stretch,
        }
    }

    fn build<const K: usize>(
        &self,
        r: &Readings<'_>,
    ) -> Result<Box<dyn Interpolant>, ReconstructError> {
        let transform = self.values.with(self.epsilon);
        let cloud = Cloud::<K>::new(KIND, r, &self.search(), transform, FEWEST)?;
        let rule = Local {
            neighbours: check_neighbours(self.neighbours, FEWEST)?,
        };
        Ok(Box::new(ScatteredInterpolant::new(rule, cloud, transform)))
    }
}

impl Reconstruct for ThinPlate {
    fn resolved(&self) -> registry::Keys {
        registry::resolved(KIND, self)
    }

    fn label(&self) -> String {
        super::label(KIND, self.values, self.coordinates.as_ref())
    }

    fn needs_grid(&self) -> bool {
        false
    }

    chooses_coordinates!();

    fn check(&self) -> Result<(), ParameterError> {
        self.values.check(self.epsilon)?;
        check_neighbours(self.neighbours, FEWEST)?;
        self.search().check()
    }

    fn interpolate(&self, r: &Readings<'_>) -> Result<Box<dyn Interpolant>, ReconstructError> {
        self.check()?;
        match r.schedule.parametrization.axes().len() {
            3 => self.build::<3>(r),
            _ => self.build::<4>(r),
        }
    }
}

/// Local thin-plate splines as a rule over neighbours.
struct Local {
    neighbours: NonZeroUsize,
}

/// Polynomials of the 4-D embedding, the most there are.
const MOST: usize = 5;

/// A pivot below this share of the neighbourhood's size means the neighbours lie in a plane.
/// Rounding of the embedded coordinates is 1e-16 of 1 (1e-9 near poles of other coordinates than the
/// schedule's), and slopes across anything thinner than this would be noise.
const FLAT: f64 = 1e-6;

/// Buffers of one thread.
struct Scratch<const K: usize> {
    /// Numbers of the neighbours.
    index: Vec<usize>,
    /// The neighbours relative to the query, in units of the farthest; the query itself is 0.
    points: Vec<[f64; K]>,
    /// Polynomials at each neighbour and, last, at the query; Lagrange ones after elimination.
    basis: Vec<[f64; MOST]>,
    /// φ to the Lagrange points minus half their own correction, per neighbour and query.
    to_lagrange: Vec<[f64; MOST]>,
    /// Neighbours that are Lagrange points, each with its column of `basis`.
    lagrange: Vec<(usize, usize)>,
    /// The other neighbours.
    free: Vec<usize>,
    /// Storage of the reduced system.
    matrix: Vec<f64>,
    /// Right-hand side, then weights of the free neighbours.
    weights: Vec<f64>,
}

/// φ(r) = r² ln r from r², as ½ r² ln r²; 0 at 0.
#[inline]
fn kernel(r2: f64) -> f64 {
    if r2 > 0.0 { 0.5 * r2 * r2.ln() } else { 0.0 }
}

#[inline]
fn distance2<const K: usize>(a: &[f64; K], b: &[f64; K]) -> f64 {
    let mut sum = 0.0;
    for (a, b) in a.iter().zip(b) {
        sum += (a - b) * (a - b);
    }
    sum
}

impl<const K: usize> ScatteredRule<K> for Local {
    type Scratch = Box<Scratch<K>>;

    fn scratch(&self) -> Self::Scratch {
        let k = self.neighbours.get();
        Box::new(Scratch {
            index: Vec::with_capacity(k),
            points: Vec::with_capacity(k),
            basis: Vec::with_capacity(k + 1),
            to_lagrange: Vec::with_capacity(k + 1),
            lagrange: Vec::with_capacity(MOST),
            free: Vec::with_capacity(k),
            matrix: Vec::with_capacity(k * k),
            weights: Vec::with_capacity(k),
        })
    }

    fn interpolate(
        &self,
        cloud: &Cloud<K>,
        tree: &Nearest<K>,
        x: &[f64; K],
        scratch: &mut Self::Scratch,
        out: &mut [f64],
    ) {
        let s = &mut **scratch;
        s.index.clear();
        let mut nearest = f64::INFINITY;
        let mut farthest = 0.0;
        tree.find_many(x, self.neighbours, |i, d2| {
            s.index.push(i);
            nearest = d2.min(nearest);
            farthest = d2.max(farthest);
        });
        if nearest == 0.0 {
            out.copy_from_slice(cloud.value(s.index[0]));
            return;
        }
        s.localise(cloud, x, farthest.sqrt());
        s.eliminate();
        if !s.solve() {
            let rule = Shepard {
                neighbours: self.neighbours,
                power: 2.0,
            };
            rule.interpolate(cloud, tree, x, &mut (), out);
            return;
        }
        s.combine(cloud, out);
    }
}

impl<const K: usize> Scratch<K> {
    /// Moves the query to 0 and the farthest neighbour to distance 1.
    fn localise(&mut self, cloud: &Cloud<K>, x: &[f64; K], size: f64) {
        self.points.clear();
        self.basis.clear();
        for &i in &self.index {
            let p = &cloud.points[i];
            let local: [f64; K] = std::array::from_fn(|d| (p[d] - x[d]) / size);
            let mut row = [0.0; MOST];
            row[0] = 1.0;
            row[1..=K].copy_from_slice(&local);
            self.points.push(local);
            self.basis.push(row);
        }
        let mut query = [0.0; MOST];
        query[0] = 1.0;
        self.basis.push(query);
    }

    /// Column elimination with full pivoting: picks the Lagrange points and turns the rows of
    /// `basis` into values of their cardinal polynomials.
    fn eliminate(&mut self) {
        let neighbours = self.points.len();
        self.lagrange.clear();
        for _ in 0..=K {
            let mut best = (0.0, 0, 0);
            for (a, row) in self.basis[..neighbours].iter().enumerate() {
                if self.lagrange.iter().any(|l| l.0 == a) {
                    continue;
                }
                for (c, value) in row[..=K].iter().enumerate() {
                    if value.abs() > best.0 && self.lagrange.iter().all(|l| l.1 != c) {
                        best = (value.abs(), a, c);
                    }
                }
            }
            let (size, a, c) = best;
            if size < FLAT {
                break;
            }
            let pivot_row = self.basis[a];
            let inverse = 1.0 / pivot_row[c];
            for row in &mut self.basis {
                let scaled = row[c] * inverse;
                for (d, value) in row[..=K].iter_mut().enumerate() {
                    if d != c {
                        *value -= scaled * pivot_row[d];
                    }
                }
                row[c] = scaled;
            }
            self.lagrange.push((a, c));
        }
        if self.lagrange.len() <= K {
            self.project();
        }
    }

    /// Projects the query on the plane of the neighbours if they lie in one: rounding of the pivots
    /// must not choose the course of a polynomial along the normal.
    fn project(&mut self) {
        let Some((&(origin, column), rest)) = self.lagrange.split_first() else {
            return;
        };
        let dot = |a: &[f64; K], b: &[f64; K]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        let origin = &self.points[origin];
        let edge = |i: usize| -> [f64; K] {
            std::array::from_fn(|d| self.points[rest[i].0][d] - origin[d])
        };
        let gram = DMatrix::from_fn(rest.len(), rest.len(), |i, j| dot(&edge(i), &edge(j)));
        let mut share = DVector::from_fn(rest.len(), |i, _| -dot(&edge(i), origin));
        if let Some(factor) = gram.cholesky() {
            factor.solve_mut(&mut share);
        }
        let query = &mut self.basis[self.points.len()];
        *query = [0.0; MOST];
        query[column] = 1.0 - share.sum();
        for (&(_, column), share) in rest.iter().zip(&share) {
            query[column] = *share;
        }
    }

    /// Solves the reduced system for the query; false if it is not positive definite.
    fn solve(&mut self) -> bool {
        let lagrange = &self.lagrange;
        let neighbours = self.points.len();
        let origin = [0.0; K];
        let mut own = [[0.0; MOST]; MOST];
        for &(a, i) in lagrange {
            for &(b, j) in lagrange {
                own[i][j] = kernel(distance2(&self.points[a], &self.points[b]));
            }
        }
        self.to_lagrange.clear();
        for (a, row) in self.basis.iter().enumerate() {
            let point = self.points.get(a).unwrap_or(&origin);
            let mut t = [0.0; MOST];
            for &(b, i) in lagrange {
                let correction: f64 = lagrange.iter().map(|&(_, j)| row[j] * own[i][j]).sum();
                t[i] = kernel(distance2(point, &self.points[b])) - 0.5 * correction;
            }
            self.to_lagrange.push(t);
        }
        self.free.clear();
        let is_free = |a: &usize| lagrange.iter().all(|l| l.0 != *a);
        self.free.extend((0..neighbours).filter(is_free));
        let n = self.free.len();
        let reduced = |phi: f64, a: usize, b: usize| {
            let (pa, pb) = (&self.basis[a], &self.basis[b]);
            let (ta, tb) = (&self.to_lagrange[a], &self.to_lagrange[b]);
            let mut sum = phi;
            for i in 0..=K {
                sum -= pa[i] * tb[i] + pb[i] * ta[i];
            }
            sum
        };
        let mut matrix = std::mem::take(&mut self.matrix);
        matrix.clear();
        matrix.resize(n * n, 0.0);
        let mut weights = std::mem::take(&mut self.weights);
        weights.clear();
        for (column, &a) in self.free.iter().enumerate() {
            let pa = &self.points[a];
            // Cholesky reads the lower triangle; storage is column-major.
            for (row, &b) in self.free.iter().enumerate().skip(column) {
                let phi = kernel(distance2(pa, &self.points[b]));
                matrix[column * n + row] = reduced(phi, a, b);
            }
            weights.push(reduced(kernel(distance2(pa, &origin)), a, neighbours));
        }
        let solved = match Cholesky::new(DMatrix::from_vec(n, n, matrix)) {
            Some(factor) => {
                let mut rhs = DVector::from_vec(weights);
                factor.solve_mut(&mut rhs);
                self.weights = rhs.data.into();
                self.matrix = factor.unpack_dirty().data.into();
                true
            }
            None => false,
        };
        solved && self.weights.iter().all(|w| w.is_finite())
    }

    /// Σ over free neighbours of w (y − its polynomial part), plus the polynomial at the query.
    fn combine(&self, cloud: &Cloud<K>, out: &mut [f64]) {
        let query = &self.basis[self.points.len()];
        let mut at_lagrange = *query;
        out.fill(0.0);
        let mut add = |weight: f64, a: usize| {
            for (out, y) in out.iter_mut().zip(cloud.value(self.index[a])) {
                *out += weight * y;
            }
        };
        for (&a, &w) in self.free.iter().zip(&self.weights) {
            add(w, a);
            for &(_, i) in &self.lagrange {
                at_lagrange[i] -= w * self.basis[a][i];
            }
        }
        for &(a, i) in &self.lagrange {
            add(at_lagrange[i], a);
        }
    }
}
