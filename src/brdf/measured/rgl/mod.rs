//! Tables of the RGL database (Dupuy and Jakob 2018), as Mitsuba 3 (`measured`), pbrt-v4 and the loader of the
//! database read them.
//!
//! An incidence ω_i holds grids over the unit square that the half vector m is mapped to: u = √(2 θ_m / π),
//! v = (φ_m + π) / 2π, φ_m against the azimuth of the light where the table is isotropic. A map that makes the visible
//! normals uniform ([`warp`]) turns (u, v) into the place in the grids of values, f_r cos θ_o · 4σ(ω_i) / D(m), so that a
//! lobe of any width has nodes. Between incidences grids and distributions are weighted linearly. [`mod@file`] has
//! the fields.
//!
//! Beyond the last elevation of the light nothing was measured, and nothing is made up: the pair is
//! [`Presence::Missing`]. (Mitsuba goes on with the last.) Of the sensor every direction above the horizon is known.
//! Values below 0 count as 0. Nodes without a reading are left out and the weights of the others renormalised.
//!
//! Light is ω_i, sensor ω_o; no reciprocity is declared. A table of one or two azimuths of the light is isotropic, and
//! the first of them is read. Of one that holds half or a quarter of the circle pairs are mirrored into it.

pub mod file;
pub(crate) mod tensor;
pub mod warp;
mod write;

pub use file::Fields;
pub use write::{LEVELS, Level, table_pairs, tabulate};

use super::specs::{file_table, length};
use super::{Channels, FileFormat, TableError, around, without_wavelengths, write_file};
use crate::brdf::{Brdf, Presence, Wavelengths};
use crate::error::ParameterError;
use crate::geometry::{Direction, DirectionPair, Symmetry};
use crate::numeric;
use file::{Colours, Lost, MOST_OF_ISOTROPIC};
use glam::DVec3;
use std::f64::consts::{FRAC_2_PI, FRAC_PI_2, PI, TAU};
use std::io;
use warp::{Densities, Grids, Weighted};

/// Distance (rad) beyond the last elevation of the light within which it counts as on it: the nodes are `f32`.
const SLACK: f64 = 1e-6;

/// An RGL table as a BRDF.
#[derive(Clone, Debug)]
pub struct Rgl {
    channels: Channels,
    phi_i: Vec<f64>,
    theta_i: Vec<f64>,
    /// 1: the table holds the whole circle of φ_i; 2 and 4: a half and a quarter of it.
    reduction: u32,
    jacobian: bool,
    ndf: Grids,
    sigma: Grids,
    vndf: Densities,
    /// A grid an incidence and channel.
    values: Grids,
    lost: Lost,
}

fn no_access(e: io::Error) -> TableError {
    TableError::Io("no access to this RGL table", e)
}

/// u from an elevation (rad) and back.
fn u_of(theta: f64) -> f64 {
    (theta * FRAC_2_PI).sqrt()
}

/// An elevation (rad) from u.
fn theta_of(u: f64) -> f64 {
    FRAC_PI_2 * u * u
}

/// v from an azimuth (rad).
fn v_of(phi: f64) -> f64 {
    let v = (phi + PI) / TAU;
    v - v.floor()
}

/// The density of (u, v) that belongs to one a steradian of m is this many times that: dω / (du dv).
fn jacobian(u: f64, sin_theta: f64) -> f64 {
    2.0 * PI * PI * u * sin_theta
}

/// The symmetries of a table of a number of azimuths of the light.
fn symmetry(azimuths: usize) -> Symmetry {
    Symmetry::NONE.with_isotropy(azimuths <= MOST_OF_ISOTROPIC)
}

impl Rgl {
    /// The table of some fields, for a scene in `channels`.
    ///
    /// # Errors
    /// [`TableError::Malformed`] of a distribution that is 0, and of channels that the table does not hold.
    pub fn new(fields: Fields, channels: Channels) -> Result<Self, TableError> {
        let vndf = Densities::new(fields.vndf);
        let vndf = vndf.ok_or_else(|| TableError::field("vndf", "is 0 for an incidence"))?;
        if !fields.sigma.values.iter().all(|s| *s > 0.0) && fields.jacobian {
            return Err(TableError::field(
                "sigma",
                "holds 0; allowed: numbers above it",
            ));
        }
        let phi_i: Vec<f64> = fields.phi_i.iter().map(|v| f64::from(*v)).collect();
        let reduction = match phi_i[..] {
            [first, .., last] if phi_i.len() > MOST_OF_ISOTROPIC => {
                (TAU / (last - first)).round() as u32
            }
            _ => 1,
        };
        let values = in_channels(fields.values, &fields.colours, &channels)?;
        Ok(Self {
            channels,
            theta_i: fields.theta_i.iter().map(|v| f64::from(*v)).collect(),
            phi_i,
            reduction,
            jacobian: fields.jacobian,
            ndf: fields.ndf,
            sigma: fields.sigma,
            vndf,
            values,
            lost: Lost::default(),
        })
    }

