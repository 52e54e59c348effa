//! Measurements: readings with uncertainties and flags.

use crate::arrays::{Matrix, Sides, numbers, other_shape, rows, shape, slice};
use crate::errors::{of_files, other_type, refused, warn};
use crate::files::{self, refuse_existing, unwritable, writer};
use crate::html::{self, HEAD};
use crate::keys::{parsed, symmetry, table};
use crate::material::channel_names;
use crate::schedule::{PySchedule, chosen, form};
use crate::shapes::tuple;
use crate::state::{Reduced, check, check_numbers, reduced, restored};
use gonio::brdf::{Channels, Wavelengths};
use gonio::formats::{WRITE_READINGS, load_all_readings};
use gonio::geometry::Symmetry;
use gonio::instrument::axis_names;
use gonio::measurement::pab::by_light;
use gonio::measurement::{About, Details, Flags, Measurement, Outcome};
use gonio::numeric::LARGEST_READING;
use gonio::schedule::{Assume, Conventions, Itinerary, Pose, Schedule, Sequence};
use numpy::{PyArray1, PyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};
use std::path::PathBuf;
use std::sync::Arc;

/// Readings of a material: f_r in 1/sr without the cosine, at the poses of a schedule.
///
/// `Measurement(omega_i, omega_o, values, type_a, type_b)` has readings of your own, (n,), (n, 3) for R, G, B, or
/// (n, wavelengths); where the shapes of directions broadcast to (m, n), (m, n) and so on, with standard uncertainties (k = 1) as wide as the values or as (n,): `type_a` is of what scatters
/// between readings, `type_b` of what they share. NaN is no reading. Values below 0 count as 0 in a copy,
/// of which a warning tells.
///
/// `symmetry` says which configurations are one; without it a sample is isotropic, reciprocal and bilateral. Readings of one
/// configuration are averaged, and a warning says when they scatter by far more than noise.
#[pyclass(frozen, name = "Measurement", module = "gonio")]
pub struct PyMeasurement {
    pub measurement: Arc<Measurement>,
    pub about: About,
    pub itinerary: Option<Itinerary>,
}

/// Numbers of readings at pairs of a shape: as wide as there are channels, or one for all.
fn wide(
    value: &Bound<'_, PyAny>,
    name: &str,
    pairs: &[usize],
    channels: usize,
) -> PyResult<Vec<f64>> {
    let array = numbers(value, name)?;
    match array.shape().strip_prefix(pairs) {
        Some([]) => {
            let repeated = |&x| std::iter::repeat_n(x, channels);
            Ok(slice(&array)?.iter().flat_map(repeated).collect())
        }
        Some(&[width]) if width == channels => Ok(slice(&array)?.to_vec()),
        _ => {
            let wide = tuple(&[pairs, &[channels]].concat());
            let allowed = format!("{} or {wide}", tuple(pairs));
            Err(other_shape(name, &array, allowed))
        }
    }
}

/// The sentence that warns of rows with values below 0.
fn below_zero(values: &[f64], channels: usize) -> Option<String> {
    let rows = values.chunks_exact(channels).enumerate();
    let mut below = rows.filter_map(|(i, row)| Some((i, row.iter().find(|x| **x < 0.0)?)));
    let (i, x) = below.next()?;
    Some(match below.count() {
        0 => format!("values[{i}] is {x}, below 0, and counts as 0 in a copy"),
        more => {
            let rows = gonio::error::count(more + 1, "row");
            format!(
                "{rows} have values below 0, which count as 0 in a copy, the first is values[{i}] = {x}"
            )
        }
    })
}

impl PyMeasurement {
    /// A measurement, and where it comes from.
    pub fn new(measurement: Measurement, about: About, itinerary: Option<Itinerary>) -> Self {
        Self {
            measurement: Arc::new(measurement),
            about,
            itinerary,
        }
    }

    /// Numbers laid out as the values, NaN where there is no reading.
    fn laid_out<'py>(&self, py: Python<'py>, of: &[f64]) -> Matrix<'py> {
        let n = self.measurement.channels.count();
        let mut values = of.to_vec();
        for (row, outcome) in values.chunks_exact_mut(n).zip(&self.measurement.outcomes) {
            if *outcome != Outcome::Reading {
                row.fill(f64::NAN);
            }
        }
        rows(py, values, n)
    }

    /// Uncertainties of a type, NaN where they are not known; `None` without any.
    fn uncertainties<'py>(
        &self,
        py: Python<'py>,
        of: fn(&Details) -> &Vec<f64>,
    ) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        let known = |&u: &f64| if u == 0.0 { f64::NAN } else { u };
        let all = self.measurement.details.as_ref().map(of);
        let all = all.map(|all| all.iter().map(known).collect::<Vec<_>>());
        all.map(|all| self.laid_out(py, &all)).transpose()
    }
}

