//! Progressive photon tracing: uniform photons into view beams and visible points.
//! [Collin 2013 Algorithm 1]

use super::run::{Progressive, Run};
use super::{Parameters, RenderError};
use crate::density::radius::KernelDimensions;
use crate::scene::Scene;
use crate::transport::photons::UniformShooter;
use crate::transport::receivers::Receivers;
use crate::transport::target::Particles;

/// Begins a render with method `ppt`.
pub fn begin<'a>(
    scene: &'a dyn Scene,
    parameters: &Parameters,
) -> Result<Box<dyn Progressive + 'a>, RenderError> {
    let mut shooter = UniformShooter::of(parameters.seed, parameters.guided_emission);
    let jitter_every = parameters.jitter_every;
    let run =
        Run::new(scene, parameters, KernelDimensions::POINTS, jitter_every, Receivers::build)?;
    Ok(run.with_pass(move |pass, sums| {
        let target = pass.target(Particles::Points);
        shooter.learn(&target, pass.lessons)?;
        Ok(shooter.shoot(&target, pass.number, pass.walks, sums)?)
    }))
}
