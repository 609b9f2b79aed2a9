//! The methods, each one readable loop, and what they share: parameters, progress, statistics.

mod apa;
mod observer;
mod parameters;
mod ppb;
mod ppbt;
mod ppbt_metro;
mod ppt;
mod ppt_metro;
mod run;
mod stats;

pub use crate::transport::counters::Counters;
pub use observer::{Observer, Progress, Silent};
pub use parameters::{Method, ParameterError, Parameters, Shooting};
pub use stats::{PhaseSeconds, Stats};

use crate::film::FilmSums;
use crate::scene::{Scene, SceneError};

/// Why a render did not end with a picture.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    #[error("the scene has no emitter, so every picture of it is black; add a lamp or a sky")]
    NoEmitter,
    #[error("the renderer that holds the scene failed: {0}")]
    Scene(#[from] SceneError),
}

/// A finished (or stopped) render.
#[derive(Debug)]
pub struct Outcome {
    pub film: FilmSums,
    pub stats: Stats,
}

/// Renders a scene with the method that the parameters name.
pub fn render(
    scene: &dyn Scene,
    parameters: &Parameters,
    observer: &mut dyn Observer,
) -> Result<Outcome, RenderError> {
    parameters.validate()?;
    if scene.description().emitter_count == 0 {
        return Err(RenderError::NoEmitter);
    }
    let render = match (parameters.method, parameters.shooting()) {
        (Method::Ppt, Shooting::Uniform) => ppt::render,
        (Method::Ppbt, Shooting::Uniform) => ppbt::render,
        (Method::Ppt | Method::PptMetro, _) => ppt_metro::render,
        (Method::Ppbt | Method::PpbtMetro, _) => ppbt_metro::render,
        (Method::Apa, _) => apa::render,
        (Method::Ppb, _) => ppb::render,
    };
    render(scene, parameters, observer)
}
