//! `gonio check`.

use super::list::{apertures, limits};
use super::run::experiment;
use super::{ConfigArgs, SeedArgs, print};
use crate::error::Error;
use crate::experiment::moments::MomentsPlan;
use crate::experiment::relations::RelationsPlan;
use crate::experiment::{Material, Plan, Router, ScheduleKey, Source};
use crate::geometry::{DirectionPair, Symmetry};
use crate::instrument::{self, InstrumentSpec, Machine, Tag, footprint};
use crate::report::Columns;
use crate::sampling::{Random, cosine_hemisphere};
use crate::schedule::Unreachable;
use clap::Args;
use std::f64::consts::PI;

#[derive(Debug, Args)]
pub(super) struct Check {
    #[command(flatten)]
    config: ConfigArgs,
    #[command(flatten)]
    seed: SeedArgs,
}

impl Check {
    pub(super) fn run(self) -> Result<(), Error> {
        let mut source = source(&self.config)?;
        if is_instrument(&source)? {
            let read = instrument::read_table(source.table()?);
            let spec = read.map_err(|e| source.error(e))?;
            let seed = self.seed.seed.map_or(1, i64::unsigned_abs);
            return print(&described(&spec, seed)?);
        }
        self.seed.apply(&mut source)?;
        experiment(&source)?.check()
    }
}

/// A plan that can describe its run.
pub(super) trait Checked {
    /// Prints the description.
    fn check(&self) -> Result<(), Error>;
}

impl Checked for MomentsPlan {
    fn check(&self) -> Result<(), Error> {
        profiles(self)
    }
}

impl Checked for RelationsPlan {
    fn check(&self) -> Result<(), Error> {
        relations(self)
    }
}

impl Checked for Plan {
    fn check(&self) -> Result<(), Error> {
        let plan = self;
        if let Some(question) = &plan.question {
            print(&format!("{}\n\n", question.trim()))?;
        }
        print(&materials(&plan.materials, &plan.missing))?;
        // Those of readings and minutes are found for each instrument, see below.
        let known = plan
            .symmetries()
            .into_iter()
            .filter(|_| !plan.budgets.is_empty());
        for symmetry in known {
            print(&format!("\nschedules for {}\n", words(symmetry)))?;
            schedules(plan, symmetry)?;
        }
        if let Some(table) = &plan.moments {
            print(&format!(
                "\nmoments: {} views up to {}°, to order {}, by {}; one profile a material and a reconstruction\n",
                table.spec.views,
                table.spec.max_view_deg,
                table.spec.order.get(),
                table.estimator.label(),
            ))?;
        }
        let names = plan.methods.iter().map(|m| {
            let most = m.up_to.map_or(String::new(), |n| format!(" up to {n}"));
            m.label() + &most
        });
        let names: Vec<_> = names.collect();
        let measures: Vec<_> = plan.measures.iter().map(|m| m.name()).collect();
        let mut infeasible = None;
        if !plan.instruments.is_empty() {
            infeasible = ways(plan)?;
        }
        print(&format!(
            "\nreconstructions: {}\nmeasures: {}, {} pairs each\nseeds: {:?}\n{} schedules, {} reconstructions, {} rows\n",
            names.join(", "),
            measures.join(", "),
            plan.metrics.pairs,
            plan.seeds,
            plan.units().len(),
            plan.jobs(),
            plan.rows()
        ))?;
        infeasible.map_or(Ok(()), Err)
    }
}

/// The file, or the preset of that name where there is no such file.
fn source(args: &ConfigArgs) -> Result<Source, Error> {
    let named = |preset: &instrument::Preset| args.config.as_os_str() == preset.name;
    match instrument::presets().into_iter().find(named) {
        Some(preset) if !args.config.exists() => args.apply(Source::new(preset.name, preset.text)),
        _ => args.source(),
    }
}

/// True of a file with keys that only instruments have, and none that only experiments have.
fn is_instrument(source: &Source) -> Result<bool, Error> {
    let table = source.table()?;
    let has = |key: &str| table.get_ref().contains_key(key);
    let experiment = ["experiment", "question", "material", "sample_set"];
    Ok(["class", "axis"].into_iter().any(has) && !experiment.into_iter().any(has))
}

/// Pairs that the reachable share is counted on: it is then good to half a percent.
const PAIRS: u64 = 10_000;

/// Elevations of light and sensor, degrees, at which the spots on the sample are told.
const SPOTS_DEG: [[f64; 2]; 4] = [[0.0, 0.0], [60.0, 0.0], [0.0, 60.0], [60.0, 60.0]];

/// Text with the spots that are lit and seen on the sample.
fn spots(spec: &InstrumentSpec) -> String {
    let mut out = "\nspots on the sample, long axes\n".to_owned();
    for [theta_i, theta_o] in SPOTS_DEG {
        let [i, o] = [theta_i, theta_o].map(f64::to_radians);
        let spot = footprint(spec, &DirectionPair::from_spherical(i, 0.0, o, PI));
        out += &format!(
            "  theta_i {theta_i:>2}°, theta_o {theta_o:>2}°  lit {:>5.1} mm, seen {:>5.1} mm: {}\n",
            spot.lit_mm,
            spot.seen_mm,
            spot.filling.name(),
        );
    }
    out
}

