//! Ray paths: what the camera sees through delta lobes and medium boundaries, kept as view beams and
//! visible points until the next jitter. [Collin 2013 §5.1]

mod emission;
mod paths;
mod records;
mod tracer;

pub use emission::{trace_aimed, trace_emission, EmissionSamples};
pub use paths::{in_order, ViewPaths};
pub use records::{BeamRecord, Lobe, PointRecord, ViewBeam};

use crate::math::uniform;
use crate::plan::Plan;
use crate::scene::*;
use crate::transport::cone::DirectionCone;
use tracer::Tracer;

/// Traces one ray path per pixel, jittered within it, and tells the scene which points to keep.
pub fn trace(scene: &dyn Scene, plan: &Plan, seed: u64, jitter: u64) -> SceneResult<ViewPaths> {
    let [width, height] = scene.description().film_size;
    let pixels = u64::from(width) * u64::from(height);
    let traced = scene.batching().run_all(pixels, |batch| {
        let stream = |purpose| uniform::stream(seed, purpose, jitter, batch.number);
        let first = batch.first as u32;
        let pixels = (first..first + batch.lanes as u32).collect();
        Tracer::new(scene, plan, pixels, stream).trace()
    })?;
    let mut paths = ViewPaths::default();
    for batch in traced {
        paths.append(batch);
    }
    paths.beam_cone = DirectionCone::around(paths.beam_segments.iter().map(|beam| beam.direction));
    paths.counters.view_rays = paths.film.len() as u64;
    paths.counters.view_beams = paths.beams.len() as u64;
    paths.counters.visible_points = paths.points.len() as u64;
    paths.store_points(scene, plan.rules.glossy_chains)?;
    Ok(paths)
}
