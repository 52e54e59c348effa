//! `gonio merge`.

use super::run::{End, Shown};
use super::{any_plan, note, read_text};
use crate::error::{Error, count, count_are};
use crate::experiment::{
    AnyPlan, Expected, Material, Record, RowKey, Source, asks_the_same, material_key,
};
use crate::report::{CONFIG, Machine, MadeFrom, Manifest, Outcome, RunFolder, read_rows};
use clap::Args;
use std::collections::{BTreeSet, HashMap};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

#[derive(Debug, Args)]
pub(super) struct Merge {
    /// Folders that `gonio run --shard` wrote, all of one config
    #[arg(required = true, value_name = "DIR")]
    parts: Vec<PathBuf>,
    /// Folder of the whole
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Replace a run that is in the output folder
    #[arg(long)]
    force: bool,
}

impl Merge {
    pub(super) fn run(self) -> Result<(), Error> {
        let started = SystemTime::now();
        // What replaces a part is not made from it.
        let place = |dir: &PathBuf| dir.canonicalize().ok();
        let mut parts = self.parts.iter().filter_map(place);
        if parts.any(|part| Some(part) == place(&self.output)) {
            let message = "this is one of the parts; choose another folder with -o";
            return Err(Error::output(&self.output, message));
        }
        let source = self.config()?;
        match any_plan(&source)? {
            AnyPlan::Acquisition(plan) => self.put_together(&*plan, &source, started),
            AnyPlan::Moments(plan) => self.put_together(&*plan, &source, started),
            AnyPlan::Relations(plan) => self.put_together(&*plan, &source, started),
        }
    }

    fn put_together<E: Shown>(
        &self,
        plan: &E,
        source: &Source,
        started: SystemTime,
    ) -> Result<(), Error> {
        if !self.force && self.output.join(E::Record::FILE).exists() {
            let message = "a run is here already; choose another folder with -o, or --force";
            return Err(Error::output(&self.output, message));
        }
        let (head, expected) = (plan.head(), plan.expected(None));
        let of = |e: &Expected| (head.materials[e.material].name.clone(), e.label.clone());
        let places: HashMap<(String, String), usize> = expected.iter().map(of).zip(0..).collect();
        let mut found: Vec<Option<(&Path, E::Record)>> = vec![None; expected.len()];
        let mut from = MadeFrom::default();
        // Which files each material was made from, and where that was found.
        let mut made_from: HashMap<String, (RowKey, &Path)> = HashMap::new();
        let mut others = 0;
        for dir in &self.parts {
            from.extend(MadeFrom::read(dir));
            let mut rows = Vec::new();
            for row in read_rows::<E::Record>(dir)? {
                let (material, material_key) = row.material();
                let place = places.get(&(material.to_owned(), row.label())).copied();
                // What a folder held before it was of this config is left there.
                match place.filter(|p| row.key() == expected[*p].key(material_key)) {
                    Some(place) => rows.push((place, row)),
                    None => others += 1,
                }
            }
            let of = |(place, row): &(usize, E::Record)| {
                (expected[*place].material, row.material().1.to_owned())
            };
            let meant = meant_materials(plan, dir, rows.iter().map(of).collect())?;
            for (place, row) in rows {
                let (material, material_key) = row.material();
                if meant.get(&expected[place].material).map(String::as_str) != Some(material_key) {
                    others += 1;
                    continue;
                }
                let entry = made_from.entry(material.to_owned());
                let (key, first) = entry.or_insert_with(|| (material_key.to_owned(), dir));
                if *key != material_key {
                    let (first, allowed) =
                        (first.display(), "parts that were made from the same files");
                    let message = format!(
                        "its {material} is another material than in {first}: the files differ; allowed: {allowed}"
                    );
                    return Err(Error::data(dir, message));
                }
                if let Some((first, held)) = &found[place]
                    && !held.agrees(&row)
                {
                    let (key, first) = (row.key(), first.display());
                    let message = format!(
                        "its row {key} has other numbers than in {first}; allowed: parts that one version made"
                    );
                    return Err(Error::data(dir, message));
                }
                found[place] = Some((dir, row));
            }
        }
        if others > 0 {
            let rows = count(others, "row");
            note(&format!("gonio: {rows} of other configs left out"));
        }
        let sorted = found.into_iter().flatten().map(|(_, row)| row);
        let sorted: Vec<E::Record> = sorted.collect();
        let keys: Vec<RowKey> = sorted.iter().map(|r| r.key().to_owned()).collect();
        let key_of = |m: &Material| Some(made_from.get(&m.name)?.0.clone());
        let materials: Vec<Option<RowKey>> = head.materials.iter().map(key_of).collect();
        let (found, of) = (keys.len(), expected.len());
        let mut folder = RunFolder::open(&self.output, self.force, head.resolved)?;
        folder.write_rows(&sorted)?;
        for dir in &self.parts {
            folder.copy_below(dir)?;
        }
        let outcome = Outcome {
            rows: found,
            incomplete: found < of && !from.are_all(),
            // What one part could not do another may have.
            failures: match found < of {
                true => from.failures.clone(),
                false => Vec::new(),
            },
            tuned: from.tuned.clone(),
            ..Outcome::default()
        };
        let (mut seconds, mut counts) = (from.seconds.clone(), from.counts.clone());
        let manifest = Manifest::new(head, source, Vec::new(), outcome, Some(from));
        let end = End {
            keys: &keys,
            materials: &materials,
            manifest: &manifest,
            ended: true,
            whole: true,
        };
        end.conclude(plan, &mut folder, &mut seconds, &mut counts)?;
        let path = folder.finish(&keys, manifest, &Machine::new(started, seconds, counts))?;
        let all = count_are(of, "row");
        note(&format!("\n{found} of {all} in {}", path.display()));
        match found < of {
            true => Err(Error::Incomplete {
                rows: found,
                of,
                path,
            }),
            false => Ok(()),
        }
    }