fn described(spec: &InstrumentSpec, seed: u64) -> Result<String, Error> {
    let machine = Machine::new(spec).map_err(|e| Error::Internal(e.to_string()))?;
    let class = machine.class();
    let mut out = format!(
        "{}: {}\nclass: {}, {}\n\naxes\n",
        spec.name,
        spec.about,
        class.name(),
        class.summary(),
    );
    let mut axes =
        Columns::new("  name\ton\t>range °\t>°/s\t>°/s²\t>resolution\t>repeatability\t>bias\t");
    for axis in &spec.axis {
        axes.row(&format!(
            "  {}\t{}\t{} to {}\t{}\t{}\t{}\t{}\t{}\t{}",
            axis.name,
            axis.parent,
            axis.min_deg,
            axis.max_deg,
            axis.speed_deg_per_s,
            axis.acceleration_deg_per_s2,
            axis.resolution_deg,
            axis.repeatability_deg,
            axis.bias_deg,
            if axis.wraps { "wraps" } else { "" },
        ));
    }
    out += &axes.to_string();
    let detector = &spec.detector;
    out += &format!(
        "\n{}\n{}\nexposures: {} from {} s to {} s, {} bits\n",
        apertures(spec),
        limits(spec),
        detector.exposures,
        detector.exposure_min_s,
        detector.exposure_max_s,
        detector.bits,
    );
    out += &spots(spec);
    out += &format!("\nof {PAIRS} cosine-distributed pairs\n");
    out += &reach(&machine, seed, true);
    if !class.isotropic_only() {
        out += &reach(&machine, seed, false);
    }
    let tags: Vec<Option<Tag>> = spec
        .origins()
        .into_iter()
        .map(|(_, entry)| entry.map(|entry| entry.tag))
        .collect();
    let count = |tag: Option<Tag>| tags.iter().filter(|&&t| t == tag).count();
    out += &format!(
        "\nnumbers: {} published, {} recalled, {} generic, {} without provenance\n",
        count(Some(Tag::Published)),
        count(Some(Tag::Recalled)),
        count(Some(Tag::Generic)),
        count(None),
    );
    Ok(out)
}

/// Text with the share of pairs that a machine reaches, and the share of each reason against.
fn reach(machine: &Machine, seed: u64, turn_freely: bool) -> String {
    let random = Random::new(seed);
    let mut reached = 0;
    let mut kept_out = [0; Unreachable::NAMES.len()];
    for i in 0..PAIRS {
        let [a, b, c, d] = random.point(i);
        let pair = DirectionPair::new(cosine_hemisphere([a, b]), cosine_hemisphere([c, d]));
        match machine.place(&pair, turn_freely) {
            Ok(_) => reached += 1,
            Err(reason) => {
                for (name, count) in Unreachable::NAMES.into_iter().zip(&mut kept_out) {
                    *count += u64::from(name == reason.name());
                }
            }
        }
    }
    let percent = |count: u64| 100.0 * count as f64 / PAIRS as f64;
    let material = if turn_freely {
        "isotropic"
    } else {
        "anisotropic"
    };
    let mut text = format!("  {material:<12} reachable {:.2} %", percent(reached));
    for (name, count) in Unreachable::NAMES.into_iter().zip(kept_out) {
        text += &format!(", {name} {:.2} %", percent(count));
    }
    text + "\n"
}

/// Prints the plan of an experiment of kind `moments`.
fn profiles(plan: &MomentsPlan) -> Result<(), Error> {
    if let Some(question) = &plan.question {
        print(&format!("{}\n\n", question.trim()))?;
    }
    print(&materials(&plan.materials, &plan.missing))?;
    let spec = &plan.moments.spec;
    let channels: Vec<_> = spec.channels.iter().map(|c| c.name()).collect();
    let profiles = plan.materials.len() * channels.len();
    print(&format!(
        "\ngroups: {}\nchannels: {}\nviews: {} up to {}°, moments to order {}\nestimator: {}\n\
         {profiles} profiles, {} rows\n",
        plan.groups().join(", "),
        channels.join(", "),
        spec.views,
        spec.max_view_deg,
        spec.order.get(),
        plan.moments.estimator.label(),
        profiles * spec.views,
    ))
}

/// Prints the plan of an experiment of kind `relations`.
fn relations(plan: &RelationsPlan) -> Result<(), Error> {
    profiles(&plan.base)?;
    let lights: Vec<_> = plan.lightings.iter().map(|l| l.name.as_str()).collect();
    let along: Vec<_> = plan.along.iter().map(|a| a.name()).collect();
    let each = plan.views.len() * along.len();
    print(&format!(
        "\nlightings: {}\nviews: {}, along {}, window {}°\n{} relations\n",
        lights.join(", "),
        plan.views.len(),
        along.join(" and "),
        plan.spec.window_deg,
        plan.base.materials.len() * lights.len() * each,
    ))
}

