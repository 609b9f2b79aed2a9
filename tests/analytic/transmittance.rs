//! Transmittance of black fog.
//!
//! A luminous black wall at z = 1 behind black fog (albedo 0) is seen along a straight line only:
//! L = L_e exp(-tau). Nothing is random but the place in the pixel, on which parallel rays' optical
//! depth does not depend.

use crate::scenes::*;
use glam::DVec3;
use vpt::analytic::{Camera, Contents, Fog, Material, Profile, Shape, Surface};
use vpt::math::Rgb;
use vpt::scene::{Phase, VACUUM};

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
