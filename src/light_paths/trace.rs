//! Rays through a periodic height field.
//!
//! A cell has two triangles. Along a ray their height is linear between the edges that it crosses, and so is the height of the
//! ray above them: a hit is where that changes its sign. Heights at an edge are interpolated between its two ends alone, so
//! both of its cells see the same number and no ray passes between them; a ray that leaves a triangle is above it, whatever
//! rounding says.
//!
//! Cells are gathered in squares of 4², 16² and 64² with the largest height of each (a maximum mipmap):
//! what a ray flies over is left out, and that is most of what it meets.

use super::surface::HeightField;
use glam::DVec3;
use std::sync::Arc;

/// Logarithms (base 2) of the cells along a square of each level.
const SHIFTS: [u32; 4] = [0, 2, 4, 6];

/// The least that a direction moves along an axis for each of its length.
const STILL: f64 = 1e-200;

/// Squares that a ray may cross before it is given up: one that runs along a groove at its own height never ends.
const STEPS: usize = 1 << 20;

/// A ray at a place, in cells; its cell is kept beside it, since rounding may put the place on the wrong side of an edge.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    cell: [u32; 2],
    /// Its place, cells.
    pub place: DVec3,
    /// Its direction, a unit vector.
    pub direction: DVec3,
    /// The triangle it starts from (that of x ≥ y first), if it does.
    start: Option<usize>,
}

/// A triangle that was hit.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// The ray that came, at the place.
    pub ray: Ray,
    /// Unit normal of the triangle, turned up.
    pub normal: DVec3,
}

/// The end of a ray.
#[derive(Clone, Copy, Debug)]
pub enum Exit {
    /// On a triangle.
    Hit(Hit),
    /// Above everything: it left.
    Sky,
    /// Nowhere within a million squares.
    Lost,
}

impl Hit {
    /// The ray that goes on from there in another direction, a unit vector.
    #[inline]
    pub fn turned(&self, direction: DVec3) -> Ray {
        Ray {
            direction,
            ..self.ray
        }
    }
}

/// A height field with the largest heights of its squares.
#[derive(Debug)]
pub struct Tracer {
    /// The heights.
    pub(crate) field: Arc<HeightField>,
    /// Of each level, x fastest, and squares along x.
    largest: [(Vec<f32>, usize); SHIFTS.len()],
    /// The largest of all.
    top: f64,
}

impl Tracer {
    /// Rays through `field`.
    pub fn new(field: Arc<HeightField>) -> Self {
        let size = field.size();
        let cells: Vec<f32> = (0..size[1])
            .flat_map(|y| (0..size[0]).map(move |x| [x, y]))
            .map(|cell| field.corners(cell).into_iter().fold(f64::MIN, f64::max) as f32)
            .collect();
        let largest = SHIFTS.map(|shift| {
            let square = 1 << shift;
            let [nx, ny] = size.map(|n| n.div_ceil(square));
            let mut all = vec![f32::MIN; nx * ny];
            for (i, height) in cells.iter().enumerate() {
                let place = (i / size[0] / square) * nx + i % size[0] / square;
                all[place] = all[place].max(*height);
            }
            (all, nx)
        });
        let top = f64::from(cells.iter().copied().fold(f32::MIN, f32::max));
        Self {
            field,
            largest,
            top,
        }
    }

    /// A ray that comes from the sky along the unit vector `direction` (z < 0) to the point (x, y), shares of the period, of the
    /// plane that touches the highest point.
    pub fn from_sky(&self, [x, y]: [f64; 2], direction: DVec3) -> Ray {
        let [nx, ny] = self.field.size();
        let (x, y) = (x * nx as f64, y * ny as f64);
        Ray {
            cell: [(x, nx), (y, ny)].map(|(x, n)| (x as u32).min(n as u32 - 1)),
            place: DVec3::new(x, y, self.top),
            direction,
            start: None,
        }
    }