    fn is_isotropic(&self) -> bool {
        self.symmetry().isotropic
    }

    /// The incidences around one.
    fn incidences(&self, theta_i: f64, phi_i: f64) -> Weighted {
        let mut all = Weighted::new();
        for (p, a) in around(&self.phi_i, phi_i) {
            for (t, b) in around(&self.theta_i, theta_i) {
                if a * b > 0.0 {
                    all.push((p * self.theta_i.len() + t, a * b));
                }
            }
        }
        all
    }

    /// Writes f_r over zeros; of no use where there is no data.
    fn look_up(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        if !pair.is_above_horizon() {
            return Presence::Present;
        }
        let [light, sensor] = self.folded(pair);
        let theta_i = light.theta();
        let last = self.theta_i.last();
        if last.is_none_or(|last| theta_i > last + SLACK) {
            return Presence::Missing;
        }
        // Above the horizon the two are never opposite.
        let Some(m) = Direction::try_new(light.vector() + sensor.vector()) else {
            return Presence::Present;
        };
        let (phi_i, turned) = match self.is_isotropic() {
            true => (self.phi_i[0], m.phi() - light.phi()),
            // Their circle begins at −π, which `phi` calls π.
            false if self.reduction >= 2 && light.phi() > 0.0 => (-PI, m.phi()),
            false => (light.phi(), m.phi()),
        };
        let place = [u_of(m.theta()), v_of(turned)];
        let incidences = self.incidences(theta_i, phi_i);
        let (uniform, _) = self.vndf.uniform(&incidences, place);
        let mut factor = 1.0 / sensor.cos_theta();
        if self.jacobian {
            let sigma = self.sigma.one([u_of(theta_i), (phi_i + PI) / TAU]);
            factor *= self.ndf.one(place) / (4.0 * sigma);
        }
        let count = out.len();
        for (channel, out) in out.iter_mut().enumerate() {
            let value = factor * self.values.value_at(&incidences, [channel, count], uniform);
            *out = value.clamp(0.0, f64::MAX);
        }
        Presence::of(out.iter().all(|v| !v.is_nan()))
    }

    /// Light and sensor, mirrored into the part of the circle of φ_i that is held.
    fn folded(&self, pair: &DirectionPair) -> [Direction; 2] {
        if self.reduction < 2 {
            return [pair.omega_i, pair.omega_o];
        }
        let light = pair.omega_i.vector();
        // Towards −π … 0, or −π … −π/2.
        let y = -1.0_f64.copysign(light.y);
        let x = match self.reduction {
            4 => -1.0_f64.copysign(light.x),
            _ => y,
        };
        let mirror = DVec3::new(x, y, 1.0);
        [pair.omega_i, pair.omega_o].map(|d| Direction::from_unit(d.vector() * mirror))
    }
}

/// The grids of the channels of a scene.
fn in_channels(grids: Grids, colours: &Colours, channels: &Channels) -> Result<Grids, TableError> {
    let held = colours.count();
    let [w, h] = grids.size;
    // A channel is a sum of some of the held grids.
    let parts: Vec<Vec<(usize, f64)>> = match (colours, channels) {
        (Colours::Rgb, Channels::Rgb) => return Ok(grids),
        (Colours::Rgb, Channels::Luminance) => {
            vec![numeric::LUMINANCE.into_iter().enumerate().collect()]
        }
        (Colours::Wavelengths(nm), Channels::Wavelengths(wanted)) => {
            let nm: Vec<f64> = nm.iter().map(|v| f64::from(*v)).collect();
            let between = |x: &f64| {
                around(&nm, *x)
                    .into_iter()
                    .filter(|(_, w)| *w > 0.0)
                    .collect()
            };
            wanted.nm().iter().map(between).collect()
        }
        (Colours::Rgb, Channels::Wavelengths(_)) => {
            let what = "is missing: the table holds R, G, B; allowed: a scene in luminance or rgb";
            return Err(TableError::field("spectra", what));
        }
        (Colours::Wavelengths(_), _) => {
            let what = "is missing: the table holds wavelengths; allowed: a scene of some of them";
            return Err(TableError::field("rgb", what));
        }
    };
    let mut values = Vec::with_capacity(grids.values.len() / held * parts.len());
    for incidence in grids.values.chunks_exact(held * w * h) {
        for parts in &parts {
            let sum = |i: usize| {
                let sum = parts
                    .iter()
                    .map(|(g, weight)| weight * f64::from(incidence[g * w * h + i]));
                sum.sum::<f64>() as f32
            };
            values.extend((0..w * h).map(sum));
        }
    }
    Ok(Grids { values, ..grids })
}

