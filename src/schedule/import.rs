//! Schedules back from files: ours in both formats, and tables that others wrote.
//!
//! The angles of the arms are all a file must have; every other column is optional, none is
//! unknown. Those that others wrote may follow [`Conventions`] of their own. Facts of the header are kept as far as the rows confirm them: with an intact
//! `schedule_hash` coordinates are those of their columns, else they follow from the angles; a
//! lattice is laid out again from its axes, and its poses are then exact to the bit.
//!
//! The schedule that comes back has the rows as its poses, numbered from 0 in the order of `index`
//! (of the rows, if there is none). With a lattice it has all of the lattice's poses under their own
//! numbers, whether they have a row or not.

use super::arms::{Pairs, read_pairs};
use super::convention::Conventions;
use super::export::{ARMS, FROM_FILE, SCHEDULE_HASH, TIMES, coordinate_axes};
use super::grid;
use super::itinerary::{MAX_AXES, Positions, Unreachable};
use super::lattice::{Lattice, LatticeAxis};
use super::names::{self, ANGLES};
use super::table::{FileError, Table};
use super::{Pose, Schedule};
use crate::error::{excerpt, in_closed, one_of};
use crate::geometry::{Direction, DirectionPair, Symmetry};
use crate::parametrization::{self, Axis, Parametrization, Unit, WarpSpec, warps};
use crate::registry;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;

/// Two poses closer than this are one, rad: ten million times closer than any arm moves, ten
/// million times further than two roundings.
const SAME_POSE: f64 = 1e-9;

/// Nodes that a lattice may have whatever its rows are, e.g. after most of them were taken out.
const NODES: usize = 1_000_000;

/// Nodes that a larger lattice may have for each pose that is listed. A grid has a few, of which one
/// is the pose and the others are the same pose or below the horizon.
const NODES_A_POSE: usize = 100;

/// Assumptions about a file: a choice goes before the header, the header before the default.
#[derive(Clone, Debug, Default)]
pub struct Assume {
    /// Name of the parametrization; by default [`usual_form`](parametrization::usual_form).
    pub parametrization: Option<String>,
    /// The symmetries of the material.
    pub symmetry: Option<Symmetry>,
    /// The symmetries if neither `symmetry` nor the header says; by default none.
    pub otherwise: Symmetry,
    /// Names of axes whose columns may be there without a header that names them, as in a table that
    /// went through a program that drops comments. Their values are not used then.
    pub axes: Vec<String>,
    /// The conventions of the file.
    pub conventions: Conventions,
}

/// A schedule that was read.
pub struct ScheduleFile {
    /// The poses.
    pub schedule: Schedule,
    /// Numbers of the poses in the order of the rows.
    pub order: Vec<u32>,
    /// Name of the instrument it was planned for.
    pub instrument: Option<String>,
    /// Names of that instrument's axes; empty if the file has no positions.
    pub axes: Vec<String>,
    /// Positions of the axes (rad), one set per row; empty if the file has none.
    pub positions: Vec<Positions>,
    /// Poses of the lattice that the instrument could not take, and why; empty if there is none.
    pub unreachable: Vec<(u32, Unreachable)>,
    /// The hash of the rows.
    pub hash: String,
}

/// Reads a schedule; `name` stands for the file in messages.
///
/// # Errors
/// One sentence with the line: a column that is not known or not there, an angle that is none or
/// out of range, a pose twice, a file that was cut.
pub fn read_schedule(text: &str, name: &str, assume: &Assume) -> Result<ScheduleFile, FileError> {
    let conventions = &assume.conventions;
    let table = Table::read(text, name, SCHEDULE_HASH, conventions, |table| {
        known_columns(table, &assume.axes, &[])
    })?;
    let rows = Rows::read(&table, conventions)?;
    if let Some(again) = rows.again().find(|again| again.row != again.first) {
        return Err(again.refuse(&table));
    }
    let kept: Vec<usize> = (0..table.lines.len()).collect();
    let (schedule, order) = rows.schedule(&table, &kept, assume, SCHEDULE_HASH)?;
    let (axes, positions) = positions(&table)?;
    let mut unreachable = Vec::new();
    if schedule.lattice.is_some() {
        let listed = listed_unreachable(&table)?;
        let mut free = vec![true; schedule.poses.len()];
        for &pose in &order {
            free[pose as usize] = false;
        }
        let known = |(pose, label): (u32, String)| {
            let there = free.get(pose as usize) == Some(&true);
            Some((pose, Unreachable::of_label(&label)?)).filter(|_| there)
        };
        unreachable.extend(listed.into_iter().filter_map(known));
    }
    Ok(ScheduleFile {
        schedule,
        order,
        unreachable,
        instrument: table.fact("instrument")?,
        axes,
        positions,
        hash: table.hash(),
    })
}

