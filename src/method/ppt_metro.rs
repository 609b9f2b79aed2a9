//! Progressive photon tracing by Metropolis chains: photons are steered to where they are seen.
//! [Collin 2013 §5.2]

use super::run::{Progressive, Run};
use super::{Parameters, RenderError};
use crate::density::radius::KernelDimensions;
use crate::markov::ChainShooter;
use crate::scene::Scene;
use crate::transport::receivers::Receivers;
use crate::transport::target::Particles;

/// Begins a render with method `ppt_metro`.
pub fn begin<'a>(
    scene: &'a dyn Scene,
    parameters: &Parameters,
) -> Result<Box<dyn Progressive + 'a>, RenderError> {
    let mut shooter = ChainShooter::new(parameters.seed, parameters.chains);
    let jitter_every = parameters.jitter_every;
    let run =
        Run::new(scene, parameters, KernelDimensions::POINTS, jitter_every, Receivers::build)?;
    Ok(run.with_pass(move |pass, sums| {
        if pass.is_pilot() {
            return pass.pilot(Particles::Points, sums);
        }
        if pass.receivers_changed {
            shooter.receivers_changed();
        }
        let target = pass.target(Particles::Points);
        let counters = shooter.shoot(&target, pass.number, pass.walks, sums)?;
        pass.report_shooting(shooter.report());
        Ok(counters)
    }))
}
