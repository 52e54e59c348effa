//! Materials of a program: functions of Python, arrays, and any material inside a config.

use crate::arrays::{list, numbers, other_shape, shape, slice, vectors};
use crate::errors::refused;
use crate::material::{Origin, PyMaterial, channel_names};
use gonio::brdf::{self, Brdf, BrdfSpec, BuildError, Channels, InChannels, Presence};
use gonio::error::{ParameterError, listed};
use gonio::geometry::{DirectionPair, Symmetry};
use gonio::parametrization::{AxisKind, Parametrization, by_name};
use gonio::registry::{self, Entry, Keys, ReadError};
use numpy::PyUntypedArrayMethods;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;
use serde::{Deserialize, Serialize};
use std::cell::Cell;
use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, Once, PoisonError, Weak};

/// The kind of a material that a config has as an object of Python.
pub const KIND: &str = "given";

/// The first error of a function during the call of the library that goes on.
static FAILED: Mutex<Option<PyErr>> = Mutex::new(None);

/// Held by the call of the library that goes on, if there are functions: an error is raised by the call that it happened in.
static CALL: Mutex<()> = Mutex::new(());

/// True once there was a function.
static FUNCTIONS: AtomicBool = AtomicBool::new(false);

thread_local! {
    /// True while this thread is in a function, which may call the library itself.
    static INSIDE: Cell<bool> = const { Cell::new(false) };
}

/// Materials in configs, by their numbers.
static GIVEN: Mutex<Vec<(String, Weak<dyn Brdf>)>> = Mutex::new(Vec::new());

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Does what may call functions of Python, without its lock; the first error of a function is raised. In a function that calls the
/// library an error of another function ends the outer call too.
pub fn detached<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    if !FUNCTIONS.load(Ordering::Relaxed) {
        return Ok(py.detach(work));
    }
    if INSIDE.get() {
        let done = py.detach(work);
        return match &*locked(&FAILED) {
            Some(error) => Err(error.clone_ref(py)),
            None => Ok(done),
        };
    }
    // The lock of Python is free while this waits for another thread's call.
    let (done, failed) = py.detach(|| {
        let _call = locked(&CALL);
        let done = work();
        (done, locked(&FAILED).take())
    });
    failed.map_or(Ok(done), Err)
}

/// A BRDF whose values a function of Python has.
pub struct Function {
    pub function: Py<PyAny>,
    pub name: String,
    pub channels: Channels,
    pub symmetry: Symmetry,
}

impl Function {
    /// Writes what the function returns for pairs above the horizon.
    fn call(&self, py: Python<'_>, pairs: &[DirectionPair], out: &mut [f64]) -> PyResult<()> {
        let light = vectors(py, pairs.iter().map(|p| p.omega_i))?;
        let sensor = vectors(py, pairs.iter().map(|p| p.omega_o))?;
        let outer = INSIDE.replace(true);
        let found = self.function.bind(py).call1((light, sensor));
        INSIDE.set(outer);
        let found = found.map_err(|e| {
            // An interrupt, or an exit, is no mistake of the function.
            if !e.is_instance_of::<PyException>(py) {
                return e;
            }
            let text = e.to_string();
            let first = text.lines().next().unwrap_or_default();
            let why = refused(format!("{}: the function raised {first}", self.name));
            why.set_cause(py, Some(e));
            why
        })?;
        let what = format!("{}: what the function returns", self.name);
        let values = numbers(&found, &what)?;
        let (n, channels) = (pairs.len(), self.channels.count());
        let is_flat = *values.shape() == [n] && channels == 1;
        if !is_flat && *values.shape() != [n, channels] {
            let allowed = match channels {
                1 => format!("({n},) or ({n}, 1)"),
                _ => format!("({n}, {channels})"),
            };
            let shape = shape(&values);
            return Err(refused(format!(
                "{what} has the shape {shape} for {n} pairs; allowed: {allowed}"
            )));
        }
        let values = slice(&values)?;
        if let Some(i) = values.iter().position(|f| !(f.is_finite() && *f >= 0.0)) {
            let (pair, f) = (&pairs[i / channels], values[i]);
            let [i, o] = [pair.omega_i, pair.omega_o].map(|d| d.vector().to_array());
            return Err(refused(format!(
                "{what} is {f} for omega_i = {i:?}, omega_o = {o:?}; allowed: finite numbers of at least 0"
            )));
        }
        out.copy_from_slice(values);
        Ok(())
    }

    /// A function as a BRDF.
    pub fn shared(self) -> Arc<Self> {
        FUNCTIONS.store(true, Ordering::Relaxed);
        Arc::new(self)
    }
}

impl Brdf for Function {
    fn channels(&self) -> &Channels {
        &self.channels
    }

