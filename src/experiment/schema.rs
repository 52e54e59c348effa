//! JSON Schema of configs and instrument files, for editors.
//!
//! Nothing is described twice: the readers themselves are asked. A reader that is given a key it
//! does not have lists those it has; one that is given a value of the wrong type says so, and so
//! it does where a `kind` is missing. What no answer says is left open in the schema.

use super::choices::OWN;
use super::config::Config;

use super::kind::Kind;
use super::materials::OF_ONE_FILE;
use super::moments;
use super::relations;
use super::source::Source;
use super::wording::{KeyPath, Step, quoted, taken_before};
use crate::acquisition;
use crate::formats::MERL;
use crate::instrument;
use crate::lighting;
use crate::parametrization;
use crate::reconstruct;
use crate::registry::{Entry, ReadError};
use crate::schedule;
use serde_json::{Map, Value as Json, json};
use std::collections::BTreeMap;
use toml::{Table, Value};

/// A key that no table has, and a name that nothing has.
const NOBODY: &str = "?";

/// The answer of a choice between names to a table without one.
const ONE_OF_A_CHOICE: &str = "wanted exactly 1 element";

/// Most keys that a table cannot be read without.
const MOST_REQUIRED: usize = 24;

/// Deepest nesting that is described; what families nest is described once.
const DEEPEST: usize = 12;

pub(crate) fn config_schema() -> Json {
    let mut asked = Asked::of(instrument_keys);
    let kinds = [
        (&[Kind::Acquisition, Kind::Study][..], Kind::Acquisition),
        (&[Kind::Moments], Kind::Moments),
        (&[Kind::Relations], Kind::Relations),
    ];
    let roots = kinds.map(|(kinds, kind)| {
        asked.reader = Box::new(move |table| read(kind, table));
        let mut root = asked.object(&KeyPath::default(), &Table::new());
        let names: Vec<_> = kinds.iter().map(|k| k.name()).collect();
        root["properties"]["experiment"] = json!({ "enum": names });
        if kind != Kind::default() {
            root["required"] = json!(["experiment"]);
        }
        root
    });
    let mut roots = json!(roots);
    let members = asked.definitions.get("material-of-a-list");
    if let Some(member) = members.and_then(|all| all["anyOf"].as_array()?.iter().find(is_merl)) {
        // `[merl]`: what all files of a folder share.
        let mut shared = member.clone();
        shared["required"] = json!([]);
        if let Some(properties) = shared["properties"].as_object_mut() {
            properties.retain(|key, _| !OF_ONE_FILE.contains(&key.as_str()));
        }
        for root in roots.as_array_mut().into_iter().flatten() {
            root["properties"]["merl"] = shared.clone();
        }
    }
    asked.finish("gonio config", json!({ "anyOf": roots }))
}

fn is_merl(member: &&Json) -> bool {
    member["properties"]["kind"]["const"] == MERL.name
}

pub(crate) fn instrument_schema() -> Json {
    let mut asked = Asked::of(instrument_keys);
    let root = asked.object(&KeyPath::default(), &Table::new());
    asked.finish("gonio instrument", root)
}

/// Reads a config as its kind does, without looking for files.
fn read(kind: Kind, table: &Table) -> Result<(), ReadError> {
    let mut table = table.clone();
    if kind != Kind::default() {
        let name = table.entry("experiment").or_insert(kind.name().into());
        if name.as_str() != Some(kind.name()) {
            return Err(ReadError::new(None, "another kind"));
        }
    }
    let source = Source::new("schema", table.to_string());
    let Ok(table) = source.table() else {
        return Err(ReadError::new(None, "no TOML"));
    };
    match kind {
        Kind::Acquisition | Kind::Study => Config::from_table(&source, table, kind).map(drop),
        Kind::Moments => moments::read_keys(table),
        Kind::Relations => relations::read_keys(table),
    }
}

fn instrument_keys(table: &Table) -> Result<(), ReadError> {
    instrument::read(&table.to_string()).map(drop)
}

