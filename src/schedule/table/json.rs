//! Tables as JSON Lines.

use super::read::Table;
use super::{FileError, WORDS};
use crate::error::{excerpt, reason};
use serde::de::{Deserialize, Deserializer, MapAccess, Visitor};
use serde_json::{Map, Value};
use std::fmt::{self, Formatter};

const HEADER: &str = "header";

impl Table {
    pub(super) fn read_json(
        &mut self,
        text: &str,
        name_columns: impl Fn(&mut Self, Vec<String>, usize) -> Result<(), FileError>,
    ) -> Result<(), FileError> {
        for (line, content) in (1..).zip(text.lines()) {
            if content.trim().is_empty() {
                continue;
            }
            let Object { mut map, twice } = serde_json::from_str(content).map_err(|_| {
                let message = "this is no JSON object; allowed: one whole object a line";
                self.error(line, message).cut_if(true)
            })?;
            if let Some(key) = twice {
                let message = format!("key {:?} is there twice; allowed: once", excerpt(&key));
                return Err(self.error(line, message));
            }
            if let Some(Value::Object(header)) = map.remove(HEADER) {
                if self.head > 0 || !self.facts.is_empty() {
                    return Err(self.error(line, "the header must be the first line"));
                }
                self.fact_lines = header.keys().map(|key| (key.clone(), line)).collect();
                self.facts = header;
                if self.is_ours()
                    && let Some(columns) = self.fact::<Map<String, Value>>("columns")?
                {
                    let columns = columns.into_iter().map(|(name, _)| name).collect();
                    name_columns(self, columns, line)?;
                }
                continue;
            }
            if self.columns.is_empty() {
                name_columns(self, map.keys().cloned().collect(), line)?;
            }
            self.read_object(map, line)?;
        }
        if self.columns.is_empty() {
            return Err(FileError::whole(&self.name, "there is no row"));
        }
        Ok(())
    }

    fn read_object(
        &mut self,
        mut object: Map<String, Value>,
        line: usize,
    ) -> Result<(), FileError> {
        self.lines.push(line);
        for d in 0..self.columns.len() {
            let column = self.label(d);
            let Some(value) = object.remove(&self.labels[d]) else {
                return Err(self.error(line, format!("{column} is missing")));
            };
            let finite = value.as_f64().filter(|number| number.is_finite());
            let number = match (&value, finite, self.columns[d] == WORDS) {
                _ if self.columns[d].is_empty() => f64::NAN,
                (Value::String(words), _, true) => {
                    self.words.push(words.clone());
                    f64::NAN
                }
                (Value::Null, _, false) => f64::NAN,
                (_, Some(number), false) => number,
                (other, _, words) => {
                    let kind = if words { "a string" } else { "a finite number" };
                    let other = other.to_string();
                    let message = format!("{column} = {}: allowed is {kind}", excerpt(&other));
                    return Err(self.error(line, message));
                }
            };
            self.numbers.push(number);
        }
        match object.keys().next() {
            Some(stray) => {
                let (stray, known) = (excerpt(stray), reason(self.labels.join(", ")));
                let message =
                    format!("{stray:?} is no column of the rows before; allowed: {known}");
                Err(self.error(line, message))
            }
            None => Ok(()),
        }
    }
}

/// A line, and a key that it or its header has twice: a plain map would keep the last.
#[derive(Default)]
struct Object {
    map: Map<String, Value>,
    twice: Option<String>,
}

impl<'de> Deserialize<'de> for Object {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_map(Object::default())
    }
}

impl<'de> Visitor<'de> for Object {
    type Value = Self;

    fn expecting(&self, f: &mut Formatter) -> fmt::Result {
        f.write_str("a row, or a header that is an object")
    }

    fn visit_map<A: MapAccess<'de>>(mut self, mut entries: A) -> Result<Self, A::Error> {
        while let Some(key) = entries.next_key::<String>()? {
            let value = if key == HEADER {
                let header: Object = entries.next_value()?;
                self.twice = self.twice.or(header.twice);
                Value::Object(header.map)
            } else {
                entries.next_value()?
            };
            if self.map.insert(key.clone(), value).is_some() {
                self.twice = Some(key);
            }
        }
        Ok(self)
    }
}
