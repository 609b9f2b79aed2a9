//! The engine against an estimator without trees, photon by photon.
//!
//! Both draw the same numbers, so the pictures must agree but for rounding: a photon that lies on the
//! edge of a kernel may count for one and not for the other. The scenes have everything at once, in
//! places where receivers crowd and overlap.

#[path = "support/brute_force.rs"]
mod brute_force;

use glam::DVec3;
use vpt::analytic::{
    Camera, Contents, Disclosure, Fog, Lamp, Material, Profile, Projection, Shape, Surface, World,
    FILM_CHANNELS,
};
use vpt::density::radius::Schedule;
use vpt::math::{Aabb, Rgb};
use vpt::method::{self, Method, Parameters, Preset, Silent};
use vpt::scene::{PathLimits, Phase, VACUUM};
use vpt::transport::photon_beam::BeamKind;

/// Share of the light by which the pictures may differ: some ten photons on the edge of a kernel.
const EDGES: f64 = 2e-4;
/// The same where the engine's tables stand for the integral of the extinction.
const TABLES: f64 = 3e-3;

const FOG: u32 = 0;
const FOG_IN_GLASS: u32 = 1;

const GLASS: Material = Material::Dielectric { index: 1.4 };

/// A room of fog with a ball of another fog, in glass or not, a matt floor, a sheet that light must not
/// pass, a luminous panel, a lamp and a sky outside.
fn everything(ball: Material) -> Contents {
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let sphere = |center, radius| Shape::Sphere { center, radius, inward: false };
    let sheet = |center, half_u, half_v| Shape::Rectangle { center, half_u, half_v };
    let matt = |r, g, b| Material::Lambertian { reflectance: Rgb::new(r, g, b) };
    let bounds = Aabb { min: DVec3::splat(-2.0).as_vec3(), max: DVec3::splat(2.0).as_vec3() };
    let forward = Phase::HenyeyGreenstein { g: 0.6 };
    let fog = Fog::uniform(Rgb::new(0.3, 0.4, 0.6), Rgb::new(0.9, 0.8, 0.7), Phase::Isotropic);
    let thick = Fog::uniform(Rgb::new(3.0, 2.0, 1.0), Rgb::new(0.5, 0.9, 0.99), forward);
    let eye = DVec3::new(0.0, 0.3, -3.0);
    let lens = Projection::Perspective { half_width_tangent: 0.4 };
    Contents {
        camera: Camera::new(eye, z, [24, 16], lens),
        surfaces: vec![
            Surface::new(sphere(DVec3::ZERO, 2.0), Material::Null).between(VACUUM, FOG),
            Surface::new(sphere(0.4 * x, 0.5), ball).between(FOG, FOG_IN_GLASS),
            Surface::new(sheet(-0.6 * y, 1.2 * x, -1.2 * z), matt(0.8, 0.6, 0.4)).between(FOG, FOG),
            Surface::new(sheet(-0.8 * x, 0.5 * y, 0.5 * z), matt(0.2, 0.9, 0.5)).between(FOG, FOG),
            Surface::new(sheet(z + y, 0.4 * x, 0.2 * y), matt(0.1, 0.1, 0.1))
                .emitting(Rgb::new(2.0, 1.0, 3.0))
                .between(FOG, FOG),
        ],
        fogs: vec![Fog { bounds, ..fog }, Fog { bounds, ..thick }],
        lamps: vec![
            Lamp::Point { position: y, intensity: Rgb::new(1.0, 2.0, 1.0), medium: FOG },
            Lamp::Sky { radiance: Rgb::new(0.1, 0.2, 0.3) },
        ],
        disclosure: Disclosure::Full,
    }
}

/// Without Russian roulette of view rays, for which the oracle has no numbers.
fn parameters() -> Parameters {
    let defaults = Preset::Paper.parameters();
    Parameters {
        limits: PathLimits { rr_depth: 12, ..defaults.limits },
        passes: 3,
        photons: 5000,
        jitter_every: 2,
        surface_radius: 0.1,
        medium_radius: 0.07,
        radius_schedule: Schedule::Matched,
        ..defaults
    }
}

