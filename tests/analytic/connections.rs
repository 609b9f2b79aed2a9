//! Light straight from lamps, looked for from what the eye sees; photons carry the rest.
//!
//! A connection has no kernel: what is lit by lamps alone is exact, whatever the radius, and is the same in every
//! picture where a lamp has one direction and strength everywhere.

use crate::scenes::*;
use glam::DVec3;
use statistics::t_test::{assert_variance, effort, Estimate};
use std::f64::consts::PI;
use vpt::analytic::{
    Camera, Contents, Disclosure, Fog, Lamp, Material, Profile, Shape, Surface, World,
};
use vpt::math::Rgb;
use vpt::method::{self, Method, Parameters, Silent};
use vpt::scene::{Phase, VACUUM};

/// Far too wide for a photon to be of use where connections are to be exact.
const WIDE: f32 = 0.5;

fn connected(photons: u64, radius: f32, jitters: u32) -> Parameters {
    Parameters {
        connections: Some(true),
        jitter_every: 1,
        passes: jitters,
        ..one_pass(photons / u64::from(jitters), radius)
    }
}

pub fn floor(half_width: f64) -> Surface {
    let (half_u, half_v) = (half_width * DVec3::X, half_width * DVec3::Y);
    Surface::new(Shape::Rectangle { center: DVec3::ZERO, half_u, half_v }, matt(HALF))
}

pub fn above(lamps: Vec<Lamp>, surfaces: Vec<Surface>) -> Contents {
    let camera = Camera::new(3.0 * DVec3::Z, -DVec3::Z, [16, 16], parallel(0.02));
    Contents { surfaces, lamps, ..empty(camera) }
}

#[test]
fn floors_under_lamps_of_every_kind() {
    // Irradiance E shows HALF E / pi: 1 below a point of intensity 1 at a height of 1, and under the sun at a cosine
    // of 0.6; pi under the sky; below a lamp of half-width a at height 1, radiance 1,
    // 4 a/sqrt(1+a²) arctan(a/sqrt(1+a²)).
    let point = Lamp::Point { position: DVec3::Z, intensity: Rgb::ONE, medium: VACUUM };
    let sun = Lamp::Sun { direction: DVec3::new(0.8, 0.0, -0.6), irradiance: Rgb::ONE };
    let a = 0.4f64;
    let (half_u, half_v) = (-a * DVec3::X, a * DVec3::Y);
    let lamp = Shape::Rectangle { center: DVec3::Z, half_u, half_v };
    let lamp = Surface::new(lamp, matt(0.0)).emitting(Rgb::ONE);
    let b = a / a.hypot(1.0);
    // Seen from between floor and lamp.
    let below = Camera::new(0.9 * DVec3::Z, -DVec3::Z, [16, 16], parallel(0.02));
    let lit = Contents { camera: below, ..above(vec![], vec![floor(2.0), lamp]) };
    for (name, contents, irradiance) in [
        ("point", above(vec![point], vec![floor(2.0)]), 1.0),
        ("sun", above(vec![sun], vec![floor(2.0)]), 0.6),
        ("sky", above(vec![sky()], vec![floor(2.0)]), PI),
        ("surface", lit, 4.0 * b * b.atan()),
    ] {
        let parameters = up_to_depth(connected(120, WIDE, 120), 2);
        let expected = f64::from(HALF) * irradiance / PI;
        assert_film(name, contents, &parameters, [expected; 3], 1e-3);
    }
}

