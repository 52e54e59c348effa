//! Text files of the ALTA library (Belcour, Barla, Pacanowski: ALTA, a BRDF analysis library),
//! a public format in which measurements are exchanged.
//!
//! `#DIM n p`, `#PARAM_IN name`, `#PARAM_OUT name` and `#VS k` in front, then rows of n coordinates,
//! p values and the numbers that `#VS` announces, in radians. Other lines that begin with `#`
//! are comments. With light L and view V, h = (L + V)/2 and k = (L − V)/2 not normalised:
//!
//! | `#PARAM_IN` | coordinates |
//! |---|---|
//! | `SPHERICAL_TL_PL_TV_PV` | theta_L, phi_L, theta_V, phi_V |
//! | `ISOTROPIC_TV_TL_DPHI` | theta_V, theta_L, phi_L − phi_V |
//! | `ISOTROPIC_TL_TV_PROJ_DPHI` | theta_L, theta_V cos d, theta_V sin d with d = phi_L − phi_V |
//! | `ISOTROPIC_TV_PROJ_DPHI` | the same without the light, which is at the normal |
//! | `RUSIN_TH_PH_TD_PD` | theta_h, phi_h, then theta_d, phi_d of **V** in the frame of h |
//! | `RUSIN_TH_TD_PD` | the same without phi_h |
//! | `RUSIN_TH_TD` | the same without azimuths: read at phi_d = π/2 |
//! | `STARK_3D` | length of h in the tangent plane, length of k, phi_k − phi_h |
//! | `STARK_2D` | the same without azimuth: read at π/2 |
//! | `NEUMANN_3D` | lengths of h and of k in the tangent plane, phi_k − phi_h |
//! | `NEUMANN_2D` | the same without azimuth: read at π/2 |
//! | `CARTESIAN` | V, then L |
//!
//! phi_d is that of our half/difference coordinates plus π. These are the coordinates that ALTA
//! computes of a pair when it writes; where it makes a pair of `STARK_3D`, `NEUMANN_3D` or
//! `ISOTROPIC_TL_TV_PROJ_DPHI` it exchanges light and view or mirrors them, which no reciprocal or
//! no bilateral BRDF shows.
//!
//! Values are f_r in sr⁻¹ (`INV_STERADIAN`, `RGB_COLOR`), or times cos theta_V
//! (`INV_STERADIAN_COSINE_FACTOR`, documented as "the cosine factor of the output direction"), one luminance or three colours;
//! without `#PARAM_OUT` [`Conventions::quantity`] says which, which goes before the line too. Where
//! `#WAVELENGTHS_NM 450 550 650` names as many wavelengths as there are values, which is a comment to
//! ALTA, they are those. `#VS 1` gives the radius of a
//! symmetric interval, of the first value or of each: it is taken for a standard uncertainty that
//! readings share; of the two ends that `#VS 2` gives it is half of what lies between them.

use super::Readings;
use super::scattered::{Rows, numbers, refuse_columns};
use crate::brdf::{Channels, Wavelengths};
use crate::error::{count, excerpt};
use crate::geometry::Direction;
use crate::numeric::safe_sqrt;
use crate::schedule::convention::names_of;
use crate::schedule::{Assume, Azimuth, Conventions, FileError, Quantity};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};

/// Tolerance of the length of a `CARTESIAN` vector, which is 1 up to four printed digits.
const LENGTH_SLACK: f64 = 1e-3;

/// What coordinates say.
#[derive(Clone, Copy)]
enum Inverse {
    /// Elevations and azimuths of light and view.
    Angles(fn(&[f64]) -> [f64; 4]),
    /// Light and view, not above the horizon if the coordinates are outside their domain.
    Vectors(fn(&[f64]) -> [DVec3; 2]),
}

use Inverse::{Angles, Vectors};

