//! Columns of values and uncertainties: their names, and what their cells say.

use super::reading_of;
use crate::brdf::marks::{Marks, is_among, is_mark_number, marks_among};
use crate::brdf::{Channels, Wavelengths};
use crate::error::excerpt;
use crate::geometry::DirectionPair;
use crate::schedule::names::{COUNTS, FAMILIES, wavelength};
use crate::schedule::table::Table;
use crate::schedule::{Conventions, FileError, Polarisation, Quantity, UncertaintyUnit};
use std::collections::BTreeMap;
use std::ops::Range;

/// Families of columns; each is one column, three with the ends of [`ENDS`], or one a wavelength.
pub(super) const VALUE: &str = "value";
const VALUE_COS: &str = "value_cos";
pub(super) const TYPE_A: &str = "type_a";
pub(super) const TYPE_B: &str = "type_b";
pub(super) const UNCERTAINTY: &str = "uncertainty";

/// Ends of the columns of colours.
pub(super) const ENDS: [&str; 3] = ["_r", "_g", "_b"];

/// The column with the wavelength of a row, nm.
pub(super) const WAVELENGTH: &str = "wavelength_nm";

/// Columns of s and p polarised light.
const POLARISED: [&str; 2] = ["value_s", "value_p"];

/// Puts values in place of what they are computed from: of s and p polarised light the mean, or one of them; of what a detector
/// counts (signal − dark) / reference, which is f_r cos θ_o. Returns the quantity of the values if it is known so.
pub(super) fn derive(
    table: &mut Table,
    conventions: &Conventions,
) -> Result<Option<Quantity>, FileError> {
    // What is a value already is read, unless one polarisation is asked for.
    let is_value = |column: &str| is_of(column, VALUE) || is_of(column, VALUE_COS);
    let there = (0..table.columns.len()).filter(|&d| is_value(&table.columns[d]));
    let there: Vec<usize> = there.collect();
    let raw = POLARISED.iter().chain(&COUNTS);
    let raw: Vec<usize> = raw.filter_map(|name| table.column(name)).collect();
    let both: Option<Vec<usize>> = POLARISED.iter().map(|name| table.column(name)).collect();
    let which = conventions.polarisation;
    if !there.is_empty() && (both.is_none() || which.is_none()) {
        raw.into_iter().for_each(|column| table.pass_over(column));
        return match which {
            None => Ok(None),
            Some(_) => Err(not_polarised(table)),
        };
    }
    there.into_iter().for_each(|column| table.pass_over(column));
    let other = conventions.no_reading;
    if let Some(both) = both {
        let which = which.unwrap_or(Polarisation::Mean);
        match which {
            Polarisation::Mean => table.combine(&both, VALUE, other, |v| 0.5 * (v[0] + v[1])),
            one => {
                let read = usize::from(one == Polarisation::P);
                table.pass_over(both[1 - read]);
                table.combine(&[both[read]], VALUE, other, |v| v[0]);
            }
        }
        table.notes.push(which.note());
        return Ok(None);
    }
    if which.is_some() {
        return Err(not_polarised(table));
    }
    let [signal, dark, reference] = COUNTS.map(|name| table.column(name));
    let Some(signal) = signal else {
        return Ok(None);
    };
    let Some(reference) = reference else {
        let message = "column signal goes with a column reference: what the sensor counts of the light itself";
        return Err(FileError::on_line(&table.name, table.head, message));
    };
    let mut of = vec![signal, reference];
    of.extend(dark);
    // Without light there is no reading.
    table.combine(&of, VALUE, other, |n| match n[1] == 0.0 {
        true => f64::NAN,
        false => (n[0] - n.get(2).copied().unwrap_or(0.0)) / n[1],
    });
    let over = match conventions.quantity {
        None => ", and f_r is that over cos theta_o",
        Some(_) => "",
    };
    let note = format!("values are (signal - dark) / reference{over}");
    table.notes.push(note);
    Ok(Some(Quantity::BrdfCosine))
}

/// The error of a table without columns of both polarisations.
fn not_polarised(table: &Table) -> FileError {
    let message = "--polarisation: there are no columns value_s and value_p";
    FileError::on_line(&table.name, table.head, message)
}