/// Poses that have no row, with their reasons.
fn listed_unreachable(table: &Table) -> Result<Vec<(u32, String)>, FileError> {
    Ok(table.fact("unreachable")?.unwrap_or_default())
}

/// Names of the columns that a file of poses may have, and `further` ones.
pub(crate) fn known_columns(
    table: &Table,
    axes: &[String],
    further: &[&str],
) -> Result<Vec<String>, FileError> {
    let plain = [&["index"], &ARMS[..], further, &["block", "stop"], &TIMES].concat();
    let mut columns: Vec<String> = plain.into_iter().map(String::from).collect();
    let named: Option<Vec<String>> = table.fact("axes")?;
    let axes = named.unwrap_or_else(|| axes.to_vec());
    columns.extend(axes.iter().map(|name| format!("{name}_deg")));
    columns.extend(axes.iter().map(|name| format!("axis_{name}_deg")));
    columns.extend(coordinate_columns());
    columns.extend(ANGLES.map(|angle| format!("{angle}_rad")));
    columns.extend(names::VECTORS.concat().into_iter().map(String::from));
    Ok(columns)
}

/// Columns of the coordinates of every parametrization.
pub(crate) fn coordinate_columns() -> BTreeSet<String> {
    let mut columns = BTreeSet::new();
    let warps = warps();
    for entry in parametrization::all() {
        for symmetry in [Symmetry::FULL, Symmetry::NONE] {
            for axis in entry.axes(symmetry) {
                let warps = warps.iter().filter_map(|entry| {
                    let example = entry.examples.first()?;
                    registry::read_text(entry, example).ok()
                });
                let warped = warps.filter_map(|warp| {
                    let warps = BTreeMap::from([(axis.symbol.to_owned(), *warp)]);
                    let form = entry.warped(symmetry, &warps).ok()?;
                    let mut axes = form.axes().iter();
                    axes.find(|a| a.symbol == axis.symbol).copied()
                });
                columns.extend(std::iter::once(axis).chain(warped).map(|a| a.column()));
            }
        }
    }
    columns.retain(|column| !ARMS.contains(&column.as_str()));
    columns
}

/// The poses of a table, row by row.
pub(crate) struct Rows {
    /// Their directions.
    pub directions: Pairs,
    /// The column `index`, if there is one.
    index: Option<Vec<u64>>,
}

/// A row whose pose was in an earlier row.
pub(crate) struct Again {
    pub row: usize,
    /// The first row of that pose.
    pub first: usize,
    /// True of two poses under one index, false of rows that share directions.
    pub by_index: bool,
}

impl Again {
    /// The error for a pose that is there twice.
    pub(crate) fn refuse(&self, table: &Table) -> FileError {
        let first = table.lines[self.first];
        let what = if self.by_index { "index" } else { "pose" };
        let message = format!("this {what} is that of line {first}; allowed: every {what} once");
        table.row_error(self.row, message)
    }
}

