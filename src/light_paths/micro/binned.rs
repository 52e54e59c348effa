//! Light of several mirrors of a surface that looks the same however it is turned: every path is counted at the nodes about its
//! pair, by its shares of them.
//!
//! Of N paths that began as the cosine of the hemisphere, with shares s of a node,
//!
//! f_r = Σ w s π/(N ∫∫ s cos θ_i cos θ_o dω_i dω_o),
//!
//! so that values, linear between nodes, integrate to the light of the paths.

use super::super::accumulate::seen;
use super::super::gathered::{Drawing, more_surface, with_unseen};
use super::super::normals::{BLOCKS, in_block};
use super::super::transport::Transport;
use super::nodes::{Nodes, Shares};
use crate::brdf::{CLASSES, ChannelValues, Channels, Part, Split, SplitErrors};
use crate::sampling::Random;
use rayon::prelude::*;
use smallvec::smallvec;
use std::f64::consts::{FRAC_PI_2, PI};

/// Classes of light that met more than one mirror.
const LATER: usize = CLASSES - 1;

/// Blocks whose sums are held at a time, and numbers in all of them, as far as one block has fewer.
const AT_A_TIME: usize = 16;
const HELD: usize = 1 << 24;

/// Bytes of a channel, of nodes so far apart (rad), while paths are counted.
pub(super) fn channel_bytes(step: f64) -> usize {
    let nodes = Nodes::new(step, 1.0, FRAC_PI_2).len();
    let of_blocks = (AT_A_TIME * LATER * nodes).min(HELD.max(LATER * nodes));
    size_of::<f64>() * (of_blocks + (LATER + 5 * CLASSES) * nodes)
}

/// See the page of the module.
pub(super) struct Binned {
    nodes: Nodes,
    channels: usize,
    /// f_r of each node, class and channel, channels fastest.
    light: Vec<f64>,
    /// Standard errors of luminance at each node: of the classes, and of their sum.
    transport: Vec<[f64; CLASSES]>,
    realisation: Vec<[f64; CLASSES]>,
}

/// What paths brought to the nodes.
struct Sums {
    /// As [`Binned::light`].
    light: Vec<f64>,
    /// Squares of the luminance that one path brought to a node.
    squares: Vec<[f64; CLASSES]>,
}

impl Sums {
    fn new(nodes: &Nodes, channels: usize) -> Self {
        Self {
            light: vec![0.0; nodes.len() * LATER * channels],
            squares: vec![[0.0; CLASSES]; nodes.len()],
        }
    }
}

impl Binned {
    /// Paths through several surfaces of a kind, as many from each of their blocks.
    pub(super) fn new(surfaces: &[Transport], random: &Random, drawing: Drawing) -> Self {
        let nodes = Nodes::new(drawing.radius, 1.0, FRAC_PI_2);
        let followed = &surfaces[0].channels;
        let channels = followed.count();
        let groups = surfaces.len() * BLOCKS;
        let of_group = drawing.rays.div_ceil(groups);
        let follow = |group: usize| {
            let mut stream = random.stream(group as u64);
            let mut sums = Sums::new(&nodes, channels);
            for _ in 0..of_group {
                let mut weight: ChannelValues = smallvec![1.0; channels];
                let start = |u| in_block(group % BLOCKS, u).map(|s| s * drawing.spot);
                let surface = &surfaces[group / BLOCKS];
                let drawn = surface.draw(start, drawing.last, &mut weight, &mut stream);
                let Some(drawn) = drawn.filter(|drawn| drawn.order > 1) else {
                    continue;
                };
                let class = Part::from_order(drawn.order).classes().start - 1;
                for (node, share) in nodes.around(drawn.pair.vectors()) {
                    let light = &mut sums.light[(node * LATER + class) * channels..][..channels];
                    let of_node = light.iter_mut().zip(&weight);
                    of_node.for_each(|(l, w)| *l += share * w);
                    let square = (share * drawn.light).powi(2);
                    sums.squares[node][class] += square;
                    sums.squares[node][LATER] += square;
                }
            }
            sums
        };
        let mut all = Sums::new(&nodes, channels);
        // Sums over groups, and of their squares, of the luminance of the classes and of both.
        let mut moments = vec![[[0.0; 2]; CLASSES]; nodes.len()];
        let numbers = LATER * channels * nodes.len();
        let at_a_time = (HELD / numbers).clamp(1, AT_A_TIME);
        for first in (0..groups).step_by(at_a_time) {
            let some = first..groups.min(first + at_a_time);
            let parts: Vec<Sums> = some.into_par_iter().map(follow).collect();
            for part in parts {
                let add = |(sum, l): (&mut f64, &f64)| *sum += l;
                all.light.iter_mut().zip(&part.light).for_each(add);
                for (node, squares) in part.squares.iter().enumerate() {
                    let light = &part.light[node * LATER * channels..][..LATER * channels];
                    let mut of_class = [0.0; CLASSES];
                    for (class, light) in light.chunks(channels).enumerate() {
                        of_class[class] = followed.luminance(light);
                        of_class[LATER] += of_class[class];
                    }
                    for i in 0..CLASSES {
                        all.squares[node][i] += squares[i];
                        moments[node][i][0] += of_class[i];
                        moments[node][i][1] += of_class[i].powi(2);
                    }
                }
            }
        }
        // What a path brings that is all a node's.
        let begun = (of_group * groups) as f64;
        let scale = nodes.measures().into_iter();
        let scale: Vec<f64> = scale.map(|measure| PI / (measure * begun)).collect();
        for (light, scale) in all.light.chunks_mut(LATER * channels).zip(&scale) {
            light.iter_mut().for_each(|l| *l *= scale);
        }
        let realisation = (0..nodes.len()).map(|node| {
            std::array::from_fn(|i| {
                let [sum, square] = moments[node][i];
                scale[node] * more_surface(groups, sum, square, all.squares[node][i])
            })
        });
        let realisation = realisation.collect();
        let transport = all.squares.iter_mut().zip(&scale).map(|(squares, scale)| {
            with_unseen(squares, 1.0);
            squares.map(|s| scale * s.sqrt())
        });
        Self {
            transport: transport.collect(),
            channels,
            light: all.light,
            realisation,
            nodes,
        }
    }