#[pymethods]
impl PyMeasurement {
    #[new]
    #[pyo3(signature = (omega_i, omega_o, values, type_a = None, type_b = None, *,
        wavelengths_nm = None, parametrization = None, symmetry = None))]
    #[expect(clippy::too_many_arguments, reason = "one a column of readings")]
    fn of_arrays(
        py: Python<'_>,
        omega_i: &Bound<'_, PyAny>,
        omega_o: &Bound<'_, PyAny>,
        values: &Bound<'_, PyAny>,
        type_a: Option<&Bound<'_, PyAny>>,
        type_b: Option<&Bound<'_, PyAny>>,
        wavelengths_nm: Option<&Bound<'_, PyAny>>,
        parametrization: Option<&Bound<'_, PyAny>>,
        symmetry: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let sides = Sides::read(omega_i, omega_o)?;
        let pairs = sides.pairs()?.visible()?;
        let array = numbers(values, "values")?;
        let is_flat = array.shape().len() <= sides.shape.len();
        let width = match array.shape().last() {
            Some(width) if !is_flat => *width,
            _ => 1,
        };
        let channels = match wavelengths_nm {
            Some(nm) => {
                let nm = crate::arrays::list(nm, "wavelengths_nm")?;
                Channels::Wavelengths(Wavelengths::new(&nm).map_err(refused)?)
            }
            None if width == 1 => Channels::Luminance,
            None if width == 3 => Channels::Rgb,
            None => {
                let shape = shape(&array);
                return Err(refused(format!(
                    "values have the shape {shape}; allowed: (n,), (n, 3) for R, G, B, or (n, w) with wavelengths_nm"
                )));
            }
        };
        let (rows, n) = (pairs.len(), channels.count());
        if n > 1 && is_flat {
            let (found, wanted) = (shape(&array), tuple(&[&sides.shape, &[n][..]].concat()));
            return Err(refused(format!(
                "values has the shape {found}, of {n} wavelengths; allowed: {wanted}"
            )));
        }
        let mut values = wide(values, "values", &sides.shape, n)?;
        let outcomes = values.chunks_exact(n).enumerate().map(|(i, row)| {
            let missing = row.iter().filter(|x| x.is_nan()).count();
            if let Some(x) = row.iter().find(|x| x.abs() > LARGEST_READING) {
                return Err(refused(format!(
                    "values[{i}] is {x:e} 1/sr; allowed is a reading of at most {LARGEST_READING:e} 1/sr"
                )));
            }
            match missing {
                0 => Ok(Outcome::Reading),
                m if m == n => Ok(Outcome::NoData),
                m => Err(refused(format!(
                    "values[{i}] is NaN in {m} of {n} channels; allowed: in all or none"
                ))),
            }
        });
        let outcomes = outcomes.collect::<PyResult<Vec<_>>>()?;
        let negative = below_zero(&values, n);
        let missing = values.iter_mut().filter(|x| x.is_nan());
        missing.for_each(|x| *x = 0.0);
        let uncertainty = |given: Option<&Bound<'_, PyAny>>, name: &str| {
            let Some(given) = given else {
                return Ok(vec![0.0; values.len()]);
            };
            let mut all = wide(given, name, &sides.shape, n)?;
            let unknown = all.iter_mut().filter(|u| u.is_nan());
            unknown.for_each(|u| *u = 0.0);
            for (i, row) in all.chunks_exact_mut(n).enumerate() {
                match row.iter().find(|u| !(0.0..=LARGEST_READING).contains(*u)) {
                    _ if outcomes[i] != Outcome::Reading => row.fill(0.0),
                    None => {}
                    Some(u) => {
                        return Err(refused(format!(
                            "{name}[{i}] is {u}; allowed is a standard uncertainty of 0 to {LARGEST_READING:e} 1/sr"
                        )));
                    }
                }
            }
            Ok(all)
        };
        let details = match type_a.is_some() || type_b.is_some() {
            true => Some(Details {
                type_a: uncertainty(type_a, "type_a")?,
                type_b: uncertainty(type_b, "type_b")?,
                flags: vec![Flags::NONE; rows],
            }),
            false => None,
        };
        let form = form(py, parametrization, symmetry)?.form;
        let measurement = Measurement {
            schedule: Arc::new(Schedule::of_pairs(form, pairs)),
            channels,
            values,
            outcomes,
            details,
            places: Vec::new(),
            half_angles_deg: [0.0; 2],
        };
        let (merged, folded) = py.detach(|| measurement.merged());
        for sentence in negative.into_iter().chain(folded.warning()) {
            warn(py, &sentence)?;
        }
        Ok(Self::new(merged, About::default(), None))
    }

    /// The readings of a file, or of several of one material: those that gonio wrote, any table of angles and values, or ALTA text.
    ///
    /// `columns`, `angles`, `elevation`, `azimuth`, `quantity`, `uncertainties`, `coverage_factor`, `polarisation`, `partial`, `mixed`, `no_reading` and `pixels` say how a file by others is read, as the options of
    /// `gonio reconstruct` do, e.g. `angles="deg"`, `columns={"theta_i": "tilt"}`.
    #[classmethod]
    #[pyo3(signature = (paths, *, parametrization = None, symmetry = None, **keys))]
    fn open(
        _class: &Bound<'_, PyType>,
        py: Python<'_>,
        paths: &Bound<'_, PyAny>,
        parametrization: Option<String>,
        symmetry: Option<&Bound<'_, PyAny>>,
        keys: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let paths = match paths.extract::<PathBuf>() {
            Ok(path) => vec![path],
            Err(_) => {
                let several = paths.extract::<Vec<PathBuf>>();
                several.map_err(|_| other_type("paths", paths, "a path, or a list of paths"))?
            }
        };
        let conventions: Conventions = parsed("readings", table(keys)?)?;
        let assume = Assume {
            parametrization,
            symmetry: symmetry.map(self::symmetry).transpose()?,
            otherwise: Symmetry::FULL,
            axes: axis_names(),
            conventions,
        };
        if paths.is_empty() {
            let message = "there is no path; allowed: one file of readings or more";
            return Err(refused(message));
        }
        let read = py.detach(|| load_all_readings(&paths, &assume, |_, _| ()));
        let read = read.map_err(of_files)?;
        for warning in read.warnings {
            warn(py, &warning)?;
        }
        Ok(Self::new(read.measurement, About::default(), None))
    }

    /// Writes the readings, in the format that the name says, or `format`: `formats()` lists them.
    ///
    /// It warns where a format has no place for uncertainties and flags, and refuses several directions of the light where a
    /// file has one.
    #[pyo3(signature = (path, *, format = None, force = false))]
    fn write(
        &self,
        py: Python<'_>,
        path: PathBuf,
        format: Option<&str>,
        force: bool,
    ) -> PyResult<()> {
        let (format, write) = writer(&WRITE_READINGS, format, &path)?;
        refuse_existing(&path, force)?;
        let n = by_light(&self.measurement, Sequence::Generated).len();
        if format.one_light && n > 1 {
            let name = format.name;
            let message = format!("{n} directions of the light; allowed: one in a file of {name}");
            return Err(unwritable(&path, message));
        }
        if let Some(sentence) = format.leaves_out(&self.measurement) {
            warn(py, &sentence)?;
        }
        let sequence = Sequence::from(self.itinerary.as_ref());
        let (measurement, about) = (&self.measurement, &self.about);
        files::write(py, &path, |out| write(measurement, about, sequence, out))
    }

    fn __len__(&self) -> usize {
        self.measurement.outcomes.len()
    }

    /// The readings of a number, a slice, a mask or an array of numbers of poses, each at most once; they are of no grid and took no
    /// known time, unless they are all.
    fn __getitem__(&self, key: &Bound<'_, PyAny>) -> PyResult<Self> {
        let all = &self.measurement;
        let poses = chosen(key, all.outcomes.len())?;
        let n = all.channels.count();
        let rows = |of: &[f64]| {
            let rows = poses.iter().map(|&i| i as usize * n);
            rows.flat_map(|i| of[i..i + n].to_vec()).collect()
        };
        let details = all.details.as_ref().map(|details| Details {
            type_a: rows(&details.type_a),
            type_b: rows(&details.type_b),
            flags: poses.iter().map(|&i| details.flags[i as usize]).collect(),
        });
        let places = poses.iter().filter_map(|&i| all.places.get(i as usize));
        let measurement = Measurement {
            schedule: self.schedule().of_poses(&poses).schedule,
            channels: all.channels.clone(),
            values: rows(&all.values),
            outcomes: poses.iter().map(|&i| all.outcomes[i as usize]).collect(),
            details,
            half_angles_deg: all.half_angles_deg,
            places: places.copied().collect(),
        };
        let are_all = poses.len() == all.outcomes.len() && poses.is_sorted();
        let itinerary = self.itinerary.clone().filter(|_| are_all);
        let mut about = self.about.clone();
        about.schedule_hash = about.schedule_hash.filter(|_| are_all);
        Ok(Self::new(measurement, about, itinerary))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let (about, is_bare) = (&self.about, self.about.is_bare);
        reduced::<Self>(py, &(&self.measurement, about, is_bare, &self.itinerary))
    }

    #[classmethod]
    fn _restored(_class: &Bound<'_, PyType>, state: &str) -> PyResult<Self> {
        let (measurement, about, is_bare, itinerary): (Measurement, _, _, _) = restored(state)?;
        let about = About { is_bare, ..about };
        check_numbers(&measurement.schedule, std::iter::empty())?;
        let poses = measurement.outcomes.len();
        let values = poses * measurement.channels.count();
        check(poses == measurement.schedule.poses.len(), "outcomes")?;
        check(values == measurement.values.len(), "values")?;
        if let Some(details) = &measurement.details {
            let known = [&details.type_a, &details.type_b];
            check(known.iter().all(|u| u.len() == values), "uncertainties")?;
            check(details.flags.len() == poses, "flags")?;
        }
        Ok(Self::new(measurement, about, itinerary))
    }

    /// The first readings as a table, for notebooks: angles in degrees, and at most three channels.
    fn _repr_html_(&self) -> String {
        let m = &self.measurement;
        let n = m.channels.count();
        let channels = self.channels().into_iter().take(3);
        let names = html::ANGLES.map(String::from).into_iter().chain(channels);
        let names: Vec<_> = names.chain(["outcome".into()]).collect();
        let poses = m.schedule.poses.iter().zip(&m.outcomes);
        let row = |((pose, outcome), values): ((&Pose, &Outcome), &[f64])| {
            let values = values.iter().take(3).map(|value| match outcome {
                Outcome::Reading => html::number(*value),
                _ => String::new(),
            });
            let angles = html::degrees(&pose.pair).into_iter();
            let outcome = outcome.name().into();
            angles.chain(values).chain([outcome]).collect()
        };
        let poses = poses.zip(m.values.chunks(n)).take(HEAD);
        let rows: Vec<_> = poses.map(row).collect();
        html::table(&self.__repr__(), &names, &rows, m.outcomes.len())
    }

    /// f_r in 1/sr, without the cosine, (n, channels); NaN where there is no reading.
    #[getter]
    fn values<'py>(&self, py: Python<'py>) -> Matrix<'py> {
        self.laid_out(py, &self.measurement.values)
    }

    /// Standard uncertainty (k = 1) of what scatters between readings, (n, channels), NaN where it is not known; None of a
    /// measurement without any.
    #[getter]
    fn type_a<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        self.uncertainties(py, |details| &details.type_a)
    }

    /// Standard uncertainty (k = 1) of what readings share, (n, channels), NaN where it is not known; None of a measurement
    /// without any.
    #[getter]
    fn type_b<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f64>>>> {
        self.uncertainties(py, |details| &details.type_b)
    }

    /// What is odd about readings: for each flag (saturated, below-noise, clipped) an array (n,) of bool.
    #[getter]
    fn flags<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = PyDict::new(py);
        for (flag, name) in Flags::ALL {
            let set: Vec<bool> = match &self.measurement.details {
                Some(details) => details.flags.iter().map(|f| f.has(flag)).collect(),
                None => vec![false; self.measurement.outcomes.len()],
            };
            all.set_item(name, PyArray1::from_vec(py, set))?;
        }
        Ok(all)
    }

    /// What became of each pose: reading, no-data, not-visited, or why the instrument cannot take it.
    #[getter]
    fn outcomes(&self) -> Vec<&'static str> {
        self.measurement.outcomes.iter().map(|o| o.name()).collect()
    }

    /// The poses.
    #[getter]
    fn schedule(&self) -> PySchedule {
        Arc::clone(&self.measurement.schedule).into()
    }

    /// Names of the channels: "luminance", or "r", "g", "b", or wavelengths as "550nm".
    #[getter]
    fn channels(&self) -> Vec<String> {
        channel_names(&self.measurement.channels)
    }

    /// Time that the machine took, s; None where no machine measured.
    #[getter]
    fn seconds(&self) -> Option<f64> {
        self.itinerary.as_ref().map(Itinerary::seconds)
    }

    fn __repr__(&self) -> String {
        let readings = gonio::error::count(self.measurement.readings(), "reading");
        let poses = gonio::error::count(self.measurement.outcomes.len(), "pose");
        format!("<gonio.Measurement {readings} at {poses}>")
    }
}
