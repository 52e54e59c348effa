//! The directions of the rows of a table.

use super::convention::{AngleUnit, Azimuth, Conventions};
use super::names;
use super::table::{FileError, Table};
use crate::error::listed;
use crate::geometry::{Direction, DirectionPair};
use crate::numeric::GRAZING_COS;
use glam::DVec3;

/// Largest azimuth, degrees: a turn, and what its printed digits may add.
const TURN: f64 = 360.001;

/// Largest polar angle of the horizon, degrees: a quarter turn, and what its printed digits may add.
const QUARTER: f64 = 90.001;

struct Angles {
    column: usize,
    unit: AngleUnit,
}

impl Angles {
    fn find(table: &Table, name: &str) -> Option<Self> {
        AngleUnit::ALL.into_iter().find_map(|unit| {
            let column = table.column(&format!("{name}_{}", unit.name))?;
            let unit = unit.value;
            Some(Self { column, unit })
        })
    }

    fn needed(table: &Table, name: &str) -> Result<Self, FileError> {
        Self::find(table, name).ok_or_else(|| {
            let message = format!(
                "column {name}_deg is missing; needed are theta_i_deg, theta_o_deg, phi_o_deg (or \
                 delta_phi_deg = phi_i - phi_o) and, unless the sample is isotropic, phi_i_deg; \
                 under other names: --columns {name}=NAME"
            );
            FileError::on_line(&table.name, table.head, message)
        })
    }

    /// True if an angle of some row is below 0.
    fn is_signed(&self, table: &Table) -> bool {
        let mut angles = (0..table.lines.len()).filter_map(|row| table.number(row, self.column));
        angles.any(|angle| angle < 0.0)
    }

    /// The angle of a row in degrees, if `good`.
    fn degrees(
        &self,
        table: &Table,
        row: usize,
        good: impl Fn(f64) -> bool,
        allowed: [&str; 2],
    ) -> Result<f64, FileError> {
        let name = table.label(self.column);
        let Some(angle) = table.number(row, self.column) else {
            return Err(table.row_error(row, format!("{name} is empty or NaN")));
        };
        let degrees = self.unit.degrees(angle);
        if good(degrees) {
            return Ok(degrees);
        }
        let allowed = allowed[usize::from(self.unit == AngleUnit::Radians)];
        let message = format!("{name} = {angle}: allowed is a number in {allowed}");
        Err(table.row_error(row, message))
    }
}

/// True of polar angles above the horizon, degrees. Closer to it than any instrument sees is below.
fn is_above(theta: f64) -> bool {
    theta < 90.0 && theta.to_radians().cos() > GRAZING_COS
}

/// Takes out the rows without an angle, or without a number in one of `further` columns; how many.
pub(crate) fn take_incomplete(table: &mut Table, further: &[&str]) -> usize {
    let rows = table.lines.len();
    let angles = ["theta_i", "phi_i", "theta_o", "phi_o", "delta_phi"];
    let angles = angles.iter().filter_map(|name| Angles::find(table, name));
    let further = further.iter().filter_map(|name| table.column(name));
    let vectors = vectors(table).into_iter().flatten().flatten();
    let needed = angles.map(|a| a.column).chain(further).chain(vectors);
    let needed: Vec<usize> = needed.collect();
    table.retain(|table, row| {
        needed
            .iter()
            .all(|column| table.number(row, *column).is_some())
    });
    rows - table.lines.len()
}

/// Rows of a table by others that are no readings of reflection.
#[derive(Debug, Default)]
pub(crate) struct Outside {
    /// Those with light or sensor at the horizon, where f_r is of no use.
    pub at_horizon: usize,
    /// Those of them with the light there.
    pub lights: usize,
    /// Those with light or sensor behind the sample.
    pub behind: usize,
}

