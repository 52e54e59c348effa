//! The fields of a table, and their checks.
//!
//! ```text
//! description  u8 [n]                 text
//! jacobian     u8 [1]                 1: values are to be multiplied by ndf / (4 sigma)
//! phi_i        f32 [P]                azimuths of the light, rad; P ≤ 2: isotropic
//! theta_i      f32 [T]                its elevations, rad
//! ndf          f32 [a, b]             distribution of normals, rows phi, columns theta
//! sigma        f32 [c, d]             projected area of the micro-surface towards the light, same axes
//! vndf         f32 [P, T, e, f]       distribution of visible normals, up to a factor
//! luminance    f32 [P, T, n, n]       density of samples in what vndf makes uniform
//! rgb          f32 [P, T, 3, n, n]    f_r cos theta_o 4 sigma / ndf, or
//! spectra      f32 [P, T, L, n, n]    the same at
//! wavelengths  f32 [L]                nm
//! ```
//!
//! Numbers of rgb and spectra that are NaN or infinite, and those that stand for no reading as -999 does ([`crate::brdf::Marks`]),
//! spoil themselves only; so does a wavelength that is NaN or has no number at all, which is left out.

use super::super::TableError;
use super::super::doubts::Doubts;
use super::no_access;
use super::tensor::{self, F32, Field, Tensor, U8};
use super::warp::Grids;
use crate::brdf::Marks;
use crate::files;
use std::f32::consts::PI;
use std::io::{self, BufReader, Read, Seek, Write};
use std::path::Path;

/// What a table holds for each incidence.
#[derive(Clone, Debug, PartialEq)]
pub enum Colours {
    /// Linear R, G, B.
    Rgb,
    /// One value at each of these wavelengths, nm.
    Wavelengths(Vec<f32>),
}

impl Colours {
    /// Grids of an incidence.
    pub(crate) fn count(&self) -> usize {
        match self {
            Colours::Rgb => 3,
            Colours::Wavelengths(nm) => nm.len(),
        }
    }
}

/// The fields of a table.
#[derive(Clone, Debug)]
pub struct Fields {
    /// Text about the material.
    pub description: String,
    /// True if values are multiplied by ndf / (4 sigma).
    pub jacobian: bool,
    /// Azimuths of the light, rad.
    pub phi_i: Vec<f32>,
    /// Elevations of the light, rad.
    pub theta_i: Vec<f32>,
    /// Distribution of normals, one grid.
    pub ndf: Grids,
    /// Projected area, one grid.
    pub sigma: Grids,
    /// Visible normals, a grid an incidence.
    pub vndf: Grids,
    /// Density of samples, a grid an incidence.
    pub luminance: Grids,
    /// A grid an incidence and colour.
    pub values: Grids,
    /// What the colours are.
    pub colours: Colours,
}

/// The largest P of a table that turns with the light.
pub(crate) const MOST_OF_ISOTROPIC: usize = 2;

/// The header of a table.
pub struct Head<R> {
    input: R,
    fields: Vec<Field>,
}

/// Opens a file and reads its header.
pub(crate) fn open(path: &Path) -> Result<Head<BufReader<std::fs::File>>, TableError> {
    let file = files::open(path).map_err(no_access)?;
    let length = file.metadata().map_err(no_access)?.len();
    Head::read(BufReader::new(file), length)
}

impl<R: Read + Seek> Head<R> {
    /// Reads the header of `length` bytes.
    pub fn read(mut input: R, length: u64) -> Result<Self, TableError> {
        let fields = tensor::head(&mut input, length)?;
        Ok(Self { input, fields })
    }

    fn has(&self, name: &str) -> bool {
        self.fields.iter().any(|f| f.name == name)
    }

    /// A field of a number of dimensions.
    fn field(&self, name: &str, dimensions: usize) -> Result<&Field, TableError> {
        let field = self.fields.iter().find(|f| f.name == name);
        let field = field.ok_or_else(|| TableError::field(name, "is missing"))?;
        let may_be_empty = name == "description";
        let shape = &field.shape;
        if shape.len() == dimensions && (may_be_empty || !shape.contains(&0)) {
            return Ok(field);
        }
        let what = format!("is {shape:?}; allowed: {dimensions} dimensions, none of them 0");
        Err(TableError::field(name, what))
    }

    fn bytes(&mut self, name: &str) -> Result<Vec<u8>, TableError> {
        let field = self.field(name, 1)?.clone();
        field.load(&mut self.input, U8)
    }