/// A document with nothing but a value at a place, in tables that have all they need, which in lists are the first.
fn holding(place: &KeyPath, mut value: Value, around: &[(usize, Table)]) -> Table {
    for (depth, step) in place.0.iter().enumerate().rev() {
        value = match step {
            Step::Index(_) => Value::Array(vec![value]),
            Step::Key(key) => {
                let found = around.iter().find(|(d, _)| *d == depth);
                let mut table = found.map_or(Table::new(), |(_, table)| table.clone());
                table.insert(key.clone(), value);
                Value::Table(table)
            }
        };
    }
    match value {
        Value::Table(table) => table,
        _ => Table::new(),
    }
}

/// Reads a document, if it can be read.
type Reader = Box<dyn Fn(&Table) -> Result<(), ReadError>>;

/// Who is asked, and what was found out.
struct Asked {
    reader: Reader,
    /// Families by name.
    definitions: BTreeMap<String, Json>,
    /// What the tables around the place must have to be read, by depth.
    around: Vec<(usize, Table)>,
}

impl Asked {
    fn of(reader: fn(&Table) -> Result<(), ReadError>) -> Self {
        Self {
            reader: Box::new(reader),
            definitions: BTreeMap::new(),
            around: Vec::new(),
        }
    }

    /// An instrument file within a config.
    fn instrument(&mut self) -> Json {
        let mut asked = Self::of(instrument_keys);
        std::mem::swap(&mut asked.definitions, &mut self.definitions);
        let made = asked.object(&KeyPath::default(), &Table::new());
        self.definitions = asked.definitions;
        made
    }

    fn finish(self, title: &str, mut root: Json) -> Json {
        root["$schema"] = "https://json-schema.org/draft/2020-12/schema".into();
        root["title"] = title.into();
        root["$defs"] = json!(self.definitions);
        root
    }

    /// The reader's answer to a value at a place.
    fn answer(&self, place: &KeyPath, value: Value) -> Option<String> {
        let document = holding(place, value, &self.around);
        (self.reader)(&document).err().map(|e| e.message)
    }

    /// The values that may stand at a place.
    fn value(&mut self, place: &KeyPath) -> Json {
        if place.0.len() > DEEPEST {
            return json!({});
        }
        let probes: [(&str, Value); 6] = [
            ("boolean", true.into()),
            ("integer", 1.into()),
            ("number", 0.5.into()),
            ("string", NOBODY.into()),
            ("array", Value::Array(Vec::new())),
            ("object", Value::Table(Table::new())),
        ];
        let probes = probes.map(|(name, probe)| (name, self.answer(place, probe)));
        let is_taken = |said: &Option<String>| !said.as_deref().is_some_and(refuses_type);
        let taken: Vec<_> = probes.iter().filter(|(_, said)| is_taken(said)).collect();
        if taken.is_empty() || taken.len() == probes.len() {
            return json!({});
        }
        let mut any = Vec::new();
        for (name, said) in &taken {
            let said = said.as_deref().unwrap_or_default();
            any.push(match *name {
                "integer" if taken.iter().any(|(other, _)| *other == "number") => continue,
                "string" => match expected(said, "unknown variant `") {
                    Some(mut names) => {
                        names.retain(|name| !self.holds_more(place, name));
                        json!({ "enum": names })
                    }
                    None => json!({ "type": "string" }),
                },
                "array" => {
                    let items = self.value(&place.index(0));
                    json!({ "type": "array", "items": items })
                }
                "object" if said.starts_with(ONE_OF_A_CHOICE) => {
                    match self.choice(place, &probes) {
                        Some(choice) => choice,
                        None => continue,
                    }
                }
                "object" => match missing_kind(said) {
                    Some((family, kinds)) => self.family(place, &family, &kinds),
                    None => self.object(place, &Table::new()),
                },
                name => json!({ "type": name }),
            });
        }
        match <[Json; 1]>::try_from(any) {
            Ok([one]) => one,
            Err(any) => json!({ "anyOf": any }),
        }
    }

    /// True of a name of a choice that cannot stand alone.
    fn holds_more(&self, place: &KeyPath, name: &str) -> bool {
        let said = self.answer(place, name.into());
        said.is_some_and(|said| said.starts_with("invalid type: unit variant"))
    }

