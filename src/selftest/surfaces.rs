//! Grazing light and views, small lamps, small openings.

use super::case::Case;
use super::trial::{Expected, Trial};
use super::worlds::{empty, one_pass, POINTS};
use super::SelftestError;
use crate::analytic::{Camera, Contents, Lamp, Material, Projection, Shape, Surface, World};
use crate::math::Rgb;
use crate::method::{Method, Parameters};
use crate::scene::VACUUM;
use glam::DVec3;
use std::f64::consts::PI;

pub const CASES: &[Case] = &[
    Case {
        name: "grazing_light",
        claim: "parallel light of irradiance 1 at a cosine of 1e-3 shows 1e-3 reflectance/pi on a floor",
        run: grazing_light,
    },
    Case {
        name: "grazing_view",
        claim: "a floor under a sky of radiance 1 shows its reflectance at a cosine of 1e-3 too",
        run: grazing_view,
    },
    Case {
        name: "visible_share",
        claim: "a window that sees a share of 1e-4 of the photons shows I reflectance/pi by chains",
        run: visible_share,
    },
    Case {
        name: "hardly_visible",
        claim: "where a share of 1e-7 is seen no picture is brighter on average than I reflectance/pi, and chains end",
        run: hardly_visible,
    },
];

const REFLECTANCE: f32 = 0.5;

fn floor(half_width: f64) -> Surface {
    let (half_u, half_v) = (half_width * DVec3::X, half_width * DVec3::Y);
    let shape = Shape::Rectangle { center: DVec3::ZERO, half_u, half_v };
    Surface::new(shape, Material::Lambertian { reflectance: Rgb::splat(REFLECTANCE) })
}

fn from_above(window: f64) -> Camera {
    Camera::new(DVec3::Z, -DVec3::Z, [4, 4], Projection::Orthographic { width: window })
}

fn grazing_light(trial: &mut Trial) -> Result<(), SelftestError> {
    let cosine = 1e-3f64;
    let direction = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, -cosine);
    let lamps = vec![Lamp::Sun { direction, irradiance: Rgb::ONE }];
    let contents = Contents { surfaces: vec![floor(1.0)], lamps, ..empty(from_above(1.0)) };
    let expected = Expected::grey(cosine * f64::from(REFLECTANCE) / PI);
    trial.film_by(&POINTS, "", &World::new(contents), &one_pass(200_000, 0.2), expected)
}

/// Rays a thousandth of the floor's width apart see as much of it as there is.
fn grazing_view(trial: &mut Trial) -> Result<(), SelftestError> {
    let cosine = 1e-3f64;
    let forward = DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, -cosine);
    let projection = Projection::Orthographic { width: 0.5e-3 };
    let camera = Camera::new(-2.0 * forward, forward, [4, 4], projection);
    let lamps = vec![Lamp::Sky { radiance: Rgb::ONE }];
    let contents = Contents { surfaces: vec![floor(1.0)], lamps, ..empty(camera) };
    let expected = Expected::grey(REFLECTANCE.into());
    trial.film_by(&Method::ALL, "", &World::new(contents), &one_pass(8000, 0.2), expected)
}

/// A point lamp at a height of 1 over the floor, of intensity 1: irradiance 1 below it. Photons within the window
/// or a radius of it are seen; both are small beside the height.
fn under_a_lamp(window: f64) -> World {
    let lamp = Lamp::Point { position: DVec3::Z, intensity: Rgb::ONE, medium: VACUUM };
    World::new(Contents {
        surfaces: vec![floor(1.0)],
        lamps: vec![lamp],
        ..empty(from_above(window))
    })
}

/// A share of 4 pi 1e-4 is a square of half-width 0.0177, of which the radius is a third.
fn visible_share(trial: &mut Trial) -> Result<(), SelftestError> {
    let expected = Expected::grey(f64::from(REFLECTANCE) / PI).noticing(0.5);
    let world = under_a_lamp(0.0236);
    let parameters = Parameters { method: Method::PptMetro, ..one_pass(300_000, 0.006) };
    trial.film("", &world, &parameters, expected)
}

fn hardly_visible(trial: &mut Trial) -> Result<(), SelftestError> {
    let world = under_a_lamp(0.00075);
    let parameters = one_pass(200_000, 0.0002);
    let parameters = Parameters { method: Method::PptMetro, ..parameters };
    trial.at_most("", &world, &parameters, f64::from(REFLECTANCE) / PI)
}
