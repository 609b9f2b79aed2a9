//! Scenes that are huge, tiny, or far from the origin.

use super::case::Case;
use super::closed_forms::half_space;
use super::trial::{Expected, Trial};
use super::worlds::{one_pass, HalfSpace};
use super::SelftestError;
use crate::analytic::World;
use crate::math::Rgb;
use crate::method::Method;
use glam::DVec3;

pub const CASES: &[Case] = &[
    Case {
        name: "scaled",
        claim: "a half-space of fog looks the same when all lengths, and sigma_t inversely, are multiplied by 1e-6 to 1e6",
        run: scaled,
    },
    Case {
        name: "moved",
        claim: "a half-space of fog looks the same 1e6 away, down to radii of 8 roundings of the coordinates",
        run: moved,
    },
];

const ALBEDO: f32 = 0.8;
const FREE_PATHS: f64 = 15.0;

fn scaled(trial: &mut Trial) -> Result<(), SelftestError> {
    let expected = Expected::grey(half_space(ALBEDO.into(), 1.0));
    for scale in [1e-6, 1e6] {
        let scene = HalfSpace::new(Rgb::splat(1.0 / scale as f32), ALBEDO, FREE_PATHS * scale);
        let world = World::new(scene.contents());
        let what = format!("by {scale:.0e}");
        trial.film_by(&Method::ALL, &what, &world, &one_pass(9000, scene.radius()), expected)?;
    }
    Ok(())
}

/// At 1e6 coordinates are multiples of 1/16. Free paths are 1000, and radii come down from 60 to 0.02, a third
/// of a rounding, below which an engine that takes them at their word counts lattice points, not areas.
fn moved(trial: &mut Trial) -> Result<(), SelftestError> {
    // Lattice points in a disk of 8 roundings: 197 instead of 201.1.
    let expected = Expected::grey(half_space(ALBEDO.into(), 1.0)).with_bias(0.025).noticing(0.4);
    let place = DVec3::new(1e6, -1e6, 1e6);
    for (free_path, radius, methods) in [
        (1000.0, 2000.0, &Method::ALL[..]),
        (1.0, 0.5, &[Method::Ppt, Method::Ppbt]),
        (1.0, 0.02, &Method::ALL),
    ] {
        let scene = HalfSpace {
            place,
            window: 4.0 * free_path,
            ..HalfSpace::new(Rgb::splat(1.0 / free_path as f32), ALBEDO, FREE_PATHS * free_path)
        };
        let world = World::new(scene.contents());
        let what = format!("radius {radius}");
        trial.film_by(methods, &what, &world, &one_pass(7000, radius), expected)?;
    }
    Ok(())
}