/// Takes out the rows with a direction at the horizon, and those behind the sample unless they are more than half, which has another
/// reason: [`read_pairs`] refuses these.
pub(crate) fn take_outside(table: &mut Table, conventions: &Conventions) -> Outside {
    let polar = ["theta_i", "theta_o"].map(|name| Angles::find(table, name));
    let vectors = vectors(table);
    let theta = |table: &Table, row: usize| {
        if let Some(vectors) = vectors {
            return vectors.map(|of| {
                let v = of.map(|d| table.number(row, d).unwrap_or(f64::NAN));
                Some((v[2] / DVec3::from_array(v).length()).acos().to_degrees())
            });
        }
        polar.each_ref().map(|angles| {
            let angles = angles.as_ref()?;
            let degrees = angles.unit.degrees(table.number(row, angles.column)?);
            Some(conventions.theta(degrees).abs())
        })
    };
    let rows = table.lines.len();
    let thetas: Vec<[Option<f64>; 2]> = (0..rows).map(|row| theta(table, row)).collect();
    let is_behind = |theta: &Option<f64>| theta.is_some_and(|t| t > QUARTER && t <= 180.0);
    let is_at_horizon = |theta: &Option<f64>| theta.is_some_and(|t| !is_above(t) && t <= QUARTER);
    let mut outside = Outside::default();
    for theta in &thetas {
        if theta.iter().any(is_behind) {
            outside.behind += 1;
            continue;
        }
        outside.at_horizon += usize::from(theta.iter().any(is_at_horizon));
        outside.lights += usize::from(is_at_horizon(&theta[0]));
    }
    if 2 * outside.behind > rows {
        outside.behind = 0;
    }
    table.retain(|_, row| match thetas[row].iter().any(is_behind) {
        true => outside.behind == 0,
        false => !thetas[row].iter().any(is_at_horizon),
    });
    outside
}

/// The directions of the rows of a table.
pub(crate) struct Pairs {
    /// The light and the sensor of every row.
    pub pairs: Vec<DirectionPair>,
    /// True if nothing fixes the light's azimuth, which is 0 then, as of an isotropic sample.
    pub isotropic: bool,
    /// Rows with a polar angle on the other side of the normal.
    pub signed: usize,
}

/// The directions of every row. A polar angle below 0, as of an arm that scans through the normal, is the
/// same angle in the opposite azimuth.
pub(super) fn read_pairs(table: &Table, conventions: &Conventions) -> Result<Pairs, FileError> {
    let found = match vectors(table) {
        Some(vectors) => pairs_of_vectors(table, vectors)?,
        None => pairs_of_angles(table, conventions)?,
    };
    match found.pairs.is_empty() {
        true => Err(FileError::whole(&table.name, "there is no row")),
        false => Ok(found),
    }
}