    /// The names of a choice that cannot stand alone, each as the key of what it holds.
    fn choice(&mut self, place: &KeyPath, said: &[(&str, Option<String>)]) -> Option<Json> {
        let mut names = said.iter().filter_map(|(_, said)| said.as_deref());
        let mut names = names.find_map(|said| expected(said, "unknown variant `"))?;
        names.retain(|name| self.holds_more(place, name));
        let held = names.into_iter().map(|name| {
            let place = place.key(&name);
            (name, self.value(&place))
        });
        let held: Map<String, Json> = held.collect();
        (!held.is_empty()).then(|| {
            json!({
                "type": "object",
                "properties": held,
                "additionalProperties": false,
                "minProperties": 1,
            })
        })
    }

    /// A table whose `kind` names a member of a family; the same everywhere but for the keys that its place adds.
    fn family(&mut self, place: &KeyPath, family: &str, kinds: &[String]) -> Json {
        let mut name = family.replace(' ', "-");
        if !added(place).is_empty() {
            name += "-of-a-list";
        }
        let reference = json!({ "$ref": format!("#/$defs/{name}") });
        if self.definitions.contains_key(&name) {
            return reference;
        }
        // Members hold each other: they find this while they are described.
        self.definitions.insert(name.clone(), Json::Null);
        let members = kinds.iter().map(|kind| {
            let (summary, mut with) = about(family, kind);
            with.insert("kind".into(), kind.as_str().into());
            let mut member = self.object(place, &with);
            member["properties"]["kind"] = json!({ "const": kind });
            member["required"] = json!(["kind"]);
            member["description"] = summary.into();
            member
        });
        let members: Vec<Json> = members.collect();
        self.definitions.insert(name, json!({ "anyOf": members }));
        reference
    }

    /// A table; `with` are keys that it needs to be read at all.
    fn object(&mut self, place: &KeyPath, with: &Table) -> Json {
        let mut with = with.clone();
        if place.to_string() == "instrument[0]" {
            with.insert("preset".into(), NOBODY.into());
        }
        let mut strange = with.clone();
        strange.insert(NOBODY.into(), 0.into());
        let said = self.answer(place, Value::Table(strange));
        let said = said.unwrap_or_default();
        let known = expected(&said, "unknown field `")
            .or_else(|| expected(&said, "unknown key `"))
            .or_else(|| Some(split(said.split_once("unknown key ?; allowed: ")?.1)));
        let kinds = self.kinds_left_out(place, &with);
        self.around.push((place.0.len(), with));
        let made = match known {
            None if said.is_empty() || refuses_type(&said) => {
                // Keys of the author's own, e.g. symbols of axes.
                let of_any = self.value(&place.key("x"));
                json!({ "type": "object", "additionalProperties": of_any })
            }
            None => json!({ "type": "object" }),
            Some(mut keys) => {
                let added = added(place).iter().map(|key| (*key).to_owned());
                let added: Vec<String> = added.filter(|key| !keys.contains(key)).collect();
                keys.extend(added);
                let table = place;
                let properties = keys.into_iter().map(|key| {
                    let place = table.key(&key);
                    let value = match place.to_string().as_str() {
                        // A name that is looked up when all others are known.
                        "coordinates[0].kind" => {
                            let kinds = parametrization::all().into_iter().map(|entry| entry.kind);
                            json!({ "enum": kinds.chain([OWN]).collect::<Vec<_>>() })
                        }
                        // It is there only without a preset.
                        "instrument[0].spec" => self.instrument(),
                        _ => self.member(table, &place),
                    };
                    (key, value)
                });
                let properties: Map<String, Json> = properties.collect();
                json!({
                    "type": "object",
                    "properties": properties,
                    "additionalProperties": false,
                })
            }
        };
        self.around.pop();
        match kinds {
            Some((family, kinds)) => {
                let members = self.family(place, &family, &kinds);
                json!({ "anyOf": [made, members] })
            }
            None => made,
        }
    }

    /// The values that a key of a table may have; some are looked at only when the table has the others that it needs.
    fn member(&mut self, table: &KeyPath, place: &KeyPath) -> Json {
        let found = self.value(place);
        let said = self.answer(place, Value::Table(Table::new()));
        let is_open = found == json!({}) || found == json!({ "type": "object" });
        if !is_open || !said.is_some_and(|said| said.starts_with("missing field `")) {
            return found;
        }
        let Some((depth, before)) = self.around.pop() else {
            return found;
        };
        self.around
            .push((depth, self.completed(table, before.clone())));
        let found = self.value(place);
        self.around.pop();
        self.around.push((depth, before));
        found
    }

