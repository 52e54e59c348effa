//! Observers and output of a moment experiment.

use super::{End, Listener, Printed, Shown};
use crate::brdf::Brdf;
use crate::cli::{not_built, note, print};
use crate::error::Error;
use crate::experiment::moments::{
    Group, MaterialProfiles, MomentsPlan, ProfileFits, ProfileRow, at_bound,
};
use crate::experiment::{ByProduct, Event, Material, Observer, Shard};
use crate::lighting::Lighting;
use crate::moments::ViewRange;
use crate::report::pictures::render_sphere;
use crate::report::{
    Below, CORRELATIONS, FITS, FilterEllipse, PROFILES, RunFolder, SUMMARY, correlations_csv,
    file_stem, fits_csv, profiles_csv, sphere_svg, study_table, summary_json,
};
use std::cell::RefCell;
use std::io::Write;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

type Folder = RunFolder<MaterialProfiles>;

impl Shown for MomentsPlan {
    fn table(&self) -> Result<Option<Printed<'_, MaterialProfiles>>, Error> {
        for name in &self.analysis.spheres {
            if self.materials.iter().all(|m| m.name != *name) {
                note(&format!(
                    "gonio: {name} of analysis.spheres is not among the materials; not drawn"
                ));
            }
        }
        let range = range(self)?;
        let of = move |m: &&MaterialProfiles| line(&fits(self, m, range), m.seconds.iter().sum());
        let lines = move |materials: &[&MaterialProfiles]| materials.iter().map(of).collect();
        Ok(Some((HEAD.into(), Box::new(lines))))
    }

    fn listener<'a>(
        &'a self,
        folder: &'a RefCell<Folder>,
        _shard: Option<Shard>,
        _stop: &Arc<AtomicBool>,
    ) -> Result<Listener<'a, MaterialProfiles>, Error> {
        Ok(Some(Box::new(Spheres {
            plan: self,
            folder,
            light: None,
            last: None,
        })))
    }

    fn conclude(&self, folder: &mut Folder, end: &End<'_>) -> Result<(), Error> {
        let (records, _) = folder.sorted(end.keys);
        let materials: Vec<MaterialProfiles> = records.into_iter().cloned().collect();
        let rows: Vec<ProfileRow<'_>> = materials.iter().flat_map(|m| m.rows()).collect();
        folder.write_file(PROFILES, profiles_csv(&rows))?;
        let range = range(self)?;
        let mut groups = groups(self, &materials, range);
        folder.write_file(FITS, fits_csv(&groups))?;
        // A run that was stopped, or a part of one, has results of materials, and none of groups that are
        // not whole.
        let members = |group: &str| -> Vec<&MaterialProfiles> {
            materials.iter().filter(|m| m.group == group).collect()
        };
        groups.retain(|group| {
            let planned = self.materials.iter().filter(|m| m.group() == group.name);
            (end.ended && end.whole) || planned.count() == members(&group.name).len()
        });
        folder.write_file(CORRELATIONS, correlations_csv(&groups))?;
        folder.write_file(SUMMARY, summary_json(&groups))?;
        for group in &groups {
            let mut of = self.materials.iter().filter(|m| m.group() == group.name);
            let bilateral = of.all(|m| m.symmetry.bilateral);
            for sheet in crate::report::group_sheets(group, &members(&group.name), bilateral) {
                let svg = crate::report::svg(&sheet.title, &sheet.panels, sheet.columns);
                let name = format!("{}.svg", sheet.name);
                folder.write_below(Below::Figures, &name, |out| out.write_all(svg.as_bytes()))?;
            }
        }
        print(&study_table(&groups, self.analysis.published.as_ref()))
    }

    fn left_out(&self) -> Vec<(&'static str, String)> {
        let mut left_out = Vec::new();
        if self.analysis.spheres.is_empty() {
            left_out.push(("spheres", "analysis.spheres names no material".into()));
        }
        if !self.analysis.horizon {
            left_out.push(("clamping", "analysis.horizon is false".into()));
        }
        left_out
    }
}

/// The views that fits use.
fn range(plan: &MomentsPlan) -> Result<ViewRange, Error> {
    let range = plan.analysis.range();
    range.map_err(Error::internal)
}

/// The fits of a material, one per channel.
fn fits(plan: &MomentsPlan, of: &MaterialProfiles, range: ViewRange) -> Vec<ProfileFits> {
    let tolerance = plan.moments.estimator.tolerance();
    let fit = |i| ProfileFits::new(of, i, range, tolerance);
    (0..of.profiles.len()).map(fit).collect()
}

/// Groups of materials by kind, in the order of their first member.
fn groups(plan: &MomentsPlan, materials: &[MaterialProfiles], range: ViewRange) -> Vec<Group> {
    let group = |name: String| {
        let members: Vec<_> = materials.iter().filter(|m| m.group == name).collect();
        let fits = members.iter().flat_map(|m| fits(plan, m, range)).collect();
        let tolerance = plan.moments.estimator.tolerance();
        Group::new(name, &members, fits, range, tolerance)
    };
    let groups = plan.groups().into_iter().map(group);
    groups.filter(|group| !group.fits.is_empty()).collect()
}

