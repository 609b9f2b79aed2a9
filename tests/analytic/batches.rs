//! How a host wants its batches does not change what is rendered.

use crate::furnace::{fog_furnace, seen_inside_the_ball};
use crate::scenes::*;
use statistics::t_test::Estimate;
use vpt::analytic::World;
use vpt::math::Rgb;
use vpt::method::{Method, Parameters, Preset};
use vpt::scene::{Batching, Phase};

/// One thread drives the host, and the others gather meanwhile.
const ONE_DRIVER: Batching = Batching { lanes: 1024, concurrent: false, launch: 1 };
/// As for a host whose calls are dear: 16 steps at once as soon as fewer than 64 walks are alive, 2 from 512 on.
const LONG_CALLS: Batching = Batching { lanes: 1024, concurrent: false, launch: 1024 };

#[test]
fn gathering_beside_tracing_finds_the_same() {
    for method in [Method::Ppt, Method::Ppbt] {
        let scene = || World::new(fog_furnace(Rgb::ONE, Phase::Isotropic));
        let parameters = Parameters { method, ..one_pass(5000, 0.1) };
        let expected = film_means(&scene(), &parameters, 2);
        let found = film_means(&scene().in_batches(ONE_DRIVER), &parameters, 2);
        for (found, expected) in found.iter().flatten().zip(expected.iter().flatten()) {
            assert!((found / expected - 1.0).abs() < 1e-6, "{method:?}: {found}, not {expected}");
        }
    }
}

#[test]
fn several_steps_in_a_call_are_steps() {
    let expected = seen_inside_the_ball(|t| t, 1.0, 0.1);
    for (method, photons) in
        [(Method::Ppt, 40_000), (Method::Apa, 40_000), (Method::PptMetro, 60_000)]
    {
        let world = World::new(fog_furnace(Rgb::ONE, Phase::Isotropic)).in_batches(LONG_CALLS);
        let parameters = Parameters { method, ..one_pass(photons, 0.1) };
        let means = film_means(&world, &parameters, SEEDS);
        Estimate::of(&means[GREY]).assert_equals(&format!("{method:?}"), expected, 0.0);
    }
}

/// The fluence is flat and white walls lose nothing: the fast preset's photons, connections and rays of emission add up to
/// the same as the paper's photons.
#[test]
fn presets_agree() {
    let world = World::new(fog_furnace(Rgb::ONE, Phase::Isotropic));
    let expected = seen_inside_the_ball(|t| t, 1.0, 0.03);
    let parameters = Parameters {
        passes: 48,
        surface_radius: 0.03,
        medium_radius: 0.03,
        alpha: 1.0 - f32::EPSILON,
        ..Preset::Fast.parameters()
    };
    let means = film_means(&world, &parameters, SEEDS);
    // The part that connections find is not blurred: where the kernel darkens the rim by 0.2 %, they do not.
    Estimate::of(&means[GREY]).assert_equals("fast", expected, 0.002);
}
