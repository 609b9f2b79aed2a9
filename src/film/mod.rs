//! Sums of film samples over all jitters of the view rays.

pub mod error;

use crate::math::Rgb;
use crate::scene::{FilmSamples, Planes, Scene, SceneDescription, SceneResult};
use crate::transport::deposits::PixelSums;
use crate::transport::view::ViewPaths;

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
        let values = description.film_pixels as usize * description.film_channels as usize;
        FilmSums { values: vec![0.0; values] }
    }

    /// Adds another film of the same size.
    pub fn add(&mut self, other: &FilmSums) {
        assert_eq!(self.values.len(), other.values.len());
        self.values.iter_mut().zip(&other.values).for_each(|(mine, theirs)| *mine += theirs);
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
    splat(scene, paths, passes, film, |pixel| {
        let emission = glam::Vec3::from(paths.emission[pixel]).to_array();
        let sums = sums.radiance(pixel);
        let [r, g, b] = [0, 1, 2].map(|channel| {
            let radiance = f64::from(emission[channel]) + sums[channel] / f64::from(passes);
            radiance.clamp(-BRIGHTEST, BRIGHTEST) as f32
        });
        Rgb::new(r, g, b)
    })
}

/// Adds the bias of one jitter to a film of its own, the same for all colours.
pub fn add_bias(
    scene: &dyn Scene,
    paths: &ViewPaths,
    sums: &PixelSums,
    passes: u32,
    film: &mut FilmSums,
) -> SceneResult<()> {
    splat(scene, paths, passes, film, |pixel| {
        Rgb::splat((sums.bias(pixel) / f64::from(passes)) as f32)
    })
}

fn splat(
    scene: &dyn Scene,
    paths: &ViewPaths,
    passes: u32,
    film: &mut FilmSums,
    color: impl Fn(usize) -> Rgb,
) -> SceneResult<()> {
    let count = paths.film.len();
    let mut radiance = Planes::default();
    radiance.resize(count);
    (0..count).for_each(|pixel| radiance.set_rgb(pixel, color(pixel)));
    let axis = |axis: usize| paths.film.iter().map(move |position| position[axis]);
    let samples = FilmSamples {
        position: axis(0).chain(axis(1)).collect(),
        radiance,
        alpha: paths.alpha.clone(),
        weight: vec![passes as f32; count],
    };
    scene.splat(&samples, &mut film.values)
}
