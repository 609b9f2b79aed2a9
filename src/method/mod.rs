//! The methods, each one readable pass, and what they share: parameters, progress, statistics.

mod apa;
mod balance;
mod effects;
mod emission;
mod gathered;
mod ground;
mod inspect;
mod observer;
mod parameters;
mod pass;
mod ppb;
mod ppbt;
mod ppbt_metro;
mod ppt;
mod ppt_metro;
mod preset;
mod run;
mod stats;
mod trial;

pub use crate::film::error::ErrorEstimate;
pub use crate::transport::counters::Counters;
pub use effects::{EffectReport, Work};
pub use gathered::Gathered;
pub use inspect::{inspect, Inspection};
pub use observer::{FilmSoFar, Observer, Progress, Silent};
pub use parameters::{Method, ParameterError, Parameters, Shooting};
pub use preset::Preset;
pub use run::Progressive;
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
    /// Weighted sums of [`crate::film::layers::LAYER_CHANNELS`] for each film pixel, divided by the film's own weights; none
    /// where layers were not asked for.
    pub layers: Option<Vec<f64>>,
    /// The estimated standard error of red, green and blue of each film pixel, in the film's unit; none
    /// where no error was to be estimated.
    pub error_image: Option<Vec<[f32; 3]>>,
    pub stats: Stats,
    /// What the film is made of.
    pub gathered: Gathered,
}

/// Renders a scene with the method that the parameters name, until the passes or the time are over or
/// the observer has enough.
pub fn render(
    scene: &dyn Scene,
    parameters: &Parameters,
    observer: &mut dyn Observer,
) -> Result<Outcome, RenderError> {
    let mut render = begin(scene, parameters)?;
    while goes_on(&*render, parameters, observer) {
        render.advance()?;
    }
    render.finish()
}

/// Begins a render that the caller advances pass by pass.
pub fn begin<'a>(
    scene: &'a dyn Scene,
    parameters: &Parameters,
) -> Result<Box<dyn Progressive + 'a>, RenderError> {
    parameters.validate()?;
    if scene.description().emitters.is_empty() {
        return Err(RenderError::NoEmitter);
    }
    let begin = match (parameters.method, parameters.shooting()) {
        (Method::Ppt, Shooting::Uniform) => ppt::begin,
        (Method::Ppbt, Shooting::Uniform) => ppbt::begin,
        (Method::Ppt | Method::PptMetro, _) => ppt_metro::begin,
        (Method::Ppbt | Method::PpbtMetro, _) => ppbt_metro::begin,
        (Method::Apa, _) => apa::begin,
        (Method::Ppb, _) => ppb::begin,
    };
    begin(scene, &parameters.settled(scene.description()))
}

/// A render as its observer sees it.
struct Held<'a>(&'a dyn Progressive);

impl FilmSoFar for Held<'_> {
    fn film(&self) -> Result<FilmSums, RenderError> {
        Ok(self.0.film())
    }
}

/// Tells the observer how far the render is; false where it has ended.
pub fn goes_on(
    render: &dyn Progressive,
    parameters: &Parameters,
    observer: &mut dyn Observer,
) -> bool {
    let progress = render.progress();
    let stopped = observer.progress(&progress, &Held(render)).is_break();
    let seconds = progress.seconds - progress.seconds_before;
    let timed_out = parameters.timeout.is_some_and(|limit| seconds >= limit.as_secs_f64());
    let accurate = parameters.target_error > 0.0
        && progress.error.is_some_and(|error| error.reaches(parameters.target_error));
    let over = timed_out || accurate;
    !stopped && progress.passes_done < parameters.passes && !(progress.passes_done > 0 && over)
}
