use crate::density::radius::{Schedule, UnknownSchedule};
use crate::scene::{PathLimits, UNBOUNDED_DEPTH};
use serde::Serialize;
use std::time::Duration;

/// The algorithm that renders.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// Progressive photon tracing: uniform photons into view beams and visible points.
    Ppt,
}

impl Method {
    pub const NAMES: [&'static str; 1] = ["ppt"];

    pub fn name(self) -> &'static str {
        match self {
            Method::Ppt => "ppt",
        }
    }
}

/// Everything that a render depends on besides the scene. Names are those of the XML properties.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Parameters {
    pub method: Method,
    /// Photon passes (`spp` of the scene's sampler).
    pub passes: u32,
    /// Walks emitted per pass (`photons`).
    pub photons: u64,
    /// View rays are jittered and both trees rebuilt every so many passes (`jitter_every`).
    pub jitter_every: u32,
    /// Share of the photons kept from pass to pass, in (0,1) (`alpha`).
    pub alpha: f32,
    /// Radius of a visible point's disk in the first pass [length]; 0 = from the pixel footprint.
    pub surface_radius: f32,
    /// Radius of a view beam in the first pass [length]; 0 = from the pixel footprint.
    pub medium_radius: f32,
    pub radius_schedule: Schedule,
    #[serde(flatten)]
    pub limits: PathLimits,
    pub seed: u64,
    /// Wall time after which no new pass starts.
    #[serde(serialize_with = "serialize_timeout")]
    pub timeout: Option<Duration>,
}

/// In seconds, as the XML has it; `null` without a timeout.
fn serialize_timeout<S: serde::Serializer>(
    timeout: &Option<Duration>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    timeout.map(|timeout| timeout.as_secs_f64()).serialize(serializer)
}

impl Default for Parameters {
    fn default() -> Self {
        Parameters {
            method: Method::Ppt,
            passes: 16,
            photons: 100_000,
            jitter_every: 4,
            alpha: 0.7,
            surface_radius: 0.0,
            medium_radius: 0.0,
            radius_schedule: Schedule::Matched,
            limits: PathLimits { max_depth: UNBOUNDED_DEPTH, rr_depth: 5, hide_emitters: false },
            seed: 0,
            timeout: None,
        }
    }
}

/// A parameter that cannot be used, with the mend.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ParameterError {
    #[error("unknown method \"{0}\"; this version has: {known}", known = Method::NAMES.join(", "))]
    UnknownMethod(String),
    #[error(transparent)]
    UnknownSchedule(#[from] UnknownSchedule),
    #[error("{name} is {value}, but must be a finite number >= 0 (0 = from the pixel footprint)")]
    BadRadius { name: &'static str, value: f32 },
    #[error("alpha is {0}, but must lie strictly between 0 and 1")]
    BadAlpha(f32),
    #[error("{name} is {value}, but must be at least 1")]
    TooSmall { name: &'static str, value: i64 },
    #[error("max_depth is {0}, but must be -1 (unbounded) or at least 0")]
    BadMaxDepth(i64),
    #[error("rr_depth is {0}, but must be at least 1")]
    BadRrDepth(i64),
}

impl std::str::FromStr for Method {
    type Err = ParameterError;
    fn from_str(name: &str) -> Result<Self, ParameterError> {
        match name {
            "ppt" => Ok(Method::Ppt),
            _ => Err(ParameterError::UnknownMethod(name.to_owned())),
        }
    }
}

impl Parameters {
    /// Checks ranges before any work is done.
    pub fn validate(&self) -> Result<(), ParameterError> {
        for (name, value) in
            [("surface_radius", self.surface_radius), ("medium_radius", self.medium_radius)]
        {
            if !(value.is_finite() && value >= 0.0) {
                return Err(ParameterError::BadRadius { name, value });
            }
        }
        if !(self.alpha > 0.0 && self.alpha < 1.0) {
            return Err(ParameterError::BadAlpha(self.alpha));
        }
        for (name, value) in [
            ("passes", self.passes as i64),
            ("photons", self.photons as i64),
            ("jitter_every", self.jitter_every as i64),
        ] {
            if value < 1 {
                return Err(ParameterError::TooSmall { name, value });
            }
        }
        Ok(())
    }
}
