//! Arrays in and out: directions, numbers, columns.

use crate::errors::refused;
use crate::given::detached;
use gonio::brdf::{Brdf, Presence};
use gonio::geometry::{Direction, DirectionPair};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;

/// A new array of one number a row, (n,).
pub type Column<'py> = PyResult<Bound<'py, PyArray1<f64>>>;

/// A new array of rows of numbers, (n, width).
pub type Matrix<'py> = PyResult<Bound<'py, PyArray2<f64>>>;

/// Rows of a task: its cost is far below theirs, and their values stay in a core's own cache.
const CHUNK: usize = 1024;

/// Squared lengths this near 1 are those of unit vectors: such a vector is taken as it is, so that one that came from
/// here goes back to the bit.
const UNIT: f64 = 4.0 * f64::EPSILON;

/// An array's numbers, f64, C-contiguous and aligned; what is masked is NaN.
fn cast<'py>(value: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let py = value.py();
    let numpy = py.import("numpy")?;
    let keys = PyDict::new(py);
    keys.set_item("dtype", "float64")?;
    let array = match value.hasattr("mask")? && value.hasattr("filled")? {
        // Integers have no NaN.
        true => value
            .call_method1("astype", ("float64",))?
            .call_method1("filled", (f64::NAN,))?,
        false => value.clone(),
    };
    let array = numpy.call_method("ascontiguousarray", (array,), Some(&keys))?;
    // A field of packed records may be contiguous, but at odd addresses.
    numpy.call_method1("require", (array, py.None(), "A"))
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
        let kind = value
            .get_type()
            .name()
            .map_or("object".into(), |n| n.to_string());
        refused(format!(
            "{name} is a {kind} without numbers; allowed: an array of numbers"
        ))
    })?;
    array.extract::<PyReadonlyArrayDyn<'py, f64>>()
}

/// The numbers of an array in memory's order.
pub fn slice<'a>(array: &'a PyReadonlyArrayDyn<'_, f64>) -> PyResult<&'a [f64]> {
    array.as_slice().map_err(refused)
}

/// A shape as Python writes it.
pub fn shape(array: &PyReadonlyArrayDyn<'_, f64>) -> String {
    let lengths: Vec<String> = array.shape().iter().map(usize::to_string).collect();
    match lengths.as_slice() {
        [one] => format!("({one},)"),
        several => format!("({})", several.join(", ")),
    }
}

/// One number a row.
pub fn list(value: &Bound<'_, PyAny>, name: &str) -> PyResult<Vec<f64>> {
    let array = numbers(value, name)?;
    if array.shape().len() != 1 {
        let shape = shape(&array);
        return Err(refused(format!(
            "{name} has the shape {shape}; allowed: (n,)"
        )));
    }
    Ok(slice(&array)?.to_vec())
}

/// Rows of two arguments, each with its name and its number: as many of one as of the other, or one for all.
fn matched(a: (&str, usize), b: (&str, usize)) -> PyResult<usize> {
    match (a.1, b.1) {
        (m, n) if m == n => Ok(n),
        (1, n) | (n, 1) => Ok(n),
        (m, n) => Err(refused(format!(
            "{} has {m} rows and {} has {n}; allowed: as many, or one",
            a.0, b.0
        ))),
    }
}

/// Directions as Python gives them.
pub struct Directions<'py> {
    name: &'static str,
    array: PyReadonlyArrayDyn<'py, f64>,
    /// 3 of vectors, 2 of angles.
    width: usize,
}

impl<'py> Directions<'py> {
    /// Directions from (n, 3) vectors, (n, 2) angles, or one of either.
    pub fn read(value: &Bound<'py, PyAny>, name: &'static str) -> PyResult<Self> {
        let array = numbers(value, name)?;
        let width = match *array.shape() {
            [width] | [_, width] if width == 2 || width == 3 => width,
            _ => {
                return Err(refused(format!(
                    "{name} has the shape {}; allowed: (n, 3) vectors, or (n, 2) angles theta and phi in radians",
                    shape(&array)
                )));
            }
        };
        Ok(Self { name, array, width })
    }

    /// The rows, which another thread may read.
    pub fn rows(&self) -> PyResult<Rows<'_>> {
        let values = slice(&self.array)?;
        let count = values.len() / self.width;
        Ok(Rows {
            name: self.name,
            values,
            width: self.width,
            count,
            stride: if count == 1 { 0 } else { self.width },
        })
    }
}

/// Rows of vectors or angles.
#[derive(Clone, Copy)]
pub struct Rows<'a> {
    name: &'static str,
    values: &'a [f64],
    width: usize,
    count: usize,
    /// Numbers from one row to the next: none where one row stands for all.
    stride: usize,
}

impl<'a> Rows<'a> {
    /// Number of directions.
    pub fn len(&self) -> usize {
        self.count
    }

    /// The direction of a row; the only one of a single row.
    fn get(&self, row: usize) -> Option<Direction> {
        let at = row * self.stride;
        direction_of(self.values.get(at..at + self.width)?)
    }

