//! Surfaces of one shape, repeated.

use super::{Facts, HeightField, SurfaceSpec, check_size};
use crate::brdf::BuildError;
use crate::error::{ParameterError, in_closed};
use crate::geometry::Symmetry;
use crate::registry::declare;
use crate::sampling::Random;
use std::f64::consts::{PI, TAU};

declare! {
    impl dyn SurfaceSpec, "v-grooves": "symmetric V-grooves along y, whose sides are steep by angle_deg", [
        "angle_deg = 45.0\nsize = 16",
    ]
    /// V-grooves, as a config writes them.
    pub struct GroovesSpec {
        /// Angle of both sides to the plane, degrees.
        angle_deg: f64 = 45.0;
        /// Cells along each axis of a period, an even number: half of them go down.
        size: usize = 16;
    }
}

impl SurfaceSpec for GroovesSpec {
    fn facts(&self) -> Facts {
        Facts::of_shape(format!("{}-{}", Self::KIND, self.angle_deg), self.size)
    }

    fn check(&self) -> Result<(), BuildError> {
        in_closed("angle_deg", self.angle_deg, 0.0, 85.0)?;
        check_size(self.size)?;
        match self.size % 2 {
            0 => Ok(()),
            _ => Err(ParameterError::new("size", self.size, "an even number").into()),
        }
    }

    fn build(&self, _draw: u64) -> Result<HeightField, BuildError> {
        self.check()?;
        let slope = self.angle_deg.to_radians().tan();
        let half = self.size / 2;
        HeightField::square(self.size, |x, _| slope * x.abs_diff(half) as f64)
    }
}

declare! {
    impl dyn SurfaceSpec, "dimples": "spherical pits (depth above 0) or bumps (below 0) of a radius, at random places, over a share of the plane", [
        "radius = 12\ndepth = 6\ncover = 0.5\nsize = 128",
        "radius = 12\ndepth = -6\nsize = 128",
    ]
    /// Pits or bumps, as a config writes them.
    pub struct DimplesSpec {
        /// Radius of the circle that one cuts out of the plane, cells.
        radius: f64 = 24.0;
        /// Depth of a pit, cells; that of a bump is below 0.
        depth: f64 = 12.0;
        /// Share of the plane that has one, on average.
        cover: f64 = 0.7;
        /// Cells along each axis of a period.
        size: usize = 1024;
        /// Another one gives other places.
        seed: u64 = 1;
    }
}

impl SurfaceSpec for DimplesSpec {
    fn facts(&self) -> Facts {
        let kind = if self.depth < 0.0 { "bumps" } else { "pits" };
        Facts {
            label: format!("{kind}-{}", (self.depth / self.radius).abs()),
            symmetry: Symmetry::FULL,
            // Without any it is a plane.
            is_random: self.depth != 0.0 && self.cover > 0.0,
            cells: self.size * self.size,
        }
    }

    fn check(&self) -> Result<(), BuildError> {
        check_size(self.size)?;
        in_closed("radius", self.radius, 2.0, self.size as f64 / 2.0)?;
        in_closed("depth", self.depth, -self.radius, self.radius)?;
        in_closed("cover", self.cover, 0.0, 0.9999)?;
        Ok(())
    }

    fn build(&self, draw: u64) -> Result<HeightField, BuildError> {
        self.check()?;
        let n = self.size as f64;
        // Places of a Poisson process leave exp(−λ) of the plane free.
        let disk = PI * self.radius * self.radius;
        let count = (-(-self.cover).ln_1p() * n * n / disk).round() as u64;
        let (r, d) = (self.radius, self.depth.abs());
        let sphere = if d > 0.0 {
            (r * r + d * d) / (2.0 * d)
        } else {
            1.0
        };
        let mut heights = vec![0.0f64; self.size * self.size];
        let random = Random::new(self.seed.wrapping_add(draw));
        let reach = r.ceil() as i64;
        for i in 0..count {
            let [x, y] = random.point(i).map(|u: f64| u * n);
            for dy in -reach..=reach {
                for dx in -reach..=reach {
                    let (cx, cy) = (x.floor() + dx as f64, y.floor() + dy as f64);
                    let rho2 = (cx - x).powi(2) + (cy - y).powi(2);
                    if rho2 < r * r && d > 0.0 {
                        let depth = d - sphere + (sphere * sphere - rho2).sqrt();
                        let place = [cx, cy].map(|c| c.rem_euclid(n) as usize);
                        let held = &mut heights[place[1] * self.size + place[0]];
                        *held = held.max(depth);
                    }
                }
            }
        }
        let sign = -self.depth.signum();
        heights.iter_mut().for_each(|h| *h *= sign);
        Ok(HeightField::new([self.size; 2], &heights)?)
    }
}

declare! {
    impl dyn SurfaceSpec, "woven": "plain weave of round threads, thread cells wide", ["thread = 16\nsize = 64"]
    /// A plain weave, as a config writes it.
    pub struct WovenSpec {
        /// Width of a thread, cells.
        thread: usize = 32;
        /// Height of the round of a thread, in its widths; half a circle is 0.5.
        round: f64 = 0.25;
        /// Cells along each axis of a period, an even number of threads.
        size: usize = 256;
    }
}

impl SurfaceSpec for WovenSpec {
    fn facts(&self) -> Facts {
        Facts::of_shape(format!("{}-{}", Self::KIND, self.round), self.size)
    }

    fn check(&self) -> Result<(), BuildError> {
        check_size(self.size)?;
        in_closed("round", self.round, 0.0, 0.5)?;
        if self.thread < 4 || !self.size.is_multiple_of(2 * self.thread.max(1)) {
            let size = self.size;
            let allowed = format!("4 or more, of which size = {size} has an even number");
            return Err(ParameterError::new("thread", self.thread, allowed).into());
        }
        Ok(())
    }

    fn build(&self, _draw: u64) -> Result<HeightField, BuildError> {
        self.check()?;
        let width = self.thread as f64;
        // The round of a thread across it (−1 … 1), and its way over and under the others along it.
        let round = |place: usize| {
            let across = 2.0 * ((place % self.thread) as f64 / width) - 1.0;
            self.round * width * (1.0 - across * across).max(0.0).sqrt()
        };
        let way = |along: usize, thread: usize| {
            let phase = TAU * (along as f64 / (2.0 * width)) - PI / 2.0 + PI * (thread % 2) as f64;
            0.5 * self.round * width * -(phase + PI / 2.0).sin()
        };
        HeightField::square(self.size, |x, y| {
            let warp = round(x) + way(y, x / self.thread);
            let weft = round(y) - way(x, y / self.thread);
            warp.max(weft)
        })
    }
}
