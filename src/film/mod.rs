//! Sums of film samples over all jitters of the view rays.

pub mod error;
mod exact;
pub mod layers;
pub mod round;
mod splat;

pub use exact::ExactSums;
pub use splat::{splat, FilmSample};

use crate::math::Rgb;
use crate::scene::{Scene, SceneDescription};
use crate::transport::deposits::PixelSums;
use crate::transport::view::{EmissionSamples, ViewPaths};

/// Radiance beyond this is cut off: films take single precision, and weigh it by passes and filters.
const BRIGHTEST: f64 = 1e28;

/// Weighted sums per pixel and channel, as the scene's film lays them out (its reconstruction
/// filter applied, weights in a channel of their own). Kept in f64: f32 sums stop moving.
#[derive(Debug, Clone, PartialEq)]
pub struct FilmSums {
    pub values: Vec<f64>,
}

impl FilmSums {
    pub fn new(description: &SceneDescription) -> Self {
        FilmSums { values: vec![0.0; value_count(description)] }
    }

    /// Red, green and blue of each pixel: sums over weights, 0 where nothing was added. `channels` are the values per pixel.
    pub fn means(&self, channels: usize) -> Vec<[f32; 3]> {
        let mean = |sums: &[f64]| {
            let weight = sums[channels - 1];
            let scale = if weight != 0.0 { 1.0 / weight } else { 0.0 };
            [0, 1, 2].map(|channel| (sums[channel] * scale) as f32)
        };
        self.values.chunks_exact(channels).map(mean).collect()
    }

    /// Adds the mean of another film, by its own weights, to the mean of this one; `channels` are those of a pixel.
    // [Emission rays]
    pub fn add_mean(&mut self, other: &FilmSums, channels: usize) {
        self.add_scaled(other, channels, |mine, theirs| mine / theirs);
    }

    /// Puts another film's weights in place of its own.
    fn take_weights(&mut self, other: &FilmSums, channels: usize) {
        let pixels =
            self.values.chunks_exact_mut(channels).zip(other.values.chunks_exact(channels));
        pixels.for_each(|(mine, theirs)| mine[channels - 1] = theirs[channels - 1]);
    }

    /// Adds everything but the weights.
    pub fn add_channels(&mut self, other: &FilmSums, channels: usize) {
        self.add_scaled(other, channels, |_, _| 1.0);
    }

    /// Adds all channels but the weights, scaled by a function of both weights, where that is finite.
    fn add_scaled(&mut self, other: &FilmSums, channels: usize, scale: impl Fn(f64, f64) -> f64) {
        assert_eq!(self.values.len(), other.values.len());
        let pixels =
            self.values.chunks_exact_mut(channels).zip(other.values.chunks_exact(channels));
        for (mine, theirs) in pixels {
            let scale = scale(mine[channels - 1], theirs[channels - 1]);
            if scale.is_finite() {
                for (mine, theirs) in mine.iter_mut().zip(theirs).take(channels - 1) {
                    *mine += theirs * scale;
                }
            }
        }
    }
}

/// Of a film's storage.
pub fn value_count(description: &SceneDescription) -> usize {
    description.film_pixels as usize * description.film_channels as usize
}

/// Whether emission that is seen directly goes to the film with what photons and connections bring.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Emission {
    Included,
    LeftOut,
}

/// Adds the ray paths of one jitter to the film, weighted by the passes that shot at them, and their bias to one value for each
/// pixel of the film, the same for all colours.
// [Collin 2013 (7)]
pub fn add_jitter(
    scene: &dyn Scene,
    paths: &ViewPaths,
    emission: Emission,
    sums: &PixelSums,
    passes: u32,
    film: &mut FilmSums,
    bias: Option<&mut [f64]>,
) {
    let has_bias = bias.is_some();
    let sample = |ray: usize| {
        let mut seen = paths.connected.get(ray).copied().unwrap_or(Rgb::ZERO);
        if emission == Emission::Included {
            seen += paths.emission[ray];
        }
        let seen = glam::Vec3::from(seen).to_array();
        let gathered = sums.radiance(ray);
        let radiance = [0, 1, 2].map(|i| f64::from(seen[i]) + gathered[i] / f64::from(passes));
        let bias = if has_bias { (sums.bias(ray) / f64::from(passes)) as f32 } else { 0.0 };
        let radiance = on_film(scene, radiance);
        FilmSample { radiance, alpha: paths.alpha[ray], bias, weight: passes as f32 }
    };
    splat(scene, &paths.film, sample, film, bias);
}

/// Adds the emission that the ray paths of one jitter and further rays saw, all rays of a pixel together as much as one.
// [Emission rays]
pub fn add_emission(
    scene: &dyn Scene,
    paths: &ViewPaths,
    further: &EmissionSamples,
    passes: u32,
    film: &mut FilmSums,
) {
    let mut rays = vec![1.0_f32; paths.film.len()];
    further.pixels.iter().for_each(|&pixel| rays[pixel as usize] += 1.0);
    let sample = |ray: usize| {
        let (radiance, pixel) = match ray.checked_sub(paths.film.len()) {
            None => (paths.emission[ray], ray),
            Some(ray) => (further.radiance[ray], further.pixels[ray] as usize),
        };
        FilmSample {
            radiance: on_film(scene, glam::Vec3::from(radiance).to_array().map(f64::from)),
            weight: passes as f32 / rays[pixel],
            ..FilmSample::default()
        }
    };
    splat(scene, &[&paths.film[..], &further.film].concat(), sample, film, None);
}

/// Red, green and blue of three channels of radiance, as a film can take them. [Shared wavelengths]
fn on_film(scene: &dyn Scene, radiance: [f64; 3]) -> Rgb {
    let rgb = match scene.description().channel_colours {
        None => radiance,
        Some(colours) => {
            let colours = colours.map(|colour| glam::Vec3::from(colour).to_array());
            [0, 1, 2].map(|i| {
                (0..3).map(|channel| radiance[channel] * f64::from(colours[channel][i])).sum()
            })
        }
    };
    let [r, g, b] = rgb.map(|value: f64| value.clamp(-BRIGHTEST, BRIGHTEST) as f32);
    Rgb::new(r, g, b)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn film_is_divided_by_its_weights() {
        let film = FilmSums { values: vec![2.0, 4.0, 6.0, 1.0, 2.0, 9.0, 9.0, 9.0, 0.0, 0.0] };
        assert_eq!(film.means(5), [[1.0, 2.0, 3.0], [0.0; 3]]);
    }
}
