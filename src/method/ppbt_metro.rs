//! Progressive photon beam tracing by Metropolis chains: photon beams are steered to where they are seen.
//! [Collin 2013 §5.2, §6]

use super::run::Run;
use super::{Observer, Outcome, Parameters, RenderError};
use crate::density::radius::KernelDimensions;
use crate::markov::ChainShooter;
use crate::scene::Scene;
use crate::transport::gather::Particles;
use crate::transport::receivers::Receivers;

/// Renders with method `ppbt_metro`.
pub fn render(
    scene: &dyn Scene,
    parameters: &Parameters,
    observer: &mut dyn Observer,
) -> Result<Outcome, RenderError> {
    let jitter_every = parameters.jitter_every;
    let mut run =
        Run::new(scene, parameters, KernelDimensions::BEAMS, jitter_every, Receivers::build)?;
    let mut shooter = ChainShooter::new(parameters.seed, parameters.policy(), parameters.chains);
    while run.goes_on(observer) {
        if run.jitter_when_due()? {
            shooter.receivers_changed();
        }
        run.pass(|pass, sums| {
            let target = pass.target(Particles::Beams(parameters.photon_beams));
            Ok(shooter.shoot(&target, pass.number, parameters.photons, sums)?)
        })?;
        run.report_shooting(shooter.report());
    }
    run.finish()
}
