//! Everything that a comparison measured, in plain data; `results.json` is this and its summary.

use super::metrics::Errors;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A comparison.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    /// Of the program.
    pub version: String,
    pub scene: String,
    pub variant: String,
    /// Width and height in pixels.
    pub film_size: [u32; 2],
    /// Seconds that every method was given, for each seed.
    pub seconds: f64,
    pub seeds: u32,
    /// What was asked for, option by option; a comparison can only go on with the same.
    #[serde(default)]
    pub settings: BTreeMap<String, String>,
    /// Whether it ended early, or has not ended yet.
    pub interrupted: bool,
    /// Most memory that the whole program held; None where the system does not tell.
    pub peak_memory_bytes: Option<u64>,
    pub reference: Reference,
    pub methods: Vec<Method>,
    /// Remarks for the reader.
    pub notes: Vec<String>,
}

/// What the errors are measured against.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    /// In words: a file, or how it was rendered.
    pub origin: String,
    /// Mean over pixels and channels.
    pub mean: f64,
    /// None for a file from elsewhere.
    pub noise: Option<Noise>,
    /// An upper estimate of its bias, root mean square in the measure of [`Errors::relative`]; None where it has none
    /// or nothing is known of it.
    #[serde(default)]
    pub bias: Option<f64>,
    /// The method or integrator that rendered it; None for a file from elsewhere.
    #[serde(default)]
    pub estimator: Option<String>,
}

/// The reference's own noise, from its two independent halves.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Noise {
    /// Standard error of a pixel, root mean square over the picture.
    pub rmse: f64,
    /// The same in the measure of [`Errors::relative_mse`].
    pub relative_mse: f64,
}

/// One method or integrator.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Method {
    pub name: String,
    pub variant: String,
    /// One of vpt's methods, else one of Mitsuba's integrators.
    pub ours: bool,
    /// Why its picture is not that of the scene; such a method is not ranked.
    pub flaw: Option<String>,
    /// Whether the reference was rendered by its estimator: what both get wrong is not seen.
    #[serde(default)]
    pub shares_reference: bool,
    /// One for each seed.
    pub runs: Vec<Run>,
}

/// One method with one seed.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Run {
    pub seed: u32,
    /// Whether it had all of its time.
    #[serde(default)]
    pub complete: bool,
    /// Passes (vpt) or samples per pixel (Mitsuba) in the end.
    pub work: u64,
    pub snapshots: Vec<Snapshot>,
    /// Where the time went, as far as the method tells.
    pub phases: Vec<Phase>,
    /// The most memory that the method held by itself, estimated from the program's resident memory around
    /// its slices.
    pub peak_memory_bytes: Option<u64>,
}

/// The errors of the picture at one time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Snapshot {
    /// Wall time of the method alone, its preparation included.
    pub seconds: f64,
    pub work: u64,
    #[serde(flatten)]
    pub errors: Errors,
    /// The picture's file (EXR), relative to the report; None where it is not kept.
    #[serde(default)]
    pub image: Option<String>,
}

/// A part of the work and the seconds that it took.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Phase {
    pub name: String,
    pub seconds: f64,
}

/// An error that is plotted over time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Metric {
    Rmse,
    RelativeMse,
    Flip,
}

impl Metric {
    pub const ALL: [Metric; 3] = [Metric::Rmse, Metric::RelativeMse, Metric::Flip];

    /// As in file names.
    pub fn name(self) -> &'static str {
        match self {
            Metric::Rmse => "rmse",
            Metric::RelativeMse => "relative_mse",
            Metric::Flip => "flip",
        }
    }

    pub fn title(self) -> &'static str {
        match self {
            Metric::Rmse => "RMSE",
            Metric::RelativeMse => "Relative MSE",
            Metric::Flip => "FLIP",
        }
    }

    pub fn of(self, errors: &Errors) -> f64 {
        match self {
            Metric::Rmse => errors.rmse,
            Metric::RelativeMse => errors.relative_mse,
            Metric::Flip => errors.flip,
        }
    }

    /// The reference's noise in this measure, where it is known.
    pub fn of_noise(self, noise: &Noise) -> Option<f64> {
        match self {
            Metric::Rmse => Some(noise.rmse),
            Metric::RelativeMse => Some(noise.relative_mse),
            Metric::Flip => None,
        }
    }
}
