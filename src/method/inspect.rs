//! What a scene calls for and what that costs, found out by a small render of each kind.

use super::{begin, Parameters, RenderError, Stats};
use crate::effect::Effects;
use crate::scene::Scene;

/// Walks of a probe at most.
const PROBE: u64 = 50_000;

/// A probe as the scene calls for it, and one with all effects forced on.
#[derive(Debug, Clone, PartialEq)]
pub struct Inspection {
    pub called_for: Stats,
    pub forced: Stats,
    /// Walks of a pass over those of a probe.
    pub pass_over_probe: f64,
}

/// Renders the view rays of one jitter and a share of one pass, twice.
pub fn inspect(scene: &dyn Scene, parameters: &Parameters) -> Result<Inspection, RenderError> {
    let parameters = &parameters.settled(scene.description());
    let probe = Parameters {
        photons: if parameters.photons == 0 { PROBE } else { parameters.photons.min(PROBE) },
        estimate_error: false,
        layers: false,
        target_error: 0.0,
        ..parameters.clone()
    };
    let forced = Parameters { effects: Effects::ALL, ..probe.clone() };
    let called_for = one_pass(scene, &probe)?;
    let photons = match parameters.photons {
        0 => {
            let mut render = begin(scene, parameters)?;
            render.learn()?;
            render.parameters().photons
        }
        given => given,
    };
    let pass_over_probe = photons as f64 / probe.photons as f64;
    Ok(Inspection { called_for, forced: one_pass(scene, &forced)?, pass_over_probe })
}

fn one_pass(scene: &dyn Scene, parameters: &Parameters) -> Result<Stats, RenderError> {
    let mut render = begin(scene, parameters)?;
    render.advance()?;
    Ok(render.finish()?.stats)
}
