//! Arrays in and out: directions, numbers, columns.

use crate::errors::{refused, warn};
use crate::given::detached;
use crate::shapes::{Along, batch, broadcast, tuple};
use gonio::brdf::{Brdf, Presence};
use gonio::error::listed;
use gonio::geometry::{Direction, DirectionPair};
use numpy::{
    PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods,
};
use pyo3::exceptions::{PyMemoryError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::fmt::Display;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A new array of any shape.
pub type Shaped<'py> = PyResult<Bound<'py, PyArrayDyn<f64>>>;

/// Two new arrays of one shape.
pub type Both<'py> = (Bound<'py, PyArrayDyn<f64>>, Bound<'py, PyArrayDyn<f64>>);

/// A new array of rows of numbers, (n, width).
pub type Matrix<'py> = PyResult<Bound<'py, PyArray2<f64>>>;

/// Rows of a task: its cost is far below theirs, and their values stay in a core's own cache.
const CHUNK: usize = 1024;

/// Squared lengths this near 1 are those of unit vectors: such a vector is taken as it is, so that one that came from
/// here goes back to the bit.
const UNIT: f64 = 4.0 * f64::EPSILON;

/// An array's numbers, f64, C-contiguous and aligned; what is masked is NaN. `None` of what is no real number: a cast would drop
/// imaginary parts, and read texts.
fn cast<'py>(value: &Bound<'py, PyAny>) -> PyResult<Result<Bound<'py, PyAny>, String>> {
    let py = value.py();
    let numpy = py.import("numpy")?;
    // One that is masked stays so.
    let array = numpy.call_method1("asanyarray", (value,))?;
    let dtype = array.getattr("dtype")?;
    let kind: char = dtype.getattr("kind")?.extract()?;
    if !"biuf".contains(kind) {
        return Ok(Err(dtype.getattr("name")?.extract()?));
    }
    let keys = PyDict::new(py);
    keys.set_item("dtype", "float64")?;
    let array = match array.hasattr("mask")? && array.hasattr("filled")? {
        // Integers have no NaN.
        true => {
            let floats = array.call_method1("astype", ("float64",))?;
            floats.call_method1("filled", (f64::NAN,))?
        }
        false => array,
    };
    let array = numpy.call_method("ascontiguousarray", (array,), Some(&keys))?;
    // A field of packed records may be contiguous, but at odd addresses.
    Ok(Ok(numpy.call_method1("require", (array, py.None(), "A"))?))
}

/// Any array-like as numbers in rows: cast to f64 and copied only where it is not so already; NaN where it is masked.
pub fn numbers<'py>(
    value: &Bound<'py, PyAny>,
    name: &str,
) -> PyResult<PyReadonlyArrayDyn<'py, f64>> {
    let py = value.py();
    let array = cast(value).map_err(|e| {
        // An interrupt or a lack of memory is not the array's fault.
        if !e.is_instance_of::<PyTypeError>(py) && !e.is_instance_of::<PyValueError>(py) {
            return e;
        }
        let kind = value.get_type().name();
        let kind = kind.map_or("object".into(), |n| n.to_string());
        refused(format!(
            "{name} is a {kind} without numbers; allowed: an array of numbers"
        ))
    })?;
    let array = array.map_err(|dtype| {
        let kind = match dtype.as_str() {
            "object" => "objects".into(),
            text if text.starts_with("str") || text.starts_with("bytes") => "texts".into(),
            other => format!("{other} numbers"),
        };
        refused(format!(
            "{name} has {kind}; allowed: an array of real numbers"
        ))
    })?;
    array.extract::<PyReadonlyArrayDyn<'py, f64>>()
}

/// The numbers of an array in memory's order.
pub fn slice<'a>(array: &'a PyReadonlyArrayDyn<'_, f64>) -> PyResult<&'a [f64]> {
    array.as_slice().map_err(refused)
}

