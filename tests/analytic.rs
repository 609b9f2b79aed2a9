//! Renders of scenes whose radiance can be worked out on paper, judged by statistics.
//!
//! Every test states its derivation. Lengths, radiances and fluxes are in units of the scene; `N`
//! is the number of emitted walks. Where a kernel of finite width blurs the answer, either the
//! answer is flat, or the blur is part of the expected value, or its size is bounded and given to
//! the comparison as `bias`.
//!
//! By default a fault of 1 % is noticed. `VPT_TEST_EFFORT=100` renders a hundred times as much and
//! notices a tenth of that.

#[path = "support/quadrature.rs"]
mod quadrature;
#[path = "support/statistics.rs"]
mod statistics;

use glam::DVec3;
use quadrature::{disk_mean, integrate, square_mean};
use statistics::{assert_variance, effort, slope, variance, Estimate};
use statrs::function::gamma::ln_gamma;
use std::f64::consts::PI;
use vpt::analytic::{
    Camera, Contents, Disclosure, Fog, Lamp, Material, Profile, Projection, Shape, Surface, World,
    FILM_CHANNELS,
};
use vpt::density::radius::{Radii, RadiusSequence, Schedule};
use vpt::film::FilmSums;
use vpt::math::{Aabb, Rgb};
use vpt::method::{self, Parameters, Silent};
use vpt::scene::{PathLimits, Phase, VACUUM};

/// Index of the only fog in most scenes.
const FOG: u32 = 0;
/// Walls of a room that scatter half of the light.
const HALF: f32 = 0.5;
/// Independent renders per estimate.
const SEEDS: u64 = 32;
const GREY: usize = 1;

// ---- Building blocks -----------------------------------------------------------------------------

fn sphere(radius: f64) -> Shape {
    Shape::Sphere { center: DVec3::ZERO, radius, inward: false }
}

fn matt(reflectance: f32) -> Material {
    Material::Lambertian { reflectance: Rgb::splat(reflectance) }
}

fn sky() -> Lamp {
    Lamp::Sky { radiance: Rgb::ONE }
}

fn pinhole(half_width_tangent: f64) -> Projection {
    Projection::Perspective { half_width_tangent }
}

fn parallel(width: f64) -> Projection {
    Projection::Orthographic { width }
}

/// Nothing but a camera.
fn empty(camera: Camera) -> Contents {
    Contents {
        camera,
        surfaces: Vec::new(),
        fogs: Vec::new(),
        lamps: Vec::new(),
        disclosure: Disclosure::Full,
    }
}

/// Fog that scatters all and fills the sphere of a radius around the origin.
fn ball_of_fog(radius: f64, sigma_t: Rgb, phase: Phase) -> Fog {
    let bounds = Aabb { min: DVec3::splat(-radius).as_vec3(), max: DVec3::splat(radius).as_vec3() };
    Fog { bounds, ..Fog::uniform(sigma_t, Rgb::ONE, phase) }
}

/// One pass of photons, all depths.
fn one_pass(photons: u64, radius: f32) -> Parameters {
    Parameters {
        passes: 1,
        photons,
        surface_radius: radius,
        medium_radius: radius,
        ..Parameters::default()
    }
}