/// Names of the columns of a family.
pub(super) fn columns_of(family: &str, channels: &Channels) -> Vec<String> {
    match channels {
        Channels::Luminance => vec![family.to_owned()],
        Channels::Rgb => ENDS.map(|end| format!("{family}{end}")).to_vec(),
        Channels::Wavelengths(w) => {
            let nm = w.nm().iter();
            nm.map(|nm| format!("{family}_{nm}nm")).collect()
        }
    }
}

/// Names of the columns of every family: those without wavelengths, and those of a table with them.
pub(super) fn known(table: &Table) -> Vec<String> {
    let mut known = vec![WAVELENGTH.to_owned()];
    known.extend(POLARISED.into_iter().chain(COUNTS).map(String::from));
    for family in FAMILIES {
        for channels in [Channels::Luminance, Channels::Rgb] {
            known.extend(columns_of(family, &channels));
        }
    }
    let spectral = |column: &&String| {
        let mut families = FAMILIES.iter();
        families.any(|family| wavelength_of(column, family).is_some())
    };
    known.extend(table.columns.iter().filter(spectral).cloned());
    known
}

/// The wavelength (nm) of a column of a family, if it names one.
fn wavelength_of(column: &str, family: &str) -> Option<f64> {
    let rest = column.strip_prefix(family)?.strip_prefix('_')?;
    wavelength(rest)?.parse().ok()
}

/// True of a column of a family, of whatever channels.
fn is_of(column: &str, family: &str) -> bool {
    let plain = |channels: Channels| columns_of(family, &channels).iter().any(|c| c == column);
    plain(Channels::Luminance) || plain(Channels::Rgb) || wavelength_of(column, family).is_some()
}

/// The columns of a family that name a wavelength: nm and place, from short to long.
fn spectral_columns(table: &Table, family: &str) -> Vec<(f64, usize)> {
    let columns = table.columns.iter().enumerate();
    let mut found: Vec<_> = columns
        .filter_map(|(i, column)| Some((wavelength_of(column, family)?, i)))
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found
}

/// Positions of the columns of values and uncertainties.
pub(super) struct ValueColumns {
    /// Channels of the measurement.
    pub channels: Channels,
    /// The columns of the values of a row.
    pub values: Vec<usize>,
    /// The column with the channel of a row; without it a row has all of them.
    wavelength: Option<usize>,
    quantity: Quantity,
    unit: UncertaintyUnit,
    /// Standard deviations that they are.
    coverage_factor: f64,
    /// The columns of type A, of type B and of both.
    uncertainties: [Option<Vec<usize>>; 3],
}