/// The shape of an array as Python writes it.
pub fn shape(array: &PyReadonlyArrayDyn<'_, f64>) -> String {
    tuple(array.shape())
}

/// A refusal of an array of another shape.
pub fn other_shape(
    name: &str,
    array: &PyReadonlyArrayDyn<'_, f64>,
    allowed: impl Display,
) -> PyErr {
    let shape = shape(array);
    refused(format!("{name} has the shape {shape}; allowed: {allowed}"))
}

/// One number a row.
pub fn list(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<f64>> {
    let array = numbers(value, name)?;
    match array.shape().len() {
        1 => Ok(slice(&array)?.to_vec()),
        _ => Err(other_shape(name, &array, "(n,)")),
    }
}

/// Warns of angles beyond a turn: degrees, where radians are asked for.
pub fn doubt_degrees<'a>(
    py: Python<'_>,
    name: &str,
    angles: impl IntoIterator<Item = &'a f64>,
) -> PyResult<()> {
    let finite = angles.into_iter().copied().filter(|x| x.is_finite());
    let larger = |most: f64, x: f64| if x.abs() > most.abs() { x } else { most };
    let largest = finite.fold(0.0, larger);
    // A turn as f32 has it is one too.
    if largest.abs() <= TAU * (1.0 + 1e-6) {
        return Ok(());
    }
    let hint = "angles are in radians, and np.radians converts degrees";
    warn(
        py,
        &format!("{name} has the angle {largest}, beyond 2π: {hint}"),
    )
}

/// Warns of directions below the horizon: how many of `count` rows have each of the arguments there.
fn doubt_horizon(py: Python<'_>, below: &[(&str, usize)], count: usize) -> PyResult<()> {
    let below = below.iter().filter(|(_, n)| *n > 0);
    let parts = listed(below.map(|(name, n)| format!("{name} in {n} of {count}")));
    if parts.is_empty() {
        return Ok(());
    }
    let why = "directions point away from the surface, and f_r is 0 below it";
    warn(py, &format!("below the horizon (z < 0) is {parts}: {why}"))
}

/// True of a direction that no BRDF is defined for; the horizon itself is none.
fn is_below(direction: Direction) -> bool {
    direction.cos_theta() < 0.0
}

/// Numbers of pairs whose light and whose sensor are below the horizon.
fn below(pairs: &[DirectionPair]) -> [usize; 2] {
    let [light, sensor]: [fn(&DirectionPair) -> Direction; 2] = [|p| p.omega_i, |p| p.omega_o];
    [light, sensor].map(|of| pairs.iter().filter(|pair| is_below(of(pair))).count())
}

/// Directions as Python gives them.
pub struct Directions<'py> {
    name: &'static str,
    array: PyReadonlyArrayDyn<'py, f64>,
    /// 3 of vectors, 2 of angles.
    width: usize,
}

impl<'py> Directions<'py> {
    /// Directions from (…, 3) vectors or (…, 2) angles.
    pub fn read(value: &Bound<'py, PyAny>, name: &'static str) -> PyResult<Self> {
        let array = numbers(value, name)?;
        let Some(&width @ (2 | 3)) = array.shape().last() else {
            let allowed = "(…, 3) vectors, or (…, 2) angles theta and phi in radians";
            return Err(other_shape(name, &array, allowed));
        };
        if width == 2 {
            doubt_degrees(value.py(), name, slice(&array)?)?;
        }
        Ok(Self { name, array, width })
    }

    /// Its name, its shape, and the axes of a row: for [`broadcast`].
    pub fn shape(&self) -> (&str, &[usize], usize) {
        (self.name, self.array.shape(), 1)
    }

    /// The lengths before the last.
    pub fn batch(&self) -> &[usize] {
        batch(self.array.shape(), 1)
    }

    /// The rows, which another thread may read, broadcast to a shape.
    pub fn rows<'a>(&'a self, to: &'a [usize]) -> PyResult<Rows<'a>> {
        let along = Along::new(self.array.shape(), 1, to);
        Ok(Rows {
            name: self.name,
            values: slice(&self.array)?,
            width: self.width,
            along,
            is_whole: along.own == to,
        })
    }
}

