//! Baseline: progressive photon beams on the CPU. Every pass stores photon beams in a hierarchy that
//! camera rays query; surfaces are seen by a photon map. [Jarosz 2011]

use super::run::Run;
use super::{Observer, Outcome, Parameters, RenderError};
use crate::density::radius::KernelDimensions;
use crate::scene::Scene;
use crate::transport::gather::Particles;
use crate::transport::view::ViewPaths;

/// Renders with method `ppb`.
pub fn render(
    scene: &dyn Scene,
    parameters: &Parameters,
    observer: &mut dyn Observer,
) -> Result<Outcome, RenderError> {
    let mut run =
        Run::<ViewPaths>::new(scene, parameters, KernelDimensions::BEAMS, 1, |paths| paths)?;
    while run.goes_on(observer) {
        run.jitter_when_due()?;
        run.pass(|pass, sums| {
            let (stored, mut counters) = pass.store(Particles::Beams(parameters.photon_beams))?;
            let map = pass.build_map(stored);
            counters.add(&map.estimate(scene, &pass.pairs(), parameters.photons, sums)?);
            Ok(counters)
        })?;
    }
    run.finish()
}
