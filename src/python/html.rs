//! Tables that notebooks show.

/// Rows of a long table that are shown.
pub const HEAD: usize = 8;

/// A text inside HTML.
fn escaped(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;");
    text.replace('>', "&gt;")
}

fn cells(tag: &str, cells: &[String]) -> String {
    let cells = cells
        .iter()
        .map(|cell| format!("<{tag}>{}</{tag}>", escaped(cell)));
    format!("<tr>{}</tr>", cells.collect::<String>())
}

/// A table with a caption, the names of its columns, if it has any, and its first rows of `count`.
pub fn table(caption: &str, names: &[String], rows: &[Vec<String>], count: usize) -> String {
    let head = match names {
        [] => String::new(),
        names => format!("<thead>{}</thead>", cells("th", names)),
    };
    let body: String = rows.iter().map(|row| cells("td", row)).collect();
    let more = match count - rows.len() {
        0 => String::new(),
        more => format!(
            "<tr><td colspan=\"{}\">… {more} more</td></tr>",
            names.len()
        ),
    };
    let caption = escaped(caption);
    format!("<table><caption>{caption}</caption>{head}<tbody>{body}{more}</tbody></table>")
}

/// A number as a table shows it; nothing of none.
pub fn number(x: f64) -> String {
    match x.abs() {
        _ if x.is_nan() => String::new(),
        size if size != 0.0 && !(1e-3..1e5).contains(&size) => format!("{x:.3e}"),
        _ => format!("{x:.4}"),
    }
}

/// Polar angle and azimuth of a direction, degrees.
pub fn degrees(direction: gonio::geometry::Direction) -> [String; 2] {
    [direction.theta(), direction.phi()].map(|angle| format!("{:.2}", angle.to_degrees()))
}