    /// A table with the keys that it cannot be read without, as far as any value will do.
    fn completed(&self, place: &KeyPath, mut with: Table) -> Table {
        for _ in 0..MOST_REQUIRED {
            let said = self.answer(place, Value::Table(with.clone()));
            let said = said.unwrap_or_default();
            let missing = said.strip_prefix("missing field `");
            let Some(key) = missing.and_then(|rest| rest.split('`').next()) else {
                break;
            };
            let values: [Value; 4] = [
                1.into(),
                NOBODY.into(),
                Value::Table(Table::new()),
                Value::Array(Vec::new()),
            ];
            let fitting = values.into_iter().find(|value| {
                let mut table = with.clone();
                table.insert(key.to_owned(), value.clone());
                let said = self.answer(place, Value::Table(table));
                !said.as_deref().is_some_and(refuses_type)
            });
            let Some(value) = fitting else {
                break;
            };
            with.insert(key.to_owned(), value);
        }
        with
    }

    /// Family and kinds of a table that is read without a kind, but may have one.
    fn kinds_left_out(&self, place: &KeyPath, with: &Table) -> Option<(String, Vec<String>)> {
        if with.contains_key("kind") {
            return None;
        }
        let mut strange = with.clone();
        strange.insert("kind".into(), NOBODY.into());
        let said = self.answer(place, Value::Table(strange))?;
        let (family, kinds) = said.split_once("; allowed: ")?;
        let refused = format!("kind = {NOBODY:?} is not a");
        let (_, family) = family.strip_prefix(&refused)?.split_once(' ')?;
        Some((family.into(), split(kinds)))
    }
}

/// Keys that are taken out of a table before its reader sees it.
fn added(place: &KeyPath) -> &'static [&'static str] {
    match place.0.as_slice() {
        [Step::Key(table)] => taken_before(table, false),
        [Step::Key(list), Step::Index(_)] => taken_before(list, true),
        _ => &[],
    }
}

/// Summary and first example that a registry has of a member.
fn about(family: &str, kind: &str) -> (&'static str, Table) {
    fn described<T: ?Sized>(all: &[Entry<T>], kind: &str) -> (&'static str, Table) {
        let entry = all.iter().find(|entry| entry.kind == kind);
        let example = entry.and_then(|entry| entry.examples.first()?.parse().ok());
        (
            entry.map_or("", |entry| entry.summary),
            example.unwrap_or_default(),
        )
    }
    match family {
        "material" => described(&super::materials::all(), kind),
        "parametrization" => described(&parametrization::all(), kind),
        "warp" => described(&parametrization::warps(), kind),
        "sample set" if schedule::all().iter().any(|e| e.kind == kind) => {
            described(&schedule::all(), kind)
        }
        "sample set" => described(&acquisition::all(), kind),
        "reconstruction" => described(&reconstruct::all(), kind),
        "lighting" => described(&lighting::all(), kind),
        "estimator" => described(&crate::moments::all(), kind),
        _ => Default::default(),
    }
}

/// True of the answer to a value of the wrong type.
fn refuses_type(said: &str) -> bool {
    let wanted = ["a string", "a table", "an array of tables"];
    let refused = |wanted: &&str| said.ends_with(&format!("; allowed: {wanted}"));
    said.starts_with("invalid type: ")
        || said == "wanted string or table"
        || (said.contains(" is ") && wanted.iter().any(refused))
}

/// Family and kinds of a table without a kind.
fn missing_kind(said: &str) -> Option<(String, Vec<String>)> {
    let missing = said.strip_prefix("kind is missing from the ")?;
    let (family, kinds) = missing.split_once("; allowed: ")?;
    Some((family.into(), split(kinds)))
}

/// The names of serde's `… expected one of `a`, `b``.
fn expected(said: &str, start: &str) -> Option<Vec<String>> {
    let (_, list) = said.strip_prefix(start)?.split_once("`, ")?;
    Some(quoted(list).map(str::to_owned).collect())
}

fn split(list: &str) -> Vec<String> {
    list.split(", ").map(str::to_owned).collect()
}
