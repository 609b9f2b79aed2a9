//! White furnaces.
//!
//! Where nothing absorbs and light of radiance 1 comes from all directions, radiance is 1 everywhere
//! and in every direction: scattering takes out of a ray what it puts in. A sky of radiance 1 is
//! such a bath, whatever white things float in it. The photons must carry all that the fog scatters.
//!
//! The fluence is flat, so the kernel blurs nothing but the boundary of the fog. The estimate along a
//! beam is the mean over the kernel's disk of what a shifted beam of the same length would see in the
//! fog, int sigma_s exp(-sigma_t t) dt with t counted along the true beam.

use crate::scenes::*;
use glam::DVec3;
use statistics::quadrature::{disk_mean, square_mean};
use vpt::analytic::{Camera, Contents, Material, Profile, Surface};
use vpt::math::Rgb;
use vpt::method::Parameters;
use vpt::scene::{Phase, VACUUM};

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
pub fn seen_inside_the_ball(tau: impl Fn(f64) -> f64, wall: f64, radius: f32) -> f64 {
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
pub fn seen_on_a_sphere(sphere_radius: f64, radius: f32) -> f64 {
    1.0 - (f64::from(radius) / sphere_radius).powi(2) / 8.0
}

/// A ball of white fog with the eye inside.
pub fn fog_furnace(sigma_t: Rgb, phase: Phase) -> Contents {
    let boundary = Surface::new(sphere(1.0), Material::Null).between(VACUUM, FOG);
    Contents {
        surfaces: vec![boundary],
        fogs: vec![ball_of_fog(1.0, sigma_t, phase)],
        lamps: vec![sky()],
        ..empty(eye_inside().inside(FOG))
    }
}

/// Parallel rays downward from the equatorial plane.
pub fn eye_inside() -> Camera {
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