#[test]
fn lamps_seen_through_null_boundaries_and_fog() {
    // A slab of fog of depth 1, with an optical depth of its own for every colour, between a floor and the sun above it.
    let sigma_t = Rgb::new(0.2, 1.0, 3.0);
    let slab = |z: f64| Shape::Rectangle {
        center: z * DVec3::Z,
        half_u: 9.0 * DVec3::X,
        half_v: 9.0 * DVec3::Y,
    };
    let sun = Lamp::Sun { direction: DVec3::new(0.6, 0.0, -0.8), irradiance: Rgb::ONE };
    let surfaces = vec![
        floor(9.0),
        Surface::new(slab(2.0), Material::Null).between(VACUUM, FOG),
        Surface::new(slab(1.0), Material::Null).between(FOG, VACUUM),
    ];
    let fogs = vec![Fog::uniform(sigma_t, Rgb::ZERO, Phase::Isotropic)];
    let contents = Contents { fogs, ..above(vec![sun], surfaces) };
    let seen = |sigma_t: f32| {
        let depth = f64::from(sigma_t) * (1.0 + 1.0 / 0.8);
        f64::from(HALF) * 0.8 / PI * (-depth).exp()
    };
    let expected = [seen(sigma_t.r), seen(sigma_t.g), seen(sigma_t.b)];
    assert_film("slab", contents, &connected(100, WIDE, 4), expected, 1e-5);
}

#[test]
fn single_scattering_of_the_sun_in_coloured_fog_and_in_an_atmosphere() {
    // Over a column of optical depth tau per unit of length to the eye and slant times that to the sun:
    // albedo p (1 - exp(-tau (1 + slant))) / (1 + slant). An atmosphere is the same in its own depth.
    let (slant, albedo) = (1.25, 0.7f32);
    let sun = Lamp::Sun { direction: DVec3::new(0.6, 0.0, -0.8), irradiance: Rgb::ONE };
    let phase = Phase::HenyeyGreenstein { g: 0.3 };
    let (g, cosine) = (f64::from(0.3f32), -0.8);
    let p = (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cosine).powf(1.5));
    let sigma_t = Rgb::new(0.2, 1.0, 30.0);
    for (profile, column) in [
        (Profile::Uniform, 2.0),
        (Profile::Exponential { scale_height: 0.5 }, 0.5 * (1.0 - (-4.0f64).exp())),
    ] {
        let fog = Fog { profile, ..Fog::uniform(sigma_t, Rgb::splat(albedo), phase) };
        let top = Shape::Rectangle {
            center: 2.0 * DVec3::Z,
            half_u: 9.0 * DVec3::X,
            half_v: 9.0 * DVec3::Y,
        };
        let black = Surface { material: matt(0.0), ..floor(9.0) }.between(FOG, VACUUM);
        let surfaces = vec![black, Surface::new(top, Material::Null).between(VACUUM, FOG)];
        let contents = Contents { fogs: vec![fog], ..above(vec![sun], surfaces) };
        let seen = |sigma_t: f32| {
            let tau = f64::from(sigma_t) * column;
            f64::from(albedo) * p * -(-tau * (1.0 + slant)).exp_m1() / (1.0 + slant)
        };
        let expected = [seen(sigma_t.r), seen(sigma_t.g), seen(sigma_t.b)];
        // The table of the atmosphere is a broken line of 32 pieces.
        let bias = if profile == Profile::Uniform { 1e-5 } else { 2e-3 };
        let parameters = up_to_depth(connected(24, WIDE, 24), 2);
        assert_film_noticing(0.04, &format!("{profile:?}"), contents, &parameters, expected, bias);
    }
}

#[test]
fn furnaces_where_connections_and_photons_share_the_light() {
    // White fog in a sphere under a sky of radiance 1, with a white sphere in it: 1, by every method. Neither part is.
    let core = Surface::new(sphere(0.5), matt(1.0)).between(FOG, VACUUM);
    let boundary = Surface::new(sphere(1.0), Material::Null).between(VACUUM, FOG);
    let camera = Camera::new(-3.0 * DVec3::Z, DVec3::Z, [4, 4], parallel(0.2));
    for disclosure in [Disclosure::Full, Disclosure::OnRequest] {
        let contents = Contents {
            surfaces: vec![core, boundary],
            fogs: vec![ball_of_fog(1.0, Rgb::ONE, Phase::HenyeyGreenstein { g: 0.3 })],
            lamps: vec![sky()],
            disclosure,
            ..empty(camera)
        };
        let all = [Method::Ppt, Method::Ppbt, Method::PptMetro, Method::Apa];
        for &method in if disclosure == Disclosure::Full { &all[..] } else { &all[..1] } {
            let parameters = Parameters { method, ..connected(30_000, 0.1, 20) };
            let name = format!("{} {disclosure:?}", method.name());
            // What the kernel of photons misses near the boundaries is less than R² of the photons' part.
            let means = film_means(&World::new(contents.clone()), &parameters, SEEDS);
            Estimate::of(&means[GREY]).assert_noticing(0.15, &name, 1.0, 0.01);
        }
    }
}

