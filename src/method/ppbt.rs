//! Progressive photon beam tracing: uniform photon beams into view beams, photons into visible points.
//! [Collin 2013 §6] [Jarosz 2011]

use super::run::Run;
use super::{Observer, Outcome, Parameters, RenderError};
use crate::density::radius::KernelDimensions;
use crate::scene::Scene;
use crate::transport::gather::Particles;
use crate::transport::photons::UniformShooter;
use crate::transport::receivers::Receivers;

/// Renders with method `ppbt`.
pub fn render(
    scene: &dyn Scene,
    parameters: &Parameters,
    observer: &mut dyn Observer,
) -> Result<Outcome, RenderError> {
    let jitter_every = parameters.jitter_every;
    let mut run =
        Run::new(scene, parameters, KernelDimensions::BEAMS, jitter_every, Receivers::build)?;
    let mut shooter = UniformShooter::new(parameters.seed);
    while run.goes_on(observer) {
        run.jitter_when_due()?;
        run.pass(|pass, sums| {
            let target = pass.target(Particles::Beams(parameters.photon_beams));
            Ok(shooter.shoot(&target, pass.number, parameters.photons, sums)?)
        })?;
    }
    run.finish()
}