impl ValueColumns {
    /// Finds them; `derived` are values of this quantity, unless `conventions` say another.
    pub(crate) fn find(
        table: &Table,
        conventions: &Conventions,
        derived: Option<Quantity>,
    ) -> Result<Self, FileError> {
        let find = |family: &str, channels: &Channels| -> Option<Vec<usize>> {
            if let Channels::Wavelengths(w) = channels {
                let (nm, columns): (Vec<_>, _) =
                    spectral_columns(table, family).into_iter().unzip();
                return (nm == w.nm()).then_some(columns);
            }
            let names = columns_of(family, channels).into_iter();
            names.map(|name| table.column(&name)).collect()
        };
        let refuse = |message: String| FileError::on_line(&table.name, table.head, message);
        let mut found = Vec::new();
        for family in [VALUE, VALUE_COS] {
            let mut kinds = vec![Channels::Luminance, Channels::Rgb];
            let spectral = spectral_columns(table, family);
            if let Some(same) = (spectral.windows(2)).find(|w| w[0].0 == w[1].0) {
                let [a, b] = [same[0], same[1]].map(|c| table.label(c.1));
                return Err(refuse(format!(
                    "columns {a} and {b} are of one wavelength; allowed: one column for each"
                )));
            }
            let nm: Vec<f64> = spectral.iter().map(|c| c.0).collect();
            if !nm.is_empty() {
                let wavelengths = Wavelengths::new(&nm);
                let wavelengths = wavelengths.map_err(|e| refuse(format!("columns of {e}")))?;
                kinds.push(Channels::Wavelengths(wavelengths));
            }
            for channels in kinds {
                let columns = find(family, &channels);
                found.extend(columns.map(|values| (channels, values, family)));
            }
        }
        if found.len() != 1 {
            let message = "there must be one kind of values (a schedule has none: measure it \
                           first); allowed: value, or value_r, value_g and value_b, or \
                           value_450nm and so on (f_r in 1/sr, without the cosine, unless \
                           --quantity says another), or the same as value_cos… (times cos \
                           theta_i); under another name: --columns value=NAME";
            return Err(refuse(message.into()));
        }
        let (mut channels, values, family) = found.swap_remove(0);
        let quantity = match (family, conventions.quantity) {
            (VALUE, said) => said.or(derived).unwrap_or(Quantity::Brdf),
            (_, None | Some(Quantity::BrdfCosineLight)) => Quantity::BrdfCosineLight,
            (..) => {
                let message = "columns value_cos… say what they are; allowed: no --quantity, or \
                               --columns value=value_cos";
                return Err(refuse(message.into()));
            }
        };
        let [a, b, both] = [TYPE_A, TYPE_B, UNCERTAINTY].map(|family| {
            let columns = find(family, &channels);
            // One that is of no value would be dropped without a word.
            let of_none = |name: &&String| {
                is_of(name, family)
                    && !(columns.iter().flatten()).any(|&c| table.columns[c] == **name)
            };
            match table.columns.iter().find(of_none) {
                None => Ok(columns),
                Some(name) => Err(refuse(format!(
                    "column {} does not go with the columns of values; allowed: {} together",
                    excerpt(name),
                    columns_of(family, &channels).join(", ")
                ))),
            }
        });
        let wavelength = table.column(WAVELENGTH);
        if let Some(column) = wavelength {
            if values.len() != 1 || channels != Channels::Luminance {
                let what = format!("column {WAVELENGTH} goes with one column of values");
                return Err(refuse(format!("{what}; allowed: {family}")));
            }
            channels = Channels::Wavelengths(row_wavelengths(table, column)?);
        }
        Ok(Self {
            values,
            wavelength,
            quantity,
            unit: conventions.uncertainties.unwrap_or(UncertaintyUnit::Value),
            coverage_factor: conventions.coverage_factor.unwrap_or(1.0),
            uncertainties: [a?, b?, both?],
            channels,
        })
    }

    pub(crate) fn has_uncertainties(&self) -> bool {
        self.uncertainties.iter().any(Option::is_some)
    }

    /// The channels that a row has values of.
    pub(crate) fn span(&self, table: &Table, row: usize) -> Range<usize> {
        let nm = self.wavelength.and_then(|column| table.number(row, column));
        match (nm, self.channels.wavelengths()) {
            (Some(nm), Some(all)) => {
                let at = all.nm().partition_point(|w| *w < nm);
                at..at + 1
            }
            _ => 0..self.values.len(),
        }
    }

    /// The reading (f_r, sr⁻¹) of a number in a cell.
    fn reading(
        &self,
        table: &Table,
        row: usize,
        column: usize,
        value: f64,
        pair: &DirectionPair,
    ) -> Result<f64, FileError> {
        reading_of(value, self.quantity.of_one(pair)).map_err(|e| {
            let message = format!("{} = {value:e} is no reading", table.label(column));
            table.row_error(row, message).because(e)
        })
    }

    /// The values of a row as they are in the file, without the empty ones.
    pub(crate) fn cells(&self, table: &Table, row: usize) -> impl Iterator<Item = f64> + Clone {
        let columns = self.values.iter();
        columns.filter_map(move |&column| table.number(row, column))
    }

    /// Empties the cells of values that are marks; returns how many of which.
    pub(crate) fn clear_marks(&self, table: &mut Table, other: Option<f64>) -> Marks {
        let rows = 0..table.lines.len();
        let cells = rows.clone().flat_map(|row| self.cells(table, row));
        let found = marks_among(cells, other);
        let mut marks = Marks::default();
        let mut clear = |column: usize, is_mark: &dyn Fn(&f64) -> bool| {
            for row in rows.clone() {
                if let Some(mark) = table.number(row, column).filter(is_mark) {
                    marks.see(&mark.to_string());
                    table.clear(row, column);
                }
            }
        };
        for &column in self.values.iter().filter(|_| !found.is_empty()) {
            clear(column, &|value| is_among(*value, &found));
        }
        // No uncertainty is below 0.
        for &column in self.uncertainties.iter().flatten().flatten() {
            clear(column, &|u| *u < 0.0 && is_mark_number(*u));
        }
        marks
    }