/// Values of `#PARAM_IN`: name, number of coordinates, true if they fix the orientation of the
/// sample, and their directions.
#[rustfmt::skip]
const INPUTS: [(&str, usize, bool, Inverse); 12] = [
    ("SPHERICAL_TL_PL_TV_PV", 4, true, Angles(|x| [x[0], x[1], x[2], x[3]])),
    ("ISOTROPIC_TV_TL_DPHI", 3, false, Angles(|x| [x[1], 0.0, x[0], -x[2]])),
    ("ISOTROPIC_TV_PROJ_DPHI", 2, false, Angles(|x| [0.0, 0.0, x[0].hypot(x[1]), -x[1].atan2(x[0])])),
    ("ISOTROPIC_TL_TV_PROJ_DPHI", 3, false, Angles(|x| [x[0], 0.0, x[1].hypot(x[2]), -x[2].atan2(x[1])])),
    ("RUSIN_TH_PH_TD_PD", 4, true, Vectors(|x| rusinkiewicz(x[0], x[1], x[2], x[3]))),
    ("RUSIN_TH_TD_PD", 3, false, Vectors(|x| rusinkiewicz(x[0], 0.0, x[1], x[2]))),
    ("RUSIN_TH_TD", 2, false, Vectors(|x| rusinkiewicz(x[0], 0.0, x[1], FRAC_PI_2))),
    ("STARK_3D", 3, false, Vectors(|x| stark(x[0], x[1], x[2]))),
    ("STARK_2D", 2, false, Vectors(|x| stark(x[0], x[1], FRAC_PI_2))),
    ("NEUMANN_3D", 3, false, Vectors(|x| neumann(x[0], x[1], x[2]))),
    ("NEUMANN_2D", 2, false, Vectors(|x| neumann(x[0], x[1], FRAC_PI_2))),
    (CARTESIAN, 6, true, Vectors(|x| [DVec3::from_slice(&x[3..]), DVec3::from_slice(x)])),
];

/// What has vectors in its columns.
const CARTESIAN: &str = "CARTESIAN";

/// What `#PARAM_OUT` may say: name, numbers of values without wavelengths, what they are.
const OUTPUTS: [(&str, &[usize], Quantity); 3] = [
    ("INV_STERADIAN", &[1, 3], Quantity::Brdf),
    ("INV_STERADIAN_COSINE_FACTOR", &[1, 3], Quantity::BrdfCosine),
    (RGB_COLOR, &[3], Quantity::Brdf),
];

/// The value of `#PARAM_OUT` by default.
const UNKNOWN_OUTPUT: &str = "UNKNOWN_OUTPUT";

/// What is not known by wavelength.
const RGB_COLOR: &str = "RGB_COLOR";

const WAVELENGTHS: &str = "WAVELENGTHS_NM";

/// A direction from its angles.
fn unit(theta: f64, phi: f64) -> DVec3 {
    Direction::from_spherical(theta, phi).vector()
}

/// Light and view below the horizon, which stand for coordinates outside their domain.
const OUTSIDE: [DVec3; 2] = [DVec3::NEG_Z, DVec3::NEG_Z];

/// The view at (theta_d, phi_d) about the half vector, the light its reflection.
fn rusinkiewicz(theta_h: f64, phi_h: f64, theta_d: f64, phi_d: f64) -> [DVec3; 2] {
    let h = unit(theta_h, phi_h);
    // The frame of h: down its meridian, along its circle.
    let down = unit(theta_h + FRAC_PI_2, phi_h);
    let along = unit(FRAC_PI_2, phi_h + FRAC_PI_2);
    let d = unit(theta_d, phi_d);
    let view = down * d.x + along * d.y + h * d.z;
    [2.0 * view.dot(h) * h - view, view]
}

/// h = (h_bar, 0, h_z) and k of a given length and azimuth, at right angles to it.
fn stark(h_bar: f64, k: f64, azimuth: f64) -> [DVec3; 2] {
    let h_z2 = 1.0 - h_bar * h_bar - k * k;
    if h_z2 < 0.0 {
        return OUTSIDE;
    }
    let h_z = h_z2.sqrt();
    let (sin, cos) = azimuth.sin_cos();
    let slope = h_bar * cos;
    let norm = h_z.hypot(slope);
    let k = if norm > 0.0 {
        DVec3::new(h_z * cos, h_z * sin, -slope) * (k / norm)
    } else {
        DVec3::new(cos, sin, 0.0) * k
    };
    let h = DVec3::new(h_bar, 0.0, h_z);
    [h + k, h - k]
}

/// Light and view from their shadows h_bar ± k_bar on the tangent plane.
fn neumann(h_bar: f64, k_bar: f64, azimuth: f64) -> [DVec3; 2] {
    let (sin, cos) = azimuth.sin_cos();
    let raised = |sign: f64| {
        let (x, y) = (h_bar + sign * k_bar * cos, sign * k_bar * sin);
        let z2 = 1.0 - x * x - y * y;
        DVec3::new(x, y, if z2 > 0.0 { safe_sqrt(z2) } else { -1.0 })
    };
    [raised(1.0), raised(-1.0)]
}

/// True if a text has the header of such a file.
pub fn is_alta(text: &str) -> bool {
    let mut header = text.lines().take_while(|line| {
        let line = line.trim();
        line.is_empty() || line.starts_with('#')
    });
    header.any(|line| line.starts_with("#DIM"))
}