impl Rows {
    /// The angles and numbers of every row.
    pub fn read(table: &Table, conventions: &Conventions) -> Result<Self, FileError> {
        let directions = read_pairs(table, conventions)?;
        let is_number = |v: &f64| v.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(v);
        let index = table.column("index").map(|column| {
            let rows = 0..table.lines.len();
            let number = |row| match table.number(row, column) {
                Some(value) if is_number(&value) => Ok(value as u64),
                value => {
                    let value = value.map_or("empty".into(), |v| v.to_string());
                    let message = format!("index = {value}: allowed is a whole number from 0");
                    Err(table.row_error(row, message))
                }
            };
            rows.map(number).collect::<Result<Vec<_>, _>>()
        });
        let index = index.transpose()?;
        let mut rows = Self { directions, index };
        // Others count rows anew from sheet to sheet.
        let starts_anew = rows.index.as_ref().is_some_and(|index| !index.is_sorted());
        if starts_anew && !table.is_ours() && rows.again().any(|again| again.by_index) {
            rows.index = None;
        }
        Ok(rows)
    }

    /// For each row the first row of its pose: of its index, or else of its directions.
    pub(crate) fn again(&self) -> impl Iterator<Item = Again> {
        let mut first = same_poses(&self.directions.pairs);
        let mut by_index = vec![false; first.len()];
        if let Some(index) = &self.index {
            let mut seen = BTreeMap::new();
            for (row, number) in index.iter().enumerate() {
                let earliest = *seen.entry(*number).or_insert(row);
                if earliest != row && first[row] == row {
                    (first[row], by_index[row]) = (earliest, true);
                }
            }
        }
        let rows = (0..).zip(first).zip(by_index);
        rows.map(|((row, first), by_index)| Again {
            row,
            first,
            by_index,
        })
    }

    /// The schedule of the rows in `kept` (each pose once, in the order of the file), and the number
    /// that each of them has in it.
    pub(crate) fn schedule(
        &self,
        table: &Table,
        kept: &[usize],
        assume: &Assume,
        hash_key: &str,
    ) -> Result<(Schedule, Vec<u32>), FileError> {
        let mut assume = assume.clone();
        assume.otherwise.isotropic |= self.directions.isotropic;
        let header = Assume {
            otherwise: assume.otherwise,
            ..Assume::default()
        };
        let declared = form(table, &header)?;
        let parametrization = form(table, &assume)?;
        let as_declared = parametrization.name() == declared.name()
            && parametrization.symmetry() == declared.symmetry()
            && parametrization.warp_name() == declared.warp_name();
        // Numbers in the order of `index`; equal ones cannot be.
        let mut by_index: Vec<usize> = (0..kept.len()).collect();
        if let Some(index) = &self.index {
            by_index.sort_by_key(|&k| index[kept[k]]);
        }
        let mut order = vec![0; kept.len()];
        for (number, &k) in by_index.iter().enumerate() {
            order[k] = number as u32;
        }
        let lattice: Option<Vec<LatticeAxis>> = table.fact("lattice")?;
        let lattice = lattice.filter(|_| as_declared);
        let unphysical_share = table.fact("unphysical_share")?.unwrap_or(0.0);
        in_closed("unphysical_share", unphysical_share, 0.0, 1.0)
            .map_err(|e| table.fact_error("unphysical_share", e.to_string()))?;
        let assumes = table.fact("assumes")?;
        let sample_set = table.fact("sample_set")?.unwrap_or(FROM_FILE.to_owned());
        let mut schedule = Schedule {
            assumes,
            ..Schedule::new(parametrization, sample_set, Vec::new(), unphysical_share)
        };
        match (lattice, &self.index) {
            (Some(axes), Some(index)) => {
                order = self.lay_out(table, kept, index, axes, &mut schedule)?;
            }
            _ => {
                let form = &*schedule.parametrization;
                let intact = table.fact::<String>(hash_key)?.is_some();
                let columns = coordinates_in(table, form).filter(|_| as_declared && intact);
                let columns = columns.unwrap_or_default();
                let pose = |k: usize| {
                    let pair = self.directions.pairs[kept[k]];
                    let mut coords = form.forward(&pair);
                    for &(d, axis, column) in &columns {
                        if let Some(value) = table.number(kept[k], column) {
                            let value = match axis.unit {
                                Unit::Radian => radians(value),
                                Unit::One => value,
                            };
                            coords[d] = value.clamp(axis.range[0], axis.range[1]);
                        }
                    }
                    Pose { coords, pair }
                };
                schedule.poses = by_index.into_iter().map(pose).collect();
            }
        }
        Ok((schedule, order))
    }

