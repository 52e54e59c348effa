//! Tables that notebooks show.

use gonio::geometry::DirectionPair;

/// Rows of a long table that are shown.
pub const HEAD: usize = 8;

/// A text inside HTML.
fn escaped(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;");
    text.replace('>', "&gt;")
}

fn cells(tag: &str, cells: &[String]) -> String {
    let cell = |cell: &String| format!("<{tag}>{}</{tag}>", escaped(cell));
    format!("<tr>{}</tr>", cells.iter().map(cell).collect::<String>())
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
        more => {
            let columns = names.len();
            format!("<tr><td colspan=\"{columns}\">… {more} more</td></tr>")
        }
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

/// Names of the columns of [`degrees`].
pub const ANGLES: [&str; 4] = ["theta_i_deg", "phi_i_deg", "theta_o_deg", "phi_o_deg"];

/// Polar angle and azimuth of light and sensor, degrees.
pub fn degrees(pair: &DirectionPair) -> [String; 4] {
    let (i, o) = (pair.omega_i, pair.omega_o);
    [i.theta(), i.phi(), o.theta(), o.phi()].map(|angle| format!("{:.2}", angle.to_degrees()))
}