impl Brdf for Rgl {
    fn channels(&self) -> &Channels {
        &self.channels
    }

    fn symmetry(&self) -> Symmetry {
        symmetry(self.phi_i.len())
    }

    fn remarks(&self) -> Vec<String> {
        let each = self.lost.wavelengths.iter();
        let each = each.map(|nm| format!("the wavelength {nm} nm has no reading: passed over"));
        let [w, h] = self.values.size;
        let grids = self.values.values.chunks_exact(w * h);
        let first = grids.step_by(self.channels.count()).flatten();
        let mut doubts = self.lost.doubts.clone();
        doubts.look_for_zeros(first.map(|v| f64::from(*v)));
        each.chain(doubts.remarks()).collect()
    }

    fn cells_without_reading(&self) -> usize {
        self.lost.doubts.marks.count() + self.lost.wavelengths.len()
    }

    fn eval(&self, pair: &DirectionPair, out: &mut [f64]) -> Presence {
        out.fill(0.0);
        let presence = self.look_up(pair, out);
        if presence == Presence::Missing {
            out.fill(0.0);
        }
        presence
    }
}

file_table! {
    "rgl": "measured table of the RGL database, the .bsdf file at `path`; R, G, B or wavelengths; also no_reading",
    Neither, {
        extensions: &["bsdf"],
        begins: Some(|bytes| bytes.starts_with(b"tensor_file")),
        summary: "over visible normals, for Mitsuba and pbrt; R, G, B or wavelengths",
        write: Some(|brdf, of, path| {
            let (fields, filled) = tabulate(brdf, LEVELS[of.size])?;
            write_file(path, filled, |out| fields.write(out))
        }),
        pairs: Some(|brdf, size| Ok(table_pairs(brdf, LEVELS[size]))),
        sizes: LEVELS.len(),
    }
    /// An RGL file, as a config writes it.
    pub struct RglSpec {}

    fn fits(&self, channels: &Channels) -> Result<(), TableError> {
        let colours = file::open(&self.path)?.colours()?;
        Ok(self.suits(&colours, channels)?)
    }

    fn channels(&self) -> Result<Option<Channels>, TableError> {
        // A wavelength without a reading is only found among the values.
        Ok(Some(match self.fields()?.0.colours {
            Colours::Rgb => Channels::Rgb,
            Colours::Wavelengths(nm) => {
                let nm: Vec<f64> = nm.iter().map(|v| f64::from(*v)).collect();
                Channels::Wavelengths(Wavelengths::new(&nm)?)
            }
        }))
    }

    fn symmetries(&self, _channels: &Channels) -> Result<Symmetry, TableError> {
        let phi_i = file::open(&self.path)?.phi_i()?;
        Ok(symmetry(phi_i.len()))
    }

    fn load(&self, channels: Channels) -> Result<impl Brdf + 'static, TableError> {
        self.fits(&channels)?;
        let (fields, lost) = self.fields()?;
        self.suits(&fields.colours, &channels)?;
        let table = Rgl::new(fields, channels)?;
        Ok(Rgl { lost, ..table })
    }

    fn channel_bytes(&self) -> usize {
        let colours = file::open(&self.path).and_then(|mut head| head.colours());
        // Distributions are held beside the normals that they are of.
        2 * length(&self.path) / colours.map_or(1, |c| c.count())
    }
}

impl RglSpec {
    /// What the file holds, but for what stands for no reading.
    fn fields(&self) -> Result<(Fields, Lost), TableError> {
        let mut fields = file::open(&self.path)?.load()?;
        let lost = fields.take_marks(self.no_reading)?;
        Ok((fields, lost))
    }

    /// Checks that a scene can make use of the colours of the file.
    fn suits(&self, colours: &Colours, channels: &Channels) -> Result<(), ParameterError> {
        let Colours::Wavelengths(nm) = colours else {
            return without_wavelengths("path", self.path.display(), channels);
        };
        let ends = [nm[0], nm[nm.len() - 1]].map(f64::from);
        // They are of single precision.
        let [low, high] = [ends[0] * (1.0 - 1e-7), ends[1] * (1.0 + 1e-7)];
        let within = |w: &Wavelengths| w.nm().iter().all(|nm| (low..=high).contains(nm));
        if channels.wavelengths().is_some_and(within) {
            return Ok(());
        }
        let allowed = format!(
            "with channels = {{ wavelengths_nm = … }} from {} to {} nm: this table holds wavelengths",
            ends[0], ends[1]
        );
        Err(ParameterError::new("path", self.path.display(), allowed))
    }
}
