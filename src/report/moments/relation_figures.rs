//! The diagrams of relations.

use super::figures::Sheet;
use super::relations::FORMS;
use crate::experiment::moments::degrees;
use crate::experiment::relations::RelationRow;
use crate::moments::relations::{AngleMoments, Relation};
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
        rows.iter().map(point).collect()
    };
    labels
        .iter()
        .enumerate()
        .map(|(i, label)| {
            let mut series = vec![Series {
                name: "rendered".into(),
                color: 0,
                mark: Mark::Line,
                points: points(i, &|r| r.rendered),
            }];
            for (k, (name, form)) in FORMS.iter().enumerate() {
                series.push(Series {
                    name: (*name).into(),
                    color: k + 1,
                    mark: Mark::Dashed,
                    points: points(i, &|r| Some(form(r)?.moments)),
                });
            }
            Panel {
                title: format!("along {}", rows[0].relation.along.name()),
                x: Axis {
                    label: "θ_o (°)".into(),
                    ..Axis::default()
                },
                y: Axis {
                    label: (*label).into(),
                    ..Axis::default()
                },
                series,
            }
        })
        .collect()
}