fn pairs_of_angles(table: &Table, conventions: &Conventions) -> Result<Pairs, FileError> {
    let polar = |name| Angles::needed(table, name);
    let [theta_i, theta_o] = [polar("theta_i")?, polar("theta_o")?];
    let [phi_i, phi_o, difference] =
        ["phi_i", "phi_o", "delta_phi"].map(|name| Angles::find(table, name));
    let relative = phi_o.is_none() && difference.is_some();
    let is_scan = || phi_i.is_none() && [&theta_i, &theta_o].iter().any(|a| a.is_signed(table));
    let phi_o = match phi_o.or(difference) {
        // An arm that scans through the normal stays in one plane.
        None if is_scan() => None,
        None => Some(Angles::needed(table, "phi_o")?),
        found => found,
    };
    let azimuth = conventions.azimuth.unwrap_or(Azimuth::Sample);
    let mut pairs = Vec::with_capacity(table.lines.len());
    let mut signed = 0;
    for row in 0..table.lines.len() {
        let polar = |angles: &Angles| {
            let good = |degrees| is_above(conventions.theta(degrees).abs());
            let allowed = match conventions.elevation {
                true => ["(0, 180): above the horizon", "(0, pi): above the horizon"],
                false => [
                    "(-90, 90): above the horizon",
                    "(-pi/2, pi/2): above the horizon",
                ],
            };
            let degrees = angles.degrees(table, row, good, allowed)?;
            Ok::<_, FileError>(conventions.theta(degrees).to_radians())
        };
        let turn = |angles: &Angles| {
            let good = |degrees: f64| degrees.abs() <= TURN;
            angles.degrees(table, row, good, ["[-360, 360]", "[-2 pi, 2 pi]"])
        };
        let (theta_i, theta_o) = (polar(&theta_i)?, polar(&theta_o)?);
        let i = phi_i.as_ref().map_or(Ok(0.0), turn)?;
        let o = phi_o.as_ref().map_or(Ok(0.0), turn)?;
        let o = if relative { -o } else { o };
        let [i, o] = azimuth.about_axis(relative, 180.0, [i, o]);
        let turned = |theta: f64, phi: f64| if theta < 0.0 { phi + 180.0 } else { phi };
        let [i, o] = [turned(theta_i, i), turned(theta_o, o)].map(f64::to_radians);
        signed += usize::from(theta_i < 0.0 || theta_o < 0.0);
        let [theta_i, theta_o] = [theta_i.abs(), theta_o.abs()];
        pairs.push(DirectionPair::from_spherical(theta_i, i, theta_o, o));
    }
    Ok(Pairs {
        pairs,
        isotropic: phi_i.is_none(),
        signed,
    })
}

/// The columns of unit vectors towards light and sensor, if all are there.
fn vectors(table: &Table) -> Option<[[usize; 3]; 2]> {
    let columns = names::VECTORS.map(|names| names.map(|name| table.column(name)));
    match columns {
        [[Some(a), Some(b), Some(c)], [Some(d), Some(e), Some(f)]] => Some([[a, b, c], [d, e, f]]),
        _ => None,
    }
}

/// Labels of columns of angles that are not read, as others say the same.
pub(crate) fn unread_angles(table: &Table) -> Vec<String> {
    let column = |name: &str, unit: &str| table.column(&format!("{name}_{unit}"));
    let all = names::ANGLES.iter().filter_map(|name| {
        let [deg, rad] = ["deg", "rad"].map(|unit| column(name, unit));
        match (vectors(table), deg, rad) {
            (Some(_), one, other) => one.or(other),
            (None, Some(_), Some(rad)) => Some(rad),
            (None, one, other) => {
                let is_read = *name != "delta_phi" || Angles::find(table, "phi_o").is_none();
                one.or(other).filter(|_| !is_read)
            }
        }
    });
    all.map(|d| table.label(d).into_owned()).collect()
}

/// Tolerance of the length of a unit vector: a few printed digits.
const LENGTH_SLACK: f64 = 1e-2;

/// The directions of every row of a table with unit vectors towards light and sensor in place of angles.
fn pairs_of_vectors(table: &Table, [light, sensor]: [[usize; 3]; 2]) -> Result<Pairs, FileError> {
    let vector = |row: usize, of: [usize; 3]| {
        let number = |d: usize| table.number(row, d).unwrap_or(f64::NAN);
        let v = DVec3::from_array(of.map(number));
        let is_unit = (v.length() - 1.0).abs() <= LENGTH_SLACK && v.z > GRAZING_COS;
        let direction = Direction::try_new(v).filter(|_| is_unit);
        direction.ok_or_else(|| {
            let labels = listed(of.map(|d| table.label(d)));
            let message = format!("{labels} = {v}: allowed is a unit vector above the horizon");
            table.row_error(row, message)
        })
    };
    let pairs = (0..table.lines.len()).map(|row| {
        let (light, sensor) = (vector(row, light)?, vector(row, sensor)?);
        Ok(DirectionPair::new(light, sensor))
    });
    Ok(Pairs {
        pairs: pairs.collect::<Result<_, _>>()?,
        isotropic: false,
        signed: 0,
    })
}
