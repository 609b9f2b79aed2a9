//! Photons whose emission is guided to where they are seen.
//!
//! A photon that is drawn with a density d over its emission numbers, and not with 1, carries 1/d of its flux: the mean does
//! not change. If every walk that is seen adds c and a share p of all is, one walk has a variance of c² p (1 - p) evenly, and of
//! less than c² p/d where the seen ones have a density of at least d. A guide that puts half of the walks into twice the share
//! has d = 1/(4 p), which leaves 4 p of the variance: some hundredths in these scenes. Asked for is a tenth.

use crate::connections::{above, floor};
use crate::scenes::*;
use glam::DVec3;
use statistics::t_test::{variance, Estimate};
use std::f64::consts::PI;
use vpt::analytic::{Camera, Contents, Fog, Lamp, Material, Shape, Surface, World};
use vpt::math::Rgb;
use vpt::method::{Method, Parameters};
use vpt::scene::{Phase, VACUUM};

/// At most so much of the variance of photons that are not guided is left.
const LEFT: f64 = 0.1;

/// Two passes, the second with view rays that the guide was not learnt from.
fn guided(photons: u64, radius: f32) -> Parameters {
    let each = one_pass(photons / 2, radius);
    Parameters { passes: 2, jitter_every: 1, guided_emission: true, ..each }
}

/// Guided photons have the expected mean within 3 %, and so do as many that are not guided within all that their noise allows.
#[track_caller]
fn assert_guided(
    name: &str,
    contents: Contents,
    parameters: &Parameters,
    expected: f64,
    bias: f64,
) {
    let world = World::new(contents);
    let guided = &film_means(&world, parameters, SEEDS)[GREY];
    Estimate::of(guided).assert_noticing(0.03, &format!("{name}, guided"), expected, bias);
    let even = Parameters { guided_emission: false, ..parameters.clone() };
    let even = &film_means(&world, &even, SEEDS)[GREY];
    let estimate = Estimate::of(even);
    estimate.assert_noticing(0.8, &format!("{name}, even"), expected, bias);
    let left = variance(guided) / variance(even);
    println!("{name}: {left:.5} of the variance is left");
    assert!(left < LEFT, "{name}: {left} of the variance is left");
}

#[test]
fn small_parts_of_floors_under_lamps_of_every_kind() {
    // As connections see them (`connections.rs`). Over a window of 0.04 and kernels of 0.02 irradiance falls by less than
    // a thousandth: under the point lamp by 3/2 of the mean square distance, 3/2 (0.04²/6 + 0.02²/2) = 7e-4. The sun and the
    // sky send their light through a disk that is as wide as the floor.
    let point = lamp_at(DVec3::Z);
    let sun = Lamp::Sun { direction: DVec3::new(0.8, 0.0, -0.6), irradiance: Rgb::ONE };
    let a = 0.1f64;
    let (half_u, half_v) = (-a * DVec3::X, a * DVec3::Y);
    let lamp = Shape::Rectangle { center: DVec3::Z, half_u, half_v };
    let lamp = Surface::new(lamp, matt(0.0)).emitting(Rgb::ONE);
    let b = a / a.hypot(1.0);
    // Three in four photons leave lamps that the floor hides: a lamp is chosen before anything else.
    let hidden = (1..4).map(|i| lamp_at(-f64::from(i) * DVec3::Z));
    for (name, lamps, surfaces, photons, irradiance) in [
        ("point", vec![point], vec![], 130_000, 1.0),
        ("one of four", hidden.chain([point]).collect(), vec![], 130_000, 1.0),
        ("sun", vec![sun], vec![], 130_000, 0.6),
        ("sky", vec![sky()], vec![], 130_000, PI),
        ("surface", vec![], vec![lamp], 130_000, 4.0 * b * b.atan()),
    ] {
        let surfaces = [vec![floor(0.5)], surfaces].concat();
        let camera = Camera::new(0.9 * DVec3::Z, -DVec3::Z, [8, 8], parallel(0.04));
        let contents = Contents { camera, ..above(lamps, surfaces) };
        let expected = f64::from(HALF) * irradiance / PI;
        let parameters = up_to_depth(guided(photons, 0.02), 2);
        assert_guided(name, contents, &parameters, expected, 1e-3);
    }
}

fn lamp_at(position: DVec3) -> Lamp {
    Lamp::Point { position, intensity: Rgb::ONE, medium: VACUUM }
}

#[test]
fn a_narrow_view_of_fog_under_the_sun() {
    // A slab of fog of depth 2 over a black floor, as in `connections.rs`: over a column of optical depth tau to the eye and slant
    // times that to the sun albedo p (1 - exp(-tau (1 + slant))) / (1 + slant). Kernels lie across the view, where light is flat.
    let (slant, albedo, column) = (1.25, 0.7f32, 2.0);
    let sun = Lamp::Sun { direction: DVec3::new(0.6, 0.0, -0.8), irradiance: Rgb::ONE };
    let slab = Shape::Rectangle {
        center: column * DVec3::Z,
        half_u: 9.0 * DVec3::X,
        half_v: 9.0 * DVec3::Y,
    };
    let black = Surface { material: matt(0.0), ..floor(9.0) }.between(FOG, VACUUM);
    let surfaces = vec![black, Surface::new(slab, Material::Null).between(VACUUM, FOG)];
    let fogs = vec![Fog::uniform(Rgb::ONE, Rgb::splat(albedo), Phase::Isotropic)];
    let mut contents = Contents { fogs, ..above(vec![sun], surfaces) };
    contents.camera.projection = parallel(0.2);
    let seen = f64::from(albedo) / (4.0 * PI) * -(-column * (1.0 + slant)).exp_m1() / (1.0 + slant);
    for method in [Method::Ppt, Method::Ppbt] {
        let parameters = Parameters { method, ..up_to_depth(guided(200_000, 0.1), 2) };
        assert_guided(method.name(), contents.clone(), &parameters, seen, 0.0);
    }
}

#[test]
fn furnaces_where_guided_photons_are_scattered_many_times() {
    // White fog in a sphere under a sky of radiance 1, with a white sphere in it: 1. Connections bring what the sky sends
    // straight, and the guide knows the rest alone. Photons' kernels miss less than R² of it near the boundaries.
    let core = Surface::new(sphere(0.5), matt(1.0)).between(FOG, VACUUM);
    let boundary = Surface::new(sphere(1.0), Material::Null).between(VACUUM, FOG);
    let camera = Camera::new(-3.0 * DVec3::Z, DVec3::Z, [4, 4], parallel(0.2));
    let contents = Contents {
        surfaces: vec![core, boundary],
        fogs: vec![ball_of_fog(1.0, Rgb::ONE, Phase::HenyeyGreenstein { g: 0.3 })],
        lamps: vec![sky()],
        ..empty(camera)
    };
    for (method, connections) in
        [(Method::Ppt, false), (Method::Ppbt, false), (Method::Ppt, true), (Method::Ppbt, true)]
    {
        let connections = Some(connections);
        let parameters = Parameters { method, connections, ..guided(30_000, 0.1) };
        let name = format!("{} {connections:?}", method.name());
        assert_film_noticing(0.15, &name, contents.clone(), &parameters, [1.0; 3], 0.01);
    }
}