    /// Nodes about a pair that have light of a part, and what its luminance errs by at each of them, by its share.
    pub(super) fn noise(
        &self,
        pair: [glam::DVec3; 2],
        part: Part,
        mut each: impl FnMut(usize, f64),
    ) {
        let of = |[second, later, sum]: [f64; CLASSES]| {
            SplitErrors([0.0, second, later, sum]).error(part)
        };
        let numbers = LATER * self.channels;
        let is_lit = |node: usize| {
            let light = &self.light[node * numbers..][..numbers];
            let mut classes = light.chunks(self.channels).zip(2..);
            classes.any(|(light, met)| part.holds(met) && light.iter().any(|l| *l > 0.0))
        };
        let about = self.nodes.around(pair).into_iter();
        for (node, share) in about.filter(|(node, _)| is_lit(*node)) {
            let [transport, realisation] =
                [&self.transport, &self.realisation].map(|e| of(e[node]));
            each(node, share * (ALONG * transport).hypot(realisation));
        }
    }

    /// Light at a pair of unit vectors: in the channels that it was `followed` in, for a scene in `channels`.
    pub(super) fn split(
        &self,
        pair: [glam::DVec3; 2],
        followed: &Channels,
        channels: &Channels,
    ) -> Split {
        let shares = self.nodes.around(pair);
        let mut value = [(); CLASSES].map(|()| ChannelValues::from_elem(0.0, self.channels));
        for (node, share) in &shares {
            let light = &self.light[node * LATER * self.channels..][..LATER * self.channels];
            for (value, light) in value[1..].iter_mut().zip(light.chunks(self.channels)) {
                let of_class = value.iter_mut().zip(light);
                of_class.for_each(|(v, l)| *v += share * l);
            }
        }
        Split {
            value: value.map(|v| seen(v, followed, channels)),
            transport: errors(&shares, &self.transport, COMMON),
            realisation: errors(&shares, &self.realisation, 1.0),
        }
    }
}

/// Share of the variance of a node that it has in common with another one about the same pair. Since a path is counted by linear
/// shares it is 1/4 of nodes that differ in one coordinate, 1/16 in two, 1/64 in three; with one number for all, errors are right
/// within 5 %.
const COMMON: f64 = 1.0 / 6.0;

/// Standard error of a sum over nodes along two coordinates, in that of nodes without paths in common. Neighbours along a coordinate have
/// 1/4 of their variance in common, so that a sum has 1 + 2/4 times the variance along each.
const ALONG: f64 = 1.5;

/// Errors at a pair, of nodes that have such a share of their variance in common.
fn errors(shares: &Shares, of_nodes: &[[f64; CLASSES]], common: f64) -> SplitErrors {
    let of = |i: usize| {
        let (mut sum, mut square) = (0.0, 0.0);
        for (node, share) in shares {
            let error = share * of_nodes[*node][i];
            sum += error;
            square += error * error;
        }
        f64::sqrt(common * sum * sum + (1.0 - common) * square)
    };
    SplitErrors([0.0, of(0), of(1), of(LATER)])
}
