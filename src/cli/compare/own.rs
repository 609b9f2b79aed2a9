//! Mitsuba's own integrators, made progressive: small renders with seeds of their own, whose mean is the picture.

use std::time::Instant;
use vpt::host::session::{HostError, LoadedScene, OwnIntegrator};
use vpt::report::picture::Picture;

/// Weighted sum of pictures.
pub struct Mean {
    sum: Vec<f64>,
    weight: f64,
}

impl Mean {
    pub fn new(pixels: usize) -> Self {
        Mean { sum: vec![0.0; 3 * pixels], weight: 0.0 }
    }

    fn add(&mut self, rgb: &[f32], weight: f64) {
        for (sum, &value) in self.sum.iter_mut().zip(rgb) {
            *sum += weight * f64::from(value);
        }
        self.weight += weight;
    }

    /// Sum of the weights.
    pub fn weight(&self) -> f64 {
        self.weight
    }

    pub fn picture(&self, [width, height]: [u32; 2]) -> Picture {
        let mean = |pixel: &[f64]| [0, 1, 2].map(|c| (pixel[c] / self.weight) as f32);
        let pixels = self.sum.chunks_exact(3).map(mean).collect();
        Picture { width: width as usize, height: height as usize, pixels }
    }
}

/// One integrator at work on one scene.
pub struct Stream<'a> {
    pub scene: &'a LoadedScene<'a>,
    pub integrator: OwnIntegrator<'a>,
    pub sensor: usize,
    pub seed: u32,
    /// Renders so far.
    count: u32,
    /// Samples per pixel of the next render.
    spp: u32,
    /// A render that takes less than this [s] is followed by a larger one.
    slice: f64,
}

impl<'a> Stream<'a> {
    /// `slice` are the seconds that one render should take.
    pub fn new(
        scene: &'a LoadedScene<'a>,
        integrator: OwnIntegrator<'a>,
        sensor: usize,
        seed: u32,
        slice: f64,
    ) -> Self {
        Stream { scene, integrator, sensor, seed, count: 0, spp: 1, slice }
    }

    /// Renders once more and adds the picture to the mean.
    pub fn advance(&mut self, mean: &mut Mean) -> Result<(), HostError> {
        let clock = Instant::now();
        // Mitsuba hashes its seeds, so neighbours are independent.
        let seed = self.seed.wrapping_mul(0x9E37_79B9).wrapping_add(self.count);
        let rendered = self.scene.render_with(&self.integrator, self.sensor, seed, self.spp)?;
        mean.add(&rendered.rgb, rendered.spp.into());
        self.count += 1;
        if clock.elapsed().as_secs_f64() < 0.5 * self.slice {
            self.spp = self.spp.saturating_mul(2).min(1 << 16);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_is_weighted_by_samples() {
        let mut mean = Mean::new(1);
        mean.add(&[1.0, 2.0, 3.0], 1.0);
        mean.add(&[4.0, 2.0, 0.0], 3.0);
        assert_eq!(mean.weight(), 4.0);
        assert_eq!(mean.picture([1, 1]).pixels, [[3.25, 2.0, 0.75]]);
    }
}
