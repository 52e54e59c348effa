//! What values of pairs err by together.

use super::super::canonical::{canonical, number, stream};
use super::nodes::Shares;
use super::{AtNodes, Known, Later, MicroSurface, half_vector};
use crate::brdf::{Part, Source, Split};
use crate::geometry::DirectionPair;

/// Kinds of what pairs have in common: a node, the normals of a block, light that is counted.
const AT_NODE: u64 = 0;
const OF_NORMALS: u64 = 1;
const COUNTED: u64 = 2;

impl MicroSurface {
    /// [`SplitBrdf::noise`](crate::brdf::SplitBrdf::noise) of a pair above the horizon, of surfaces whose pairs have values.
    pub(super) fn noise_above(&self, pair: &DirectionPair, each: &mut dyn FnMut(Source, f64)) {
        let part = self.keys.bounces;
        let numbered = |of: u64, place: u64| Source::Common(of << 61 | place);
        let (pair, key) = canonical(pair, self.symmetry);
        let own = Source::Pair(number(&key));
        let Known { at_nodes, later } = self.known();
        let Some(mirrors) = &self.mirrors else {
            // What another surface would do cancels in sums over directions: what does not leave to one leaves to others.
            return match at_nodes {
                Some((nodes, AtNodes::Lit(lit))) => {
                    for (node, share) in nodes.around(pair) {
                        let error = share * lit[node].error(part);
                        each(numbered(AT_NODE, node as u64), error);
                    }
                }
                _ => {
                    let lit = self.lit(pair, &mut stream(&self.random, &key));
                    each(own, lit.error(part));
                }
            };
        };
        let luminance = |split: &Split| self.channels.luminance(&split.part(part));
        let first = part.holds(1).then(|| self.first(mirrors, pair, &key));
        // Where nothing was found, of all that might be there the sum is known: what was found elsewhere errs by it.
        if let Some(first) = first.filter(|first| luminance(first) > 0.0) {
            let mut of_normals = Vec::new();
            let images = self.images(half_vector(pair));
            let density = mirrors
                .density
                .noise(&mirrors.normals, &images, |block, error| {
                    of_normals.push((block, error));
                });
            let scale = luminance(&first) / density;
            for (block, error) in of_normals {
                each(numbered(OF_NORMALS, block as u64), scale * error);
            }
            match at_nodes {
                Some((nodes, AtNodes::Seen(seen))) => {
                    let of_nodes = nodes.around(pair).into_iter();
                    let of_nodes: Shares = of_nodes
                        .map(|(node, share)| (node, share * seen[node][1]))
                        .collect();
                    let all = of_nodes.iter().fold(0.0, |all: f64, (_, e)| all.hypot(*e));
                    for (node, error) in of_nodes.into_iter().filter(|(_, e)| *e > 0.0) {
                        let error = first.transport.error(Part::All) * error / all;
                        each(numbered(AT_NODE, node as u64), error);
                    }
                }
                _ => each(own, first.transport.error(Part::All)),
            }
        }
        match later {
            Some(Later::Binned(binned)) => {
                binned.noise(pair, part, |node, error| {
                    each(numbered(COUNTED, node as u64), error)
                });
            }
            Some(Later::Gathered(gathered)) => {
                let split = gathered.split(pair, &self.surfaces[0].channels, &self.channels);
                let split = split.only(part);
                if luminance(&split) > 0.0 {
                    each(numbered(COUNTED, gathered.place(pair)), split.error(part));
                }
            }
            None => {}
        }
    }
}
