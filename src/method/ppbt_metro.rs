//! Progressive photon beam tracing by Metropolis chains: photon beams are steered to where they are seen.
//! [Collin 2013 §5.2, §6]

use super::run::{Progressive, Run};
use super::{Parameters, RenderError};
use crate::density::radius::KernelDimensions;
use crate::markov::ChainShooter;
use crate::scene::Scene;
use crate::transport::receivers::Receivers;
use crate::transport::target::Particles;

/// Begins a render with method `ppbt_metro`.
pub fn begin<'a>(
    scene: &'a dyn Scene,
    parameters: &Parameters,
) -> Result<Box<dyn Progressive + 'a>, RenderError> {
    let mut shooter = ChainShooter::new(parameters.seed, parameters.chains);
    let jitter_every = parameters.jitter_every;
    let run = Run::new(scene, parameters, KernelDimensions::BEAMS, jitter_every, Receivers::build)?;
    Ok(run.with_pass(move |pass, sums| {
        if pass.is_pilot() {
            return pass.pilot(Particles::Beams(pass.parameters.photon_beams), sums);
        }
        if pass.receivers_changed {
            shooter.receivers_changed();
        }
        let target = pass.target(Particles::Beams(pass.parameters.photon_beams));
        let counters = shooter.shoot(&target, pass.number, pass.walks, sums)?;
        pass.report_shooting(shooter.report());
        Ok(counters)
    }))
}
