//! The file that `--stats` writes.

use super::job::RenderJob;
use super::target::Target;
use serde::Serialize;
use std::collections::BTreeMap;
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
pub struct Report<'a> {
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

/// What a report takes from the render, besides the job.
pub struct Facts<'a> {
    pub variant: &'a str,
    pub film_size: [u32; 2],
    pub notes: &'a [String],
    pub load_seconds: f64,
    /// Bytes.
    pub peak_memory: Option<u64>,
    pub render_memory: Option<u64>,
    pub ending: Ending,
    pub stats: &'a Stats,
}

impl<'a> Report<'a> {
    pub fn new(job: &'a RenderJob, facts: &Facts<'a>) -> Self {
        Report {
            version: env!("CARGO_PKG_VERSION"),
            variant: facts.variant,
            scene: job.scene.path.display().to_string(),
            picture: job.picture.path().display().to_string(),
            film_size: facts.film_size,
            sensor: job.sensor,
            seed: job.seed,
            defines: as_map(&job.scene.defines),
            settings: as_map(&job.scene.settings),
            ending: facts.ending,
            load_seconds: facts.load_seconds,
            peak_memory_bytes: facts.peak_memory,
            render_memory_bytes: facts.render_memory,
            notes: facts.notes,
            stats: facts.stats,
        }
    }

    pub fn write(&self, target: &Target) -> anyhow::Result<()> {
        let json = serde_json::to_string_pretty(self)?;
        target.replace(|aside| Ok(std::fs::write(aside, json + "\n")?))
    }
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