    fn symmetry(&self) -> Symmetry {
        self.symmetry
    }

    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        let mut presence = [Presence::Present];
        self.eval_batch(std::slice::from_ref(pair), out, &mut presence);
        presence[0]
    }

    fn eval_batch(&self, pairs: &[DirectionPair], out: &mut [f64], presence: &mut [Presence]) {
        presence.fill(Presence::Present);
        out.fill(0.0);
        let is_up = |p: &DirectionPair| p.omega_i.cos_theta() > 0.0 && p.omega_o.cos_theta() > 0.0;
        let up: Vec<usize> = (0..pairs.len()).filter(|&i| is_up(&pairs[i])).collect();
        // After an error nothing is worth a call: the values are thrown away.
        if up.is_empty() || locked(&FAILED).is_some() {
            return;
        }
        let n = self.channels.count();
        let seen: Vec<DirectionPair> = up.iter().map(|&i| pairs[i]).collect();
        let mut values = vec![0.0; seen.len() * n];
        match Python::attach(|py| self.call(py, &seen, &mut values)) {
            Ok(()) => {
                for (&i, values) in up.iter().zip(values.chunks_exact(n)) {
                    out[i * n..(i + 1) * n].copy_from_slice(values);
                }
            }
            Err(e) => {
                locked(&FAILED).get_or_insert(e);
            }
        }
    }
}

/// True if keys name a material that only this process has.
pub fn is_of_process(keys: &toml::Value) -> bool {
    match keys {
        toml::Value::Table(table) => {
            let kind = table.get("kind").and_then(toml::Value::as_str);
            kind == Some(KIND) || table.values().any(is_of_process)
        }
        toml::Value::Array(all) => all.iter().any(is_of_process),
        _ => false,
    }
}

/// A BRDF between the nodes of a lattice of coordinates, linear along each axis.
#[derive(Serialize, Deserialize)]
pub struct Array {
    #[serde(with = "by_name")]
    form: Arc<dyn Parametrization>,
    /// Increasing nodes of each axis.
    nodes: Vec<Vec<f64>>,
    /// The values, the last axis and then channels fastest.
    values: Vec<f64>,
    channels: Channels,
}

impl Array {
    /// Refuses an array of a pickle whose values are not as many as its nodes have.
    pub fn checked(self) -> PyResult<Self> {
        let nodes = self.nodes.iter().map(Vec::len).product::<usize>();
        let damaged = "this pickle is damaged; allowed: one that gonio made";
        match nodes * self.channels.count() == self.values.len() {
            true => Ok(self),
            false => Err(refused(damaged)),
        }
    }

    /// From an array of `axes` and, if there are several, channels. Refused are nodes that do not increase or are outside the ranges,
    /// another shape, and a value below 0.
    pub fn new(
        values: &Bound<'_, PyAny>,
        axes: &[Bound<'_, PyAny>],
        form: Arc<dyn Parametrization>,
        channels: Channels,
    ) -> PyResult<Self> {
        let all = form.axes();
        if axes.len() != all.len() {
            let (found, names) = (axes.len(), listed(all.iter().map(|a| a.symbol)));
            return Err(refused(format!(
                "axes are {found}; allowed: one list of nodes for each of {names}"
            )));
        }
        let nodes = axes.iter().zip(all).map(|(nodes, axis)| {
            let nodes = list(nodes, axis.symbol)?;
            let [least, most] = axis.range;
            let inside = |x: &f64| (least..=most).contains(x);
            let increase = nodes.windows(2).all(|w| w[0] < w[1]);
            if nodes.is_empty() || !increase || !nodes.iter().all(inside) {
                let allowed = format!("increasing numbers from {least} to {most}");
                let name = axis.symbol;
                return Err(refused(format!("{name} = {nodes:?}; allowed: {allowed}")));
            }
            Ok(nodes)
        });
        let nodes: Vec<Vec<f64>> = nodes.collect::<PyResult<_>>()?;
        let array = numbers(values, "values")?;
        let count = channels.count();
        let mut wanted: Vec<usize> = nodes.iter().map(Vec::len).collect();
        if count > 1 {
            wanted.push(count);
        }
        if array.shape() != wanted {
            let channels = if count > 1 { " and the channels" } else { "" };
            let allowed = format!("{wanted:?}, the nodes of the axes{channels}");
            return Err(other_shape("values", &array, allowed));
        }
        let values = slice(&array)?.to_vec();
        if let Some(f) = values.iter().find(|f| !(f.is_finite() && **f >= 0.0)) {
            let message = format!("values has {f}; allowed: finite numbers of at least 0");
            return Err(refused(message));
        }
        Ok(Self {
            form,
            nodes,
            values,
            channels,
        })
    }

    /// The nodes on both sides of a coordinate, and the weight of the second. Beyond the last node that is the first one of a period
    /// further on, or of no weight.
    fn around(&self, axis: usize, x: f64) -> ([usize; 2], f64) {
        let (nodes, about) = (&self.nodes[axis], &self.form.axes()[axis]);
        let last = nodes.len() - 1;
        let above = nodes.partition_point(|node| *node <= x);
        if (1..=last).contains(&above) {
            let [a, b] = [nodes[above - 1], nodes[above]];
            return ([above - 1, above], (x - a) / (b - a));
        }
        if about.kind != AxisKind::Periodic {
            let end = if above == 0 { 0 } else { last };
            return ([end, end], 0.0);
        }
        let gap = nodes[0] + about.length() - nodes[last];
        let from = x - nodes[last] + if above == 0 { about.length() } else { 0.0 };
        ([last, 0], if gap > 0.0 { from / gap } else { 0.0 })
    }
}

impl Brdf for Array {
    fn channels(&self) -> &Channels {
        &self.channels
    }