    /// The poses of a lattice, as it was laid out, whether they have a row or not; returns the
    /// numbers of those that have, in the order of the file.
    fn lay_out(
        &self,
        table: &Table,
        kept: &[usize],
        index: &[u64],
        axes: Vec<LatticeAxis>,
        schedule: &mut Schedule,
    ) -> Result<Vec<u32>, FileError> {
        let form = &*schedule.parametrization;
        let poses: usize = table.fact("poses")?.unwrap_or(0);
        let nodes = axes.iter().try_fold(1_usize, |n, a| n.checked_mul(a.n));
        // The header alone does not say how much there is: it must be borne out by what is listed.
        let listed = table.lines.len() + listed_unreachable(table)?.len();
        let limit = listed.saturating_mul(NODES_A_POSE).max(NODES);
        let fits = axes.len() == form.axes().len()
            && nodes.is_some_and(|n| n <= limit)
            && axes.iter().zip(form.axes()).all(|(a, axis)| a.fits(axis));
        let laid = fits.then(|| grid::nodes(form, &axes, poses)).flatten();
        let Some((all, of_node)) = laid.filter(|(all, _)| all.len() == poses) else {
            let message = "lattice: this is not the lattice of the poses in this file; allowed: the \
                           header as it was written, or one without this line";
            return Err(table.fact_error("lattice", message));
        };
        let mut order = Vec::with_capacity(kept.len());
        for &row in kept {
            let number = index[row];
            match all.get(number as usize) {
                Some(pose) if distance(&pose.pair, &self.directions.pairs[row]) < SAME_POSE => {
                    order.push(number as u32);
                }
                _ => {
                    let message = format!(
                        "this is not pose {number} of the lattice in the header; allowed: the pose as it \
                         was written, or a header without lattice"
                    );
                    return Err(table.row_error(row, message));
                }
            }
        }
        schedule.poses = all;
        schedule.lattice = Some(Lattice {
            axes,
            pose: of_node,
        });
        Ok(order)
    }
}

/// The coordinates that have columns of their own, and these; `None` unless all are there.
fn coordinates_in<'f>(
    table: &Table,
    form: &'f dyn Parametrization,
) -> Option<Vec<(usize, &'f Axis, usize)>> {
    let axes = coordinate_axes(form.axes());
    axes.map(|(d, axis)| Some((d, axis, table.column(&axis.column())?)))
        .collect()
}

/// The angle (rad) that is written as `degrees`. Of neighbours that are, the first is taken.
fn radians(degrees: f64) -> f64 {
    let near = degrees.to_radians();
    let candidates = [near, near.next_up(), near.next_down()];
    let written = candidates.into_iter().find(|r| r.to_degrees() == degrees);
    written.unwrap_or(near)
}

/// The form of the coordinates of a file.
pub(crate) fn form(table: &Table, assume: &Assume) -> Result<Arc<dyn Parametrization>, FileError> {
    let declared: Option<String> = table.fact("parametrization")?;
    let chosen = assume.parametrization.clone();
    // Warps are of the parametrization in the header.
    let same = chosen.is_none() || chosen == declared;
    let unsaid = chosen.is_none() && declared.is_none();
    let name = chosen.or(declared).unwrap_or("half-difference".into());
    let refuse = |key: &str, problem: String| Err(table.fact_error(key, problem));
    let Some(entry) = parametrization::find(&name) else {
        let all = one_of(&name, parametrization::all().iter().map(|e| e.kind));
        let message = format!("parametrization = {:?}: allowed are {all}", excerpt(&name));
        return refuse("parametrization", message);
    };
    let symmetry = match assume.symmetry {
        Some(symmetry) => symmetry,
        None => table.fact("symmetry")?.unwrap_or(assume.otherwise),
    };
    let mut warps = BTreeMap::new();
    let written: Option<String> = table.fact("warp")?;
    if unsaid && written.is_none() {
        return Ok(parametrization::usual_form(symmetry));
    }
    let written = written.filter(|warp| same && warp != "none");
    for warp in written.iter().flat_map(|warps| warps.split(';')) {
        let parts = warp.split_once(':');
        let parts = parts.and_then(|(symbol, name)| Some((symbol, WarpSpec::named(name)?)));
        let Some((symbol, spec)) = parts else {
            let warp = excerpt(warp);
            let message = format!("warp = {warp:?}: allowed is e.g. \"theta_h:square-root\"");
            return refuse("warp", message);
        };
        warps.insert(symbol.to_owned(), spec);
    }
    entry
        .warped(symmetry, &warps)
        .or_else(|e| refuse("warp", e.to_string()))
}

