//! Memory per receiver: sizes are deterministic, so that bounds are stated without statistics.

use crate::scenes::*;
use glam::DVec3;
use vpt::analytic::{Camera, Contents, Fog, Surface, World};
use vpt::math::Rgb;
use vpt::method::{render, Method, Parameters, Preset, Silent};
use vpt::scene::Phase;

/// Bytes at most, where reflectances and extinctions are constant and the camera is a pinhole.
const PER_VIEW_BEAM: f64 = 96.0;
const PER_VISIBLE_POINT: f64 = 64.0;

/// A matt ball in fog, seen from within the fog by so many pixels, and closely enough that it fills the film.
fn ball_in_fog(film_size: [u32; 2]) -> World {
    let camera = Camera::new(2.0 * DVec3::Z, -DVec3::Z, film_size, pinhole(0.3)).inside(FOG);
    let ball = Surface::new(sphere(1.0), matt(HALF)).between(FOG, FOG);
    let fog = Fog::uniform(Rgb::splat(0.2), Rgb::splat(0.8), Phase::Isotropic);
    World::new(Contents {
        surfaces: vec![ball],
        fogs: vec![fog],
        lamps: vec![sky()],
        ..empty(camera)
    })
}

#[test]
fn receivers_of_the_plain_case_are_small() {
    // Every pixel sees one beam and one point. A beam takes 28 bytes beside the 32 of its segment, and as much of the grid
    // as 4 bytes for each of about as many cells. A point takes 36, and of the tree 12 for every place of a bucket, of
    // which more than 4 in 8 are filled, with 8 for its plane: 62 at most. The films fill
    // buckets by 6.25, by as little as 4.06, and entirely.
    for film_size in [[160, 160], [64, 65], [64, 64]] {
        let world = ball_in_fog(film_size);
        for parameters in [Preset::Fast.parameters(), one_pass(1000, 0.01)] {
            let parameters =
                Parameters { method: Method::Ppt, passes: 1, photons: 1000, ..parameters };
            let stats = render(&world, &parameters, &mut Silent).expect("it renders").stats;
            let pixels = u64::from(film_size[0] * film_size[1]);
            assert_eq!([stats.counters.view_beams, stats.counters.visible_points], [pixels; 2]);
            let beam = stats.memory.bytes_per_view_beam.expect("beams are seen");
            let point = stats.memory.bytes_per_visible_point.expect("points are seen");
            assert!((28.0 + 32.0..=PER_VIEW_BEAM).contains(&beam), "{beam} at {film_size:?}");
            assert!((36.0 + 12.0..=PER_VISIBLE_POINT).contains(&point), "{point} at {film_size:?}");
        }
    }
}