    /// Finite numbers, none below `least`; any without it.
    fn floats(
        &mut self,
        name: &str,
        dimensions: usize,
        least: Option<f32>,
    ) -> Result<(Vec<usize>, Vec<f32>), TableError> {
        let field = self.field(name, dimensions)?.clone();
        let bytes = field.load(&mut self.input, F32)?;
        let floats = bytes.as_chunks().0.iter();
        let floats: Vec<f32> = floats.map(|b| f32::from_le_bytes(*b)).collect();
        // A table of readings has some of them.
        let is_wrong = |v: &f32| least.is_some_and(|least| !v.is_finite() || *v < least);
        let Some(i) = floats.iter().position(is_wrong) else {
            return Ok((field.shape, floats));
        };
        let allowed = match least.unwrap_or(f32::MIN) {
            f32::MIN => "finite numbers".into(),
            least => format!("finite numbers from {least} on"),
        };
        let what = format!("holds {} at place {i}; allowed: {allowed}", floats[i]);
        Err(TableError::field(name, what))
    }

    /// Ascending numbers within a range.
    fn nodes(&mut self, name: &str, range: [f32; 2]) -> Result<Vec<f32>, TableError> {
        let (_, nodes) = self.floats(name, 1, Some(f32::MIN))?;
        ascending(name, nodes, range)
    }

    /// Azimuths of the light, rad.
    pub(crate) fn phi_i(&mut self) -> Result<Vec<f32>, TableError> {
        let nodes = self.nodes("phi_i", [-2.01 * PI, 2.01 * PI])?;
        if let [first, .., last] = nodes[..]
            && nodes.len() > MOST_OF_ISOTROPIC
        {
            let parts = 2.0 * PI / (last - first);
            let mut held = [1.0, 2.0, 4.0].iter();
            let is_part = held.any(|n| (parts / n - 1.0).abs() < 1e-3);
            if !is_part || !((first + PI).abs() < 1e-3) {
                let what = "is no circle, half or quarter of one from -π on";
                return Err(TableError::field("phi_i", what));
            }
        }
        Ok(nodes)
    }

    pub(crate) fn colours(&mut self) -> Result<Colours, TableError> {
        if !self.has("spectra") {
            return Ok(Colours::Rgb);
        }
        let mut nm = self.wavelengths()?;
        nm.retain(|nm| !nm.is_nan());
        match nm.is_empty() {
            false => Ok(Colours::Wavelengths(nm)),
            true => Err(TableError::field(
                "wavelengths",
                "holds none that is a number",
            )),
        }
    }

    /// Wavelengths as they are in the file, nm: ascending, but for those that are NaN.
    fn wavelengths(&mut self) -> Result<Vec<f32>, TableError> {
        let (_, nm) = self.floats("wavelengths", 1, None)?;
        let known: Vec<f32> = nm.iter().copied().filter(|nm| !nm.is_nan()).collect();
        ascending("wavelengths", known, [1.0, 1e6])?;
        Ok(nm)
    }

    /// Grids of which there are so many.
    fn grids(
        &mut self,
        name: &str,
        before: &[usize],
        least: Option<f32>,
    ) -> Result<Grids, TableError> {
        let (shape, values) = self.floats(name, before.len() + 2, least)?;
        let (found, size) = shape.split_at(before.len());
        if found != before || size.iter().any(|n| *n < 2) {
            let what = format!("is {shape:?}; allowed: {before:?} and two numbers of at least 2");
            return Err(TableError::field(name, what));
        }
        let size = [size[1], size[0]];
        Ok(Grids { size, values })
    }

    /// All fields.
    pub fn load(mut self) -> Result<Fields, TableError> {
        let description = match self.has("description") {
            true => String::from_utf8_lossy(&self.bytes("description")?).into_owned(),
            false => String::new(),
        };
        let jacobian = match self.has("jacobian") {
            true => self.bytes("jacobian")? != [0],
            false => true,
        };
        let phi_i = self.phi_i()?;
        let theta_i = self.nodes("theta_i", [0.0, 1.001 * PI / 2.0])?;
        let colours = match self.has("spectra") {
            true => Colours::Wavelengths(self.wavelengths()?),
            false => Colours::Rgb,
        };
        let incidences = [phi_i.len(), theta_i.len()];
        let ndf = self.grids("ndf", &[], Some(0.0))?;
        let sigma = self.grids("sigma", &[], Some(0.0))?;
        let vndf = self.grids("vndf", &incidences, Some(0.0))?;
        let luminance = self.grids("luminance", &incidences, Some(0.0))?;
        let of_colours = [incidences[0], incidences[1], colours.count()];
        let name = match colours {
            Colours::Rgb => "rgb",
            Colours::Wavelengths(_) => "spectra",
        };
        let values = self.grids(name, &of_colours, None)?;
        Ok(Fields {
            description,
            jacobian,
            phi_i,
            theta_i,
            ndf,
            sigma,
            vndf,
            luminance,
            values,
            colours,
        })
    }
}

