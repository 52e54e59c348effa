//! How files of readings by others are read.

use super::{choice_of, detail, in_range, say, whole};
use crate::error::{Error, ParameterError, count_are, left_open};
use crate::formats::{Readings, load_all_readings};
use crate::measurement::WIDEST_DEG;
use crate::schedule::{
    AngleUnit, Assume, Azimuth, Conventions, Polarisation, Quantity, UncertaintyUnit,
};
use clap::Args;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// What readings by others say in another way than ours; the page `docs::formats` has an example of
/// each.
#[derive(Clone, Debug, Default, Args)]
#[command(next_help_heading = "Readings that gonio did not write")]
pub(super) struct ReadingArgs {
    /// Names of columns in the file, or their numbers from 1, e.g. theta_i=thetaIn,phi_o=2,value_*nm=R*;
    /// others that are unknown are passed over then
    #[arg(long, value_name = "OURS=NAME,…", value_delimiter = ',', value_parser = column)]
    columns: Vec<(String, String)>,
    /// Unit of the angles whose columns do not end in _deg or _rad
    #[arg(long, value_name = "UNIT", value_parser = choice_of(&AngleUnit::ALL))]
    angles: Option<AngleUnit>,
    /// theta_i and theta_o are counted from the surface, not from the normal
    #[arg(long)]
    elevation: bool,
    /// Where azimuths are counted from [default: sample; differences: light]
    #[arg(long, value_name = "FROM", value_parser = choice_of(&Azimuth::ALL))]
    azimuth: Option<Azimuth>,
    /// What the values are, and their uncertainties [default: what the file says, else brdf]
    #[arg(long, value_name = "WHAT", value_parser = choice_of(&Quantity::ALL))]
    quantity: Option<Quantity>,
    /// The unit of uncertainties [default: that of the values]
    #[arg(long, value_name = "UNIT", value_parser = choice_of(&UncertaintyUnit::ALL))]
    uncertainties: Option<UncertaintyUnit>,
    /// Half-angles in degrees of the cones of source and sensor, over which readings are means [default: what the file says, else 0]
    #[arg(long, value_name = "SOURCE,SENSOR", value_parser = half_angles)]
    half_angles: Option<[f64; 2]>,
    /// Standard deviations that uncertainties are, e.g. 2 for k = 2 [default: 1]
    #[arg(long, value_name = "K", value_parser = in_range("coverage-factor", left_open(0.0, 10.0)))]
    coverage_factor: Option<f64>,
    /// Of columns value_s and value_p those that are read [default: mean]
    #[arg(long, value_name = "WHICH", value_parser = choice_of(&Polarisation::ALL))]
    polarisation: Option<Polarisation>,
    /// Read a file that was cut up to the cut
    #[arg(long)]
    partial: bool,
    /// A value that stands for no reading, beside texts, empty cells and numbers as -999
    #[arg(long, value_name = "VALUE", allow_negative_numbers = true)]
    pub(super) no_reading: Option<f64>,
    /// Rows are pixels of pictures, which a column stop numbers: make at most N readings of each picture, means over patches of pixels
    #[arg(long, value_name = "N", value_parser = whole::<1, 1_000_000>)]
    pub(super) pixels: Option<u64>,
    /// Refuse files in which texts, numbers as -999 or empty cells stand for readings
    #[arg(long)]
    strict: bool,
    /// Take readings of materials or instruments that the headers call by different names for those of one
    #[arg(long)]
    mixed: bool,
}

fn column(text: &str) -> Result<(String, String), ParameterError> {
    match text.split_once('=') {
        Some((ours, theirs)) if !ours.is_empty() && !theirs.is_empty() => {
            Ok((ours.trim().into(), theirs.trim().into()))
        }
        _ => Err(ParameterError::new("column", text, "e.g. theta_i=thetaIn")),
    }
}

fn half_angles(text: &str) -> Result<[f64; 2], ParameterError> {
    let is_one = |angle: &f64| (0.0..=WIDEST_DEG).contains(angle);
    let angle = |text: &str| text.trim().parse().ok().filter(is_one);
    match text.split_once(',').map(|(a, b)| [a, b].map(angle)) {
        Some([Some(source), Some(sensor)]) => Ok([source, sensor]),
        _ => {
            let allowed = format!("two angles from 0 to {WIDEST_DEG}, e.g. 0.25,0.5");
            Err(ParameterError::new("half-angles", text, allowed))
        }
    }
}

impl ReadingArgs {
    /// Refuses a file in which so many cells stand for no reading, with `--strict`.
    pub(crate) fn refuse_lost(&self, path: &Path, lost: usize) -> Result<(), Error> {
        if self.strict && lost > 0 {
            let lost = count_are(lost, "reading");
            let message = format!("{lost} lost, see above; allowed with --strict: none");
            return Err(Error::data(path, message));
        }
        Ok(())
    }

    /// The readings of one material in one file or more; warnings about them go to stderr.
    pub(crate) fn read_all(&self, paths: &[PathBuf], assume: &Assume) -> Result<Readings, Error> {
        let assume = Assume {
            conventions: Conventions {
                columns: self.columns.clone(),
                angles: self.angles,
                elevation: self.elevation,
                azimuth: self.azimuth,
                quantity: self.quantity,
                uncertainties: self.uncertainties,
                coverage_factor: self.coverage_factor,
                polarisation: self.polarisation,
                partial: self.partial,
                mixed: self.mixed,
                no_reading: self.no_reading,
                pixels: self.pixels.and_then(|n| NonZeroUsize::new(n as usize)),
            },
            ..assume.clone()
        };
        let mut first_lost = None;
        let all = load_all_readings(paths, &assume, |path, readings| {
            detail(|| format!("gonio: reads {}", path.display()));
            if readings.as_ref().map_or(true, |readings| readings.lost > 0) {
                first_lost.get_or_insert_with(|| path.to_owned());
            }
            let readings = match readings {
                Ok(readings) => readings,
                Err(e) => return say(&format!("gonio: {e}; the file is left out")),
            };
            if let Some(given) = self.half_angles {
                readings.measurement.half_angles_deg = given;
            }
            for warning in &readings.warnings {
                say(&format!("gonio: {}: {warning}", path.display()));
            }
        })?;
        self.refuse_lost(first_lost.as_ref().unwrap_or(&paths[0]), all.lost)?;
        Ok(all)
    }
}