/// The header: kinds and numbers of columns.
struct Header {
    input: (&'static str, usize, bool, Inverse),
    channels: Channels,
    quantity: Quantity,
    intervals: usize,
}

/// Reads a text; `name` stands for the file in messages. Coordinates without the azimuth of the
/// sample are those of an isotropic material unless `assume` says otherwise.
///
/// # Errors
/// One sentence with the line: a header that lacks a line or holds an unsupported value, a row with
/// another number of cells, or with one that is no finite number or no reading.
pub fn read(text: &str, name: &str, assume: &Assume) -> Result<Readings, FileError> {
    let conventions = &assume.conventions;
    refuse_columns("an ALTA file", name, conventions, None)?;
    let header = Header::read(text, name, conventions)?;
    let (input, dimension, fixes_sample, inverse) = header.input;
    let n = header.channels.count();
    let azimuth = conventions.azimuth.unwrap_or(Azimuth::Sample);
    let mut rows = Rows::new(name);
    let mut beyond_turn = false;
    for (line, content) in (1..).zip(text.lines().map(str::trim)) {
        if let Some(comment) = content.strip_prefix('#') {
            let key = comment.split_whitespace().next().unwrap_or_default();
            if !KEYS.contains(&key) {
                rows.pass_over(key);
            }
            continue;
        }
        if content.is_empty() {
            continue;
        }
        let cells = header.row(content, name, line)?;
        let refuse = |message: String| FileError::on_line(name, line, message);
        let [light, view] = match inverse {
            Vectors(of) => of(&cells[..dimension]),
            Angles(of) => {
                let angles = &cells[..dimension];
                beyond_turn |= angles.iter().any(|angle| angle.abs() > 4.0 * PI);
                let [theta_l, phi_l, theta_v, phi_v] = of(angles);
                let turned = azimuth.about_axis(!fixes_sample, PI, [phi_l, phi_v]);
                [unit(theta_l, turned[0]), unit(theta_v, turned[1])]
            }
        };
        if input == CARTESIAN {
            for v in [light, view] {
                if (v.length() - 1.0).abs() > LENGTH_SLACK {
                    let length = v.length();
                    let message = format!("a direction of length {length}: allowed is 1");
                    return Err(refuse(message));
                }
            }
        }
        let (values, intervals) = cells[dimension..].split_at(n);
        let intervals = intervals.chunks(header.intervals.max(1));
        let mut radii = Vec::new();
        for (value, interval) in values.iter().zip(intervals) {
            radii.push(match *interval {
                [least, most] if least <= *value && *value <= most => 0.5 * (most - least),
                [least, most] => {
                    return Err(refuse(format!(
                        "an interval from {least} to {most} of the value {value}: allowed are ends around it, the lesser first"
                    )));
                }
                [radius] if radius >= 0.0 => radius,
                _ => {
                    let what = format!("an interval of radius {}", interval[0]);
                    return Err(refuse(format!("{what}: allowed is a number from 0")));
                }
            });
        }
        // One radius stands for all values.
        let radii: Vec<f64> = radii.into_iter().cycle().take(n).collect();
        rows.push(line, [light, view], header.quantity, values, &radii)?;
    }
    let below = rows.below_horizon;
    let has_azimuths = matches!(inverse, Angles(_));
    let mut readings = rows.readings(header.channels, assume, fixes_sample, has_azimuths)?;
    let poses = readings.measurement.schedule.poses.len();
    readings.notes = vec![format!(
        "ALTA {input}: {} below the horizon, {} averaged with earlier ones",
        count(below, "row"),
        count(readings.rows - poses - below, "row")
    )];
    // Beyond two turns.
    readings.warnings.extend(beyond_turn.then(|| {
        "some angles are beyond two turns, as if degrees were read as radians, which ALTA's files have".into()
    }));
    Ok(readings)
}

/// Keys of the header that are read.
const KEYS: [&str; 6] = ["FORMAT", "DIM", "PARAM_IN", "PARAM_OUT", "VS", WAVELENGTHS];

fn wavelengths(words: &[&str], name: &str, line: usize) -> Result<Wavelengths, FileError> {
    let refuse = |message: String| FileError::on_line(name, line, message);
    let number = |word: &&str| {
        word.parse::<f64>().map_err(|_| {
            let word = excerpt(word);
            refuse(format!("#{WAVELENGTHS} {word}: allowed are numbers of nm"))
        })
    };
    let nm: Vec<f64> = words.iter().map(number).collect::<Result<_, _>>()?;
    Wavelengths::new(&nm).map_err(|e| refuse(format!("#{WAVELENGTHS}: {e}")))
}

impl Header {
    fn read(text: &str, name: &str, conventions: &Conventions) -> Result<Self, FileError> {
        let fact = |key: &str| {
            (1..).zip(text.lines()).find_map(|(line, content)| {
                let mut words = content.strip_prefix('#')?.split_whitespace();
                (words.next()? == key).then(|| (line, words.collect::<Vec<_>>()))
            })
        };
        let needed = |key: &str| {
            let missing = || FileError::whole(name, format!("the line #{key} is missing"));
            fact(key).ok_or_else(missing)
        };
        let refuse = |key: &str, (line, words): &(usize, Vec<&str>), allowed: String| {
            let found = words.join(" ");
            let message = format!("#{key} {}: allowed {allowed}", excerpt(&found));
            FileError::on_line(name, *line, message)
        };
        if let Some(fact) = fact("FORMAT").filter(|(_, words)| words != &["text"]) {
            return Err(refuse("FORMAT", &fact, "is text".into()));
        }
        let param_in = needed("PARAM_IN")?;
        let Some(input) = INPUTS.into_iter().find(|input| param_in.1 == [input.0]) else {
            let allowed = format!("are {}", INPUTS.map(|input| input.0).join(", "));
            return Err(refuse("PARAM_IN", &param_in, allowed));
        };
        if conventions.azimuth.is_some() && matches!(input.3, Vectors(_)) {
            let message = format!(
                "--azimuth: #PARAM_IN {} has no azimuths of its own",
                input.0
            );
            return Err(FileError::on_line(name, param_in.0, message));
        }
        let said = fact("PARAM_OUT").filter(|(_, words)| *words != [UNKNOWN_OUTPUT]);
        let output = match (&said, conventions.quantity) {
            // Without a name as many values as that of a BRDF has.
            (None, Some(_)) => OUTPUTS[0],
            (None, None) => {
                let message = format!(
                    "the line #PARAM_OUT is missing, which says what the values are; allowed: \
                     --quantity with one of {}",
                    names_of(&Quantity::ALL)
                );
                return Err(FileError::whole(name, message));
            }
            (Some(said), _) => {
                let known = OUTPUTS.into_iter().find(|output| said.1 == [output.0]);
                known.ok_or_else(|| {
                    let allowed = format!("are {}", OUTPUTS.map(|output| output.0).join(", "));
                    refuse("PARAM_OUT", said, allowed)
                })?
            }
        };
        let quantity = conventions.quantity.unwrap_or(output.2);
        let wavelengths = match fact(WAVELENGTHS) {
            None => None,
            Some((line, _)) if output.0 == RGB_COLOR => {
                let message = format!("#{WAVELENGTHS}: not allowed with #PARAM_OUT {RGB_COLOR}");
                return Err(FileError::on_line(name, line, message));
            }
            Some((line, words)) => Some(wavelengths(&words, name, line)?),
        };
        let counts = match &wavelengths {
            None => output.1.to_vec(),
            Some(wavelengths) => vec![wavelengths.nm().len()],
        };
        let dim = needed("DIM")?;
        let numbers: Option<Vec<usize>> = dim.1.iter().map(|w| w.parse().ok()).collect();
        let values = match numbers.as_deref() {
            Some(&[n, p]) if n == input.1 && counts.contains(&p) => p,
            _ => {
                let allowed: Vec<_> = counts.iter().map(usize::to_string).collect();
                let allowed = format!(
                    "are {} coordinates of {} and {} values of {}{}",
                    input.1,
                    input.0,
                    allowed.join(" or "),
                    output.0,
                    match &wavelengths {
                        None if output.0 != RGB_COLOR => ", or one for each of #WAVELENGTHS_NM",
                        _ => "",
                    }
                );
                return Err(refuse("DIM", &dim, allowed));
            }
        };
        let intervals = match fact("VS") {
            None => 0,
            Some(said) => match said.1[..] {
                ["0"] => 0,
                ["1"] => 1,
                ["2"] => 2,
                _ => return Err(refuse("VS", &said, "are 0, 1 and 2".into())),
            },
        };
        let channels = match (wavelengths, values) {
            (Some(wavelengths), _) => Channels::Wavelengths(wavelengths),
            (None, 1) => Channels::Luminance,
            (None, _) => Channels::Rgb,
        };
        Ok(Self {
            input,
            channels,
            quantity,
            intervals,
        })
    }

    fn row(&self, content: &str, name: &str, line: usize) -> Result<Vec<f64>, FileError> {
        let n = self.channels.count();
        let bare = self.input.1 + n;
        let counts = [bare + self.intervals, bare + self.intervals * n];
        let words = content.split_whitespace();
        numbers(words, name, line, "#DIM and #VS ask for", &counts)
    }
}
