use super::effects::EffectReport;
use super::Parameters;
use crate::density::radius::Radii;
use crate::film::error::ErrorEstimate;
use crate::markov::FamilyReport;
use crate::plan::Connections;
use crate::transport::counters::Counters;
use crate::transport::memory::ReceiverMemory;
use crate::transport::photon::PerFamily;
use serde::{Deserialize, Serialize};

/// Seconds of wall time by phase, summed over the threads of batches that ran side by side.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct PhaseSeconds {
    /// View rays: tracing them and their transmittances.
    pub view: f64,
    /// Building trees: over receivers once per jitter, over photons (`apa`, `ppb`) in every pass.
    pub trees: f64,
    /// Photon walks, their queries and splats.
    pub photons: f64,
    /// Film: reconstruction filter and sums.
    pub film: f64,
}

impl PhaseSeconds {
    pub fn add(&mut self, o: &PhaseSeconds) {
        self.view += o.view;
        self.trees += o.trees;
        self.photons += o.photons;
        self.film += o.film;
    }
}

/// The report of a render, as written by `--stats`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Stats {
    /// As they were in force: the scene's, the command line's and the defaults.
    pub parameters: Parameters,
    /// Which receivers looked for lamps by themselves.
    pub connections: Connections,
    pub passes: u32,
    /// Threads that the engine worked with.
    pub threads: usize,
    pub seconds: f64,
    pub phase_seconds: PhaseSeconds,
    pub initial_radii: Radii,
    pub final_radii: Radii,
    pub counters: Counters,
    /// Of the receivers of the last jitter.
    pub memory: ReceiverMemory,
    /// What was simulated and why, and the work that it took, in the order of [`crate::effect::Effect::ALL`].
    pub effects: Vec<EffectReport>,
    /// What was measured and decided about shooting, by family; all zero where a method does not measure.
    pub shooting: PerFamily<FamilyReport>,
    /// None where no error was to be estimated, or too little was there to judge by.
    pub estimated_error: Option<ErrorEstimate>,
    pub warnings: Vec<String>,
}