/// Names of the axes, and their positions row by row; empty if the file has none.
fn positions(table: &Table) -> Result<(Vec<String>, Vec<Positions>), FileError> {
    let axes: Vec<String> = table.fact("axes")?.unwrap_or_default();
    if axes.len() > MAX_AXES {
        let message = format!("{} axes: allowed are at most {MAX_AXES}", axes.len());
        return Err(table.fact_error("axes", message));
    }
    let column = |name: &String| {
        let own = table.column(&format!("axis_{name}_deg"));
        own.or_else(|| table.column(&format!("{name}_deg")))
    };
    let columns: Option<Vec<usize>> = axes.iter().map(column).collect();
    let Some(columns) = columns.filter(|columns| !columns.is_empty()) else {
        return Ok((Vec::new(), Vec::new()));
    };
    let mut positions = Vec::with_capacity(table.lines.len());
    for row in 0..table.lines.len() {
        let mut at = [0.0; MAX_AXES];
        for ((at, &column), name) in at.iter_mut().zip(&columns).zip(&axes) {
            let degrees = table.number(row, column).ok_or_else(|| {
                table.row_error(row, format!("the position of {} is empty", excerpt(name)))
            })?;
            *at = degrees.to_radians();
        }
        positions.push(at);
    }
    Ok((axes, positions))
}

/// The larger angle between the directions of two pairs (for small ones: their chord), rad.
fn distance(a: &DirectionPair, b: &DirectionPair) -> f64 {
    let chord = |a: Direction, b: Direction| (a.vector() - b.vector()).length();
    chord(a.omega_i, b.omega_i).max(chord(a.omega_o, b.omega_o))
}

/// For each pair the first one that is the same pose.
fn same_poses(pairs: &[DirectionPair]) -> Vec<usize> {
    // Equal poses have equal shadows on any line; in this direction no two others of a regular set do.
    let shadow = |pair: &DirectionPair| {
        let (i, o) = (pair.omega_i.vector(), pair.omega_o.vector());
        0.618 * i.x + 0.414 * i.y + 0.302 * i.z + 0.193 * o.x + 0.541 * o.y + 0.162 * o.z
    };
    let shadows: Vec<f64> = pairs.iter().map(shadow).collect();
    let mut sorted: Vec<usize> = (0..pairs.len()).collect();
    sorted.sort_by(|&a, &b| shadows[a].total_cmp(&shadows[b]));
    // Each pair is compared with one of each pose, however many are that pose.
    let mut poses: VecDeque<usize> = VecDeque::new();
    let mut of: Vec<usize> = (0..pairs.len()).collect();
    let mut first = of.clone();
    for &a in &sorted {
        // The weights are a vector shorter than 1 for each direction.
        while (poses.front()).is_some_and(|&p| shadows[a] - shadows[p] > 2.0 * SAME_POSE) {
            poses.pop_front();
        }
        match (poses.iter()).find(|&&p| distance(&pairs[a], &pairs[p]) < SAME_POSE) {
            Some(&pose) => {
                of[a] = pose;
                first[pose] = first[pose].min(a);
            }
            None => poses.push_back(a),
        }
    }
    of.into_iter().map(|pose| first[pose]).collect()
}