    fn symmetry(&self) -> Symmetry {
        self.form.symmetry()
    }

    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        out.fill(0.0);
        if pair.omega_i.cos_theta() <= 0.0 || pair.omega_o.cos_theta() <= 0.0 {
            return Presence::Present;
        }
        let coords = self.form.forward(pair);
        let n = self.nodes.len();
        let mut around = [([0; 2], 0.0); 4];
        for (axis, around) in around[..n].iter_mut().enumerate() {
            *around = self.around(axis, coords[axis]);
        }
        for corner in 0..1_usize << n {
            let (mut at, mut weight) = (0, 1.0);
            for (axis, (ends, share)) in around[..n].iter().enumerate() {
                let side = corner >> axis & 1;
                at = at * self.nodes[axis].len() + ends[side];
                weight *= if side == 1 { *share } else { 1.0 - share };
            }
            if weight != 0.0 {
                let values = &self.values[at * out.len()..];
                let pairs = out.iter_mut().zip(values);
                pairs.for_each(|(o, v)| *o += weight * v);
            }
        }
        Presence::Present
    }
}

/// What a config has in the place of an object: its number.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Number {
    number: i64,
}

/// The keys of the material of a number.
fn numbered(number: i64) -> Keys {
    registry::resolved(KIND, &Number { number })
}

/// The keys of a material in a config: its own, or a number where it has none.
pub fn keys_of(material: &PyMaterial) -> toml::Table {
    if let Origin::Keys(keys) = &material.origin {
        return keys.clone();
    }
    static JOIN: Once = Once::new();
    JOIN.call_once(|| _ = brdf::join(ENTRY));
    let mut given = locked(&GIVEN);
    let this = Arc::downgrade(&material.brdf);
    let known = given.iter().position(|(_, brdf)| brdf.ptr_eq(&this));
    let number = known.unwrap_or_else(|| {
        given.push((material.label.clone(), this));
        given.len() - 1
    });
    numbered(number as i64)
}

const ENTRY: Entry<dyn BrdfSpec> = Entry {
    kind: KIND,
    summary: "a gonio.Material of Python",
    examples: &[],
    read: |table| {
        let Number { number } = registry::parse(table)?;
        let given = locked(&GIVEN);
        let found = usize::try_from(number).ok().and_then(|n| given.get(n));
        let brdf = found.and_then(|(name, brdf)| Some((name.clone(), brdf.upgrade()?)));
        match brdf {
            Some((name, brdf)) => Ok(Box::new(Given { number, name, brdf })),
            None => Err(ReadError {
                message: format!("number = {number}: allowed is a gonio.Material in its place"),
                span: None,
            }),
        }
    },
};

/// A material of Python, as a config has it.
struct Given {
    number: i64,
    name: String,
    brdf: Arc<dyn Brdf>,
}

impl fmt::Debug for Given {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.name, self.number)
    }
}

impl BrdfSpec for Given {
    fn resolved(&self) -> Keys {
        numbered(self.number)
    }

    fn label(&self) -> String {
        self.name.clone()
    }

    fn check(&self, channels: &Channels) -> Result<(), BuildError> {
        let held = self.brdf.channels();
        if channels == held || *channels == Channels::Luminance {
            return Ok(());
        }
        let [held, asked] = [held, channels].map(|c| channel_names(c).join(", "));
        let allowed = format!("luminance, or {held} as {} has", self.name);
        Err(ParameterError::new("channels", asked, allowed).into())
    }

    fn held_channels(&self) -> Result<Option<Channels>, BuildError> {
        Ok(Some(self.brdf.channels().clone()))
    }

    fn symmetry(&self, _channels: &Channels) -> Result<Symmetry, BuildError> {
        Ok(self.brdf.symmetry())
    }

    fn build(&self, channels: Channels) -> Result<Box<dyn Brdf>, BuildError> {
        self.check(&channels)?;
        Ok(Box::new(InChannels::new(Arc::clone(&self.brdf), channels)))
    }
}