    /// A point of a triangle: that of x ≥ y of cell (x, y) is number 2 (y n_x + x), the other one the next; `u`, of the unit
    /// square, is spread evenly over it. It goes on as a hit from above does.
    pub(crate) fn on_triangle(&self, triangle: usize, [u, v]: [f64; 2]) -> Hit {
        let (index, side) = (triangle / 2, triangle % 2);
        let row = self.field.size()[0];
        let cell = [index % row, index / row];
        // Folded into the half of the square.
        let (u, v) = match (u < v) == (side == 1) {
            true => (u, v),
            false => (v, u),
        };
        let corners = self.field.corners(cell);
        let [cx, cy] = cell.map(|c| c as f64);
        Hit {
            ray: Ray {
                cell: cell.map(|c| c as u32),
                place: DVec3::new(cx + u, cy + v, height(corners, side, u, v)),
                direction: DVec3::NEG_Z,
                start: Some(side),
            },
            normal: normal(corners, side),
        }
    }

    /// Follows a ray to its end.
    pub fn follow(&self, ray: Ray) -> Exit {
        let way = Way::new(self, ray.direction);
        let mut at = ray;
        // What comes from below begins among the smallest squares.
        let mut level = SHIFTS.len() - 1;
        if ray.start.is_some() {
            let step = way.step(&at, 0);
            if let Some(hit) = self.cell(&at, &way, &step, ray.start) {
                return Exit::Hit(hit);
            }
            way.go_on(&mut at, &step, 0);
            level = 0;
        }
        let rising = way.direction.z >= 0.0;
        for _ in 0..STEPS {
            if rising && at.place.z >= self.top {
                return Exit::Sky;
            }
            let step = way.step(&at, level);
            let lowest = at.place.z + (way.direction.z * step.time).min(0.0);
            let (largest, row) = &self.largest[level];
            if lowest > f64::from(largest[step.square[1] as usize * row + step.square[0] as usize])
            {
                level = way.go_on(&mut at, &step, level);
            } else if level > 0 {
                level -= 1;
            } else if let Some(hit) = self.cell(&at, &way, &step, None) {
                return Exit::Hit(hit);
            } else {
                level = way.go_on(&mut at, &step, 0);
            }
        }
        Exit::Lost
    }

    /// Looks for a hit in the cell of a ray, from the triangle `start` of it if it comes from there.
    #[inline]
    fn cell(&self, at: &Ray, way: &Way, step: &Step, start: Option<usize>) -> Option<Hit> {
        let corners @ [a, b, c, d] = self.field.corners(at.cell.map(|c| c as usize));
        let [cx, cy] = at.cell.map(f64::from);
        let (u, v) = (at.place.x - cx, at.place.y - cy);
        let direction = way.direction;
        let out = at.place + direction * step.time;
        // Where it leaves, and the height of the surface there, interpolated along the edge alone: the next cell sees the same.
        let (u1, v1, edge) = match (step.axis, way.forward[step.axis]) {
            (0, 1) => (1.0, out.y - cy, b + (out.y - cy) * (d - b)),
            (0, _) => (0.0, out.y - cy, a + (out.y - cy) * (c - a)),
            (_, 1) => (out.x - cx, 1.0, c + (out.x - cx) * (d - c)),
            _ => (out.x - cx, 0.0, a + (out.x - cx) * (b - a)),
        };
        let side_at = |u: f64, v: f64, otherwise: usize| match u - v {
            s if s > 0.0 => 0,
            s if s < 0.0 => 1,
            _ => otherwise,
        };
        let last = side_at(u1, v1, step.axis);
        let first = start.unwrap_or_else(|| side_at(u, v, last));
        // Its height above the surface where it comes in, crosses the diagonal and leaves. It comes in above, and leaves the
        // triangle it starts from above.
        let mut above = match start {
            Some(_) => 0.0,
            None => (at.place.z - height(corners, first, u, v)).max(0.0),
        };
        let above_out = out.z - edge;
        let mut from = 0.0;
        if first != last {
            let (s0, s1) = (u - v, u1 - v1);
            let share = if s0 == s1 {
                0.0
            } else {
                (s0 / (s0 - s1)).clamp(0.0, 1.0)
            };
            let time = share * step.time;
            let diagonal = at.place.z + direction.z * time - (a + (u + share * (u1 - u)) * (d - a));
            if start.is_none() && diagonal < 0.0 {
                let share = above / (above - diagonal);
                return Some(meet(at, way, time * share, first, corners));
            }
            (above, from) = (diagonal.max(0.0), time);
        } else if start.is_some() {
            return None;
        }
        (above_out < 0.0).then(|| {
            let share = above / (above - above_out);
            meet(at, way, from + (step.time - from) * share, last, corners)
        })
    }
}

