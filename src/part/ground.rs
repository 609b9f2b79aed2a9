//! What parts must have in common to add up.

use crate::density::radius::Radii;
use crate::method::{Parameters, Progressive};
use crate::picture::FilmFormat;
use crate::plan::Connections;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;

/// Parameters in which parts may differ: which passes they hold, and what ended them.
const FREE: [&str; 5] = ["passes", "first_pass", "timeout", "target_error", "seed"];

/// Everything that a picture depends on but its passes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ground {
    pub vpt: String,
    pub mitsuba: String,
    pub variant: String,
    /// Of the scene's files, wherever they lie.
    pub scene_hash: String,
    /// As given with `-D`.
    pub defines: BTreeMap<String, String>,
    pub sensor: usize,
    pub seed: u64,
    pub film: FilmGround,
    /// As they are in force.
    parameters: BTreeMap<String, Value>,
    /// Of the first of all passes.
    pub radii: Radii,
    /// Which receivers look for lamps by themselves.
    connections: BTreeMap<String, Value>,
}

/// The film.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FilmGround {
    /// Width and height.
    pub size: [u32; 2],
    /// Floats per pixel.
    pub channels: u32,
    pub format: FilmFormat,
    /// Whether the picture shows its estimated error.
    pub error_image: bool,
}

/// Something in which two grounds differ.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Difference {
    /// As it is called in the file: `parameters.alpha`.
    pub what: String,
    pub values: [String; 2],
}

impl Ground {
    /// Puts in what the engine has settled for a render. Until it has learnt what passes go by, photons per pass and samples of
    /// lamps may be 0.
    pub fn with_render(self, render: &dyn Progressive) -> Self {
        let settled = |parameters: &Parameters| {
            let mut map = fields(parameters);
            map.retain(|name, _| !FREE.contains(&name.as_str()));
            map
        };
        Ground {
            parameters: settled(render.parameters()),
            seed: render.parameters().seed,
            radii: render.initial_radii(),
            connections: connections(render.connections()),
            ..self
        }
    }

    /// Before [`Self::with_render`].
    pub fn new(
        [vpt, mitsuba, variant]: [&str; 3],
        scene_hash: u64,
        defines: &[(String, String)],
        sensor: usize,
        film: FilmGround,
    ) -> Self {
        Ground {
            vpt: vpt.to_owned(),
            mitsuba: mitsuba.to_owned(),
            variant: variant.to_owned(),
            scene_hash: format!("{scene_hash:016x}"),
            defines: defines.iter().cloned().collect(),
            sensor,
            seed: 0,
            film,
            parameters: BTreeMap::new(),
            radii: Radii::default(),
            connections: BTreeMap::new(),
        }
    }

    /// Parameters as they were in force, as JSON.
    pub fn parameters(&self) -> &BTreeMap<String, Value> {
        &self.parameters
    }

    /// Everything in which two grounds differ, by name.
    pub fn differences(&self, other: &Ground) -> Vec<Difference> {
        let (mine, theirs) = (flattened(self), flattened(other));
        let mut names: Vec<&String> = mine.keys().chain(theirs.keys()).collect();
        names.sort();
        names.dedup();
        let shown = |value: Option<&Value>| match value {
            None => "not given".to_owned(),
            Some(Value::String(text)) => format!("\"{text}\""),
            Some(value) => value.to_string(),
        };
        let different = names.into_iter().filter(|name| mine.get(*name) != theirs.get(*name));
        let difference = |name: &String| Difference {
            what: name.clone(),
            values: [shown(mine.get(name)), shown(theirs.get(name))],
        };
        different.map(difference).collect()
    }

    /// The same, but for what a render learns before its first pass, where `other` has not learnt it yet.
    pub fn differences_but_learnt(&self, other: &Ground) -> Vec<Difference> {
        let is_open = |name: &str| match other.parameters.get(name) {
            Some(value) => value.is_null() || *value == 0,
            None => false,
        };
        let mut all = self.differences(other);
        all.retain(|difference| match difference.what.as_str() {
            "parameters.photons" => !is_open("photons"),
            "parameters.connection_samples" | "connections.samples" => {
                !is_open("connection_samples")
            }
            what => !(what.starts_with("connections.") && is_open("connections")),
        });
        all
    }
}

fn connections(connections: Connections) -> BTreeMap<String, Value> {
    fields(&connections)
}

/// A structure of plain values, by the names of its fields.
fn fields(of: &impl Serialize) -> BTreeMap<String, Value> {
    match serde_json::to_value(of) {
        Ok(Value::Object(map)) => map.into_iter().collect(),
        // Plain values always become JSON.
        _ => BTreeMap::new(),
    }
}

/// By paths such as `film.size.0`.
fn flattened(ground: &Ground) -> BTreeMap<String, Value> {
    let mut all = BTreeMap::new();
    for (name, value) in fields(ground) {
        flatten(name, value, &mut all);
    }
    all
}

fn flatten(name: String, value: Value, out: &mut BTreeMap<String, Value>) {
    match value {
        Value::Object(map) => {
            map.into_iter().for_each(|(key, value)| flatten(format!("{name}.{key}"), value, out))
        }
        value => drop(out.insert(name, value)),
    }
}
