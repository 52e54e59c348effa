//! The script and the style of a page.

/// Modules of the script, each after those that it uses.
const MODULES: [(&str, &str); 19] = [
    ("theme", include_str!("page/theme.js")),
    ("pen", include_str!("page/pen.js")),
    ("geometry", include_str!("page/geometry.js")),
    ("plot", include_str!("page/plot.js")),
    ("state", include_str!("page/state.js")),
    ("table", include_str!("page/table.js")),
    ("data", include_str!("page/data.js")),
    ("readings", include_str!("page/readings.js")),
    ("look", include_str!("page/look.js")),
    ("view", include_str!("page/view.js")),
    ("uncertainty", include_str!("page/uncertainty.js")),
    ("drop", include_str!("page/drop.js")),
    ("directions", include_str!("page/directions.js")),
    ("slices", include_str!("page/slices.js")),
    ("coordinates", include_str!("page/coordinates.js")),
    ("machine", include_str!("page/machine.js")),
    ("appearance", include_str!("page/appearance.js")),
    ("moments", include_str!("page/moments.js")),
    ("main", include_str!("page/main.js")),
];

pub(super) const STYLE: &str = include_str!("page/style.css");

/// SHA-256 of [`script`] and of [`STYLE`], which the policy of a page allows and nothing else.
pub(super) const HASHES: [&str; 2] = [
    "isHdOg4tD5km5YutHkpkzYsyyJubKqp71nWpqVbZBjw=",
    "uFFLLEiOJp+1IeCYg1y7sdcEJqu9U5MJhIrKSH2EsPo=",
];

/// The script: the modules in one, each a function of those that it uses.
pub(super) fn script() -> String {
    let mut all = String::from("\"use strict\";\n");
    for (name, text) in MODULES {
        let mut names = Vec::new();
        all += &format!("const ${name} = (() => {{\n");
        for line in text.lines() {
            if let Some(rest) = line.strip_prefix("import ") {
                let (what, from) = rest.split_once(" from \"./").unwrap_or_default();
                all += &format!("const {what} = ${};\n", from.trim_end_matches(".js\";"));
                continue;
            }
            let Some(rest) = line.strip_prefix("export ") else {
                all += line;
                all.push('\n');
                continue;
            };
            let words = rest.split(|c: char| !c.is_alphanumeric() && c != '_');
            let keyword = |word: &&str| ["async", "function", "class", "const", ""].contains(word);
            names.extend(words.into_iter().find(|word| !keyword(word)));
            all += rest;
            all.push('\n');
        }
        all += &format!("return {{ {} }};\n}})();\n", names.join(", "));
    }
    all
}
