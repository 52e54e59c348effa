//! A weighted sum of materials: a lacquer over a diffuse base, a blend of two lobes.
//!
//! f_r = Σ_j w_j f_j, each weight w_j in [0, 10⁶], at least one component; components may be sums.
//!
//! Where one component has no data the sum has none. It has the symmetries all its components have,
//! and conserves energy if they do and the weights sum to at most 1 (to rounding).

use super::{
    Brdf, BrdfSpec, BuildError, ChannelValues, Channels, Favours, Presence, SampleBrdf, Tables,
};
use crate::error::{ParameterError, in_closed};
use crate::geometry::{Direction, DirectionPair, Symmetry};
use crate::registry::{self, Entry, ReadError, Table, only};
use serde::Deserialize;
use serde::de::IgnoredAny;

const KIND: &str = "sum";

/// The registry entry.
pub const ENTRY: Entry<dyn BrdfSpec> = Entry {
    kind: KIND,
    summary: "weighted sum of other materials",
    examples: &[
        "component = [{ weight = 0.5, brdf = { kind = \"lambert\", albedo = 0.8 } }, { weight = 0.5, brdf = { kind = \"ggx\", alpha = 0.1 } }]",
        "component = [{ weight = 0.6, brdf = { kind = \"ward\", alpha = [0.1, 0.3] } }, { weight = 0.9, brdf = { kind = \"test-s\" } }]",
    ],
    read,
};

/// A weighted sum, as a config writes it.
#[derive(Debug)]
pub struct SumSpec {
    /// The terms of the sum.
    pub component: Vec<ComponentSpec>,
}

/// A term of the sum.
#[derive(Debug)]
pub struct ComponentSpec {
    /// Its weight, 0 or more.
    pub weight: f64,
    /// Its material.
    pub brdf: Box<dyn BrdfSpec>,
}

/// The keys of a component; `brdf` is taken out before and listed for the message about an unknown one.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ComponentKeys {
    weight: f64,
    #[serde(rename = "brdf")]
    _brdf: Option<IgnoredAny>,
}

fn read(mut table: Table<'_>) -> Result<Box<dyn BrdfSpec>, ReadError> {
    let span = table.span();
    let items = registry::take_tables(&mut table, "component")?;
    only!(table, "component")?;
    let Some(items) = items else {
        let message = "component is missing from the sum; allowed: an array of { weight, brdf }";
        return Err(ReadError::new(span, message));
    };
    let component = items.into_iter().map(read_component);
    Ok(Box::new(SumSpec {
        component: component.collect::<Result<_, _>>()?,
    }))
}

fn read_component(mut item: Table<'_>) -> Result<ComponentSpec, ReadError> {
    let span = item.span();
    let brdf = registry::take_table(&mut item, "brdf")?;
    let ComponentKeys { weight, .. } = registry::parse(item)?;
    let Some(brdf) = brdf else {
        let message = "brdf is missing from a component; allowed: a table with a kind";
        return Err(ReadError::new(span, message));
    };
    Ok(ComponentSpec {
        weight,
        brdf: super::read(brdf)?,
    })
}

impl BrdfSpec for SumSpec {
    fn resolved(&self) -> registry::Keys {
        let components = self.component.iter().map(|c| {
            let mut item = registry::Keys::new();
            item.insert("weight".into(), c.weight.into());
            item.insert("brdf".into(), c.brdf.resolved().into());
            registry::Value::from(item)
        });
        registry::nested(KIND, "component", components.collect::<Vec<_>>())
    }

    fn label(&self) -> String {
        let terms = self.component.iter();
        terms.fold(KIND.to_owned(), |label, c| {
            format!("{label}-{}-{}", c.weight, c.brdf.label())
        })
    }

    fn check(&self, channels: &Channels) -> Result<(), BuildError> {
        if self.component.is_empty() {
            return Err(ParameterError::new("component", "[]", "at least one component").into());
        }
        for (j, c) in self.component.iter().enumerate() {
            in_closed(&format!("component[{j}].weight"), c.weight, 0.0, 1e6)?;
            c.brdf.check(channels).map_err(inside(j))?;
        }
        Ok(())
    }

    fn favours(&self) -> Favours {
        // What is the same everywhere bends no isoline, and a weight of 0 adds nothing.
        let terms = self.component.iter();
        let mut said = terms
            .filter(|c| c.weight > 0.0 && !c.brdf.is_constant())
            .map(|c| c.brdf.favours());
        let first = said
            .next()
            .filter(|first| said.all(|other| other == *first));
        first.unwrap_or(Favours::Neither)
    }

