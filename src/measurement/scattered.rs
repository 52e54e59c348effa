//! Readings at poses of no lattice, as tables by others have them.

use super::{
    About, Details, Measurement, Negative, Outcome, Place, Readings, reading_of, retro_peak,
};
use crate::brdf::Channels;
use crate::brdf::marks::{Marks, is_among, is_mark_number, marks_among};
use crate::error::{count, excerpt};
use crate::geometry::{Direction, DirectionPair};
use crate::numeric::{GRAZING_COS, XYZ};
use crate::schedule::import::form;
use crate::schedule::table::{Table, number};
use crate::schedule::{Assume, Conventions, FileError, Quantity, Schedule};
use glam::DVec3;
use std::sync::Arc;

/// Rows of a table while it is read.
#[derive(Default)]
pub(super) struct Rows<'a> {
    name: &'a str,
    pairs: Vec<DirectionPair>,
    values: Vec<f64>,
    radii: Vec<f64>,
    places: Vec<Place>,
    /// Rows with a direction that is not above the horizon.
    pub below_horizon: usize,
    /// Material and instrument that the header names.
    pub about: About,
    unread: Vec<String>,
    /// Values as they are in the file.
    raw: Vec<f64>,
}

impl<'a> Rows<'a> {
    pub(crate) fn new(name: &'a str) -> Self {
        Self {
            name,
            about: About {
                is_bare: true,
                ..About::default()
            },
            ..Self::default()
        }
    }

    /// Takes in a key of the header that is not read.
    pub(crate) fn pass_over(&mut self, key: &str) {
        let key = excerpt(key).into_owned();
        if !self.unread.contains(&key) {
            self.unread.push(key);
        }
    }

    /// Takes in the name of the material of the rows that follow; another one than before is an error, unless they may be `mixed`.
    pub(crate) fn name_material(
        &mut self,
        line: usize,
        material: &str,
        mixed: bool,
    ) -> Result<(), FileError> {
        let first = self.about.material.get_or_insert_with(|| material.into());
        if first == material || mixed {
            return Ok(());
        }
        let [one, other] = [first, material].map(|name| excerpt(name));
        let message = format!(
            "these readings are of the material {other:?}, those before of {one:?}; allowed: readings of one, or --mixed"
        );
        Err(FileError::on_line(self.name, line, message))
    }

    /// Adds a row: light and view, which need not be unit, a value a channel, and as many standard uncertainties that
    /// readings share, or none. A row with a direction that is not above the horizon is counted.
    pub(crate) fn push(
        &mut self,
        line: usize,
        directions: [DVec3; 2],
        quantity: Quantity,
        values: &[f64],
        radii: &[f64],
    ) -> Result<(), FileError> {
        let above = |d: &Direction| d.cos_theta() > GRAZING_COS;
        let [light, view] = directions.map(|v| Direction::try_new(v).filter(above));
        let (Some(light), Some(view)) = (light, view) else {
            self.below_horizon += 1;
            return Ok(());
        };
        let pair = DirectionPair::new(light, view);
        let of_one = quantity.of_one(&pair);
        self.pairs.push(pair);
        self.places.push(Place { file: 0, line });
        self.raw.extend(values);
        for (to, numbers) in [(&mut self.values, values), (&mut self.radii, radii)] {
            for &number in numbers {
                let refused = |e| {
                    let message = format!("{number:e} is no reading");
                    FileError::on_line(self.name, line, message).because(e)
                };
                to.push(reading_of(number, of_one).map_err(refused)?);
            }
        }
        Ok(())
    }

