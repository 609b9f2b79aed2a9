//! Baseline: a probabilistic approach. Every pass renders a picture of its own, by photon maps of surfaces
//! and media and the beam radiance estimate; the mean of the pictures is the result.
//! [Knaus 2011] [Jarosz 2008]

use super::run::{Progressive, Run};
use super::{Parameters, RenderError};
use crate::density::radius::KernelDimensions;
use crate::scene::Scene;
use crate::transport::target::Particles;
use crate::transport::view::ViewPaths;

/// Begins a render with method `apa`.
pub fn begin<'a>(
    scene: &'a dyn Scene,
    parameters: &Parameters,
) -> Result<Box<dyn Progressive + 'a>, RenderError> {
    let run: Run<ViewPaths> =
        Run::new(scene, parameters, KernelDimensions::POINTS, 1, |_, paths| paths)?;
    Ok(run.with_pass(move |pass, sums| {
        let (stored, mut counters) = pass.store(Particles::Points)?;
        let map = pass.build_map(stored);
        counters.add(&map.estimate(pass.scene, &pass.pairs(), pass.walks, sums)?);
        Ok(counters)
    }))
}
