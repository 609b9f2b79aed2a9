//! How fast noise and blur go down with passes.
//!
//! Knaus & Zwicker 2011, for a kernel over d dimensions whose radius shrinks so that
//! R_k^d ~ k^(alpha - 1): the variance of pass k goes as R_k^-d ~ k^(1 - alpha), that of the mean of n
//! passes as (1/n²) sum_k k^(1 - alpha) ~ n^-alpha. The bias of pass k goes as R_k², that of the mean as
//! (1/n) sum_k R_k². Both kernels here have d = 2, so the matched schedule gives R² ~ k^(alpha - 1),
//! variance ~ n^-alpha and bias ~ n^(alpha - 1). The paper's cube root in media gives
//! R² ~ k^(2 (alpha - 1) / 3): variance ~ n^(-(1 + 2 alpha) / 3), bias ~ n^(2 (alpha - 1) / 3).
//! The sums below are exact for every n, not only in the limit.

use crate::furnace::{fog_furnace, seen_on_a_sphere};
use crate::room::room;
use crate::scenes::*;
use crate::surface::{blurred_irradiance, lamp_at, lamps_over_floor};
use statistics::t_test::{assert_variance, effort, slope, variance, Estimate};
use statrs::function::gamma::ln_gamma;
use std::f64::consts::PI;
use vpt::analytic::{Contents, World};
use vpt::density::radius::Schedule;
use vpt::math::Rgb;
use vpt::method::Parameters;
use vpt::scene::Phase;

const ALPHA: f64 = 0.4;
/// Numbers of passes that the convergence tests render.
const PASSES: [u32; 4] = [1, 4, 16, 64];

/// `(R_k / R_1)²` of pass `k`, counted from 1, by the closed form of the product
/// `prod_{j=1}^{k-1} (j + alpha) / (j + 1) = Gamma(k + alpha) / (Gamma(1 + alpha) Gamma(k + 1))`.
pub fn shrink(alpha: f64, k: f64) -> f64 {
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