/// Rows of vectors or angles.
#[derive(Clone, Copy)]
pub struct Rows<'a> {
    name: &'static str,
    values: &'a [f64],
    width: usize,
    along: Along<'a>,
    /// True if no row stands for several.
    is_whole: bool,
}

impl<'a> Rows<'a> {
    fn get(&self, row: usize) -> Option<Direction> {
        let at = self.along.at(row) * self.width;
        direction_of(self.values.get(at..at + self.width)?)
    }

    /// Rows from one on, where they are vectors and no row stands for several.
    fn vectors(&self, first: usize, count: usize) -> Option<&'a [f64]> {
        let plain = self.is_whole && self.width == 3;
        plain.then(|| self.values.get(3 * first..3 * (first + count)))?
    }

    /// Every direction; an error names the first row that is none.
    pub fn all(&self) -> PyResult<Vec<Direction>> {
        let rows = 0..self.along.to.iter().product();
        rows.map(|row| self.get(row).ok_or_else(|| refused(self.sentence(row))))
            .collect()
    }

    /// Every direction as of [`all`](Self::all), with a warning of those below the horizon.
    pub fn above(&self, py: Python<'_>) -> PyResult<Vec<Direction>> {
        let all = self.all()?;
        let below = all.iter().filter(|d| is_below(**d)).count();
        doubt_horizon(py, &[(self.name, below)], all.len())?;
        Ok(all)
    }

    /// The sentence about a row that is no direction.
    fn sentence(&self, row: usize) -> String {
        let at = self.along.at(row) * self.width;
        let values = listed(self.values.get(at..at + self.width).unwrap_or_default());
        let (name, index) = (self.name, self.along.index(row));
        format!(
            "{name}{index} is ({values}), which is no direction; allowed: finite numbers, not all 0"
        )
    }
}

/// The direction of a vector, or of angles.
#[inline]
fn direction_of(row: &[f64]) -> Option<Direction> {
    match *row {
        [x, y, z] => {
            let v = glam::DVec3::new(x, y, z);
            match (v.length_squared() - 1.0).abs() <= UNIT {
                true => Some(Direction::from_unit(v)),
                false => Direction::try_new(v),
            }
        }
        [theta, phi] if theta.is_finite() && phi.is_finite() => {
            Some(Direction::from_spherical(theta, phi))
        }
        _ => None,
    }
}

/// Rows of light and sensor directions.
#[derive(Clone, Copy)]
pub struct Pairs<'a> {
    light: Rows<'a>,
    sensor: Rows<'a>,
    count: usize,
}

/// Light and sensor directions as Python gives them.
pub struct Sides<'py> {
    light: Directions<'py>,
    sensor: Directions<'py>,
    /// The shape that both broadcast to, without that of a direction.
    pub shape: Vec<usize>,
}

impl<'py> Sides<'py> {
    /// The arguments `omega_i` and `omega_o` of a function.
    pub fn read(omega_i: &Bound<'py, PyAny>, omega_o: &Bound<'py, PyAny>) -> PyResult<Self> {
        let light = Directions::read(omega_i, "omega_i")?;
        let sensor = Directions::read(omega_o, "omega_o")?;
        let shape = broadcast(light.shape(), sensor.shape())?;
        Ok(Self {
            light,
            sensor,
            shape,
        })
    }

    /// The pairs, the last axis fastest.
    pub fn pairs(&self) -> PyResult<Pairs<'_>> {
        let mut lengths = self.shape.iter();
        let count = lengths.try_fold(1, |n: usize, k| n.checked_mul(*k));
        Ok(Pairs {
            count: count.ok_or_else(too_many)?,
            light: self.light.rows(&self.shape)?,
            sensor: self.sensor.rows(&self.shape)?,
        })
    }
}