/// What does not change along a ray.
struct Way {
    direction: DVec3,
    inverse: [f64; 2],
    /// 1 where it goes up along an axis, else 0.
    forward: [u32; 2],
    size: [u32; 2],
}

/// The way out of a square.
struct Step {
    square: [u32; 2],
    time: f64,
    axis: usize,
    edge: f64,
}

impl Way {
    fn new(tracer: &Tracer, direction: DVec3) -> Self {
        // Along an axis that it does not move along a ray gets to the edge in the end: no infinities, and heights that are
        // interpolated up to there are as right.
        let moving = |d: f64| if d.abs() < STILL { STILL } else { d };
        let [x, y] = [moving(direction.x), moving(direction.y)];
        Self {
            direction: DVec3::new(x, y, direction.z),
            inverse: [1.0 / x, 1.0 / y],
            forward: [u32::from(x > 0.0), u32::from(y > 0.0)],
            size: tracer.field.size().map(|n| n as u32),
        }
    }

    /// The way out of the square of a level.
    #[inline(always)]
    fn step(&self, at: &Ray, level: usize) -> Step {
        let shift = SHIFTS[level];
        let square = at.cell.map(|c| c >> shift);
        let edge = |axis: usize| {
            f64::from(((square[axis] + self.forward[axis]) << shift).min(self.size[axis]))
        };
        let edges = [edge(0), edge(1)];
        // Rounding may have put the place beyond the edge.
        let x = ((edges[0] - at.place.x) * self.inverse[0]).max(0.0);
        let y = ((edges[1] - at.place.y) * self.inverse[1]).max(0.0);
        let axis = usize::from(y < x);
        Step {
            square,
            time: x.min(y),
            axis,
            edge: edges[axis],
        }
    }

    /// Moves to the edge and into the next square; the level to go on with: a larger one where its edge was crossed.
    #[inline(always)]
    fn go_on(&self, at: &mut Ray, step: &Step, level: usize) -> usize {
        let shift = SHIFTS[level];
        at.place += self.direction * step.time;
        let along = |other: usize, place: f64| {
            let low = step.square[other] << shift;
            let high = (low + (1 << shift)).min(self.size[other]) - 1;
            (place.max(0.0) as u32).clamp(low, high)
        };
        let (mut edge, size) = (step.edge as u32, self.size[step.axis]);
        let forward = self.forward[step.axis] == 1;
        if forward && edge == size {
            edge = 0;
        } else if !forward && edge == 0 {
            edge = size;
        }
        let cell = if forward { edge } else { edge - 1 };
        if step.axis == 0 {
            at.place.x = f64::from(edge);
            at.cell = [cell, along(1, at.place.y)];
        } else {
            at.place.y = f64::from(edge);
            at.cell = [along(0, at.place.x), cell];
        }
        let next = (level + 1).min(SHIFTS.len() - 1);
        let crossed = edge & ((1 << SHIFTS[next]) - 1) == 0 || edge == size;
        if crossed { next } else { level }
    }
}

/// The hit after `time` on a triangle of a cell.
fn meet(at: &Ray, way: &Way, time: f64, side: usize, corners: [f64; 4]) -> Hit {
    let place = at.place + way.direction * time;
    let [x, y] = [0, 1].map(|axis| {
        let low = f64::from(at.cell[axis]);
        place[axis].clamp(low, low + 1.0)
    });
    let [cx, cy] = at.cell.map(f64::from);
    Hit {
        ray: Ray {
            cell: at.cell,
            place: DVec3::new(x, y, height(corners, side, x - cx, y - cy)),
            direction: way.direction,
            start: Some(side),
        },
        normal: normal(corners, side),
    }
}

#[inline]
fn normal([a, b, c, d]: [f64; 4], side: usize) -> DVec3 {
    let [x, y] = [[b - a, d - b], [d - c, c - a]][side];
    DVec3::new(-x, -y, 1.0).normalize()
}

/// Height of a triangle of a cell at (u, v).
#[inline]
fn height([a, b, c, d]: [f64; 4], side: usize, u: f64, v: f64) -> f64 {
    match side {
        0 => a + u * (b - a) + v * (d - b),
        _ => a + v * (c - a) + u * (d - c),
    }
}
