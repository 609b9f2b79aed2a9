//! Ray paths of one jitter and what is built over them; the first radii.

use super::{Counters, Parameters, PhaseSeconds, RenderError};
use crate::density::radius::Radii;
use crate::plan::Plan;
use crate::scene::Scene;
use crate::transport::connect;
use crate::transport::footprint::automatic_radii;
use crate::transport::memory::HoldsReceivers;
use crate::transport::view::{self, ViewPaths};
use std::time::Instant;

/// What ray paths depend on.
pub struct Ground<'a> {
    pub scene: &'a dyn Scene,
    pub seed: u64,
    pub plan: &'a Plan,
    /// Whether layers are kept apart.
    pub layers: bool,
}

/// What makes receivers of ray paths, with the threads that the scene lends.
pub type Prepare<R> = fn(&dyn Scene, ViewPaths) -> R;

impl Ground<'_> {
    /// Ray paths of one jitter and what is built over them. [Collin 2013 §5.1]
    pub fn trace<R: HoldsReceivers>(
        &self,
        jitter: u64,
        prepare: Prepare<R>,
        counters: &mut Counters,
        seconds: &mut PhaseSeconds,
    ) -> Result<R, RenderError> {
        let clock = Instant::now();
        let paths = view::trace(self.scene, self.plan, self.seed, jitter)?;
        seconds.view += clock.elapsed().as_secs_f64();
        self.receivers(paths, Some(jitter), prepare, counters, seconds)
    }

    /// Makes receivers of ray paths; without a jitter they are there for a trial, which has connected them already.
    pub fn receivers<R: HoldsReceivers>(
        &self,
        mut paths: ViewPaths,
        jitter: Option<u64>,
        prepare: Prepare<R>,
        counters: &mut Counters,
        seconds: &mut PhaseSeconds,
    ) -> Result<R, RenderError> {
        let clock = Instant::now();
        if let Some(jitter) = jitter {
            if self.layers {
                paths.keep_layers_apart();
            }
            if self.plan.connections.any() {
                connect::connect(self.scene, self.plan, self.seed, jitter, &mut paths)?;
            }
        }
        counters.add(&paths.counters);
        paths.shrink_for_passes();
        seconds.view += clock.elapsed().as_secs_f64();
        let clock = Instant::now();
        let receivers = prepare(self.scene, paths);
        seconds.trees += clock.elapsed().as_secs_f64();
        Ok(receivers)
    }
}

/// Radii as given, or from the pixel footprint where they are 0.
pub fn first_radii(
    scene: &dyn Scene,
    parameters: &Parameters,
    paths: &ViewPaths,
) -> Result<Radii, RenderError> {
    let automatic = automatic_radii(scene, paths)?;
    let choose = |given: f32, automatic: f32| if given > 0.0 { given } else { automatic };
    Ok(Radii {
        surface: choose(parameters.surface_radius, automatic.surface),
        medium: choose(parameters.medium_radius, automatic.medium),
    })
}
