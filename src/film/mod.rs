//! Sums of film samples over all jitters of the view rays.

use crate::math::Rgb;
use crate::scene::{FilmSamples, Planes, Scene, SceneDescription, SceneResult};
use crate::transport::deposits::PixelSums;
use crate::transport::view::ViewPaths;

/// Weighted sums per pixel and channel, as the scene's film lays them out (its reconstruction
/// filter applied, weights in a channel of their own). Kept in f64: f32 sums stop moving.
#[derive(Debug, Clone, PartialEq)]
pub struct FilmSums {
    pub values: Vec<f64>,
}

impl FilmSums {
    pub fn new(description: &SceneDescription) -> Self {
        let values = description.film_pixels as usize * description.film_channels as usize;
        FilmSums { values: vec![0.0; values] }
    }
}

/// Adds the ray paths of one jitter to the film, weighted by the passes that shot at them.
// [Collin 2013 (7)]
pub fn add_jitter(
    scene: &dyn Scene,
    paths: &ViewPaths,
    sums: &PixelSums,
    passes: u32,
    film: &mut FilmSums,
) -> SceneResult<()> {
    let count = paths.film.len();
    let mut radiance = Planes::default();
    radiance.resize(count);
    for pixel in 0..count {
        let sum = sums.get(pixel).map(|channel| (channel / f64::from(passes)) as f32);
        radiance.set_rgb(pixel, paths.emission[pixel] + Rgb::new(sum[0], sum[1], sum[2]));
    }
    let axis = |axis: usize| paths.film.iter().map(move |position| position[axis]);
    let samples = FilmSamples {
        position: axis(0).chain(axis(1)).collect(),
        radiance,
        alpha: paths.alpha.clone(),
        weight: vec![passes as f32; count],
    };
    scene.splat(&samples, &mut film.values)
}
