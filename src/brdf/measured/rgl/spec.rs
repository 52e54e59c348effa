//! An RGL file as a config names it.

use super::super::label_of;
use super::Rgl;
use super::file::{self, Colours, Fields, Lost, MOST_OF_ISOTROPIC};
use crate::brdf::{Brdf, BrdfSpec, BuildError, Channels, Favours, Tables, Wavelengths};
use crate::error::ParameterError;
use crate::geometry::Symmetry;
use crate::registry;

file_table! {
    "rgl": "measured table of the RGL database, the .bsdf file at `path`; R, G, B or wavelengths; also no_reading"
    /// An RGL file, as a config writes it.
    pub struct RglSpec {}
}

impl RglSpec {
    /// What the file holds, but for what stands for no reading.
    fn load(&self) -> Result<(Fields, Lost), BuildError> {
        let fields = file::open(&self.path).and_then(|head| head.load());
        let lost = fields.and_then(|mut fields| {
            let lost = fields.take_marks(self.no_reading)?;
            Ok((fields, lost))
        });
        lost.map_err(|e| e.of_file(&self.path))
    }

    fn suits(&self, colours: &Colours, channels: &Channels) -> Result<(), ParameterError> {
        let refused =
            |allowed: String| Err(ParameterError::new("path", self.path.display(), allowed));
        match (colours, channels.wavelengths()) {
            (Colours::Rgb, None) => Ok(()),
            (Colours::Rgb, Some(_)) => refused(
                "a material known by wavelength in a scene of wavelengths: this table holds R, G, B"
                    .into(),
            ),
            (Colours::Wavelengths(nm), wanted) => {
                let ends = [nm[0], nm[nm.len() - 1]].map(f64::from);
                // They are of single precision.
                let [low, high] = [ends[0] * (1.0 - 1e-7), ends[1] * (1.0 + 1e-7)];
                let within =
                    |w: &Wavelengths| w.nm().iter().all(|nm| (low..=high).contains(nm));
                match wanted.is_some_and(within) {
                    true => Ok(()),
                    false => refused(format!(
                        "with channels = {{ wavelengths_nm = … }} from {} to {} nm: this table holds wavelengths",
                        ends[0], ends[1]
                    )),
                }
            }
        }
    }
}

impl BrdfSpec for RglSpec {
    fn resolved(&self) -> registry::Keys {
        registry::resolved(KIND, self)
    }

    fn label(&self) -> String {
        label_of(&self.path, KIND)
    }

    fn check(&self, channels: &Channels) -> Result<(), BuildError> {
        let colours = file::open(&self.path).and_then(|mut head| head.colours());
        Ok(self.suits(&colours.map_err(|e| e.of_file(&self.path))?, channels)?)
    }

    fn held_channels(&self) -> Result<Option<Channels>, BuildError> {
        Ok(Some(
            // A wavelength without a reading is only found among the values.
            match self.load()?.0.colours {
                Colours::Rgb => Channels::Rgb,
                Colours::Wavelengths(nm) => {
                    let nm: Vec<f64> = nm.iter().map(|v| f64::from(*v)).collect();
                    Channels::Wavelengths(Wavelengths::new(&nm)?)
                }
            },
        ))
    }

    fn symmetry(&self, _channels: &Channels) -> Result<Symmetry, BuildError> {
        let phi_i = file::open(&self.path).and_then(|mut head| head.phi_i());
        let phi_i = phi_i.map_err(|e| e.of_file(&self.path))?;
        Ok(Symmetry {
            isotropic: phi_i.len() <= MOST_OF_ISOTROPIC,
            ..Symmetry::NONE
        })
    }

    fn favours(&self) -> Favours {
        Favours::Neither
    }

    fn build(&self, channels: Channels) -> Result<Box<dyn Brdf>, BuildError> {
        self.check(&channels)?;
        let (fields, lost) = self.load()?;
        self.suits(&fields.colours, &channels)?;
        let table = Rgl::new(fields, channels).map_err(|e| e.of_file(&self.path))?;
        Ok(Box::new(table.with_lost(lost)))
    }

    fn tables(&self) -> Tables {
        let length = std::fs::metadata(&self.path).map_or(0, |file| file.len() as usize);
        let colours = file::open(&self.path).and_then(|mut head| head.colours());
        Tables {
            files: vec![self.path.clone()],
            // Distributions are held beside the normals that they are of.
            channel_bytes: 2 * length / colours.map_or(1, |c| c.count()),
        }
    }
}