    /// The values of a row; `None` unless all are there.
    pub fn read(
        &self,
        table: &Table,
        row: usize,
        pair: &DirectionPair,
    ) -> Result<Option<Vec<f64>>, FileError> {
        let mut found = Vec::with_capacity(self.values.len());
        for &column in &self.values {
            if let Some(value) = table.number(row, column) {
                found.push(self.reading(table, row, column, value, pair)?);
            }
        }
        Ok((found.len() == self.values.len()).then_some(found))
    }

    /// The columns of those uncertainties, of each type and of both, that some row states.
    pub(crate) fn stated(&self, table: &Table) -> Vec<usize> {
        let states = |column: usize| {
            let mut rows = 0..table.lines.len();
            rows.any(|row| table.number(row, column).is_some_and(|u| u > 0.0))
        };
        let stated = self.uncertainties.iter().flatten();
        let stated = stated.filter(|columns| columns.iter().any(|column| states(*column)));
        stated.flatten().copied().collect()
    }

    /// The uncertainties of a row of type A and type B; an empty one, which is not known, is 0. `uncertainty`, that of both, is of
    /// type B but for what type A explains of it.
    pub(crate) fn read_uncertainties(
        &self,
        table: &Table,
        row: usize,
        pair: &DirectionPair,
    ) -> Result<[Vec<f64>; 2], FileError> {
        let [of_a, of_b, both] = &self.uncertainties;
        let of_both = of_b.is_none();
        let of_b = if of_both { both } else { of_b };
        let mut types = [of_a, of_b].map(|_| vec![0.0; self.values.len()]);
        let values = match self.unit {
            UncertaintyUnit::Value => Vec::new(),
            _ => self.read(table, row, pair)?.unwrap_or_default(),
        };
        for (columns, out) in [of_a, of_b].into_iter().zip(&mut types) {
            let mut readings = values.iter().copied();
            for (&column, out) in columns.iter().flatten().zip(out) {
                let value = table.number(row, column).unwrap_or(0.0);
                if value < 0.0 {
                    let name = table.label(column);
                    let message = format!("{name} = {value}: allowed is a number from 0");
                    return Err(table.row_error(row, message));
                }
                let value = value / self.coverage_factor;
                *out = match self.unit {
                    UncertaintyUnit::Value => self.reading(table, row, column, value, pair)?,
                    unit => value * unit.factor(readings.next().unwrap_or(0.0)),
                };
            }
        }
        if of_both {
            let [a, both] = &mut types;
            for (a, b) in a.iter().zip(both) {
                *b = (*b * *b - a * a).max(0.0).sqrt();
            }
        }
        Ok(types)
    }
}

/// Takes out the rows at wavelengths (nm) that most others are not at; how many.
pub(super) fn take_rare_wavelengths(table: &mut Table) -> usize {
    let Some(column) = table.column(WAVELENGTH) else {
        return 0;
    };
    let mut counts = BTreeMap::new();
    let bits = |table: &Table, row| table.number(row, column).unwrap_or(f64::NAN).to_bits();
    for row in 0..table.lines.len() {
        *counts.entry(bits(table, row)).or_insert(0) += 1;
    }
    let most = counts.values().max().copied().unwrap_or(0);
    let rows = table.lines.len();
    table.retain(|table, row| counts.get(&bits(table, row)).is_some_and(|n| 2 * n >= most));
    rows - table.lines.len()
}

/// The wavelengths of a column that has one a row.
fn row_wavelengths(table: &Table, column: usize) -> Result<Wavelengths, FileError> {
    let name = table.label(column);
    let (mut nm, mut all) = (Vec::new(), None);
    for row in 0..table.lines.len() {
        let Some(value) = table.number(row, column) else {
            return Err(table.row_error(row, format!("{name} is empty")));
        };
        let at = nm.partition_point(|w| *w < value);
        if nm.get(at) != Some(&value) {
            nm.insert(at, value);
            all = Some(Wavelengths::new(&nm).map_err(|e| {
                let message = format!("{name} = {value} cannot be");
                table.row_error(row, message).because(e)
            })?);
        }
    }
    all.ok_or_else(|| FileError::whole(&table.name, "there is no row"))
}