    fn is_constant(&self) -> bool {
        let mut terms = self.component.iter();
        terms.all(|c| c.weight == 0.0 || c.brdf.is_constant())
    }

    fn build(&self, channels: Channels) -> Result<Box<dyn Brdf>, BuildError> {
        self.check(&channels)?;
        let built = self.component.iter().enumerate().map(|(j, c)| {
            let brdf = c.brdf.build(channels.clone()).map_err(inside(j))?;
            Ok((c.weight, brdf))
        });
        let components = built.collect::<Result<_, BuildError>>()?;
        Ok(Box::new(Sum::new(components, channels)))
    }

    fn remarks(&self) -> Vec<String> {
        let components = self.component.iter();
        components.flat_map(|c| c.brdf.remarks()).collect()
    }

    fn tables(&self) -> Tables {
        let mut all = Tables::NONE;
        for c in &self.component {
            let tables = c.brdf.tables();
            all.files.extend(tables.files);
            all.channel_bytes += tables.channel_bytes;
        }
        all
    }
}

/// An error about the material of a component.
fn inside(component: usize) -> impl Fn(BuildError) -> BuildError {
    move |e| e.within(&format!("component[{component}].brdf"))
}

/// A weighted sum of BRDFs.
pub struct Sum {
    channels: Channels,
    components: Vec<(f64, Box<dyn Brdf>)>,
    total_weight: f64,
}

impl Sum {
    /// The sum of weight × BRDF; every BRDF must have been built for `channels`.
    pub fn new(components: Vec<(f64, Box<dyn Brdf>)>, channels: Channels) -> Self {
        debug_assert!(components.iter().all(|(_, f)| *f.channels() == channels));
        Self {
            channels,
            total_weight: components.iter().map(|(w, _)| w).sum(),
            components,
        }
    }
}

impl Brdf for Sum {
    fn channels(&self) -> &Channels {
        &self.channels
    }

    fn symmetry(&self) -> Symmetry {
        let each = self.components.iter().map(|(_, f)| f.symmetry());
        each.fold(Symmetry::FULL, Symmetry::and)
    }

    fn conserves_energy(&self) -> bool {
        // Weights such as 0.1 + 0.2 + 0.7 may sum to an ulp above 1.
        self.total_weight <= 1.0 + 1e-12
            && self.components.iter().all(|(_, f)| f.conserves_energy())
    }

    fn is_mirrored(&self) -> bool {
        self.components.iter().all(|(_, f)| f.is_mirrored())
    }

    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        out.fill(0.0);
        let mut values = ChannelValues::from_elem(0.0, out.len());
        for (weight, brdf) in &self.components {
            if brdf.eval(pair, &mut values) == Presence::Missing {
                out.fill(0.0);
                return Presence::Missing;
            }
            for (out, value) in out.iter_mut().zip(values.iter()) {
                *out += weight * value;
            }
        }
        Presence::Present
    }

    fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64], presence: &mut [Presence]) {
        let n = self.channels.count();
        out.fill(0.0);
        presence.fill(Presence::Present);
        let mut values = vec![0.0; out.len()];
        let mut present = vec![Presence::Present; presence.len()];
        for (weight, brdf) in &self.components {
            brdf.eval_batch(pairs, &mut values, &mut present);
            for (out, value) in out.iter_mut().zip(&values) {
                *out += weight * value;
            }
            for (sum, component) in presence.iter_mut().zip(&present) {
                if *component == Presence::Missing {
                    *sum = Presence::Missing;
                }
            }
        }
        for (out, presence) in out.chunks_exact_mut(n).zip(presence) {
            if *presence == Presence::Missing {
                out.fill(0.0);
            }
        }
    }

    fn as_sample(&self) -> Option<&dyn SampleBrdf> {
        let all = self.components.iter().all(|(_, f)| f.as_sample().is_some());
        (all && self.total_weight > 0.0).then_some(self)
    }
}

impl SampleBrdf for Sum {
    /// Draws from a component, chosen in proportion to its weight.
    fn sample(&self, omega_o: Direction, [u, v]: [f64; 2]) -> Option<Direction> {
        let mut rest = u * self.total_weight;
        for (weight, brdf) in &self.components {
            if rest < *weight {
                // What is left of u after the choice is again uniform.
                return brdf.as_sample()?.sample(omega_o, [rest / weight, v]);
            }
            rest -= weight;
        }
        // u < 1 ends here only when the last weight is missed by rounding.
        None
    }

    fn pdf(&self, pair: &DirectionPair) -> f64 {
        let components = self.components.iter();
        let sum: f64 = components
            .filter_map(|(weight, f)| Some(weight * f.as_sample()?.pdf(pair)))
            .sum();
        sum / self.total_weight
    }
}
