//! Scenes whose channels are wavelengths that the view rays and photons of a jitter share.

use crate::furnace::{eye_inside, fog_furnace, seen_inside_the_ball};
use crate::scenes::*;
use statistics::t_test::{effort, Estimate};
use std::f64::consts::TAU;
use vpt::analytic::{Contents, Lamp, World};
use vpt::math::Rgb;
use vpt::method::Parameters;
use vpt::scene::Phase;

const RADIUS: f32 = 0.1;

/// The extinction of white fog at a wavelength, told by its number.
fn extinction(number: f64) -> f64 {
    0.5 + 0.4 * (TAU * number).cos()
}

/// The radiance of the sky there.
fn radiance(number: f64) -> f64 {
    1.0 + 0.5 * (TAU * number).sin()
}

/// The numbers of the three channels.
fn numbers(number: f32) -> [f64; 3] {
    [0.0, 1.0, 2.0].map(|i| f64::from(number) + i / 3.0)
}

/// The film takes the mean over wavelengths for red, that of those with little extinction for green, and nothing for blue.
fn furnace(number: f32) -> (Contents, [Rgb; 3]) {
    let rgb = |of: fn(f64) -> f64| {
        let [r, g, b] = numbers(number).map(|number| of(number) as f32);
        Rgb::new(r, g, b)
    };
    let lit = Contents {
        lamps: vec![Lamp::Sky { radiance: rgb(radiance) }],
        ..fog_furnace(rgb(extinction), Phase::Isotropic)
    };
    let colours = numbers(number).map(|number| {
        let clear = (1.0 - extinction(number)) as f32;
        Rgb::new(1.0, clear, 0.0) / 3.0
    });
    (lit, colours)
}

/// Every wavelength has a furnace of its own: what is seen is `L(n)` times what a ball of extinction `sigma_t(n)` shows, and the film
/// takes the mean over the numbers `n`. The pure midpoint rule of 24 wavelengths is exact to rounding for what changes as
/// slowly as this. Extinction, sky and film change from jitter to jitter; a view ray and a photon of different jitters, a medium or a film of
/// another jitter would each be seen.
#[test]
fn furnaces_of_every_wavelength() {
    let (darkest, _) = furnace(0.0);
    let world = World::spectral(
        Contents {
            fogs: fog_furnace(Rgb::splat(0.9), Phase::Isotropic).fogs,
            camera: eye_inside().inside(FOG),
            ..darkest
        },
        furnace,
    );
    // Radii stay what they are.
    let parameters =
        Parameters { passes: 8, jitter_every: 1, alpha: 0.9999, ..one_pass(20_000, RADIUS) };
    let means = film_means(&world, &parameters, SEEDS * effort());
    let over_numbers = |weight: fn(f64) -> f64| {
        const NUMBERS: usize = 48;
        let seen = |index: usize| {
            let number = index as f64 / NUMBERS as f64;
            let sigma_t = extinction(number);
            let ball = seen_inside_the_ball(|t| sigma_t * t, 1.0, RADIUS);
            radiance(number) * ball * weight(number)
        };
        (0..NUMBERS).map(seen).sum::<f64>() / NUMBERS as f64
    };
    Estimate::of(&means[0]).assert_equals("red", over_numbers(|_| 1.0), 0.0);
    let clear = over_numbers(|number| 1.0 - extinction(number));
    Estimate::of(&means[1]).assert_equals("green", clear, 0.0);
    assert!(means[2].iter().all(|&blue| blue == 0.0));
}
