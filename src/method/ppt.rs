//! Progressive photon tracing: uniform photons into view beams and visible points.
//! [Collin 2013 Algorithm 1]

use super::run::Run;
use super::{Observer, Outcome, Parameters, RenderError};
use crate::density::radius::KernelDimensions;
use crate::scene::Scene;
use crate::transport::gather::Particles;
use crate::transport::photons::UniformShooter;
use crate::transport::receivers::Receivers;

/// Renders with method `ppt`.
pub fn render(
    scene: &dyn Scene,
    parameters: &Parameters,
    observer: &mut dyn Observer,
) -> Result<Outcome, RenderError> {
    let jitter_every = parameters.jitter_every;
    let mut run =
        Run::new(scene, parameters, KernelDimensions::POINTS, jitter_every, Receivers::build)?;
    let mut shooter = UniformShooter::new(parameters.seed);
    while run.goes_on(observer) {
        run.jitter_when_due()?;
        run.pass(|pass, sums| {
            let target = pass.target(Particles::Points);
            Ok(shooter.shoot(&target, pass.number, parameters.photons, sums)?)
        })?;
    }
    run.finish()
}
