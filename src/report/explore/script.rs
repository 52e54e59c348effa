//! The script and the style of a page.

macro_rules! modules {
    ($($name:literal)*) => {
        [$(($name, include_str!(concat!("page/", $name, ".js")))),*]
    };
}

/// Modules of the script, each after those that it uses.
const MODULES: [(&str, &str); 18] = modules!(
    "theme" "pen" "geometry" "plot" "state" "table" "data" "readings" "look" "view" "drop"
    "directions" "slices" "coordinates" "machine" "appearance" "moments" "main"
);

pub(super) const STYLE: &str = include_str!("page/style.css");

/// SHA-256 of [`script`] and of [`STYLE`], which the policy of a page allows and nothing else.
pub(super) const HASHES: [&str; 2] = [
    "5yTGSXfFQmKAc2+XsJJpbWNieOnF6pgkpTiXxL/+Qi8=",
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
            let exported = line.strip_prefix("export ");
            let words = exported.map(|rest| rest.split(|c: char| !c.is_alphanumeric() && c != '_'));
            let keyword = |word: &&str| ["async", "function", "class", "const", ""].contains(word);
            names.extend(words.into_iter().flatten().find(|word| !keyword(word)));
            all += exported.unwrap_or(line);
            all.push('\n');
        }
        all += &format!("return {{ {} }};\n}})();\n", names.join(", "));
    }
    all
}