/// What is raised where two arrays broadcast to more than memory holds.
fn too_many() -> PyErr {
    PyMemoryError::new_err("omega_i and omega_o make more pairs than memory holds; allowed: fewer")
}

/// Numbers, all 0.
fn zeros(count: usize, width: usize) -> PyResult<Vec<f64>> {
    let all = count.checked_mul(width).ok_or_else(too_many)?;
    // A lack of memory would end the process.
    let room = Vec::<f64>::new().try_reserve_exact(all);
    room.map_err(|_| too_many())?;
    Ok(vec![0.0; all])
}

impl<'a> Pairs<'a> {
    /// The pairs from a row on, into a buffer; the row that is none.
    fn read(&self, first: usize, count: usize, out: &mut Vec<DirectionPair>) -> Result<(), usize> {
        out.clear();
        out.reserve(count);
        let vectors = |side: &Rows<'a>| side.vectors(first, count);
        if let (Some(light), Some(sensor)) = (vectors(&self.light), vectors(&self.sensor)) {
            // The usual case, without a look-up a row.
            let rows = light.chunks_exact(3).zip(sensor.chunks_exact(3));
            for (i, (a, b)) in rows.enumerate() {
                match (direction_of(a), direction_of(b)) {
                    (Some(a), Some(b)) => out.push(DirectionPair::new(a, b)),
                    _ => return Err(first + i),
                }
            }
            return Ok(());
        }
        for row in first..first + count {
            match (self.light.get(row), self.sensor.get(row)) {
                (Some(light), Some(sensor)) => out.push(DirectionPair::new(light, sensor)),
                _ => return Err(row),
            }
        }
        Ok(())
    }

    fn refused(&self, row: usize) -> PyErr {
        let side = match self.light.get(row) {
            None => self.light,
            Some(_) => self.sensor,
        };
        refused(side.sentence(row))
    }

    /// Every pair; an error names the first row that is none.
    fn all(&self) -> PyResult<Vec<DirectionPair>> {
        let mut all = Vec::new();
        let room = all.try_reserve_exact(self.count);
        room.map_err(|_| too_many())?;
        let read = self.read(0, self.count, &mut all);
        read.map(|()| all).map_err(|row| self.refused(row))
    }

    /// Every pair as of [`all`](Self::all), with a warning of those below the horizon.
    pub fn above(&self, py: Python<'_>) -> PyResult<Vec<DirectionPair>> {
        let all = self.all()?;
        self.doubt(py, below(&all))?;
        Ok(all)
    }

    fn doubt(&self, py: Python<'_>, [light, sensor]: [usize; 2]) -> PyResult<()> {
        let below = [(self.light.name, light), (self.sensor.name, sensor)];
        doubt_horizon(py, &below, self.count)
    }

    /// Every pair, above the horizon; an error names the first row that is none, or that no instrument sees.
    pub fn visible(&self) -> PyResult<Vec<DirectionPair>> {
        let all = self.all()?;
        let low = |d: Direction| d.cos_theta() <= gonio::numeric::GRAZING_COS;
        if let Some(row) = all.iter().position(|p| low(p.omega_i) || low(p.omega_o)) {
            let side = match low(all[row].omega_i) {
                true => self.light,
                false => self.sensor,
            };
            let (name, index) = (side.name, side.along.index(row));
            return Err(refused(format!(
                "{name}{index} is not above the horizon; allowed: polar angles below 90°"
            )));
        }
        Ok(all)
    }