/// A line of the table that is printed while materials are analysed.
fn line(fits: &[ProfileFits], seconds: f64) -> String {
    let Some(first) = fits.first() else {
        return String::new();
    };
    let number = |v: Option<f64>| v.map_or("undefined".into(), |v| format!("{v:.4}"));
    let knots = first.energy.as_ref().ok().and_then(|fit| {
        let [low, high] = at_bound(fit, first.range);
        let (low, high) = (if low { "≤" } else { "" }, if high { "≥" } else { "" });
        let [a, b] = fit.knots()?.map(f64::to_degrees);
        Some(format!("{low}{a:.1}° {high}{b:.1}°"))
    });
    let knots = knots.unwrap_or("undetermined".into());
    format!(
        "  {:<28} {:>10} {:>10} {:>14} {:>8.1} %{:>6} {seconds:>8.2} s\n",
        first.material,
        number(first.slope()),
        number(first.average_variance()),
        knots,
        100.0 * first.clamped_share,
        fits.iter().map(|f| f.unresolved).sum::<usize>(),
    )
}

const HEAD: &str =
    "  material                     mean slope   variance          knots   clamped  unresolved\n";

/// Pixels along each side of a sphere.
const SPHERE: usize = 512;

/// Points per pixel.
const SAMPLES: usize = 64;

/// View elevation and azimuth (deg) of the filters that are drawn on it.
const FILTERS: [(f64, f64); 3] = [(25.0, 150.0), (50.0, 30.0), (75.0, 270.0)];

/// Draws the materials that `analysis.spheres` names.
struct Spheres<'a> {
    plan: &'a MomentsPlan,
    folder: &'a RefCell<Folder>,
    /// The lighting, built when the first sphere needs it.
    light: Option<Box<dyn Lighting>>,
    /// The profiles of the last material.
    last: Option<MaterialProfiles>,
}

impl Spheres<'_> {
    fn stem(name: &str) -> String {
        format!("sphere-{}", file_stem(name))
    }

    /// A comment in the SVG that names its material by hash: another may have the same name.
    fn mark(material_key: &str) -> String {
        format!("<!-- material {material_key} -->\n")
    }

    fn is_asked(&self, material: &Material) -> bool {
        self.plan.analysis.spheres.contains(&material.name)
    }

    /// Draws a material on a sphere, with the filters of three views (Fig. 8 of Zubiaga et al.).
    fn sphere(
        &mut self,
        brdf: &dyn Brdf,
        of: &MaterialProfiles,
        material_key: &str,
    ) -> Result<(), Error> {
        let (name, profile) = (&of.material, &of.profiles[0]);
        let light = match &mut self.light {
            Some(light) => light,
            none => {
                let built = self.plan.lighting.build();
                none.insert(built.map_err(|e| not_built("lighting", e))?)
            }
        };
        let image = render_sphere(brdf, &**light, SPHERE, SAMPLES);
        let white = image.white();
        let ellipse = |&(view, azimuth): &(f64, f64)| {
            let near = |theta: &f64| (theta.to_degrees() - view).abs();
            let views = profile.views.iter().enumerate();
            let (i, theta_o) = views.min_by(|a, b| near(a.1).total_cmp(&near(b.1)))?;
            let azimuth = f64::to_radians(azimuth);
            FilterEllipse::new(*theta_o, azimuth, &profile.slices[i].moments)
        };
        let ellipses: Vec<_> = FILTERS.iter().filter_map(ellipse).collect();
        let title = format!("{name}: means and covariances of slices on a sphere");
        let svg = sphere_svg(&title, &image, white, &ellipses);
        let stem = Self::stem(name);
        let mut folder = self.folder.borrow_mut();
        folder.write_below(Below::Figures, &format!("{stem}.png"), |out| {
            out.write_all(&image.png(white))
        })?;
        // Last, since it says that both are there.
        folder.write_below(Below::Figures, &format!("{stem}.svg"), |out| {
            write!(out, "{svg}{}", Self::mark(material_key))
        })
    }
}

impl Observer<MaterialProfiles> for Spheres<'_> {
    fn requests(&self, wish: &ByProduct<'_>) -> bool {
        match wish {
            ByProduct::Material(_, material, key) if self.is_asked(material) => {
                let name = format!("{}.svg", Self::stem(&material.name));
                let there = self.folder.borrow().below(Below::Figures, &name);
                !there.is_some_and(|svg| svg.ends_with(Self::mark(key).as_bytes()))
            }
            _ => false,
        }
    }

    fn observe(&mut self, event: &Event<'_, MaterialProfiles>) -> Result<(), Error> {
        match event {
            Event::Complete([.., last]) => self.last = Some((*last).clone()),
            Event::Loaded(material, key, brdf) if self.is_asked(material) => {
                if let Some(profiles) = self.last.take() {
                    self.sphere(*brdf, &profiles, key)?;
                }
            }
            _ => {}
        }
        Ok(())
    }
}
