//! Single scattering around a lamp in fog.
//!
//! A lamp of intensity I at the origin of infinite fog. Its unscattered light at x, |x| = r, has
//! fluence I exp(-sigma_t r) / r². With one scattering event the eye, looking along +z from z = -1 at
//! an offset (x, y) from the lamp, sees
//!     L(x, y) = int_0 exp(-sigma_t t) sigma_s p(cos) I exp(-sigma_t r) / r² dt,
//! where the cosine is that between the photon's travel, x/r, and the way to the eye, -z. What lies
//! behind z = 8 adds less than 1e-5 of it.
//! A kernel of radius R averages the fluence over the disk, not the transmittance to the eye, which
//! belongs to the distance along the beam: exactly the mean of L over the disk. A pixel averages over
//! its square. The pixels around the lamp, where L has a pole, are left out.

use crate::scenes::*;
use glam::DVec3;
use statistics::quadrature::{disk_mean, integrate, square_mean};
use statistics::t_test::{effort, Estimate};
use std::f64::consts::PI;
use vpt::analytic::{Camera, Contents, Fog, Lamp, Material, Surface, World};
use vpt::math::Rgb;
use vpt::scene::{Phase, VACUUM};

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