/// Pixels are compared one by one; the sum of their differences is a share of the sum of their values.
#[track_caller]
fn assert_same_picture(contents: Contents, parameters: &Parameters, allowed: f64) {
    let world = World::new(contents);
    let engine = method::render(&world, parameters, &mut Silent).expect("the engine renders").film;
    let oracle = brute_force::render(&world, parameters);
    for channel in 0..FILM_CHANNELS {
        let values = |film: &[f64]| -> Vec<f64> {
            film.iter().skip(channel).step_by(FILM_CHANNELS).copied().collect()
        };
        let (engine, oracle) = (values(&engine.values), values(&oracle.values));
        let difference: f64 = engine.iter().zip(&oracle).map(|(a, b)| (a - b).abs()).sum();
        let sum: f64 = oracle.iter().sum();
        println!("channel {channel}: pictures differ by {difference:.2e} of {sum:.2e}");
        assert!(difference <= allowed * sum, "channel {channel}: {difference} of {sum}");
    }
}

#[test]
fn with_what_the_engine_knows() {
    assert_same_picture(everything(GLASS), &parameters(), EDGES);
}

// The engine draws numbers for its tables from the stream of the view rays, and so chooses other lobes of
// glass than the oracle where a medium varies or has to be asked about.

#[test]
fn with_what_the_engine_must_ask() {
    let scene = Contents { disclosure: Disclosure::OnRequest, ..everything(Material::Null) };
    assert_same_picture(scene, &parameters(), EDGES);
}

#[test]
fn with_a_varying_medium() {
    let mut scene = everything(Material::Null);
    scene.fogs[FOG as usize].profile = Profile::Exponential { scale_height: 1.0 };
    assert_same_picture(scene, &parameters(), TABLES);
}

/// The picture of a method that keeps its photons is that of the one that does not, if both have new view
/// rays in every pass: the same photons meet the same receivers.
#[track_caller]
fn assert_same_as_stored(contents: Contents, shot: Parameters, stored: Method) {
    let world = World::new(contents);
    let picture = |parameters: &Parameters| -> Vec<f64> {
        method::render(&world, parameters, &mut Silent).expect("it renders").film.values
    };
    let shot = Parameters { jitter_every: 1, ..shot };
    let (ours, baseline) = (picture(&shot), picture(&Parameters { method: stored, ..shot }));
    let difference: f64 = ours.iter().zip(&baseline).map(|(a, b)| (a - b).abs()).sum();
    let sum: f64 = ours.iter().sum();
    println!("{} and {}: {difference:.2e} of {sum:.2e}", shot.method.name(), stored.name());
    // The order of additions, in double precision over single-precision terms.
    assert!(difference <= 1e-9 * sum, "{difference} of {sum}");
}

#[test]
fn photon_maps_see_what_the_trees_of_the_view_see() {
    for disclosure in [Disclosure::Full, Disclosure::OnRequest] {
        let scene = |material| Contents { disclosure, ..everything(material) };
        assert_same_as_stored(scene(GLASS), parameters(), Method::Apa);
        for photon_beams in [BeamKind::Short, BeamKind::Long] {
            let method = Method::Ppbt;
            let beams = Parameters { method, photon_beams, photons: 1000, ..parameters() };
            assert_same_as_stored(scene(GLASS), beams.clone(), Method::Ppb);
            let mut varying = scene(Material::Null);
            varying.fogs[FOG as usize].profile = Profile::Exponential { scale_height: 1.0 };
            assert_same_as_stored(varying, beams, Method::Ppb);
        }
    }
}

#[test]
fn with_limits_and_the_printed_schedule() {
    for max_depth in 0..5 {
        let limits = PathLimits { max_depth, hide_emitters: true, ..parameters().limits };
        let parameters =
            Parameters { limits, radius_schedule: Schedule::Paper, seed: 7, ..parameters() };
        assert_same_picture(everything(GLASS), &parameters, EDGES);
    }
}