    /// The readings, each configuration once, see [`Measurement::merged`]. Where nothing `fixes_sample` the material is isotropic unless
    /// `assume` says otherwise; azimuths of the file are doubted unless `assume` says where they count from.
    pub(crate) fn readings(
        self,
        channels: Channels,
        assume: &Assume,
        fixes_sample: bool,
        has_azimuths: bool,
    ) -> Result<Readings, FileError> {
        if self.pairs.is_empty() {
            let message = "there is no row above the horizon";
            return Err(FileError::whole(self.name, message));
        }
        let doubts_azimuths = has_azimuths && assume.conventions.azimuth.is_none();
        let mut assume = assume.clone();
        assume.otherwise.isotropic |= !fixes_sample;
        let parametrization = form(&Table::named(self.name), &assume)?;
        let schedule = Schedule::of_pairs(parametrization, self.pairs);
        let rows = schedule.poses.len();
        let other = assume.conventions.no_reading;
        let found = marks_among(self.raw.iter().copied(), other);
        let (mut marks, mut negative) = (Marks::default(), Negative::default());
        let mut outcomes = Vec::with_capacity(rows);
        let each = self.raw.chunks_exact(channels.count());
        for (raw, place) in each.zip(&self.places) {
            let seen = raw.iter().filter(|v| is_among(**v, &found));
            seen.clone().for_each(|mark| marks.see(&mark.to_string()));
            // A row with a mark is no reading, so it counts as no 0 either.
            if seen.count() > 0 {
                outcomes.push(Outcome::NoData);
                continue;
            }
            outcomes.push(Outcome::Reading);
            negative.see(place.line, raw.iter().copied());
        }
        let measurement = Measurement {
            channels,
            outcomes,
            details: (!self.radii.is_empty()).then(|| Details {
                type_b: self.radii,
                ..Details::unknown(self.values.len(), rows)
            }),
            values: self.values,
            places: self.places,
            half_angles_deg: [0.0; 2],
            schedule: Arc::new(schedule),
        };
        let (measurement, folded) = measurement.merged();
        let counted = [
            (
                self.below_horizon,
                "with light or sensor below the horizon: passed over",
            ),
            (folded.dropped(), "averaged with earlier ones"),
        ];
        let notes = (counted.into_iter().filter(|(number, _)| *number > 0))
            .map(|(number, what)| format!("{} {what}", count(number, "row")));
        let peak = retro_peak(&measurement).filter(|_| doubts_azimuths);
        let poses = measurement.schedule.poses.len();
        Ok(Readings {
            measurement,
            about: self.about,
            notes: notes.collect(),
            warnings: (peak.iter().map(ToString::to_string))
                .chain(negative.warning())
                .chain(marks.warning())
                .chain(folded.warning())
                .collect(),
            rows: poses + self.below_horizon + folded.dropped(),
            lost: marks.count(),
            unread: self.unread,
            intact: false,
        })
    }
}

/// R, G, B of which grey has X = Y = Z, of X, Y, Z; what stands for no reading stays.
pub(super) fn rgb_of(xyz: &[f64], no_reading: Option<f64>) -> Vec<f64> {
    let is_mark = |v: &&f64| is_mark_number(**v) || no_reading == Some(**v);
    match xyz.iter().find(is_mark) {
        Some(mark) => vec![*mark; 3],
        None => (XYZ.inverse() * DVec3::from_slice(xyz)).to_array().to_vec(),
    }
}

/// Refuses the options that say what the columns of a table are, of a format whose header says it, but for one that is read.
pub(super) fn refuse_columns(
    what: &str,
    name: &str,
    conventions: &Conventions,
    read: Option<&str>,
) -> Result<(), FileError> {
    for (option, given) in [
        ("--columns", !conventions.columns.is_empty()),
        ("--angles", conventions.angles.is_some()),
        ("--elevation", conventions.elevation),
        ("--uncertainties", conventions.uncertainties.is_some()),
        ("--polarisation", conventions.polarisation.is_some()),
    ] {
        if given && read != Some(option) {
            let message = format!("{option}: the header of {what} says what its columns are");
            return Err(FileError::whole(name, message));
        }
    }
    if conventions.pixels.is_some() {
        let message =
            format!("--pixels: {what} has no column stop, which names the picture of each row");
        return Err(FileError::whole(name, message));
    }
    Ok(())
}

/// The finite numbers of a row; `asks` for one of some numbers of them, the least first, as `the header asks for`.
pub(super) fn numbers<'t>(
    words: impl Iterator<Item = &'t str>,
    name: &str,
    line: usize,
    asks: &str,
    counts: &[usize],
) -> Result<Vec<f64>, FileError> {
    let parse = |word: &str| match number(word, true) {
        Some(value) if value.is_finite() => Ok(value),
        _ => {
            let message = format!("{}: allowed is a finite number", excerpt(word));
            Err(FileError::on_line(name, line, message))
        }
    };
    let cells: Vec<f64> = words.map(parse).collect::<Result<_, _>>()?;
    if counts.contains(&cells.len()) {
        return Ok(cells);
    }
    let (found, asked) = (cells.len(), counts[0]);
    let message = format!("{found} cells where {asks} {asked}");
    Err(FileError::on_line(name, line, message).cut_if(found < asked))
}