/// Checks that numbers ascend within a range.
fn ascending(name: &str, nodes: Vec<f32>, [low, high]: [f32; 2]) -> Result<Vec<f32>, TableError> {
    if nodes.is_sorted_by(|a, b| a < b) && nodes.iter().all(|v| (low..=high).contains(v)) {
        return Ok(nodes);
    }
    let what = format!("does not ascend within [{low}, {high}]");
    Err(TableError::field(name, what))
}

/// What of a file is not there to be read.
#[derive(Clone, Debug, Default)]
pub(in crate::brdf::measured) struct Lost {
    /// About the numbers of what is left.
    pub doubts: Doubts,
    /// Wavelengths (nm) without a reading.
    pub wavelengths: Vec<f32>,
}

impl Fields {
    /// Makes NaN of values that stand for no reading, `no_reading` among them, and leaves out wavelengths without any other.
    /// Errors: [`TableError::Malformed`] if nothing is left.
    pub(in crate::brdf::measured) fn take_marks(
        &mut self,
        no_reading: Option<f64>,
    ) -> Result<Lost, TableError> {
        let mut lost = Lost {
            doubts: Doubts::take(&mut self.values.values, Marks::default(), no_reading),
            wavelengths: Vec::new(),
        };
        let colours = self.colours.count();
        let [w, h] = self.values.size;
        let mut held = vec![false; colours];
        for (i, grid) in self.values.values.chunks_exact(w * h).enumerate() {
            held[i % colours] |= grid.iter().any(|v| !v.is_nan());
        }
        if let Colours::Wavelengths(nm) = &mut self.colours {
            for (held, nm) in held.iter_mut().zip(nm.iter()) {
                *held &= !nm.is_nan();
                lost.wavelengths.extend((!*held).then_some(nm));
            }
            if !lost.wavelengths.is_empty() {
                let grids = self.values.values.chunks_exact(w * h).enumerate();
                let kept = grids.filter(|(i, _)| held[i % colours]);
                self.values.values = kept.flat_map(|(_, grid)| grid).copied().collect();
                let mut kept = held.iter();
                nm.retain(|_| kept.next() == Some(&true));
            }
        }
        match held.contains(&true) {
            true => Ok(lost),
            false => Err(TableError::field("rgb or spectra", "holds no reading")),
        }
    }

    /// Writes a file.
    pub fn write(&self, out: &mut impl Write) -> io::Result<()> {
        let incidences = [self.phi_i.len(), self.theta_i.len()];
        let floats = |numbers: &[f32]| numbers.iter().flat_map(|v| v.to_le_bytes()).collect();
        let grids = |name, before: &[usize], grids: &Grids| -> Tensor<'_> {
            let shape = [before, &[grids.size[1], grids.size[0]]].concat();
            (name, shape, F32, floats(&grids.values))
        };
        let of_colours = [&incidences[..], &[self.colours.count()]].concat();
        let list = |name, numbers: &[f32]| -> Tensor<'_> {
            (name, vec![numbers.len()], F32, floats(numbers))
        };
        let bytes =
            |name, bytes: &[u8]| -> Tensor<'_> { (name, vec![bytes.len()], U8, bytes.into()) };
        let mut tensors = vec![
            bytes("description", self.description.as_bytes()),
            bytes("jacobian", &[u8::from(self.jacobian)]),
            list("phi_i", &self.phi_i),
            list("theta_i", &self.theta_i),
            grids("ndf", &[], &self.ndf),
            grids("sigma", &[], &self.sigma),
            grids("vndf", &incidences, &self.vndf),
            grids("luminance", &incidences, &self.luminance),
        ];
        match &self.colours {
            Colours::Rgb => tensors.push(grids("rgb", &of_colours, &self.values)),
            Colours::Wavelengths(nm) => {
                tensors.push(list("wavelengths", nm));
                tensors.push(grids("spectra", &of_colours, &self.values));
            }
        }
        tensor::write(&tensors, out)
    }
}