#[test]
fn connections_are_the_same_on_request() {
    let core = Surface::new(sphere(0.5), matt(1.0)).between(FOG, VACUUM);
    let boundary = Surface::new(sphere(1.0), Material::Null).between(VACUUM, FOG);
    let camera = Camera::new(-3.0 * DVec3::Z, DVec3::Z, [8, 8], parallel(0.2));
    for (name, surfaces, phase) in [
        ("core", vec![core], Phase::Isotropic),
        ("fog", vec![boundary], Phase::Isotropic),
        ("forward fog", vec![boundary], Phase::HenyeyGreenstein { g: 0.3 }),
        ("both", vec![boundary, core], Phase::Isotropic),
    ] {
        let contents = Contents {
            surfaces,
            fogs: vec![ball_of_fog(1.0, Rgb::new(0.5, 1.0, 2.0), phase)],
            lamps: vec![sky()],
            ..empty(camera)
        };
        assert_same_on_request(name, contents, &up_to_depth(connected(400, 0.1, 40), 2));
    }
}

#[test]
fn light_that_glass_sends_is_left_to_photons() {
    // Under a pane of index 1.5 no connection reaches the lamp. With max_depth 4 a path has three events: the light of the sun
    // that goes straight through both boundaries, 0.96² of it.
    let pane = |z: f64| Shape::Rectangle {
        center: z * DVec3::Z,
        half_u: 9.0 * DVec3::X,
        half_v: 9.0 * DVec3::Y,
    };
    let glass = |index| Material::Dielectric { index };
    let sun = Lamp::Sun { direction: -DVec3::Z, irradiance: Rgb::ONE };
    let surfaces = vec![
        floor(9.0),
        Surface::new(pane(2.0), glass(1.5)),
        Surface::new(pane(1.5), glass(1.0 / 1.5)),
    ];
    let below = Camera::new(DVec3::Z, -DVec3::Z, [4, 4], parallel(0.5));
    let contents = Contents { camera: below, ..above(vec![sun], surfaces) };
    let expected = f64::from(HALF) / PI * 0.96 * 0.96;
    let parameters = up_to_depth(connected(800_000, 0.5, 4), 4);
    assert_film_noticing(0.03, "pane", contents, &parameters, [expected; 3], 0.0);
}

/// The sky over a floor. A sample of its directions, uniform over the sphere, has a cosine z that is uniform in [-1, 1] and adds
/// X = 4 pi z rho/pi = 4 rho z above the horizon: E X = rho, E X² = 16 rho² / 6, so the variance is 5/3 rho². With S samples, S
/// even, z has S slices of width 2/S, half of them above the horizon: there X is uniform over 8 rho / S, with a variance
/// of 64 rho² / (12 S²), and the mean of S has 1/S² · S/2 of that, 8/3 rho² / S³. That is less than 1/S of the variance of one sample,
/// which S independent ones would leave.
#[test]
fn samples_of_the_sky_have_one_mean_and_the_variance_of_slices() {
    let (pixels, jitters, seeds) = (256, 2, 400 * effort());
    let world = World::new(above(vec![sky()], vec![floor(2.0)]));
    let rho = f64::from(HALF);
    for (samples, variance) in [(1, 5.0 / 3.0), (2, 1.0 / 3.0), (4, 1.0 / 24.0)] {
        let connection_samples = samples;
        let parameters =
            Parameters { connection_samples, ..up_to_depth(connected(4, WIDE, jitters), 2) };
        let values = &film_means(&world, &parameters, seeds)[GREY];
        let name = format!("{samples} samples");
        Estimate::of(values).assert_noticing(0.02, &name, rho, 0.0);
        assert_variance(&name, values, rho * rho * variance / f64::from(pixels * jitters));
    }
}

