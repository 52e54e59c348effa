//! Materials: models, tables, and reconstructions.

use crate::arrays::{Directions, Shaped, Sides, numbers, other_shape, shaped, slice};
use crate::errors::{of_files, of_keys, other_type, refused, warn};
use crate::files::{refuse_existing, refused_by_system, unwritable, writer};
use crate::given::{Array, Function, detached, is_of_process};
use crate::html;
use crate::keys::{self, channels, named, read, table};
use crate::moments;
use crate::parametrization::PyParametrization;
use crate::shapes::{Along, broadcast};
use crate::state::{Reduced, reduced_to, restored, text};
use crate::table::{columns, of_json};
use crate::words::in_keywords;
use gonio::Error;
use gonio::brdf::laws::max_albedo;
use gonio::brdf::{Brdf, Channels, Part, Presence, SampleBrdf};
use gonio::error::{ParameterError, in_left_open, listed, one_of};
use gonio::experiment::{keys_of_file, materials, split_of};
use gonio::files::destination;
use gonio::formats::{READ_READINGS, READ_TABLE, TableError, Tabulation, WRITE_TABLE};
use gonio::geometry::{Direction, DirectionPair, Symmetry};
use gonio::importance::{SamplerSettings, TabulatedSampler};
use gonio::parametrization;
use gonio::report::BouncesReport;
use numpy::{PyArray1, PyUntypedArrayMethods};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyType};
use rayon::prelude::*;
use std::fs;
use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

/// A BRDF: a model by its kind and keys, or a table. `channels` are "luminance", "rgb" or wavelengths in nm.
///
/// `Material("ggx", alpha=0.3)` takes the keys of a config; `materials()` lists the kinds.
#[pyclass(frozen, subclass, name = "Material", module = "gonio")]
pub struct PyMaterial {
    pub brdf: Arc<dyn Brdf>,
    /// What makes it again.
    pub origin: Origin,
    /// A short name.
    #[pyo3(get)]
    pub label: String,
    /// Tables to draw from, once directions were drawn of a material that has no sampler of its own.
    pub tables: OnceLock<TabulatedSampler>,
}

/// What a material was made of.
pub enum Origin {
    /// What a config has for it.
    Keys(toml::Table),
    /// A function of Python.
    Function(Arc<Function>),
    /// An array.
    Array(Arc<Array>),
    /// A measurement, which the reconstruction has.
    Readings,
}

impl PyMaterial {
    /// The material of all its keys; without channels in those that its file holds.
    fn build(py: Python<'_>, keys: toml::Table, channels: Option<Channels>) -> PyResult<Self> {
        let spec = read("material", "kind", &materials(), keys)?;
        let built = detached(py, || {
            let channels = channels.map_or_else(|| spec.widest_channels(), Ok)?;
            spec.check(&channels)?;
            spec.build(channels)
        })?;
        Ok(Self {
            brdf: Arc::from(built.map_err(refused)?),
            origin: Origin::Keys(spec.resolved()),
            label: spec.label(),
            tables: OnceLock::new(),
        })
    }

    fn of_function(function: Function) -> Self {
        let (label, function) = (function.name.clone(), function.shared());
        Self {
            brdf: Arc::clone(&function) as Arc<dyn Brdf>,
            origin: Origin::Function(function),
            label,
            tables: OnceLock::new(),
        }
    }

    fn of_array(array: Array, label: String) -> Self {
        let array = Arc::new(array);
        Self {
            brdf: Arc::clone(&array) as Arc<dyn Brdf>,
            origin: Origin::Array(array),
            label,
            tables: OnceLock::new(),
        }
    }

    /// Its own sampler, or one by tables, which are made when they are first asked for.
    fn sampler(&self, py: Python<'_>) -> PyResult<&dyn SampleBrdf> {
        if let Some(own) = self.brdf.as_sample() {
            return Ok(own);
        }
        if self.tables.get().is_none() {
            let settings = SamplerSettings::default();
            let made = detached(py, || TabulatedSampler::new(&*self.brdf, settings))?;
            // Another thread may have been first, with the same tables.
            _ = self.tables.set(made.map_err(refused)?);
        }
        let missing = || refused(format!("{} has no tables", self.label));
        Ok(self.tables.get().ok_or_else(missing)?)
    }
}

#[pymethods]
impl PyMaterial {
    #[new]
    #[pyo3(signature = (kind, /, *, channels = None, **keys))]
    fn new(
        py: Python<'_>,
        kind: &str,
        channels: Option<&Bound<'_, PyAny>>,
        keys: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        Self::build(py, named(kind, keys)?, Some(self::channels(channels)?))
    }