    /// Rows from one on, where they are vectors and no row stands for all.
    fn vectors(&self, first: usize, count: usize) -> Option<&'a [f64]> {
        let plain = self.stride == 3;
        plain.then(|| self.values.get(3 * first..3 * (first + count)))?
    }

    /// Every direction.
    ///
    /// # Errors
    /// The first row without one.
    pub fn all(&self) -> PyResult<Vec<Direction>> {
        let all = (0..self.len()).map(|i| self.get(i).ok_or_else(|| refused(self.sentence(i))));
        all.collect()
    }

    fn sentence(&self, row: usize) -> String {
        let row = if self.len() == 1 { 0 } else { row };
        let values = &self.values[row * self.width..(row + 1) * self.width];
        let values: Vec<String> = values.iter().map(f64::to_string).collect();
        format!(
            "{}[{row}] is ({}), which is no direction; allowed: finite numbers, not all 0",
            self.name,
            values.join(", ")
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
}

impl<'py> Sides<'py> {
    /// The arguments `omega_i` and `omega_o` of a function.
    pub fn read(omega_i: &Bound<'py, PyAny>, omega_o: &Bound<'py, PyAny>) -> PyResult<Self> {
        Ok(Self {
            light: Directions::read(omega_i, "omega_i")?,
            sensor: Directions::read(omega_o, "omega_o")?,
        })
    }

    /// As many of one as of the other, or one for all.
    pub fn pairs(&self) -> PyResult<Pairs<'_>> {
        let (light, sensor) = (self.light.rows()?, self.sensor.rows()?);
        Ok(Pairs {
            count: matched((light.name, light.len()), (sensor.name, sensor.len()))?,
            light,
            sensor,
        })
    }
}

impl<'a> Pairs<'a> {
    /// The pairs from a row on, into a buffer; the row that is none.
    fn read(&self, first: usize, count: usize, out: &mut Vec<DirectionPair>) -> Result<(), usize> {
        out.clear();
        out.reserve(count);
        let vectors = |side: &Rows<'a>| side.vectors(first, count);
        if let (Some(light), Some(sensor)) = (vectors(&self.light), vectors(&self.sensor)) {
            // The usual case, without a look-up a row.
            for (i, (a, b)) in light
                .chunks_exact(3)
                .zip(sensor.chunks_exact(3))
                .enumerate()
            {
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

    /// Every pair.
    ///
    /// # Errors
    /// The first row that is none.
    pub fn all(&self) -> PyResult<Vec<DirectionPair>> {
        let mut all = Vec::with_capacity(self.count);
        self.read(0, self.count, &mut all)
            .map_err(|row| self.refused(row))?;
        Ok(all)
    }

    /// Every pair, above the horizon.
    ///
    /// # Errors
    /// The first row that is none, or that no instrument sees.
    pub fn visible(&self) -> PyResult<Vec<DirectionPair>> {
        let all = self.all()?;
        let low = |d: Direction| d.cos_theta() <= gonio::numeric::GRAZING_COS;
        if let Some(row) = all.iter().position(|p| low(p.omega_i) || low(p.omega_o)) {
            let side = if low(all[row].omega_i) {
                self.light
            } else {
                self.sensor
            };
            let row = if side.len() == 1 { 0 } else { row };
            return Err(refused(format!(
                "{}[{row}] is not above the horizon; allowed: polar angles below 90°",
                side.name
            )));
        }
        Ok(all)
    }

    /// `width` numbers a pair, made a chunk at a time in parallel and without the global lock.
    ///
    /// # Errors
    /// The first row that is no pair.
    pub fn map(
        &self,
        py: Python<'_>,
        width: usize,
        work: impl Fn(&[DirectionPair], &mut [f64]) + Sync,
    ) -> PyResult<Vec<f64>> {
        let (pairs, count) = (*self, self.count);
        let made = detached(py, || {
            let mut out = vec![0.0; count * width];
            let chunks = out.par_chunks_mut(CHUNK * width.max(1)).enumerate();
            let wrong = chunks.map_init(Vec::new, |buffer, (i, out)| {
                let rows = out.len() / width.max(1);
                let read = pairs.read(i * CHUNK, rows, buffer);
                if read.is_ok() {
                    work(buffer, out);
                }
                read.err()
            });
            match wrong.flatten().min() {
                None => Ok(out),
                Some(row) => Err(row),
            }
        });
        made?.map_err(|row| self.refused(row))
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

/// A new array of vectors.
pub fn vectors<'py>(py: Python<'py>, directions: impl Iterator<Item = Direction>) -> Matrix<'py> {
    rows(
        py,
        directions.flat_map(|d| d.vector().to_array()).collect(),
        3,
    )
}

/// Unit vectors, (n, 3), of polar angles from the normal and azimuths, in radians.
///
/// Either may be one number for all.
#[pyfunction]
pub fn direction<'py>(
    py: Python<'py>,
    theta: &Bound<'py, PyAny>,
    phi: &Bound<'py, PyAny>,
) -> Matrix<'py> {
    let (theta, phi) = (list(theta, "theta")?, list(phi, "phi")?);
    let n = matched(("theta", theta.len()), ("phi", phi.len()))?;
    let at = |list: &[f64], i: usize| list[if list.len() == 1 { 0 } else { i }];
    vectors(
        py,
        (0..n).map(|i| Direction::from_spherical(at(&theta, i), at(&phi, i))),
    )
}

/// Polar angles from the normal and azimuths of directions, (n, 2), in radians.
#[pyfunction]
pub fn angles<'py>(py: Python<'py>, omega: &Bound<'py, PyAny>) -> Matrix<'py> {
    let directions = Directions::read(omega, "omega")?;
    let all = directions.rows()?.all()?;
    let values = all.iter().flat_map(|d| [d.theta(), d.phi()]);
    rows(py, values.collect(), 2)
}