    /// The config of the parts, which must be the same but for the places of files.
    fn config(&self) -> Result<Source, Error> {
        let mut config: Option<(String, String, toml::Table)> = None;
        for dir in &self.parts {
            let path = dir.join(CONFIG);
            let text = read_text(&path)?;
            let table: toml::Table = text.parse().map_err(|e: toml::de::Error| {
                Error::data(&path, format!("this is no config: {}", e.message()))
            })?;
            let name = path.display().to_string();
            let (first, _, other) = config.get_or_insert((name, text, table.clone()));
            if !asks_the_same(other, &table) {
                let message =
                    format!("this is another config than {first}; allowed: parts of one run");
                return Err(Error::data(path, message));
            }
        }
        let config = config.map(|(name, text, _)| Source::new(name, text));
        config.ok_or_else(|| Error::Internal("a folder is required".into()))
    }
}

/// Which of the materials of that name the rows of a part mean: of a formula that of the config; of
/// files, which may be elsewhere, the only one, or the one whose files are here.
fn meant_materials<E: Shown>(
    plan: &E,
    dir: &Path,
    found: BTreeSet<(usize, RowKey)>,
) -> Result<HashMap<usize, RowKey>, Error> {
    let found = Vec::from_iter(found);
    let meant = found.chunk_by(|a, b| a.0 == b.0).map(|several| {
        let position = several[0].0;
        let material = &plan.head().materials[position];
        let key = match several {
            [(_, only)] if !material.spec.tables().files.is_empty() => Ok(only.clone()),
            _ => material_key(material),
        };
        let key = key.map_err(|_| {
            let message = format!(
                "it holds rows of several materials called {}, and its files are not here to \
                 tell which is meant; allowed: parts whose files are here, or of one material",
                material.name
            );
            Error::data(dir, message)
        });
        Ok((position, key?))
    });
    meant.collect()
}