    /// `width` numbers a pair, made a chunk at a time in parallel and without the global lock; a warning of pairs below the horizon.
    /// An error names the first row that is no pair.
    pub fn map(
        &self,
        py: Python<'_>,
        width: usize,
        work: impl Fn(&[DirectionPair], &mut [f64]) + Sync,
    ) -> PyResult<Vec<f64>> {
        let (pairs, count) = (*self, self.count);
        let mut out = zeros(count, width)?;
        let (light, sensor) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let made = detached(py, || {
            let chunks = out.par_chunks_mut(CHUNK * width.max(1)).enumerate();
            let wrong = chunks.map_init(Vec::new, |buffer, (i, out)| {
                let rows = out.len() / width.max(1);
                let read = pairs.read(i * CHUNK, rows, buffer);
                if read.is_ok() {
                    for (all, low) in [&light, &sensor].into_iter().zip(below(buffer)) {
                        all.fetch_add(low, Ordering::Relaxed);
                    }
                    work(buffer, out);
                }
                read.err()
            });
            wrong.flatten().min()
        });
        if let Some(row) = made? {
            return Err(self.refused(row));
        }
        self.doubt(py, [light.into_inner(), sensor.into_inner()])?;
        Ok(out)
    }

    /// f_r without the cosine, sr⁻¹, channel by channel; NaN where there is no data.
    pub fn values(&self, py: Python<'_>, brdf: &dyn Brdf) -> PyResult<Vec<f64>> {
        let n = brdf.channels().count();
        self.map(py, n, |pairs, out| {
            let mut presence = [Presence::Present; CHUNK];
            let presence = &mut presence[..pairs.len()];
            brdf.eval_batch(pairs, out, presence);
            for (values, presence) in out.chunks_exact_mut(n).zip(presence) {
                if *presence == Presence::Missing {
                    values.fill(f64::NAN);
                }
            }
        })
    }
}

/// A new array of rows.
pub fn rows<'py>(py: Python<'py>, values: Vec<f64>, width: usize) -> Matrix<'py> {
    let n = values.len() / width.max(1);
    PyArray1::from_vec(py, values).reshape([n, width])
}

/// A new array of a shape, with a last axis of `width` if there is one.
pub fn shaped<'py>(
    py: Python<'py>,
    values: Vec<f64>,
    shape: &[usize],
    width: Option<usize>,
) -> Shaped<'py> {
    let shape: Vec<usize> = shape.iter().copied().chain(width).collect();
    PyArray1::from_vec(py, values).reshape(shape)
}

/// A new array of vectors.
pub fn vectors<'py>(py: Python<'py>, directions: impl Iterator<Item = Direction>) -> Matrix<'py> {
    let values = directions.flat_map(|d| d.vector().to_array());
    rows(py, values.collect(), 3)
}

/// Unit vectors, (…, 3), of polar angles from the normal and azimuths, in radians, whose shapes broadcast.
///
/// One of two numbers is (1, 3). Angles beyond 2π are warned of: they may be degrees.
#[pyfunction]
pub fn direction<'py>(
    py: Python<'py>,
    theta: &Bound<'py, PyAny>,
    phi: &Bound<'py, PyAny>,
) -> Shaped<'py> {
    let (theta, phi) = (numbers(theta, "theta")?, numbers(phi, "phi")?);
    doubt_degrees(py, "theta", slice(&theta)?)?;
    doubt_degrees(py, "phi", slice(&phi)?)?;
    let to = broadcast(("theta", theta.shape(), 0), ("phi", phi.shape(), 0))?;
    let [along, about] = [&theta, &phi].map(|angles| Along::new(angles.shape(), 0, &to));
    let (theta, phi) = (slice(&theta)?, slice(&phi)?);
    let vector = |row: usize| {
        let direction = Direction::from_spherical(theta[along.at(row)], phi[about.at(row)]);
        direction.vector().to_array()
    };
    let all = 0..to.iter().product();
    shaped(py, all.flat_map(vector).collect(), &to, Some(3))
}

/// Polar angles from the normal and azimuths of directions, (…, 2), in radians.
#[pyfunction]
pub fn angles<'py>(py: Python<'py>, omega: &Bound<'py, PyAny>) -> Shaped<'py> {
    let directions = Directions::read(omega, "omega")?;
    let all = directions.rows(directions.batch())?.all()?;
    let values = all.iter().flat_map(|d| [d.theta(), d.phi()]);
    shaped(py, values.collect(), directions.batch(), Some(2))
}
