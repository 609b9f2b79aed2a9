//! What a picture is made of, apart: radiance of surfaces, of media and of lamps that are seen directly, and the photons that
//! brought it.

use super::{on_film, splat, value_count, Emission, ExactSums, FilmSample, FilmSums};
use crate::math::Rgb;
use crate::scene::{Scene, SceneDescription};
use crate::transport::deposits::PixelSums;
use crate::transport::photon::Family;
use crate::transport::view::ViewPaths;
use glam::Vec3;

/// The channels of layers, in the order of [`LayerSums::finish`].
pub const LAYER_CHANNELS: [&str; 10] = [
    "surfaces.R",
    "surfaces.G",
    "surfaces.B",
    "media.R",
    "media.G",
    "media.B",
    "emission.R",
    "emission.G",
    "emission.B",
    "samples.Y",
];

/// Films of layers, with the weights of the whole picture's.
#[derive(Debug, Clone, PartialEq)]
pub struct LayerSums {
    pub surfaces: ExactSums,
    pub media: ExactSums,
    /// Zeros where emission has rays and a film of its own.
    pub emission: ExactSums,
    /// Deposits of photons on the view rays of each film pixel, before any filter.
    pub samples: Vec<u64>,
}

impl LayerSums {
    pub fn new(description: &SceneDescription) -> Self {
        let [surfaces, media, emission] =
            [(); 3].map(|()| ExactSums::new(value_count(description)));
        let samples = vec![0; description.film_pixels as usize];
        LayerSums { surfaces, media, emission, samples }
    }

    /// Adds the ray paths of one jitter, as [`super::add_jitter`] does to the whole picture.
    pub fn add_jitter(
        &mut self,
        scene: &dyn Scene,
        paths: &ViewPaths,
        emission: Emission,
        sums: &PixelSums,
        passes: u32,
    ) {
        let add = |film: &mut ExactSums, color: &(dyn Fn(usize) -> Rgb + Sync)| {
            let mut jitter = FilmSums::new(scene.description());
            let sample = |ray| FilmSample {
                radiance: color(ray),
                alpha: paths.alpha[ray],
                weight: passes as f32,
                ..FilmSample::default()
            };
            splat(scene, &paths.film, sample, &mut jitter, None);
            film.add(scene, &jitter);
        };
        let received = |family, pixel| {
            let connected = Vec3::from(paths.connected_of(family, pixel)).to_array();
            let gathered = sums.radiance_of(family, pixel);
            let radiance =
                [0, 1, 2].map(|i| f64::from(connected[i]) + gathered[i] / f64::from(passes));
            on_film(scene, radiance)
        };
        add(&mut self.surfaces, &|pixel| received(Family::Surface, pixel));
        add(&mut self.media, &|pixel| received(Family::Medium, pixel));
        if emission == Emission::Included {
            let seen = |pixel: usize| {
                on_film(scene, Vec3::from(paths.emission[pixel]).to_array().map(f64::from))
            };
            add(&mut self.emission, &seen);
        }
        for ray in 0..sums.len() {
            if let Some(pixel) = film_pixel(scene.description(), ray) {
                self.samples[pixel] += sums.deposits(ray);
            }
        }
    }

    /// Adds those of other jitters.
    pub fn merge(&mut self, other: &LayerSums) {
        self.surfaces.merge(&other.surfaces);
        self.media.merge(&other.media);
        self.emission.merge(&other.emission);
        self.samples.iter_mut().zip(&other.samples).for_each(|(mine, theirs)| *mine += theirs);
    }

    /// Weighted sums of [`LAYER_CHANNELS`] for each pixel of a film of so many passes; of deposits the mean per pass, since a count of many
    /// passes would leave the range of half precision. `film` is the whole picture's, whose weights divide them;
    /// `emission` is the film of emission where it has one of its own; `channels` are those of a film's pixel.
    pub fn finish(
        &self,
        channels: usize,
        film: &FilmSums,
        emission: Option<&FilmSums>,
        passes: u32,
    ) -> Vec<f64> {
        let mut lamps = self.emission.rounded();
        if let Some(emission) = emission {
            lamps.take_weights(film, channels);
            lamps.add_mean(emission, channels);
        }
        let layers = [self.surfaces.rounded(), self.media.rounded(), lamps];
        let mut values = Vec::with_capacity(self.samples.len() * LAYER_CHANNELS.len());
        for (pixel, &samples) in self.samples.iter().enumerate() {
            let first = pixel * channels;
            layers.iter().for_each(|layer| values.extend(&layer.values[first..first + 3]));
            let weight = film.values[first + channels - 1];
            values.push(samples as f64 / f64::from(passes.max(1)) * weight);
        }
        values
    }
}

/// The film pixel in which a view ray starts; none within the border that some filters need.
fn film_pixel(description: &SceneDescription, ray: usize) -> Option<usize> {
    let SceneDescription { film_size, film_pixels, film_width, .. } = *description;
    let rays_width = film_size[0] as usize;
    let width = film_width as usize;
    let height = film_pixels as usize / width.max(1);
    let border = description.film_border().map(|n| n as usize);
    let x = (ray % rays_width).checked_sub(border[0])?;
    let y = (ray / rays_width).checked_sub(border[1])?;
    (x < width && y < height).then_some(y * width + x)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A film of 4 x 3 pixels within a border of one.
    #[test]
    fn rays_of_the_border_belong_to_no_pixel() {
        let description = SceneDescription {
            film_size: [6, 5],
            film_offset: [-1, -1],
            ..SceneDescription::of_film([4, 3], 5)
        };
        let pixels: Vec<_> = (0..30).filter_map(|ray| film_pixel(&description, ray)).collect();
        assert_eq!(pixels, (0..12).collect::<Vec<_>>());
        assert_eq!(film_pixel(&description, 7), Some(0));
        assert_eq!((film_pixel(&description, 6), film_pixel(&description, 11)), (None, None));
    }
}