/// Of two lamps an even number of samples takes each as often: nothing is left to chance but where in the window, 0.02 wide, a
/// view ray goes. There irradiance falls by 3/2 of 0.02²/6 / 0.5², less than a thousandth.
#[test]
fn samples_are_spread_over_lamps() {
    let lamp = |position| Lamp::Point { position, intensity: Rgb::ONE, medium: VACUUM };
    let lamps = vec![lamp(DVec3::Z), lamp(0.5 * DVec3::Z)];
    let world = World::new(above(lamps, vec![floor(2.0)]));
    let expected = f64::from(HALF) * (1.0 + 4.0) / PI;
    for connection_samples in [1, 2, 3, 4] {
        let parameters =
            Parameters { connection_samples, ..up_to_depth(connected(24, WIDE, 24), 2) };
        let values = &film_means(&world, &parameters, SEEDS)[GREY];
        let estimate = Estimate::of(values);
        estimate.assert_equals(&format!("{connection_samples} samples"), expected, 1e-3);
        let is_exact = estimate.standard_error < 1e-5 * expected;
        assert_eq!(is_exact, connection_samples % 2 == 0, "{}", estimate.standard_error);
    }
}

/// Places along a beam that nothing scatters at count as dark, and do not move the lamps of the places after them.
#[test]
fn places_without_fog_leave_the_other_samples_where_they_are() {
    // One view ray through an atmosphere under the sun: albedo p (1 - exp(-tau (1 + slant))) / (1 + slant), as above. It is so low
    // that its density is 0 in single precision above 104 scale heights, where a lamp hangs that lights next to nothing but
    // has nearly half of all places drawn near it.
    let (slant, albedo) = (1.25, 0.7f32);
    let (scale_height, tau) = (0.01, 1.0f64);
    let sun = Lamp::Sun { direction: DVec3::new(0.6, 0.0, -0.8), irradiance: Rgb::ONE };
    let position = DVec3::new(0.1, 0.0, 1.8);
    let high = Lamp::Point { position, intensity: Rgb::splat(1e-6), medium: FOG };
    let top =
        Shape::Rectangle { center: 2.0 * DVec3::Z, half_u: 9.0 * DVec3::X, half_v: 9.0 * DVec3::Y };
    let black = Surface { material: matt(0.0), ..floor(9.0) }.between(FOG, VACUUM);
    let surfaces = vec![black, Surface::new(top, Material::Null).between(VACUUM, FOG)];
    let sigma_t = Rgb::splat((tau / scale_height) as f32);
    let profile = Profile::Exponential { scale_height };
    let fog = Fog { profile, ..Fog::uniform(sigma_t, Rgb::splat(albedo), Phase::Isotropic) };
    let mut contents = Contents { fogs: vec![fog], ..above(vec![sun, high], surfaces) };
    contents.camera.film_size = [1, 1];
    let scattered = -(-tau * (1.0 + slant)).exp_m1() / (1.0 + slant);
    let expected = f64::from(albedo) / (4.0 * PI) * scattered;
    for connection_samples in [1, 2] {
        let parameters =
            Parameters { connection_samples, ..up_to_depth(connected(800, WIDE, 800), 2) };
        let name = format!("{connection_samples} samples");
        // The table of the atmosphere is a broken line.
        assert_film_noticing(0.2, &name, contents.clone(), &parameters, [expected; 3], 0.01);
    }
}

/// Under the open sky every other sample of its directions finds light, and no photon of a pilot the window that is looked at: that
/// these show no noise must not speak for them.
#[test]
fn a_trial_does_not_trust_photons_that_were_not_seen() {
    let open = Parameters { photons: 0, connections: None, passes: 1, ..Parameters::default() };
    let world = World::new(above(vec![sky()], vec![floor(2.0)]));
    let stats = method::render(&world, &up_to_depth(open, 2), &mut Silent).unwrap().stats;
    assert!(stats.connections.visible_points);
    assert_eq!(stats.connections.samples, stats.parameters.connection_samples);
    assert!(stats.connections.samples > 1, "{} samples", stats.connections.samples);
}
