//! Extreme extinction, albedo and phase functions.

use super::case::Case;
use super::closed_forms::{half_space, half_space_up_to};
use super::trial::{Expected, Trial};
use super::worlds::{one_pass, up_to_depth, HalfSpace, FOG, POINTS};
use super::SelftestError;
use crate::analytic::{Camera, Contents, Projection, World};
use crate::math::Rgb;
use crate::method::Method;
use glam::DVec3;

pub const CASES: &[Case] = &[
    Case {
        name: "extinction",
        claim: "a half-space of fog reflects 1 - sqrt(1-albedo) H(1) of a sky, for sigma_t from 1e2 to 1e6 in a scene of size 1",
        run: extinction,
    },
    Case {
        name: "coloured_extinction",
        claim: "a half-space reflects the same in channels whose sigma_t is 1e-4, 1e-2 and 1",
        run: coloured_extinction,
    },
    Case {
        name: "albedo_1",
        claim: "white half-spaces of sigma_t from 1e2 to 1e6 reflect the orders up to 20 of Chandrasekhar's series",
        run: white_fog,
    },
    Case {
        name: "albedo_0",
        claim: "black fog shows exp(-sigma_t d) of the sky behind it, and its photons nothing",
        run: black_fog,
    },
];

const ALBEDO: f32 = 0.8;
/// Free paths from the middle of a half-space to where light no longer enters.
const FREE_PATHS: f64 = 15.0;

/// Sizes that go with the extinction are `scaled`'s. Beams shorter than their kernel are hardly ever met, so here and
/// in coloured fog are points alone; `coloured_laser` has beams.
fn extinction(trial: &mut Trial) -> Result<(), SelftestError> {
    let expected = Expected::grey(half_space(ALBEDO.into(), 1.0));
    for sigma_t in [1e2f32, 1e4, 1e6] {
        let scene = HalfSpace::new(Rgb::splat(sigma_t), ALBEDO, 1.0);
        let world = World::new(scene.contents());
        let what = format!("sigma_t {sigma_t:.0e}");
        let parameters = one_pass(11_000, scene.radius());
        trial.film_by(&POINTS, &what, &world, &parameters, expected)?;
    }
    Ok(())
}

fn coloured_extinction(trial: &mut Trial) -> Result<(), SelftestError> {
    let sigma_t = Rgb::new(1e-4, 1e-2, 1.0);
    let scene = HalfSpace::new(sigma_t, ALBEDO, FREE_PATHS / 1e-4);
    let world = World::new(scene.contents());
    let expected = Expected::grey(half_space(ALBEDO.into(), 1.0)).noticing(0.4);
    trial.film_by(&POINTS, "", &world, &one_pass(24_000, scene.radius()), expected)
}

/// White fog without an end keeps its light for ever, so that depth is bounded.
fn white_fog(trial: &mut Trial) -> Result<(), SelftestError> {
    const ORDERS: u32 = 20;
    let expected = Expected::grey(half_space_up_to(1.0, 1.0, ORDERS as usize));
    for sigma_t in [1e2f32, 1e4, 1e6] {
        let scene = HalfSpace::new(Rgb::splat(sigma_t), 1.0, 1.0);
        let world = World::new(scene.contents());
        let what = format!("sigma_t {sigma_t:.0e}");
        let parameters = up_to_depth(one_pass(13_000, scene.radius()), ORDERS + 1);
        trial.film_by(&POINTS, &what, &world, &parameters, expected)?;
    }
    Ok(())
}

/// The eye looks up at the sky from 1 below the top.
fn black_fog(trial: &mut Trial) -> Result<(), SelftestError> {
    let projection = Projection::Orthographic { width: 1.0 };
    let camera = Camera::new(-DVec3::Z, DVec3::Z, [4, 4], projection).inside(FOG);
    for sigma_t in [1e-6f32, 1.0, 20.0, 1e6] {
        let scene = HalfSpace::new(Rgb::splat(sigma_t), 0.0, 10.0);
        let world = World::new(Contents { camera, ..scene.contents() });
        let expected = Expected::grey((-f64::from(sigma_t)).exp());
        let what = format!("sigma_t {sigma_t:.0e}");
        trial.film_by(&Method::ALL, &what, &world, &one_pass(1000, 0.1), expected)?;
    }
    Ok(())
}
