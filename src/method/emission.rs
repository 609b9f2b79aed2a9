//! Emission that is seen directly, with rays of its own and a film of its own: both have other weights than the rest.

use crate::film::{add_emission, FilmSums};
use crate::plan::Plan;
use crate::scene::{Scene, SceneDescription, SceneResult};
use crate::transport::deposits::PixelSums;
use crate::transport::emission_rays::EmissionRays;
use crate::transport::view::{self, EmissionSamples, ViewPaths};
use crate::transport::wavelengths;

/// Rays per pixel that look where further rays are worth while, before the first jitter; another one comes with each doubling
/// of the jitters.
const FIRST_LESSONS: u32 = 2;
/// Places on lamps that are looked at before: what is smaller than a pixel would be met late.
const AIMED: u32 = 4096;

pub struct DirectEmission {
    rays: EmissionRays,
    /// Rays per pixel that were thrown away after looking.
    lessons: u32,
    /// What rays beyond one per pixel saw in the present jitter.
    pub further: EmissionSamples,
    /// Mean brightness of the picture.
    pub level: f32,
}

impl DirectEmission {
    pub fn new(description: &SceneDescription) -> Self {
        DirectEmission {
            rays: EmissionRays::new(description.film_size),
            lessons: 0,
            further: EmissionSamples::default(),
            level: 0.0,
        }
    }

    /// Learns how bright the picture is, by a pilot pass at these paths.
    pub fn learn_level(&mut self, paths: &ViewPaths, pilot: &PixelSums) {
        self.level = brightness(paths, pilot);
    }

    /// The share of the pixels where further rays are worth while.
    pub fn share(&self) -> f64 {
        self.rays.marked(self.level).len() as f64 / self.rays.pixel_count().max(1) as f64
    }

    /// So many further rays per pixel of the film are to be traced in a jitter.
    pub fn spend(&mut self, rays_per_pixel: f64) {
        self.rays.budget = rays_per_pixel;
    }

    /// Traces further rays for a new jitter, in the `scene` as its rays see it, where rays that were thrown away saw differences.
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

    /// Traces the rays to learn from that a jitter calls for, in the `scene` before it is tuned, and throws them away. How many there
    /// are, and what they see, depends on the jitter's number alone, so that passes can be shared out: all see by the
    /// wavelengths of the first jitter.
    // [Emission rays]
    pub fn learn(
        &mut self,
        scene: &dyn Scene,
        plan: &Plan,
        seed: u64,
        jitter: u64,
    ) -> SceneResult<()> {
        let due = FIRST_LESSONS + (jitter + 1).ilog2();
        if self.lessons >= due {
            return Ok(());
        }
        let tuned = wavelengths::tuned(scene, seed, 0)?;
        let scene = tuned.as_deref().unwrap_or(scene);
        let mut plan = plan.clone();
        plan.retune(scene.description());
        if self.lessons == 0 {
            self.rays.note(&view::trace_aimed(scene, &plan, seed, AIMED)?);
        }
        let all: Vec<u32> = (0..self.rays.pixel_count() as u32).collect();
        while self.lessons < due {
            // Numbered from the other end than jitters, so that no stream serves twice.
            let number = u64::MAX - u64::from(self.lessons);
            self.rays.note(&view::trace_emission(scene, &plan, seed, number, &all)?);
            self.lessons += 1;
        }
        Ok(())
    }

    /// The emission seen in the present jitter.
    pub fn film(&self, scene: &dyn Scene, paths: &ViewPaths, passes: u32) -> FilmSums {
        let mut seen = FilmSums::new(scene.description());
        add_emission(scene, paths, &self.further, passes, &mut seen);
        seen
    }
}

/// Mean over pixels and channels of what one pass shows.
fn brightness(paths: &ViewPaths, sums: &PixelSums) -> f32 {
    let of_pixel = |pixel: usize| {
        let gathered = sums.radiance(pixel).iter().sum::<f64>() / 3.0;
        let connected = paths.connected.get(pixel).map_or(0.0, |rgb| rgb.mean());
        gathered + f64::from(connected + paths.emission[pixel].mean())
    };
    ((0..sums.len()).map(of_pixel).sum::<f64>() / sums.len().max(1) as f64) as f32
}
