//! Sets of parameters under one name.

use super::{Method, ParameterError, Parameters};
use crate::density::radius::Schedule;
use crate::effect::Effects;
use crate::scene::{PathLimits, UNBOUNDED_DEPTH};
use crate::transport::photon_beam::BeamKind;
use serde::Serialize;

/// What parameters are that nobody set (`preset`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Preset {
    /// What reaches a small error soonest: all that `vpt compare` found to win.
    #[default]
    Fast,
    /// The paper's method to the letter: photons carry all light, radii in media fall by the cube root, and view rays
    /// stay for several passes.
    Paper,
}

impl Preset {
    pub fn parameters(self) -> Parameters {
        let fast = Parameters {
            method: Method::Ppt,
            shooting: None,
            chains: 0,
            photon_beams: BeamKind::Short,
            connections: None,
            emission_rays: true,
            glossy_chains: true,
            guided_emission: true,
            connection_samples: 0,
            effects: Effects::NONE,
            passes: 16,
            first_pass: 0,
            photons: 0,
            jitter_every: 0,
            alpha: 0.7,
            surface_radius: 0.0,
            medium_radius: 0.0,
            radius_schedule: Schedule::Matched,
            limits: PathLimits { max_depth: UNBOUNDED_DEPTH, rr_depth: 5, hide_emitters: false },
            estimate_error: true,
            layers: false,
            target_error: 0.0,
            seed: 0,
            timeout: None,
        };
        match self {
            Preset::Fast => fast,
            Preset::Paper => Parameters {
                connections: Some(false),
                emission_rays: false,
                glossy_chains: false,
                guided_emission: false,
                photons: 100_000,
                jitter_every: 4,
                radius_schedule: Schedule::Paper,
                ..fast
            },
        }
    }
}

impl std::str::FromStr for Preset {
    type Err = ParameterError;
    fn from_str(name: &str) -> Result<Self, ParameterError> {
        match name {
            "fast" => Ok(Preset::Fast),
            "paper" => Ok(Preset::Paper),
            _ => Err(ParameterError::UnknownPreset(name.to_owned())),
        }
    }
}
