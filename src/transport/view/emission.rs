//! Rays that look for emission alone.

use super::tracer::Tracer;
use super::ViewPaths;
use crate::math::uniform::{self, Purpose};
use crate::math::Rgb;
use crate::plan::Plan;
use crate::scene::*;
use crate::transport::counters::Counters;
use rand_pcg::Pcg64Mcg;

/// Emission that rays saw directly, where on the film.
#[derive(Debug, Default)]
pub struct EmissionSamples {
    /// The pixel of each ray, its film position (x, y) and what it saw.
    pub pixels: Vec<u32>,
    pub film: Vec<[f32; 2]>,
    pub radiance: Vec<Rgb>,
    pub counters: Counters,
}

/// Traces rays that look for emission alone through these places on the film, such as have lamps behind them if nothing is in
/// the way.
pub fn trace_aimed(
    scene: &dyn Scene,
    plan: &Plan,
    seed: u64,
    places: u32,
) -> SceneResult<EmissionSamples> {
    let (mut numbers, mut found) = (Vec::new(), Vec::new());
    let lanes = places as usize;
    uniform::fill(
        &mut uniform::stream(seed, Purpose::AimedRays, 0, 0),
        &mut numbers,
        AIM_DIMENSIONS * lanes,
    );
    scene.aim(lanes, &numbers, &mut found)?;
    let SceneDescription { film_size, film_offset, .. } = *scene.description();
    let aimed = (0..lanes).filter_map(|lane| {
        let place = [found[lane], found[lanes + lane]];
        let [x, y] = [0, 1].map(|axis: usize| place[axis] - film_offset[axis] as f32);
        let is_on_film = x >= 0.0 && y >= 0.0 && x < film_size[0] as f32 && y < film_size[1] as f32;
        is_on_film.then(|| (y as u32 * film_size[0] + x as u32, place))
    });
    let (pixels, places): (Vec<u32>, Vec<[f32; 2]>) = aimed.unzip();
    let stream = |purpose, batch| uniform::stream(seed, of_emission(purpose), u64::MAX, batch);
    emission_rays(scene, plan, stream, &pixels, Some(&places))
}

/// Traces rays through these pixels that look for emission alone.
pub fn trace_emission(
    scene: &dyn Scene,
    plan: &Plan,
    seed: u64,
    jitter: u64,
    pixels: &[u32],
) -> SceneResult<EmissionSamples> {
    let stream = |purpose, batch| uniform::stream(seed, of_emission(purpose), jitter, batch);
    emission_rays(scene, plan, stream, pixels, None)
}

/// The purpose of a ray path's stream where it looks for emission alone.
fn of_emission(purpose: Purpose) -> Purpose {
    match purpose {
        Purpose::Aperture => Purpose::EmissionAperture,
        Purpose::ViewTables => Purpose::EmissionTables,
        _ => Purpose::EmissionRays,
    }
}

/// At these places, or anywhere in their pixels.
fn emission_rays(
    scene: &dyn Scene,
    plan: &Plan,
    stream: impl Fn(Purpose, u64) -> Pcg64Mcg + Sync,
    pixels: &[u32],
    places: Option<&[[f32; 2]]>,
) -> SceneResult<EmissionSamples> {
    let traced = scene.batching().run_all(pixels.len() as u64, |batch| {
        let lanes = batch.first as usize..batch.first as usize + batch.lanes;
        let of_batch = |purpose| stream(purpose, batch.number);
        let mut tracer = Tracer::new(scene, plan, pixels[lanes.clone()].to_vec(), of_batch);
        tracer.places = places.map(|places| places[lanes].to_vec());
        let ViewPaths { film, emission, counters, .. } = tracer.trace()?;
        Ok((film, emission, counters))
    })?;
    let mut samples = EmissionSamples { pixels: pixels.to_vec(), ..EmissionSamples::default() };
    for (mut film, mut radiance, counters) in traced {
        samples.film.append(&mut film);
        samples.radiance.append(&mut radiance);
        samples.counters.emission_queries += counters.emission_queries;
        samples.counters.view_table_samples += counters.view_table_samples;
        samples.counters.dropped_view_rays += counters.dropped_view_rays;
    }
    Ok(samples)
}
