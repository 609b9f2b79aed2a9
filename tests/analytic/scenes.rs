//! Building blocks of the scenes, and the comparison of their renders.

use glam::DVec3;
use statistics::t_test::{effort, Estimate};
use vpt::analytic::{
    Camera, Contents, Disclosure, Fog, Lamp, Material, Projection, Shape, World, FILM_CHANNELS,
};
use vpt::film::FilmSums;
use vpt::math::{Aabb, Rgb};
use vpt::method::{self, Parameters, Preset, Silent};
use vpt::scene::{PathLimits, Phase};

/// Index of the only fog in most scenes.
pub const FOG: u32 = 0;
/// Walls of a room that scatter half of the light.
pub const HALF: f32 = 0.5;
/// Independent renders per estimate.
pub const SEEDS: u64 = 32;
pub const GREY: usize = 1;

pub fn sphere(radius: f64) -> Shape {
    Shape::Sphere { center: DVec3::ZERO, radius, inward: false }
}

pub fn matt(reflectance: f32) -> Material {
    Material::Lambertian { reflectance: Rgb::splat(reflectance) }
}

pub fn sky() -> Lamp {
    Lamp::Sky { radiance: Rgb::ONE }
}

pub fn pinhole(half_width_tangent: f64) -> Projection {
    Projection::Perspective { half_width_tangent }
}

pub fn parallel(width: f64) -> Projection {
    Projection::Orthographic { width }
}

/// Nothing but a camera.
pub fn empty(camera: Camera) -> Contents {
    Contents {
        camera,
        surfaces: Vec::new(),
        fogs: Vec::new(),
        lamps: Vec::new(),
        disclosure: Disclosure::Full,
    }
}

/// Fog that scatters all and fills the sphere of a radius around the origin.
pub fn ball_of_fog(radius: f64, sigma_t: Rgb, phase: Phase) -> Fog {
    let bounds = Aabb { min: DVec3::splat(-radius).as_vec3(), max: DVec3::splat(radius).as_vec3() };
    Fog { bounds, ..Fog::uniform(sigma_t, Rgb::ONE, phase) }
}

/// One pass of photons, all depths.
pub fn one_pass(photons: u64, radius: f32) -> Parameters {
    Parameters {
        passes: 1,
        photons,
        surface_radius: radius,
        medium_radius: radius,
        ..Preset::Paper.parameters()
    }
}

pub fn up_to_depth(parameters: Parameters, max_depth: u32) -> Parameters {
    let limits = PathLimits { max_depth, ..parameters.limits };
    Parameters { limits, ..parameters }
}

fn render(world: &World, parameters: &Parameters) -> FilmSums {
    method::render(world, parameters, &mut Silent).expect("the render ends with a picture").film
}

/// Mean of a channel over the pixels to keep.
fn pixel_mean(film: &FilmSums, channel: usize, keep: impl Fn(usize) -> bool) -> f64 {
    let pixels = film.values.chunks_exact(FILM_CHANNELS).enumerate();
    let (value, weight) = pixels
        .filter(|(index, _)| keep(*index))
        .fold((0.0, 0.0), |sum, (_, p)| (sum.0 + p[channel], sum.1 + p[FILM_CHANNELS - 1]));
    value / weight
}

/// Means of independent renders over the pixels to keep, by channel.
pub fn pixel_means(
    world: &World,
    parameters: &Parameters,
    seeds: u64,
    keep: impl Fn(usize) -> bool,
) -> [Vec<f64>; 3] {
    let mut means = [const { Vec::new() }; 3];
    for seed in 0..seeds {
        let film = render(world, &Parameters { seed, ..parameters.clone() });
        for (channel, values) in means.iter_mut().enumerate() {
            values.push(pixel_mean(&film, channel, &keep));
        }
    }
    means
}

/// Means of independent renders over the film, by channel.
pub fn film_means(world: &World, parameters: &Parameters, seeds: u64) -> [Vec<f64>; 3] {
    pixel_means(world, parameters, seeds, |_| true)
}

/// Compares the film's mean with one value per channel.
#[track_caller]
pub fn assert_film(
    name: &str,
    contents: Contents,
    parameters: &Parameters,
    expected: [f64; 3],
    bias: f64,
) {
    let means = film_means(&World::new(contents), parameters, SEEDS * effort());
    for (channel, values) in means.iter().enumerate() {
        let name = format!("{name}, channel {channel}");
        Estimate::of(values).assert_equals(&name, expected[channel], bias);
    }
}

/// As [`assert_film`], with the relative fault that has to be noticed.
#[track_caller]
pub fn assert_film_noticing(
    detectable: f64,
    name: &str,
    contents: Contents,
    parameters: &Parameters,
    expected: [f64; 3],
    bias: f64,
) {
    let means = film_means(&World::new(contents), parameters, SEEDS);
    for (channel, values) in means.iter().enumerate() {
        let name = format!("{name}, channel {channel}");
        Estimate::of(values).assert_noticing(detectable, &name, expected[channel], bias);
    }
}

/// Checks that it makes no difference whether the engine evaluates scattering functions and extinctions
/// by itself or asks the scene for each value.
#[track_caller]
pub fn assert_same_on_request(name: &str, contents: Contents, parameters: &Parameters) {
    let told = film_means(&World::new(contents.clone()), parameters, 1);
    let asking = World::new(Contents { disclosure: Disclosure::OnRequest, ..contents });
    let asked = film_means(&asking, parameters, 1);
    for (told, asked) in told.iter().flatten().zip(asked.iter().flatten()) {
        assert!((asked - told).abs() <= 1e-5 * told, "{name}: {asked} when asking for {told}");
    }
}
