//! The diagrams of relations.

use super::figures::Sheet;
use super::relations::FORMS;
use crate::experiment::moments::degrees;
use crate::experiment::relations::RelationRow;
use crate::moments::relations::{Along, AngleMoments, Relation};
use crate::report::svg::plot::{Axis, Mark, Panel, Series};

/// One sheet per material and lighting: rendered and predicted moments over the view.
pub fn relation_sheets(rows: &[RelationRow]) -> Vec<Sheet> {
    let mut sheets: Vec<Sheet> = Vec::new();
    let same =
        |a: &RelationRow, b: &RelationRow| a.material == b.material && a.lighting == b.lighting;
    for rows in rows.chunk_by(same) {
        let mut panels = Vec::new();
        for rows in rows.chunk_by(|a, b| a.relation.along == b.relation.along) {
            panels.extend(over_views(rows));
        }
        sheets.push(Sheet {
            name: format!("{}-{}", rows[0].material, rows[0].lighting),
            title: format!(
                "Moments of radiance: {} under {}, window {:.0}°",
                rows[0].material,
                rows[0].lighting,
                rows[0].relation.window.to_degrees()
            ),
            panels,
            columns: 3,
        });
    }
    sheets
}

/// Places of the forms in the colour cycle: no green beside red.
const COLORS: [usize; 3] = [1, 6, 3];

fn symbol(along: Along) -> &'static str {
    match along {
        Along::Theta => "θ",
        Along::Phi => "φ",
    }
}

fn over_views(rows: &[RelationRow]) -> Vec<Panel> {
    let labels = ["energy", "mean (°)", "standard deviation (°)"];
    let value = |i: usize, m: &AngleMoments| match i {
        0 => m.energy,
        1 => m.mean.to_degrees(),
        // Of a form that can be negative it has none.
        _ => m.variance.max(0.0).sqrt().to_degrees(),
    };
    let points = |i: usize, of: &dyn Fn(&Relation) -> Option<AngleMoments>| {
        let point = |row: &RelationRow| {
            let r = &row.relation;
            (degrees(r.theta_o), of(r).map(|m| value(i, &m)))
        };
        rows.iter().map(point).collect::<Vec<_>>()
    };
    labels
        .iter()
        .enumerate()
        .map(|(i, label)| {
            let rendered = points(i, &|r| r.rendered);
            let mut series = vec![Series::new("rendered", 0, Mark::Line, rendered)];
            for ((name, form), color) in FORMS.into_iter().zip(COLORS) {
                let points = points(i, &|r| Some(form(r)?.moments));
                series.push(Series::new(name, color, Mark::Dashed, points));
            }
            // Light in the plane of incidence has its mean there; what is computed is rounding.
            let all = || series.iter().flat_map(|s| &s.points).filter_map(|p| p.1);
            let largest = all().fold(0.0, |most: f64, y| most.max(y.abs()));
            let zero = all().next().is_some() && largest < 1e-9;
            let points = series.iter_mut().flat_map(|s| &mut s.points);
            for y in points.filter_map(|p| p.1.as_mut()).filter(|_| zero) {
                *y = 0.0;
            }
            let said = match zero {
                true => format!(": 0 (computed: at most {largest:.0e})"),
                false => String::new(),
            };
            let title = format!("along {}{said}", symbol(rows[0].relation.along));
            Panel::new(title, ["θ_o (°)", label].map(Axis::linear), series)
        })
        .collect()
}