    /// The material of a file: a table in any format that is read, or readings, which are reconstructed.
    ///
    /// Without `channels` it has those of the file: R, G, B of a table in colour, e.g. of MERL, wavelengths of a spectral one, luminance of
    /// readings or a table in luminance. `channels="luminance"` needs a third of the memory.
    #[classmethod]
    #[pyo3(signature = (path, *, channels = None, **keys))]
    fn open(
        _class: &Bound<'_, PyType>,
        py: Python<'_>,
        path: PathBuf,
        channels: Option<&Bound<'_, PyAny>>,
        keys: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let mut all = keys_of_file(&path).ok_or_else(|| {
            let allowed = listed([READ_TABLE.extensions("."), READ_READINGS.extensions(".")]);
            let message = "no format of tables or readings is known by this name; allowed";
            of_files(Error::data(path, format!("{message}: {allowed}")))
        })?;
        all.extend(table(keys)?);
        let channels = channels.map(|given| self::channels(Some(given)));
        Self::build(py, all, channels.transpose()?)
    }

    /// The material of a function: f_r in 1/sr without the cosine, (n,) or (n, channels), of (n, 3) unit vectors omega_i and omega_o, which
    /// point away from the surface and are above the horizon.
    ///
    /// It is called with many pairs at once, perhaps by several threads. If you declare a symmetry that it lacks, a part of its domain is
    /// never evaluated. An error of it ends the call of the library, a run too.
    #[classmethod]
    #[pyo3(signature = (function, /, *, symmetry = None, channels = None, name = "function"))]
    fn from_function(
        _class: &Bound<'_, PyType>,
        function: &Bound<'_, PyAny>,
        symmetry: Option<&Bound<'_, PyAny>>,
        channels: Option<&Bound<'_, PyAny>>,
        name: &str,
    ) -> PyResult<Self> {
        if !function.is_callable() {
            let allowed = "a function of omega_i and omega_o";
            return Err(other_type("function", function, allowed));
        }
        let function = Function {
            function: function.clone().unbind(),
            name: name.to_owned(),
            channels: self::channels(channels)?,
            symmetry: symmetry.map_or(Ok(Symmetry::NONE), keys::symmetry)?,
        };
        Ok(Self::of_function(function))
    }

    /// The material of an array over the nodes of coordinates, linear between them: f_r in 1/sr without the cosine, an index an axis, and
    /// then one of the channel if there are several.
    ///
    /// `axes` are increasing nodes in the units of `Parametrization.ranges`, in the order of `Parametrization.axes`. Beyond the first
    /// and last node an azimuth goes on round its turn, any other coordinate stays at their value.
    #[classmethod]
    #[pyo3(signature = (values, axes, *, parametrization, symmetry = None, channels = None, name = "array"))]
    fn from_array(
        _class: &Bound<'_, PyType>,
        values: &Bound<'_, PyAny>,
        axes: Vec<Bound<'_, PyAny>>,
        parametrization: &Bound<'_, PyAny>,
        symmetry: Option<&Bound<'_, PyAny>>,
        channels: Option<&Bound<'_, PyAny>>,
        name: &str,
    ) -> PyResult<Self> {
        let form = PyParametrization::read(parametrization, symmetry)?.form;
        let array = Array::new(values, &axes, form, self::channels(channels)?)?;
        Ok(Self::of_array(array, name.to_owned()))
    }

    /// f_r in 1/sr without the cosine, (…, channels); NaN where there is no data, 0 below the horizon, of which a warning tells.
    ///
    /// Shapes of directions broadcast: (n, 1, 3) and (m, 3) give (n, m, channels).
    fn eval<'py>(&self, omega_i: &Bound<'py, PyAny>, omega_o: &Bound<'py, PyAny>) -> Shaped<'py> {
        let py = omega_i.py();
        let sides = Sides::read(omega_i, omega_o)?;
        let values = sides.pairs()?.values(py, &*self.brdf)?;
        shaped(py, values, &sides.shape, Some(self.brdf.channels().count()))
    }

