//! Rooms with luminous walls.
//!
//! In a closed room whose walls all emit L_e and reflect rho, radiance is the same everywhere:
//! L = L_e + rho L = L_e (1 + rho + rho² + ...) = L_e / (1 - rho). White fog does not change it. The
//! estimate takes the photons' light, rho L, with the kernel's error on a sphere.

use crate::furnace::{eye_inside, seen_inside_the_ball, seen_on_a_sphere};
use crate::scenes::*;
use glam::DVec3;
use vpt::analytic::{Camera, Contents, Fog, Material, Shape, Surface, World};
use vpt::math::Rgb;
use vpt::method::Parameters;
use vpt::scene::{PathLimits, Phase, VACUUM};

/// A sphere of radius 1 with luminous walls around the eye, filled with fog if there is one.
pub fn room(reflectance: f32, fog: Option<Fog>) -> Contents {
    let inside = if fog.is_some() { FOG } else { VACUUM };
    let walls = Shape::Sphere { center: DVec3::ZERO, radius: 1.0, inward: true };
    let surface = Surface::new(walls, matt(reflectance)).emitting(Rgb::ONE);
    let camera = match inside {
        VACUUM => Camera::new(DVec3::ZERO, DVec3::X, [8, 8], pinhole(2.0)),
        _ => eye_inside().inside(inside),
    };
    Contents {
        surfaces: vec![surface.between(inside, VACUUM)],
        fogs: fog.into_iter().collect(),
        ..empty(camera)
    }
}

#[test]
fn room_of_luminous_black_walls() {
    assert_film("black room", room(0.0, None), &one_pass(1000, 0.1), [1.0; 3], 0.0);
}

#[test]
fn room_of_luminous_grey_walls() {
    let expected = [1.0 + seen_on_a_sphere(1.0, 0.1); 3];
    assert_film("grey room", room(HALF, None), &one_pass(30_000, 0.1), expected, 0.0);
}

#[test]
fn room_of_luminous_black_walls_with_fog() {
    let fog = ball_of_fog(1.0, Rgb::ONE, Phase::Isotropic);
    let expected = [seen_inside_the_ball(|t| t, 1.0, 0.1); 3];
    let scene = room(0.0, Some(fog));
    assert_film("black room with fog", scene, &one_pass(40_000, 0.1), expected, 0.0);
}

#[test]
fn room_of_luminous_grey_walls_with_fog() {
    let fog = ball_of_fog(1.0, Rgb::ONE, Phase::HenyeyGreenstein { g: 0.3 });
    // Twice the furnace of radiance 1: of its wall, half is its own light and half is the photons'.
    let wall = 0.5 + 0.5 * seen_on_a_sphere(1.0, 0.1);
    let expected = [2.0 * seen_inside_the_ball(|t| t, wall, 0.1); 3];
    let scene = room(HALF, Some(fog));
    assert_film("grey room with fog", scene, &one_pass(50_000, 0.1), expected, 0.0);
}

#[test]
fn room_cut_at_every_depth() {
    // A path with k reflections is kept while k < max_depth: L = L_e (1 + rho + ... ), max_depth terms.
    for (max_depth, reflected) in [(1, 0.0), (2, 0.5), (3, 0.75), (4, 0.875)] {
        let parameters = up_to_depth(one_pass(30_000, 0.1), max_depth);
        let expected = 1.0 + reflected * seen_on_a_sphere(1.0, 0.1);
        let name = format!("room, max_depth {max_depth}");
        assert_film(&name, room(HALF, None), &parameters, [expected; 3], 0.0);
    }
    let black = film_means(&World::new(room(HALF, None)), &up_to_depth(one_pass(1000, 0.1), 0), 2);
    assert_eq!(black[GREY], [0.0, 0.0], "no path is kept with max_depth 0");
}

#[test]
fn events_on_the_way_to_the_eye_count_as_depth() {
    // The eye sits in a ball of radius 0.05 whose surface has index 1: it changes nothing, but counts as
    // a scattering event. With max_depth 3 a path has at most two: the ball and one reflection. Light
    // that crosses the ball before it is reflected is cut, too. Seen from the wall, the ball covers
    // sin² = 0.05² of the light.
    let mut scene = room(HALF, None);
    scene.surfaces.push(Surface::new(sphere(0.05), Material::Dielectric { index: 1.0 }));
    let expected = 1.0 + 0.5 * seen_on_a_sphere(1.0, 0.1) * (1.0 - 0.0025);
    let parameters = up_to_depth(one_pass(30_000, 0.1), 3);
    assert_film("eye in a ball", scene, &parameters, [expected; 3], 0.0);
}

#[test]
fn russian_roulette_does_not_change_the_mean() {
    for rr_depth in [1, 20] {
        let base = one_pass(30_000, 0.1);
        let expected = [1.0 + seen_on_a_sphere(1.0, 0.1); 3];
        let limits = PathLimits { rr_depth, ..base.limits };
        let name = format!("room, rr_depth {rr_depth}");
        assert_film(&name, room(HALF, None), &Parameters { limits, ..base }, expected, 0.0);
    }
}