fn up_to_depth(parameters: Parameters, max_depth: u32) -> Parameters {
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
fn pixel_means(
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
fn film_means(world: &World, parameters: &Parameters, seeds: u64) -> [Vec<f64>; 3] {
    pixel_means(world, parameters, seeds, |_| true)
}

/// Compares the film's mean with one value per channel.
#[track_caller]
fn assert_film(
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

/// Checks that it makes no difference whether the engine evaluates scattering functions and extinctions
/// by itself or asks the scene for each value.
#[track_caller]
fn assert_same_on_request(name: &str, contents: Contents, parameters: &Parameters) {
    let told = film_means(&World::new(contents.clone()), parameters, 1);
    let asking = World::new(Contents { disclosure: Disclosure::OnRequest, ..contents });
    let asked = film_means(&asking, parameters, 1);
    for (told, asked) in told.iter().flatten().zip(asked.iter().flatten()) {
        assert!((asked - told).abs() <= 1e-5 * told, "{name}: {asked} when asking for {told}");
    }
}

// ---- White furnaces ------------------------------------------------------------------------------
//
// Where nothing absorbs and light of radiance 1 comes from all directions, radiance is 1 everywhere
// and in every direction: scattering takes out of a ray what it puts in. A sky of radiance 1 is
// such a bath, whatever white things float in it. The photons must carry all that the fog scatters.
//
// The fluence is flat, so the kernel blurs nothing but the boundary of the fog. The estimate along a
// beam is the mean over the kernel's disk of what a shifted beam of the same length would see in the
// fog, int sigma_s exp(-sigma_t t) dt with t counted along the true beam.

/// `1 - exp(-tau)`: radiance that white fog adds between two distances from the eye.
fn added(sigma_t: f64, near: f64, far: f64) -> f64 {
    (-sigma_t * near).exp() - (-sigma_t * far).exp()
}

/// Half of the length of the chord of a sphere at an offset (x, y) from its center.
fn half_chord(radius: f64, x: f64, y: f64) -> f64 {
    (radius * radius - x * x - y * y).sqrt()
}

/// Half of the width of a square of parallel rays that start in the equatorial plane of a ball.
const WINDOW: f64 = 0.6;

/// What these rays see in a ball of white fog of radius 1 in front of a `wall`, in surroundings of
/// radiance 1. `tau` gives the optical depth at a distance. At an offset from a ray the fog may end
/// earlier than the ray.
fn seen_inside_the_ball(tau: impl Fn(f64) -> f64, wall: f64, radius: f32) -> f64 {
    square_mean(0.0, 0.0, WINDOW, |x, y| {
        let length = half_chord(1.0, x, y);
        let fog = disk_mean(f64::from(radius), |dx, dy| {
            1.0 - (-tau(length.min(half_chord(1.0, x + dx, y + dy)))).exp()
        });
        wall * (-tau(length)).exp() + fog
    })
}

/// What a beam of parallel rays through a ball of white fog of radius 1 sees against a sky of radiance
/// 1, at an offset of the beam's axis from the center. The beam is there for its own chord; at an
/// offset from its axis the fog may begin later and end earlier.
fn seen_through_the_ball(sigma_t: f64, radius: f32, x: f64, y: f64) -> f64 {
    let chord = half_chord(1.0, x, y);
    let fog = disk_mean(f64::from(radius), |dx, dy| {
        let missing = (chord - half_chord(1.0, x + dx, y + dy)).max(0.0);
        added(sigma_t, missing, 2.0 * chord - missing)
    });
    (-2.0 * sigma_t * chord).exp() + fog
}

/// Share of uniform light that a visible point on a white sphere shows. Photons within R (straight
/// distance) lie on a cap of area pi R² exactly, whatever its curvature, uniformly over the distance
/// squared. At a distance c the surface is tilted by delta, 1 - cos(delta) = c²/(2 r²), and of its light
/// the part from below the point's own horizon, where the BSDF is zero, is lost: (1 - cos(delta)) / 2.
/// The mean over the cap is R²/(8 r²).
fn seen_on_a_sphere(sphere_radius: f64, radius: f32) -> f64 {
    1.0 - (f64::from(radius) / sphere_radius).powi(2) / 8.0
}

/// A ball of white fog with the eye inside.
fn fog_furnace(sigma_t: Rgb, phase: Phase) -> Contents {
    let boundary = Surface::new(sphere(1.0), Material::Null).between(VACUUM, FOG);
    Contents {
        surfaces: vec![boundary],
        fogs: vec![ball_of_fog(1.0, sigma_t, phase)],
        lamps: vec![sky()],
        ..empty(eye_inside().inside(FOG))
    }
}

/// Parallel rays downward from the equatorial plane.
fn eye_inside() -> Camera {
    Camera::new(DVec3::ZERO, -DVec3::Z, [8, 8], parallel(2.0 * WINDOW))
}

#[test]
fn white_furnace_of_fog() {
    let scene = fog_furnace(Rgb::ONE, Phase::Isotropic);
    let expected = [seen_inside_the_ball(|t| t, 1.0, 0.1); 3];
    assert_film("isotropic fog", scene, &one_pass(40_000, 0.1), expected, 0.0);
}

#[test]
fn white_furnace_of_forward_scattering_fog() {
    let scene = fog_furnace(Rgb::ONE, Phase::HenyeyGreenstein { g: 0.6 });
    let expected = [seen_inside_the_ball(|t| t, 1.0, 0.1); 3];
    assert_film("forward fog", scene, &one_pass(100_000, 0.1), expected, 0.0);
}

#[test]
fn white_furnace_of_coloured_fog() {
    let scene = fog_furnace(Rgb::new(0.5, 1.0, 2.0), Phase::Isotropic);
    let expected = [0.5, 1.0, 2.0].map(|sigma_t| seen_inside_the_ball(|t| sigma_t * t, 1.0, 0.1));
    assert_film("coloured fog", scene, &one_pass(140_000, 0.1), expected, 0.0);
}

#[test]
fn white_furnace_seen_from_outside() {
    // Parallel rays cross vacuum, fog and vacuum.
    let camera = Camera::new(DVec3::new(0.0, 0.0, -3.0), DVec3::Z, [8, 8], parallel(0.8));
    let scene = Contents { camera, ..fog_furnace(Rgb::ONE, Phase::Isotropic) };
    let expected = square_mean(0.0, 0.0, 0.4, |x, y| seen_through_the_ball(1.0, 0.1, x, y));
    assert_film("fog from outside", scene, &one_pass(100_000, 0.1), [expected; 3], 0.0);
}

#[test]
fn white_furnace_with_a_matt_sphere_in_the_fog() {
    // A visible point and the beam before it. The beam ends where it meets the sphere, and beside it
    // the fog may end earlier.
    let matt_sphere = Surface::new(sphere(0.8), matt(1.0)).between(FOG, VACUUM);
    let boundary = Surface::new(sphere(1.2), Material::Null).between(VACUUM, FOG);
    let camera = Camera::new(DVec3::new(0.0, 0.0, -1.0), DVec3::Z, [8, 8], parallel(0.9));
    let scene = Contents {
        surfaces: vec![matt_sphere, boundary],
        fogs: vec![ball_of_fog(1.2, Rgb::ONE, Phase::Isotropic)],
        lamps: vec![sky()],
        ..empty(camera.inside(FOG))
    };
    let radius = 0.4;
    let expected = square_mean(0.0, 0.0, 0.45, |x, y| {
        let length = 1.0 - half_chord(0.8, x, y);
        let fog = disk_mean(0.1, |dx, dy| {
            added(1.0, 0.0, length.min(1.0 - half_chord(0.8, x + dx, y + dy)))
        });
        (-length).exp() * seen_on_a_sphere(0.8, radius) + fog
    });
    let parameters = Parameters { surface_radius: radius, ..one_pass(270_000, 0.1) };
    assert_film("matt sphere", scene, &parameters, [expected; 3], 0.0);
}

#[test]
fn white_furnace_of_glass_filled_with_fog() {
    // In glass radiance is n² times that outside; the eye, which weights rays that leave glass by
    // 1/n², sees 1. Wrong factors of n² on photons or view rays show as factors of 2.25.
    // A ray that comes in at an offset b runs at b/n from the center. What the kernel misses there is
    // dimmed by the share of light that enters, 0.96 at normal incidence; rays that are reflected
    // within miss it again, but that is 0.04 exp(-2) of it. Both shares are right within 0.3 % of what
    // is missing, for b up to 0.28.
    let glass = Surface::new(sphere(1.0), Material::Dielectric { index: 1.5 }).between(VACUUM, FOG);
    let camera = Camera::new(DVec3::new(0.0, 0.0, -3.0), DVec3::Z, [8, 8], parallel(0.4));
    let scene = Contents {
        surfaces: vec![glass],
        fogs: vec![ball_of_fog(1.0, Rgb::ONE, Phase::Isotropic)],
        lamps: vec![sky()],
        ..empty(camera)
    };
    let missing =
        square_mean(0.0, 0.0, 0.2, |x, y| 1.0 - seen_through_the_ball(1.0, 0.1, x / 1.5, y / 1.5));
    let expected = 1.0 - 0.96 * (1.0 + 0.04 * (-2.0f64).exp()) * missing;
    assert_film("glass", scene, &one_pass(160_000, 0.1), [expected; 3], 0.0);
}

// ---- Rooms with luminous walls --------------------------------------------------------------------
//
// In a closed room whose walls all emit L_e and reflect rho, radiance is the same everywhere:
// L = L_e + rho L = L_e (1 + rho + rho² + ...) = L_e / (1 - rho). White fog does not change it. The
// estimate takes the photons' light, rho L, with the kernel's error on a sphere.

/// A sphere of radius 1 with luminous walls around the eye, filled with fog if there is one.
fn room(reflectance: f32, fog: Option<Fog>) -> Contents {
    let inside = if fog.is_some() { FOG } else { VACUUM };
    let walls = Shape::Sphere { center: DVec3::ZERO, radius: 1.0, inward: true };
    let surface = Surface::new(walls, matt(reflectance)).emitting(Rgb::ONE);
    let camera = match inside {
        VACUUM => Camera::new(DVec3::ZERO, DVec3::X, [8, 8], pinhole(2.0)),
        _ => eye_inside().inside(inside),
    };
    Contents {
        surfaces: vec![surface.between(inside, VACUUM)],
        fogs: fog.into_iter().collect(),
        ..empty(camera)
    }
}

#[test]
fn room_of_luminous_black_walls() {
    assert_film("black room", room(0.0, None), &one_pass(1000, 0.1), [1.0; 3], 0.0);
}

#[test]
fn room_of_luminous_grey_walls() {
    let expected = [1.0 + seen_on_a_sphere(1.0, 0.1); 3];
    assert_film("grey room", room(HALF, None), &one_pass(30_000, 0.1), expected, 0.0);
}

#[test]
fn room_of_luminous_black_walls_with_fog() {
    let fog = ball_of_fog(1.0, Rgb::ONE, Phase::Isotropic);
    let expected = [seen_inside_the_ball(|t| t, 1.0, 0.1); 3];
    let scene = room(0.0, Some(fog));
    assert_film("black room with fog", scene, &one_pass(40_000, 0.1), expected, 0.0);
}

#[test]
fn room_of_luminous_grey_walls_with_fog() {
    let fog = ball_of_fog(1.0, Rgb::ONE, Phase::HenyeyGreenstein { g: 0.3 });
    // Twice the furnace of radiance 1: of its wall, half is its own light and half is the photons'.
    let wall = 0.5 + 0.5 * seen_on_a_sphere(1.0, 0.1);
    let expected = [2.0 * seen_inside_the_ball(|t| t, wall, 0.1); 3];
    let scene = room(HALF, Some(fog));
    assert_film("grey room with fog", scene, &one_pass(50_000, 0.1), expected, 0.0);
}

#[test]
fn room_cut_at_every_depth() {
    // A path with k reflections is kept while k < max_depth: L = L_e (1 + rho + ... ), max_depth terms.
    for (max_depth, reflected) in [(1, 0.0), (2, 0.5), (3, 0.75), (4, 0.875)] {
        let parameters = up_to_depth(one_pass(30_000, 0.1), max_depth);
        let expected = 1.0 + reflected * seen_on_a_sphere(1.0, 0.1);
        let name = format!("room, max_depth {max_depth}");
        assert_film(&name, room(HALF, None), &parameters, [expected; 3], 0.0);
    }
    let black = film_means(&World::new(room(HALF, None)), &up_to_depth(one_pass(1000, 0.1), 0), 2);
    assert_eq!(black[GREY], [0.0, 0.0], "no path is kept with max_depth 0");
}

#[test]
fn events_on_the_way_to_the_eye_count_as_depth() {
    // The eye sits in a ball of radius 0.05 whose surface has index 1: it changes nothing, but counts as
    // a scattering event. With max_depth 3 a path has at most two: the ball and one reflection. Light
    // that crosses the ball before it is reflected is cut, too. Seen from the wall, the ball covers
    // sin² = 0.05² of the light.
    let mut scene = room(HALF, None);
    scene.surfaces.push(Surface::new(sphere(0.05), Material::Dielectric { index: 1.0 }));
    let expected = 1.0 + 0.5 * seen_on_a_sphere(1.0, 0.1) * (1.0 - 0.0025);
    let parameters = up_to_depth(one_pass(30_000, 0.1), 3);
    assert_film("eye in a ball", scene, &parameters, [expected; 3], 0.0);
}

#[test]
fn russian_roulette_does_not_change_the_mean() {
    for rr_depth in [1, 20] {
        let base = one_pass(30_000, 0.1);
        let expected = [1.0 + seen_on_a_sphere(1.0, 0.1); 3];
        let limits = PathLimits { rr_depth, ..base.limits };
        let name = format!("room, rr_depth {rr_depth}");
        assert_film(&name, room(HALF, None), &Parameters { limits, ..base }, expected, 0.0);
    }
}

// ---- Single scattering ----------------------------------------------------------------------------
//
// A lamp of intensity I at the origin of infinite fog. Its unscattered light at x, |x| = r, has
// fluence I exp(-sigma_t r) / r². With one scattering event the eye, looking along +z from z = -1 at
// an offset (x, y) from the lamp, sees
//     L(x, y) = int_0 exp(-sigma_t t) sigma_s p(cos) I exp(-sigma_t r) / r² dt,
// where the cosine is that between the photon's travel, x/r, and the way to the eye, -z. What lies
// behind z = 8 adds less than 1e-5 of it.
// A kernel of radius R averages the fluence over the disk, not the transmittance to the eye, which
// belongs to the distance along the beam: exactly the mean of L over the disk. A pixel averages over
// its square. The pixels around the lamp, where L has a pole, are left out.

/// Distance of the eye before the lamp, and where the integral along the ray ends.
const EYE: f64 = 1.0;
const FAR: f64 = 8.0;
/// Pixels across the film and across the hole in its middle, and half of a pixel's width.
const FILM: u32 = 32;
const HOLE: u32 = 12;
const HALF_PIXEL: f64 = 0.03;
const LAMP_KERNEL: f32 = 0.15;

/// Radiance of single scattering along a ray at a distance from the lamp, per unit of intensity.
fn single_scattering(sigma_t: f64, albedo: f64, g: f64, b: f64) -> f64 {
    // z = b sinh(u) spreads the peak near the lamp; r = b cosh(u).
    integrate((-EYE / b).asinh(), (FAR / b).asinh(), 4, |u| {
        let (z, r) = (b * u.sinh(), b * u.cosh());
        let cosine = -z / r;
        let phase = (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cosine).powf(1.5));
        albedo * sigma_t * phase * (-sigma_t * (EYE + z + r)).exp() / (r * r) * r
    })
}

/// Whether a pixel counts, by its column and row.
fn outside_the_hole(x: u32, y: u32) -> bool {
    let hole = (FILM - HOLE) / 2..(FILM + HOLE) / 2;
    !(hole.contains(&x) && hole.contains(&y))
}

/// The mean over the kernel's disk and the pixels outside the hole.
fn seen_single_scattering(sigma_t: f32, albedo: f32, g: f64) -> f64 {
    let (sigma_t, albedo) = (f64::from(sigma_t), f64::from(albedo));
    // b L(b) is smooth: a table with linear interpolation is right to 1e-6.
    let step = 1e-3;
    let table: Vec<f64> = (1..2500)
        .map(|i| step * f64::from(i))
        .map(|b| b * single_scattering(sigma_t, albedo, g, b))
        .collect();
    let radiance = |x: f64, y: f64| {
        let b = x.hypot(y);
        let (index, part) = ((b / step) as usize - 1, (b / step).fract());
        (table[index] * (1.0 - part) + table[index + 1] * part) / b
    };
    // One quadrant stands for all.
    let (mut sum, mut pixels) = (0.0, 0.0);
    for (x, y) in (FILM / 2..FILM).flat_map(|x| (FILM / 2..FILM).map(move |y| (x, y))) {
        if outside_the_hole(x, y) {
            let center = [x, y].map(|i| (2.0 * f64::from(i - FILM / 2) + 1.0) * HALF_PIXEL);
            sum += disk_mean(f64::from(LAMP_KERNEL), |dx, dy| {
                square_mean(center[0] + dx, center[1] + dy, HALF_PIXEL, radiance)
            });
            pixels += 1.0;
        }
    }
    sum / pixels
}

/// A lamp in infinite fog.
fn lamp_in_fog(sigma_t: Rgb, albedo: Rgb, phase: Phase) -> Contents {
    let width = 2.0 * HALF_PIXEL * f64::from(FILM);
    let camera = Camera::new(-EYE * DVec3::Z, DVec3::Z, [FILM, FILM], parallel(width));
    Contents {
        fogs: vec![Fog::uniform(sigma_t, albedo, phase)],
        lamps: vec![Lamp::Point { position: DVec3::ZERO, intensity: Rgb::ONE, medium: FOG }],
        ..empty(camera.inside(FOG))
    }
}

#[track_caller]
fn assert_single_scattering(name: &str, phase: Phase, g: f64) {
    let (sigma_t, albedo) = (Rgb::new(0.5, 1.0, 1.5), Rgb::new(0.9, 0.5, 0.7));
    let expected = [
        seen_single_scattering(sigma_t.r, albedo.r, g),
        seen_single_scattering(sigma_t.g, albedo.g, g),
        seen_single_scattering(sigma_t.b, albedo.b, g),
    ];
    let world = World::new(lamp_in_fog(sigma_t, albedo, phase));
    let parameters = up_to_depth(one_pass(90_000, LAMP_KERNEL), 2);
    let means = pixel_means(&world, &parameters, SEEDS * effort(), |index| {
        outside_the_hole(index as u32 % FILM, index as u32 / FILM)
    });
    for (channel, values) in means.iter().enumerate() {
        let name = format!("{name}, channel {channel}");
        Estimate::of(values).assert_equals(&name, expected[channel], 0.0);
    }
}

#[test]
fn single_scattering_in_isotropic_fog() {
    assert_single_scattering("isotropic", Phase::Isotropic, 0.0);
}

#[test]
fn single_scattering_in_forward_fog() {
    assert_single_scattering("forward", Phase::HenyeyGreenstein { g: 0.2 }, 0.2);
}

#[test]
fn single_scattering_in_backward_fog() {
    assert_single_scattering("backward", Phase::HenyeyGreenstein { g: -0.4 }, -0.4);
}

#[test]
fn scattering_in_fog_is_the_same_on_request() {
    // Fog that varies, for all that the engine knows, needs an end.
    let phase = Phase::HenyeyGreenstein { g: -0.4 };
    let mut scene = lamp_in_fog(Rgb::new(0.5, 1.0, 1.5), Rgb::ONE, phase);
    scene.fogs[0].bounds = ball_of_fog(FAR, Rgb::ONE, phase).bounds;
    scene.surfaces = vec![Surface::new(sphere(FAR), Material::Null).between(VACUUM, FOG)];
    assert_same_on_request("fog", scene, &one_pass(50_000, LAMP_KERNEL));
}

// ---- Transmittance --------------------------------------------------------------------------------
//
// A luminous black wall at z = 1 behind black fog (albedo 0) is seen along a straight line only:
// L = L_e exp(-tau). Nothing is random but the place in the pixel, on which parallel rays' optical
// depth does not depend.

/// A wall of radiance 1 seen through fog between z = 0 and z = 1, by rays that are tilted by an angle
/// with cosine 0.8.
fn wall_behind_fog(fog: Fog) -> Contents {
    let (u, v) = (10.0 * DVec3::X, 10.0 * DVec3::Y);
    let wall = Shape::Rectangle { center: 1.5 * DVec3::Z, half_u: u, half_v: -v };
    let face = |z: f64| Shape::Rectangle { center: z * DVec3::Z, half_u: u, half_v: v };
    let forward = DVec3::new(0.6, 0.0, 0.8);
    let camera = Camera::new(-2.0 * forward, forward, [2, 2], parallel(0.1));
    Contents {
        surfaces: vec![
            Surface::new(wall, matt(0.0)).emitting(Rgb::ONE),
            Surface::new(face(1.0), Material::Null).between(VACUUM, FOG),
            Surface::new(face(0.0), Material::Null).between(FOG, VACUUM),
        ],
        fogs: vec![fog],
        ..empty(camera)
    }
}

const BLACK_FOG: Rgb = Rgb::new(0.2, 1.0, 3.0);

#[test]
fn transmittance_of_uniform_fog() {
    // tau = sigma_t / 0.8.
    let expected = [0.2, 1.0, 3.0].map(|sigma_t: f64| (-sigma_t / 0.8).exp());
    let fog = Fog::uniform(BLACK_FOG, Rgb::ZERO, Phase::Isotropic);
    assert_film("uniform slab", wall_behind_fog(fog), &one_pass(10, 0.1), expected, 0.0);
}

#[test]
fn transmittance_of_an_atmosphere() {
    // sigma_t(z) = sigma_t(0) exp(-z/h): tau = sigma_t(0) h (1 - exp(-1/h)) / 0.8.
    // The engine tabulates it: steps of h/16 or shorter along the ray, and linear interpolation,
    // keep tau within (1/16)²/8 = 0.05 %, and 3.0 * 0.31 * 0.05 % is the bias of the densest channel.
    let scale_height: f64 = 0.25;
    let column = scale_height * (1.0 - (-1.0 / scale_height).exp()) / 0.8;
    let expected = [0.2, 1.0, 3.0].map(|sigma_t: f64| (-sigma_t * column).exp());
    let fog = Fog {
        profile: Profile::Exponential { scale_height },
        ..Fog::uniform(BLACK_FOG, Rgb::ZERO, Phase::Isotropic)
    };
    assert_film("atmosphere", wall_behind_fog(fog), &one_pass(10, 0.1), expected, 0.0005);
}

#[test]
fn white_furnace_of_an_atmosphere() {
    // Photons' free flights use the exact optical depth, view beams the engine's table: together they
    // must give 1. Looking down from z = 0, tau(t) = sigma_t(0) (exp(t) - 1), for all beams side by
    // side, with scale height 1.
    let mut scene = fog_furnace(Rgb::new(0.5, 1.0, 1.5), Phase::Isotropic);
    scene.fogs[0].profile = Profile::Exponential { scale_height: 1.0 };
    let tau = |sigma_t: f64| move |t: f64| sigma_t * t.exp_m1();
    let expected = [0.5, 1.0, 1.5].map(|sigma_t| seen_inside_the_ball(tau(sigma_t), 1.0, 0.1));
    assert_film("atmosphere", scene, &one_pass(100_000, 0.1), expected, 0.0005);
}

// ---- Surfaces -------------------------------------------------------------------------------------
//
// A point lamp of intensity I at height h over a matt floor. At a distance x from its foot
//     E = I cos / r² = I h / (h² + x²)^(3/2),      L = rho E / pi.
// The mean over a disk around the foot has a closed form,
//     (1 / pi R²) int_0^R 2 pi x E dx = (2 I h / R²) (1/h - 1/sqrt(h² + R²)).

/// Irradiance on the floor under a lamp of intensity 1 at height 1.
fn irradiance(x: f64, y: f64) -> f64 {
    (1.0 + x * x + y * y).powf(-1.5)
}

/// Irradiance at the foot of the lamp as a kernel of a radius sees it.
fn blurred_irradiance(radius: f64) -> f64 {
    2.0 / (radius * radius) * (1.0 - 1.0 / (1.0 + radius * radius).sqrt())
}

/// A floor in the plane z = 0 under lamps, seen from above or from below through a square window.
fn lamps_over_floor(lamps: Vec<Lamp>, eye_z: f64, window: f64) -> Contents {
    let (half_u, half_v) = (10.0 * DVec3::X, 10.0 * DVec3::Y);
    let floor = Shape::Rectangle { center: DVec3::ZERO, half_u, half_v };
    let camera =
        Camera::new(eye_z * DVec3::Z, -eye_z.signum() * DVec3::Z, [16, 16], parallel(window));
    Contents { surfaces: vec![Surface::new(floor, matt(HALF))], lamps, ..empty(camera) }
}

fn lamp_at(z: f64, intensity: Rgb) -> Lamp {
    Lamp::Point { position: z * DVec3::Z, intensity, medium: VACUUM }
}

/// Radiance of the floor in a window of half width 0.8 around the foot, with kernels of radius 0.2.
fn radiance_in_window() -> f64 {
    let irradiance = disk_mean(0.2, |dx, dy| square_mean(dx, dy, 0.8, irradiance));
    f64::from(HALF) / PI * irradiance
}

#[test]
fn irradiance_under_a_point_lamp() {
    let colour = Rgb::new(1.0, 2.0, 0.5);
    let expected = [1.0, 2.0, 0.5].map(|intensity| intensity * radiance_in_window());
    let scene = lamps_over_floor(vec![lamp_at(1.0, colour)], 3.0, 1.6);
    assert_film("floor", scene.clone(), &one_pass(160_000, 0.2), expected, 0.0);
    assert_same_on_request("floor", scene, &one_pass(160_000, 0.2));
}

#[test]
fn light_does_not_pass_a_thin_sheet() {
    // A red lamp above the sheet, a green one below. Each side shows its own colour only, although
    // photons of the other side lie as near.
    let lamps =
        || vec![lamp_at(1.0, Rgb::new(1.0, 0.0, 0.0)), lamp_at(-1.0, Rgb::new(0.0, 1.0, 0.0))];
    for (eye_z, seen, hidden) in [(3.0, 0, 1), (-3.0, 1, 0)] {
        let sheet = lamps_over_floor(lamps(), eye_z, 1.6);
        let name = format!("sheet from z = {eye_z}");
        let world = World::new(sheet.clone());
        let means = film_means(&world, &one_pass(270_000, 0.2), SEEDS * effort());
        Estimate::of(&means[seen]).assert_equals(&name, radiance_in_window(), 0.0);
        assert!(means[hidden].iter().all(|&x| x == 0.0), "{name}: the other side shows through");
        assert_same_on_request(&name, sheet, &one_pass(270_000, 0.2));
    }
}

#[test]
fn hidden_emitters_are_looked_through() {
    // A luminous ball between the eye and the floor. Shown, it is all that the eye sees: L_e = 1.
    // Hidden, the floor appears, lit by the ball as by a point lamp: outside a uniform ball of radius
    // a, E = pi L_e a² cos / r² (its image, seen from the floor, is wholly above the horizon).
    let ball = Shape::Sphere { center: DVec3::Z, radius: 0.5, inward: false };
    let mut scene = lamps_over_floor(Vec::new(), 3.0, 0.7);
    scene.surfaces.push(Surface::new(ball, matt(0.0)).emitting(Rgb::ONE));
    scene.camera.film_size = [8, 8];
    let shown = one_pass(380_000, 0.2);
    let hidden =
        Parameters { limits: PathLimits { hide_emitters: true, ..shown.limits }, ..shown.clone() };
    let intensity = PI * 0.25;
    let irradiance = disk_mean(0.2, |dx, dy| square_mean(dx, dy, 0.35, irradiance));
    let floor = f64::from(HALF) / PI * intensity * irradiance;
    assert_film("shown ball", scene.clone(), &shown, [1.0; 3], 0.0);
    assert_film("hidden ball", scene, &hidden, [floor; 3], 0.0);
}

// ---- Convergence ----------------------------------------------------------------------------------
//
// Knaus & Zwicker 2011, for a kernel over d dimensions whose radius shrinks so that
// R_k^d ~ k^(alpha - 1): the variance of pass k goes as R_k^-d ~ k^(1 - alpha), that of the mean of n
// passes as (1/n²) sum_k k^(1 - alpha) ~ n^-alpha. The bias of pass k goes as R_k², that of the mean as
// (1/n) sum_k R_k². Both kernels here have d = 2, so the matched schedule gives R² ~ k^(alpha - 1),
// variance ~ n^-alpha and bias ~ n^(alpha - 1). The paper's cube root in media gives
// R² ~ k^(2 (alpha - 1) / 3): variance ~ n^(-(1 + 2 alpha) / 3), bias ~ n^(2 (alpha - 1) / 3).
// The sums below are exact for every n, not only in the limit.

const ALPHA: f64 = 0.4;
/// Numbers of passes that the convergence tests render.
const PASSES: [u32; 4] = [1, 4, 16, 64];

/// `(R_k / R_1)²` of pass `k`, counted from 1, by the closed form of the product
/// `prod_{j=1}^{k-1} (j + alpha) / (j + 1) = Gamma(k + alpha) / (Gamma(1 + alpha) Gamma(k + 1))`.
fn shrink(alpha: f64, k: f64) -> f64 {
    (ln_gamma(k + alpha) - ln_gamma(1.0 + alpha) - ln_gamma(k + 1.0)).exp()
}

/// `(R_k / R_1)²` in media by schedule; on surfaces both schedules match the kernel.
fn squared_radius(schedule: Schedule, k: u32) -> f64 {
    let exponent = match schedule {
        Schedule::Matched => 1.0,
        Schedule::Paper => 2.0 / 3.0,
    };
    shrink(ALPHA, f64::from(k)).powf(exponent)
}

/// Parameters of a render of several small passes, without new jitters.
fn passes(count: u32, photons: u64, radius: f32, schedule: Schedule) -> Parameters {
    Parameters {
        passes: count,
        jitter_every: count,
        radius_schedule: schedule,
        alpha: ALPHA as f32,
        ..one_pass(photons, radius)
    }
}

/// Renders to judge a variance by: its relative standard error is sqrt(2 / 400) = 7 %.
const VARIANCE_SEEDS: u64 = 400;

/// Compares the variance of the mean of n passes with `first * sum_k (R_1 / R_k)² / n²`, and its
/// decay with the line through these values.
#[track_caller]
fn assert_variance_decay(
    name: &str,
    scene: Contents,
    parameters: impl Fn(u32) -> Parameters,
    first: Option<f64>,
    squared_radius: impl Fn(u32) -> f64,
) {
    let world = World::new(scene);
    let (mut measured, mut predicted) = (Vec::new(), Vec::new());
    for n in PASSES {
        let values = &film_means(&world, &parameters(n), VARIANCE_SEEDS)[GREY];
        let sum: f64 = (1..=n).map(|k| 1.0 / squared_radius(k)).sum();
        let relative = sum / f64::from(n * n);
        if let Some(first) = first {
            assert_variance(&format!("{name}, {n} passes"), values, first * relative);
        }
        measured.push((f64::from(n).ln(), variance(values).ln()));
        predicted.push((f64::from(n).ln(), relative.ln()));
    }
    // The logarithm of each variance has a standard error of sqrt(2/400); with x = 0, 1, 2, 3 times
    // ln 4 the slope's is that over ln 4 sqrt(5) = 0.023.
    let (measured, predicted) = (slope(&measured), slope(&predicted));
    println!("{name}: variance falls as n^{measured:.3}, expected n^{predicted:.3}");
    assert!((measured - predicted).abs() < 4.0 * 0.023, "{name}: {measured} for {predicted}");
}

#[test]
fn variance_on_surfaces_falls_with_passes() {
    // Light of the walls of a spherical room arrives uniformly on them, so the first hits within R of
    // a point are binomial with p = pi R² / 4 pi. Each adds rho/pi * (pi * 4 pi L_e) / (pi R² N) =
    // rho L_e / (p N): the variance of a pass is rho² L_e² (1 - p) / (p N), here p = 0.04 and less. Some
    // of them come from below the point's horizon.
    let (photons, radius) = (250, 0.4);
    let p = radius * radius / 4.0;
    let first = 0.25 * (1.0 - p) / (p * photons as f64) * seen_on_a_sphere(1.0, radius as f32);
    let mut scene = room(HALF, None);
    scene.camera.film_size = [1, 1];
    let parameters = |n| up_to_depth(passes(n, photons, radius as f32, Schedule::Matched), 2);
    let squared_radius = |k| squared_radius(Schedule::Matched, k);
    assert_variance_decay("surface", scene, parameters, Some(first), squared_radius);
}

#[test]
fn variance_in_media_falls_with_passes() {
    // Light that the sky sends into a ball of fog and that is scattered once: few photons within the
    // kernel, independent of each other, so the variance of a pass goes as the density of the kernel.
    let mut scene = fog_furnace(Rgb::ONE, Phase::Isotropic);
    scene.camera.film_size = [1, 1];
    scene.camera.projection = parallel(1e-3);
    for schedule in [Schedule::Matched, Schedule::Paper] {
        let parameters = |n| up_to_depth(passes(n, 250, 0.3, schedule), 2);
        let name = format!("medium, {schedule:?}");
        let squared_radius = |k| squared_radius(schedule, k);
        assert_variance_decay(&name, scene.clone(), parameters, None, squared_radius);
    }
}

#[test]
fn bias_falls_with_passes() {
    // At the foot of the lamp the kernel always blurs toward the dark: the mean of n passes is
    // (1/n) sum_k of the blurred irradiance at R_k, which the bias 1 - mean follows down.
    let radius: f64 = 0.6;
    let mut scene = lamps_over_floor(vec![lamp_at(1.0, Rgb::ONE)], 3.0, 1e-3);
    scene.camera.film_size = [1, 1];
    let world = World::new(scene);
    let (mut measured, mut predicted, mut errors) = (Vec::new(), Vec::new(), Vec::new());
    for n in PASSES {
        let parameters = passes(n, 9000, radius as f32, Schedule::Matched);
        let radiance = Estimate::of(&film_means(&world, &parameters, 64 * effort())[GREY]);
        let unit = PI / f64::from(HALF);
        let (mean, error) = (unit * radiance.mean, unit * radiance.standard_error);
        let blurred = |k| blurred_irradiance(radius * squared_radius(Schedule::Matched, k).sqrt());
        let expected = (1..=n).map(blurred).sum::<f64>() / f64::from(n);
        println!("{n} passes: bias {:.4} ± {error:.4}, expected {:.4}", 1.0 - mean, 1.0 - expected);
        if n == 64 {
            radiance.assert_equals("bias after 64 passes", expected / unit, 0.0);
        }
        measured.push((f64::from(n).ln(), (1.0 - mean).ln()));
        predicted.push((f64::from(n).ln(), (1.0 - expected).ln()));
        errors.push(error / (1.0 - mean));
    }
    // Least squares weights the points by their distance from the middle: -1.5, -0.5, 0.5, 1.5 times
    // ln 4, over 5 ln 4.
    let error = (1..=4).map(|i| (f64::from(i) - 2.5) / (5.0 * 4f64.ln())).zip(errors);
    let error = error.map(|(weight, e)| (weight * e).powi(2)).sum::<f64>().sqrt();
    let (measured, predicted) = (slope(&measured), slope(&predicted));
    println!("bias falls as n^{measured:.3} ± {error:.3}, expected n^{predicted:.3}");
    assert!(error < 0.02, "too noisy: {error}");
    assert!((measured - predicted).abs() < 4.0 * error, "{measured} for {predicted}");
}

// ---- Arithmetic -----------------------------------------------------------------------------------

#[test]
fn radii_follow_the_gamma_function() {
    // After n updates by (8), R² is R_1² times prod_{j=1}^n (j + alpha) / (j + 1) =
    // Gamma(n + 1 + alpha) / (Gamma(1 + alpha) Gamma(n + 2)); for large x = n + 1,
    // Gamma(x + alpha) / Gamma(x + 1) = x^(alpha - 1) (1 + alpha (alpha - 1) / 2x + O(1/x²)).
    let alpha = 0.7f32;
    let initial = Radii { surface: 2.0, medium: 3.0 };
    for (schedule, exponent) in [(Schedule::Matched, 1.0 / 2.0), (Schedule::Paper, 1.0 / 3.0)] {
        let mut radii = RadiusSequence::new(initial, alpha, schedule);
        let close = |radius: f32, expected: f64| {
            assert!((f64::from(radius) / expected - 1.0).abs() < 2e-7, "{radius} for {expected}");
        };
        assert_eq!(radii.current(), initial);
        let alpha = f64::from(alpha);
        for n in 1..=1_000_000u32 {
            radii.advance();
            let x = f64::from(n) + 1.0;
            let product = match n {
                1 | 2 | 10 | 1000 => shrink(alpha, x),
                1_000_000 => {
                    let ratio = x.powf(alpha - 1.0) * (1.0 + alpha * (alpha - 1.0) / (2.0 * x));
                    ratio / ln_gamma(1.0 + alpha).exp()
                }
                _ => continue,
            };
            close(radii.current().surface, 2.0 * product.sqrt());
            close(radii.current().medium, 3.0 * product.powf(exponent));
        }
    }
}

#[test]
fn printed_radiance_update_diverges() {
    // [Collin 2013 (6)] prints L <- (L + L'/N') (N + N' (1 - alpha)) / N, with N photons so far and N'
    // in this pass. The factor is above 1 in every pass. With the same N' in each, N = k N' after pass k,
    // and with the same radiance l of each pass, L_k = (L_{k-1} + l) (1 + (1 - alpha) / k). The solution
    // grows as l k / alpha: neither L nor L/k tends to l. The running mean of the passes is l at once.
    let (alpha, l) = (0.7, 1.0);
    let (mut printed, mut sum) = (0.0, 0.0);
    for k in 1..=100_000 {
        let factor = 1.0 + (1.0 - alpha) / f64::from(k);
        assert!(factor > 1.0);
        printed = (printed + l) * factor;
        sum += l;
        assert!(printed > l * f64::from(k), "pass {k}: {printed}");
        assert_eq!(sum / f64::from(k), l);
    }
    assert!((printed / 1e5 - l / alpha).abs() < 1e-3, "{printed}");
}
