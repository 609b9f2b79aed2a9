//! Emission that is seen directly, with rays of its own and a film of its own: both have other weights than the rest.

use crate::film::{add_emission, FilmSums};
use crate::plan::Plan;
use crate::scene::{Scene, SceneDescription, SceneResult};
use crate::transport::deposits::PixelSums;
use crate::transport::emission_rays::EmissionRays;
use crate::transport::view::{self, EmissionSamples, ViewPaths};

pub struct DirectEmission {
    rays: EmissionRays,
    /// What rays beyond one per pixel saw in the present jitter.
    pub further: EmissionSamples,
    /// Mean brightness of the newest jitter's picture.
    level: f32,
    /// Of the jitters that ended.
    pub film: FilmSums,
}

impl DirectEmission {
    pub fn new(description: &SceneDescription) -> Self {
        DirectEmission {
            rays: EmissionRays::new(description.film_size),
            further: EmissionSamples::default(),
            level: 0.0,
            film: FilmSums::new(description),
        }
    }

    /// Traces further rays for a new jitter where the last ones call for them.
    pub fn trace(
        &mut self,
        scene: &dyn Scene,
        plan: &Plan,
        seed: u64,
        jitter: u64,
    ) -> SceneResult<()> {
        let pixels = self.rays.pixels(self.level);
        self.further = view::trace_emission(scene, plan, seed, jitter, &pixels)?;
        Ok(())
    }

    /// Learns from a jitter that ends, and returns the emission seen in it.
    pub fn end_jitter(
        &mut self,
        scene: &dyn Scene,
        paths: &ViewPaths,
        sums: &PixelSums,
        passes: u32,
    ) -> SceneResult<FilmSums> {
        let mut seen = FilmSums::new(scene.description());
        add_emission(scene, paths, &self.further, passes, &mut seen)?;
        self.film.add(&seen);
        self.rays.note(&paths.emission, &self.further);
        self.level = brightness(paths, sums, passes);
        Ok(seen)
    }
}

/// Mean over pixels and channels.
fn brightness(paths: &ViewPaths, sums: &PixelSums, passes: u32) -> f32 {
    let of_pixel = |pixel: usize| {
        let gathered = sums.radiance(pixel).iter().sum::<f64>() / (3.0 * f64::from(passes));
        let connected = paths.connected.get(pixel).map_or(0.0, |rgb| rgb.mean());
        gathered + f64::from(connected + paths.emission[pixel].mean())
    };
    ((0..sums.len()).map(of_pixel).sum::<f64>() / sums.len().max(1) as f64) as f32
}
