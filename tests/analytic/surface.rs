//! Light on a floor, and through it.
//!
//! A point lamp of intensity I at height h over a matt floor. At a distance x from its foot
//!     E = I cos / r² = I h / (h² + x²)^(3/2),      L = rho E / pi.
//! The mean over a disk around the foot has a closed form,
//!     (1 / pi R²) int_0^R 2 pi x E dx = (2 I h / R²) (1/h - 1/sqrt(h² + R²)).

use crate::scenes::*;
use glam::DVec3;
use statistics::quadrature::{disk_mean, square_mean};
use statistics::t_test::{effort, Estimate};
use std::f64::consts::PI;
use vpt::analytic::{Camera, Contents, Lamp, Shape, Surface, World};
use vpt::math::Rgb;
use vpt::method::Parameters;
use vpt::scene::{PathLimits, VACUUM};

/// Irradiance on the floor under a lamp of intensity 1 at height 1.
fn irradiance(x: f64, y: f64) -> f64 {
    (1.0 + x * x + y * y).powf(-1.5)
}

/// Irradiance at the foot of the lamp as a kernel of a radius sees it.
pub fn blurred_irradiance(radius: f64) -> f64 {
    2.0 / (radius * radius) * (1.0 - 1.0 / (1.0 + radius * radius).sqrt())
}

/// A floor in the plane z = 0 under lamps, seen from above or from below through a square window.
pub fn lamps_over_floor(lamps: Vec<Lamp>, eye_z: f64, window: f64) -> Contents {
    let (half_u, half_v) = (10.0 * DVec3::X, 10.0 * DVec3::Y);
    let floor = Shape::Rectangle { center: DVec3::ZERO, half_u, half_v };
    let camera =
        Camera::new(eye_z * DVec3::Z, -eye_z.signum() * DVec3::Z, [16, 16], parallel(window));
    Contents { surfaces: vec![Surface::new(floor, matt(HALF))], lamps, ..empty(camera) }
}

pub fn lamp_at(z: f64, intensity: Rgb) -> Lamp {
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