    /// Light directions, (…, 3), for sensor directions from (…, 2) numbers in [0, 1), whose shapes broadcast; NaN where a draw is below the
    /// horizon. A material that cannot draw by itself (see `can_sample`) draws from tables. With `weights` a pair: the directions, and
    /// f_r cos theta_i over their density, laid out as `eval` has values, 0 where a draw is below the horizon or there is no data; they
    /// average to the albedo.
    #[pyo3(signature = (omega_o, u, *, weights = false))]
    fn sample<'py>(
        &self,
        py: Python<'py>,
        omega_o: &Bound<'py, PyAny>,
        u: &Bound<'py, PyAny>,
        weights: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let sampler = self.sampler(py)?;
        let sensor = Directions::read(omega_o, "omega_o")?;
        let u = numbers(u, "u")?;
        let Some(2) = u.shape().last() else {
            return Err(other_shape("u", &u, "(…, 2)"));
        };
        let to = broadcast(sensor.shape(), ("u", u.shape(), 1))?;
        let along = Along::new(u.shape(), 1, &to);
        let sensor = sensor.rows(&to)?.above(py)?;
        let u = slice(&u)?;
        if let Some(x) = u.iter().find(|x| !(0.0..1.0).contains(*x)) {
            return Err(refused(format!("u has {x}; allowed: numbers in [0, 1)")));
        }
        let drawn: Vec<Option<Direction>> = py.detach(|| {
            let draw = |(row, sensor): (usize, &Direction)| {
                let at = 2 * along.at(row);
                sampler.sample(*sensor, [u[at], u[at + 1]])
            };
            sensor.iter().enumerate().map(draw).collect()
        });
        let vector =
            |light: &Option<Direction>| light.map_or([f64::NAN; 3], |d| d.vector().to_array());
        let light = shaped(py, drawn.iter().flat_map(vector).collect(), &to, Some(3))?;
        if !weights {
            return Ok(light.into_any());
        }
        let n = self.brdf.channels().count();
        let found = detached(py, || {
            let pair = |(light, sensor): (&Option<Direction>, &Direction)| {
                light.map(|light| DirectionPair::new(light, *sensor))
            };
            let pairs: Vec<_> = drawn.iter().zip(&*sensor).map(pair).collect();
            let kept: Vec<_> = pairs.iter().flatten().copied().collect();
            let (values, presence) = self.brdf.values(&kept);
            let mut found = values.chunks_exact(n).zip(presence);
            let mut weights = vec![0.0; n * pairs.len()];
            for (weights, pair) in weights.chunks_exact_mut(n).zip(&pairs) {
                let Some((pair, (values, presence))) = pair.and_then(|p| Some((p, found.next()?)))
                else {
                    continue;
                };
                let density = sampler.pdf(&pair);
                // At the horizon a draw may be rounded to where there is neither light nor density.
                if presence == Presence::Present && density > 0.0 {
                    let scale = pair.omega_i.cos_theta() / density;
                    weights
                        .iter_mut()
                        .zip(values)
                        .for_each(|(w, f)| *w = f * scale);
                }
            }
            weights
        })?;
        let weights = shaped(py, found, &to, Some(n))?;
        Ok((light, weights).into_pyobject(py)?.into_any())
    }

    /// Density of `sample` at pairs, per steradian of omega_i, in the shape that their directions broadcast to; 0 below the horizon, of
    /// which a warning tells.
    fn pdf<'py>(&self, omega_i: &Bound<'py, PyAny>, omega_o: &Bound<'py, PyAny>) -> Shaped<'py> {
        let py = omega_i.py();
        let sampler = self.sampler(py)?;
        let sides = Sides::read(omega_i, omega_o)?;
        let values = sides.pairs()?.map(py, 1, |pairs, out| {
            for (pair, out) in pairs.iter().zip(out) {
                *out = sampler.pdf(pair);
            }
        })?;
        shaped(py, values, &sides.shape, None)
    }

    /// Moments of the slices at view elevations (radians): a column a moment and its uncertainty, NaN where undefined.
    #[pyo3(signature = (theta_o, *, channel = "luminance", seed = 1, **estimator))]
    fn moments<'py>(
        &self,
        py: Python<'py>,
        theta_o: &Bound<'py, PyAny>,
        channel: &str,
        #[pyo3(from_py_with = keys::seed)] seed: u64,
        estimator: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let found = moments::moments_at(py, &*self.brdf, theta_o, channel, seed, estimator)?;
        columns(py, &moments::objects(&self.label, &[found]))
    }

    /// Moments over the view: the columns of `gonio moments`. Keys are those of `[moments]` in a config.
    #[pyo3(signature = (*, seed = 1, **keys))]
    fn profile<'py>(
        &self,
        py: Python<'py>,
        #[pyo3(from_py_with = keys::seed)] seed: u64,
        keys: Option<&Bound<'py, PyDict>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let found = moments::profiles(py, &*self.brdf, seed, keys)?;
        columns(py, &moments::objects(&self.label, &found))
    }

    /// Light by the number of facets that it met, where light paths are followed: shares, and what coordinates say of the number.
    ///
    /// The dictionary is that of `gonio paths --json`: `paths` are followed; the boxes of coordinates hold light of `bounce`
    /// ("first", "second" or "later") with at least the share `purity` of it.
    #[pyo3(signature = (*, paths = 1_048_576, bounce = "second", purity = 0.9))]
    fn paths<'py>(
        &self,
        py: Python<'py>,
        #[pyo3(from_py_with = keys::paths)] paths: usize,
        bounce: &str,
        purity: f64,
    ) -> PyResult<Bound<'py, PyAny>> {
        let split = split_of(&self.label, &*self.brdf).map_err(of_keys)?;
        let found = Part::CLASSES.into_iter().find(|c| c.name() == bounce);
        let class = found.ok_or_else(|| {
            let allowed = one_of(bounce, Part::CLASSES.map(Part::name));
            refused(ParameterError::new("bounce", bounce, allowed))
        })?;
        in_left_open("purity", purity, 0.0, 1.0).map_err(refused)?;
        let report = py.detach(|| {
            let entries = parametrization::all();
            BouncesReport::new(&self.label, split, paths, &entries, (class, purity), |_| ())
                .map(|report| report.json().to_string())
        });
        of_json(py, &report.map_err(of_keys)?)
    }

    /// Writes the BRDF as a table, in the format that the name says, or `format`: `formats()` lists them.
    ///
    /// `size` 1, 2, … are finer ones where a format has them. It warns of one that reflects more than it receives.
    #[pyo3(signature = (path, *, format = None, size = 0, force = false))]
    fn write(
        &self,
        py: Python<'_>,
        path: PathBuf,
        format: Option<&str>,
        size: i64,
        force: bool,
    ) -> PyResult<()> {
        let (format, write) = writer(&WRITE_TABLE, format, &path)?;
        let sizes = format.table.sizes;
        let size = usize::try_from(size).ok().filter(|s| *s < sizes);
        let size = size.ok_or_else(|| {
            let (most, name) = (sizes - 1, format.name);
            refused(format!(
                "size: allowed is a whole number from 0 to {most} for the format {name}"
            ))
        })?;
        refuse_existing(&path, force)?;
        for sentence in detached(py, || gains(&*self.brdf))? {
            warn(py, &sentence)?;
        }
        let tabulation = Tabulation {
            size,
            ..Tabulation::default()
        };
        // Under another name until it is whole: a function may fail.
        let target = destination(&path).map_err(refused_by_system(&path))?;
        let mut part = target.clone().into_os_string();
        part.push(".part");
        let part = PathBuf::from(part);
        let done = detached(py, || write(&*self.brdf, tabulation, &part));
        let done = done.and_then(|done| {
            let filled = done.map_err(|e| match e {
                TableError::Io(..) => unwritable(&path, e),
                e => refused(e),
            })?;
            let renamed = fs::rename(&part, &target).map(|()| filled);
            renamed.map_err(refused_by_system(&path))
        });
        if done.is_err() {
            _ = fs::remove_file(&part);
        }
        let filled = done?;
        match filled {
            0 => Ok(()),
            filled => warn(py, &format!("{filled} pairs had no data and were filled")),
        }
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let channels = self.brdf.channels();
        let (made, state) = match &self.origin {
            Origin::Keys(keys) if is_of_process(&keys.clone().into()) => {
                return Err(PyTypeError::new_err(
                    "a material of another one that is a function or an array cannot be pickled; allowed: to pickle that one, and to make this again",
                ));
            }
            Origin::Keys(keys) => ("keys", text(&(keys.to_string(), channels))?),
            Origin::Function(of) => {
                let state = text(&(&of.name, channels, of.symmetry))?;
                return reduced_to::<Self, _>(py, ("function", state, &of.function));
            }
            Origin::Array(array) => ("array", text(&(&self.label, array))?),
            // A reconstruction has its own.
            Origin::Readings => {
                let message = "readings are pickled with their reconstruction";
                return Err(PyTypeError::new_err(message));
            }
        };
        reduced_to::<Self, _>(py, (made, state))
    }

    /// What a pickle has: how it was made, of what as a text, and a function if it is one.
    #[classmethod]
    #[pyo3(signature = (made, state, function = None))]
    fn _restored(
        _class: &Bound<'_, PyType>,
        py: Python<'_>,
        made: &str,
        state: &str,
        function: Option<Py<PyAny>>,
    ) -> PyResult<Self> {
        match (made, function) {
            ("function", Some(function)) => {
                let (name, channels, symmetry) = restored(state)?;
                let made = Function {
                    function,
                    name,
                    channels,
                    symmetry,
                };
                Ok(Self::of_function(made))
            }
            ("array", None) => {
                let (label, array): (_, Array) = restored(state)?;
                Ok(Self::of_array(array.checked()?, label))
            }
            _ => {
                let (keys, channels): (String, _) = restored(state)?;
                let keys = toml::from_str(&keys).map_err(refused)?;
                Self::build(py, keys, Some(channels))
            }
        }
    }

    /// A summary as a table, for notebooks.
    fn _repr_html_(slf: &Bound<'_, Self>) -> PyResult<String> {
        let this = slf.get();
        let can_sample = if this.can_sample() { "True" } else { "False" };
        let symmetry = match listed(this.symmetry()) {
            none if none.is_empty() => "none".into(),
            names => names,
        };
        let row = |name: &str, text: String| vec![name.to_owned(), text];
        let mut rows = vec![
            row("channels", listed(this.channels())),
            row("symmetry", symmetry),
            row("can_sample", can_sample.into()),
        ];
        if let Origin::Keys(keys) = &this.origin {
            rows.extend(keys.iter().map(|(key, value)| row(key, value.to_string())));
        }
        rows.extend(this.remarks().into_iter().map(|text| row("remark", text)));
        let caption = slf.repr()?.to_string();
        Ok(html::table(&caption, &[], &rows, rows.len()))
    }

    /// Names of the channels: "luminance", or "r", "g", "b", or wavelengths as "550nm".
    #[getter]
    fn channels(&self) -> Vec<String> {
        channel_names(self.brdf.channels())
    }

    /// Wavelengths in nm, (channels,); None where channels are luminance or R, G, B.
    #[getter]
    fn wavelengths_nm<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray1<f64>>> {
        let wavelengths = self.brdf.channels().wavelengths()?;
        Some(PyArray1::from_slice(py, wavelengths.nm()))
    }

    /// Names of the symmetries that it has by construction.
    #[getter]
    fn symmetry(&self) -> Vec<&'static str> {
        self.brdf.symmetry().names()
    }

    /// True if it has a sampler of its own: others draw from tables.
    #[getter]
    fn can_sample(&self) -> bool {
        self.brdf.as_sample().is_some()
    }

    /// What should be told of it, a sentence each.
    #[getter]
    fn remarks(&self) -> Vec<String> {
        let remarks = self.brdf.remarks();
        remarks.iter().map(|text| in_keywords(text)).collect()
    }

    fn __repr__(&self) -> String {
        let channels = listed(self.channels());
        format!("<gonio.Material {} ({channels})>", self.label)
    }
}

