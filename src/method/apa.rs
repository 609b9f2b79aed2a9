//! Baseline: a probabilistic approach. Every pass renders a picture of its own, by photon maps of surfaces
//! and media and the beam radiance estimate; the mean of the pictures is the result.
//! [Knaus 2011] [Jarosz 2008]

use super::run::Run;
use super::{Observer, Outcome, Parameters, RenderError};
use crate::density::radius::KernelDimensions;
use crate::scene::Scene;
use crate::transport::gather::Particles;
use crate::transport::view::ViewPaths;

/// Renders with method `apa`.
pub fn render(
    scene: &dyn Scene,
    parameters: &Parameters,
    observer: &mut dyn Observer,
) -> Result<Outcome, RenderError> {
    let mut run =
        Run::<ViewPaths>::new(scene, parameters, KernelDimensions::POINTS, 1, |paths| paths)?;
    while run.goes_on(observer) {
        run.jitter_when_due()?;
        run.pass(|pass, sums| {
            let (stored, mut counters) = pass.store(Particles::Points)?;
            let map = pass.build_map(stored);
            counters.add(&map.estimate(scene, &pass.pairs(), parameters.photons, sums)?);
            Ok(counters)
        })?;
    }
    run.finish()
}
