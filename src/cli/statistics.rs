//! The file that `--stats` writes.

use super::failure::Failure;
use super::job::RenderJob;
use super::memory::Watch;
use serde::Serialize;
use std::collections::BTreeMap;
use vpt::host::session::{LoadedScene, Session};
use vpt::method::Stats;

/// What ended a render.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Ending {
    Complete,
    Interrupt,
    Timeout,
    /// The error aimed at was reached.
    Accuracy,
}

impl Ending {
    /// The ending of a render of which so many passes were done and asked for.
    pub fn of(done: u32, asked: u32, interrupted: bool) -> Self {
        match (done < asked, interrupted) {
            (false, _) => Ending::Complete,
            (true, true) => Ending::Interrupt,
            (true, false) => Ending::Timeout,
        }
    }
}

/// A render in numbers, with everything that it takes to repeat it.
#[derive(Debug, Serialize)]
struct Report<'a> {
    version: &'static str,
    variant: &'a str,
    scene: String,
    picture: String,
    film_size: [u32; 2],
    sensor: usize,
    seed: u32,
    /// As given with `-D` and `--set`.
    defines: BTreeMap<&'a str, &'a str>,
    settings: BTreeMap<&'a str, &'a str>,
    ending: Ending,
    load_seconds: f64,
    /// Most memory that the process held at any time; `null` where the system does not tell.
    peak_memory_bytes: Option<u64>,
    /// Most memory that the render took on top of the loaded scene.
    render_memory_bytes: Option<u64>,
    notes: &'a [String],
    #[serde(flatten)]
    stats: &'a Stats,
}

/// Writes the report, if the job wants one.
pub fn write(
    job: &RenderJob,
    session: &Session,
    scene: &LoadedScene,
    load_seconds: f64,
    memory: &Watch,
    ending: Ending,
    stats: &Stats,
) -> Result<(), Failure> {
    let Some(target) = &job.stats else { return Ok(()) };
    let report = Report {
        version: env!("CARGO_PKG_VERSION"),
        variant: session.variant(),
        scene: job.scene.path.display().to_string(),
        picture: job.picture.path().display().to_string(),
        film_size: scene.film_size(job.sensor),
        sensor: job.sensor,
        seed: job.seed,
        defines: as_map(&job.scene.defines),
        settings: as_map(&job.scene.settings),
        ending,
        load_seconds,
        peak_memory_bytes: memory.peak(),
        render_memory_bytes: memory.growth(),
        notes: scene.notes(),
        stats,
    };
    let json = serde_json::to_string_pretty(&report).map_err(Failure::failed)? + "\n";
    target.replace(|aside| Ok(std::fs::write(aside, json)?)).map_err(Failure::failed)
}

fn as_map(pairs: &[(String, String)]) -> BTreeMap<&str, &str> {
    pairs.iter().map(|(name, value)| (name.as_str(), value.as_str())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_render_with_all_its_passes_is_complete() {
        assert_eq!(Ending::of(4, 4, true), Ending::Complete);
        assert_eq!(Ending::of(3, 4, true), Ending::Interrupt);
        assert_eq!(Ending::of(3, 4, false), Ending::Timeout);
    }
}