fn materials(materials: &[Material], missing: &[String]) -> String {
    let mut columns = Columns::new(&format!("materials: {}", materials.len()));
    for m in materials {
        columns.row(&format!("  {}\t{}", m.name, words(m.symmetry)));
    }
    let mut out = columns.to_string();
    if !missing.is_empty() {
        out += &format!("not in materials_dir: {}\n", missing.join(", "));
    }
    out
}

/// Prints the schedules of the first seed, line by line: large ones take their time.
fn schedules(plan: &Plan, symmetry: Symmetry) -> Result<(), Error> {
    let labels = plan.parametrizations.iter().map(|c| c.label().len());
    let w = labels.max().unwrap_or(0).max(15);
    let sets = plan.sample_sets.iter().map(|s| s.name.chars().count());
    let v = sets.max().unwrap_or(0).max(10);
    print(&format!(
        "  {:<w$}  {:<v$}  {:>8}  {:>8}  {:>10}  nodes\n",
        "parametrization", "sample set", "budget", "poses", "unphysical"
    ))?;
    for coordinates in &plan.parametrizations {
        let form = coordinates.form(symmetry);
        let form = form.map_err(|e| Error::Internal(format!("a warp that was checked: {e}")))?;
        for set in &plan.sample_sets {
            for &budget in &plan.budgets {
                let line = match set.set.plan(&form, budget, plan.seeds[0]) {
                    Err(e) => format!("{e}"),
                    Ok(schedule) => {
                        let shape = schedule.lattice.as_ref().map(|lattice| {
                            let shape = lattice.shape();
                            let shape: Vec<_> = shape.iter().map(usize::to_string).collect();
                            shape.join("×")
                        });
                        format!(
                            "{:>8}  {:>10.4}  {}",
                            schedule.poses.len(),
                            schedule.unphysical_share,
                            shape.unwrap_or_else(|| "scattered".into())
                        )
                    }
                };
                print(&format!(
                    "  {:<w$}  {:<v$}  {budget:>8}  {line}\n",
                    coordinates.label(),
                    set.name
                ))?;
            }
        }
    }
    Ok(())
}

/// Prints every instrument's time and reach for the schedules of the first seed.
///
/// Returns the first plan that one cannot carry out.
fn ways(plan: &Plan) -> Result<Option<Error>, Error> {
    let mut infeasible = None;
    let mut router = Router::default();
    let labels = plan.parametrizations.iter().map(|c| c.label().len());
    let w = labels.max().unwrap_or(0).max(15);
    let sets = plan.sample_sets.iter().map(|s| s.name.chars().count());
    let v = sets.max().unwrap_or(0).max(10);
    for instrument in &plan.instruments {
        let order = instrument.use_of.order.name();
        print(&format!(
            "\n{} visits the poses in the order {order}\n  {:<w$}  {:<v$}  {:>13}  {:>8}  {:>7}  {:>9}  out of reach\n",
            instrument.name,
            "parametrization",
            "sample set",
            "allowed",
            "budget",
            "reach",
            "minutes"
        ))?;
        for symmetry in plan.symmetries() {
            for coordinates in &plan.parametrizations {
                for sample_set in &plan.sample_sets {
                    for allowance in plan.allowances() {
                        let key = ScheduleKey {
                            coordinates,
                            symmetry,
                            sample_set,
                            allowance,
                            instrument: Some(instrument),
                            seed: plan.seeds[0],
                        };
                        let line = match router.find(&key) {
                            Err(e) => {
                                let line = e.to_string();
                                infeasible.get_or_insert(e);
                                line
                            }
                            Ok(route) => route.itinerary().map_or(String::new(), |i| {
                                let reach = 100.0 * i.reachable();
                                let minutes = i.seconds() / 60.0;
                                format!(
                                    "{:>8}  {reach:>6.1}%  {minutes:>9.1}  {}",
                                    route.budget,
                                    i.reasons_text()
                                )
                            }),
                        };
                        let allowed = allowance.to_string();
                        let line = format!(
                            "  {:<w$}  {:<v$}  {allowed:>13}  {}\n",
                            coordinates.label(),
                            sample_set.name,
                            line.trim_end()
                        );
                        print(&line)?;
                    }
                }
            }
        }
    }
    Ok(infeasible)
}

pub(super) fn words(symmetry: Symmetry) -> String {
    let isotropic = if symmetry.isotropic {
        "isotropic"
    } else {
        "anisotropic"
    };
    let mut words = vec![isotropic];
    words.extend(symmetry.reciprocal.then_some("reciprocal"));
    words.extend(symmetry.bilateral.then_some("bilateral"));
    words.join(", ")
}