/// Polar angles of the views whose albedo is looked at, degrees: nearer to the horizon few tables are without gains.
const VIEWS_DEG: [f64; 2] = [0.0, 60.0];

/// Azimuths of these views, degrees; an isotropic material is seen from the first one.
const AZIMUTHS_DEG: [f64; 4] = [0.0, 45.0, 90.0, 135.0];

/// A sentence for each polar angle where the directional albedo exceeds 1 by more than its error.
fn gains(brdf: &dyn Brdf) -> Vec<String> {
    let azimuths = match brdf.symmetry().isotropic {
        true => &AZIMUTHS_DEG[..1],
        false => &AZIMUTHS_DEG,
    };
    let gain = |theta: &f64| {
        let view = |phi: &f64| Direction::from_spherical(theta.to_radians(), phi.to_radians());
        let views: Vec<Direction> = azimuths.iter().map(view).collect();
        let largest = max_albedo(brdf, &views)?.albedo;
        let (value, error) = (largest.max(), largest.error);
        (value > 1.0 + error).then(|| {
            format!("the albedo is {value:.4} ± {error:.1e} seen from {theta}°: it reflects more than it receives")
        })
    };
    VIEWS_DEG.par_iter().filter_map(gain).collect()
}

/// Names of channels.
pub fn channel_names(channels: &Channels) -> Vec<String> {
    match channels {
        Channels::Luminance => vec!["luminance".into()],
        Channels::Rgb => ["r", "g", "b"].map(String::from).to_vec(),
        Channels::Wavelengths(w) => w.nm().iter().map(|nm| format!("{nm}nm")).collect(),
    }
}
