//! Baseline: progressive photon beams on the CPU. Every pass stores photon beams in a hierarchy that
//! camera rays query; surfaces are seen by a photon map. [Jarosz 2011]

use super::run::{Progressive, Run};
use super::{Parameters, RenderError};
use crate::density::radius::KernelDimensions;
use crate::scene::Scene;
use crate::transport::target::Particles;
use crate::transport::view::ViewPaths;

/// Begins a render with method `ppb`.
pub fn begin<'a>(
    scene: &'a dyn Scene,
    parameters: &Parameters,
) -> Result<Box<dyn Progressive + 'a>, RenderError> {
    let run: Run<ViewPaths> =
        Run::new(scene, parameters, KernelDimensions::BEAMS, 1, |_, paths| paths)?;
    Ok(run.with_pass(move |pass, sums| {
        let (stored, mut counters) = pass.store(Particles::Beams(pass.parameters.photon_beams))?;
        let map = pass.build_map(stored);
        counters.add(&map.estimate(pass.scene, &pass.pairs(), pass.walks, sums)?);
        Ok(counters)
    }))
}
