//! Lamps that are small, and skies with a sun in one pixel.

use crate::method::Method;
use crate::selftest::case::Case;
use crate::selftest::trial::{by_default, Expected, Trial};
use crate::selftest::worlds::{one_pass, up_to_depth, POINTS};
use crate::selftest::SelftestError;
use std::f64::consts::PI;

pub const CASES: &[Case] = &[
    Case {
        name: "small_lamp",
        claim:
            "a lamp of radius 1e-5 lights a floor as a point does: pi r² radiance reflectance/pi",
        run: small_lamp,
    },
    Case {
        name: "lamp_in_a_pixel",
        claim: "a lamp that covers 1/100 of a pixel shows 1/100 of its radiance there",
        run: lamp_in_a_pixel,
    },
    Case {
        name: "bright_pixel",
        claim: "under a sky with one pixel 1e8 brighter a floor is what Mitsuba's path tracer says",
        run: bright_pixel,
    },
    Case {
        name: "bright_pixel_in_fog",
        claim: "the same floor under fog is what Mitsuba's volumetric path tracer says",
        run: bright_pixel_in_fog,
    },
];

const LAMP: &str = include_str!("../scenes/small_lamp.xml");
const LAMP_IN_A_PIXEL: &str = include_str!("../scenes/lamp_in_a_pixel.xml");
const SKY: &str = include_str!("../scenes/bright_pixel.xml");

/// Irradiance 1 below the lamp. Within the kernel's disk it falls as (1 + r²)^-2, to 1 - R² on average.
fn small_lamp(trial: &mut Trial) -> Result<(), SelftestError> {
    let radius: f64 = 1e-5;
    let defines =
        [("radius", radius.to_string()), ("radiance", (1.0 / (PI * radius * radius)).to_string())];
    let scene = trial.bench.load(LAMP, &defines)?;
    let lent = scene.lend(0)?;
    let expected = Expected::grey(0.5 / PI).with_bias(0.01);
    trial.film_by(&POINTS, "", lent.scene(), &one_pass(60_000, 0.1), expected)
}

/// From a distance of 4 a sphere covers `pi (r/4)²` of the `(2 tan 5°)²` of the film at a distance of 1, but for `(r/4)²` of it. By
/// default it is aimed at; a sample of each pixel would meet it in one of 100 jitters.
fn lamp_in_a_pixel(trial: &mut Trial) -> Result<(), SelftestError> {
    let (film, share): (f64, f64) = (49.0, 1.0 / 100.0);
    let side = 2.0 * 5f64.to_radians().tan();
    let radius = 4.0 * side / film * (share / PI).sqrt();
    let defines = [("film", film.to_string()), ("radius", radius.to_string())];
    let scene = trial.bench.load(LAMP_IN_A_PIXEL, &defines)?;
    let lent = scene.lend(0)?;
    let parameters = by_default(&up_to_depth(one_pass(8, 0.1), 1));
    trial.film("fast", lent.scene(), &parameters, Expected::grey(share / film / film))
}

/// 64 x 32 pixels of 1, and one of 1e8 at 45° above the horizon.
fn write_sky(trial: &Trial) -> Result<(), SelftestError> {
    let bright = |x, y| if (x, y) == (20, 8) { 1e8f32 } else { 1.0 };
    let pixel = |x, y| (bright(x, y), bright(x, y), bright(x, y));
    exr::prelude::write_rgb_file(trial.bench.path("sky.exr"), 64, 32, pixel)
        .map_err(|error| SelftestError::Files(std::io::Error::other(error)))
}

/// `volpath` chooses directions by the sky's brightness and looks through null boundaries, so that it holds hardly any noise.
fn bright_pixel(trial: &mut Trial) -> Result<(), SelftestError> {
    write_sky(trial)?;
    let scene = trial.bench.load(SKY, &[])?;
    let seen = trial.seen_by_mitsuba(&scene, "volpath", 4096)?;
    let lent = scene.lend(0)?;
    let expected = Expected::rgb(seen).with_bias(0.01);
    trial.film_by(&POINTS, "", lent.scene(), &one_pass(12_000, 0.25), expected)
}

/// Fog of optical depth 0.5 above the floor. Where the bright pixel's light leaves it at the sides is out of sight; what
/// kernels cover beyond the top of the fog holds no photons.
fn bright_pixel_in_fog(trial: &mut Trial) -> Result<(), SelftestError> {
    write_sky(trial)?;
    let scene = trial.bench.load(SKY, &[("sigma_t", "0.5".to_owned())])?;
    let seen = trial.seen_by_mitsuba(&scene, "volpath", 16_384)?;
    let lent = scene.lend(0)?;
    let expected = Expected::rgb(seen).with_bias(0.03);
    let methods = [Method::Ppt, Method::PptMetro, Method::Ppbt];
    trial.film_by(&methods, "", lent.scene(), &one_pass(12_000, 0.2), expected)
}
