//! Ranges of passes by the library alone, in a scene of closed forms.

use glam::DVec3;
use proptest::prelude::*;
use vpt::analytic::{
    Camera, Contents, Disclosure, Fog, Lamp, Material, Projection, Shape, Surface, World,
};
use vpt::markov::Mode;
use vpt::math::Rgb;
use vpt::method::{self, Gathered, Method, Parameters, Preset, RenderError, Silent};
use vpt::scene::{Phase, VACUUM};

const FOG: u32 = 0;

/// A half-space of fog under the sky, seen from outside.
fn world() -> World {
    let top =
        Shape::Rectangle { center: DVec3::ZERO, half_u: 10.0 * DVec3::X, half_v: 10.0 * DVec3::Y };
    let projection = Projection::Orthographic { width: 2.0 };
    World::new(Contents {
        camera: Camera::new(4.0 * DVec3::Z, -DVec3::Z, [6, 5], projection),
        surfaces: vec![Surface::new(top, Material::Null).between(VACUUM, FOG)],
        fogs: vec![Fog::uniform(Rgb::ONE, Rgb::splat(0.8), Phase::Isotropic)],
        lamps: vec![Lamp::Sky { radiance: Rgb::ONE }],
        disclosure: Disclosure::Full,
    })
}

fn parameters(method: Method) -> Parameters {
    // No photons are given: the pilot chooses them. Few, so that the tests are quick.
    Parameters { method, seed: 5, ..Preset::Fast.parameters() }
}

/// What the passes of a range bring.
fn gathered(world: &World, parameters: &Parameters, first: u32, end: u32) -> Gathered {
    let own = Parameters { first_pass: first, passes: end - first, ..parameters.clone() };
    let outcome = method::render(world, &own, &mut Silent).unwrap();
    assert_eq!(outcome.stats.passes, end - first);
    outcome.gathered
}

/// The ranges between marks, merged in an order that is not theirs.
fn merged(world: &World, parameters: &Parameters, marks: &[u32]) -> Gathered {
    let ranges: Vec<_> = marks.windows(2).map(|pair| (pair[0], pair[1])).collect();
    let mut parts = ranges.iter().map(|&(first, end)| gathered(world, parameters, first, end));
    let mut sum = parts.next().unwrap();
    let mut others: Vec<_> = parts.collect();
    others.reverse();
    others.iter().for_each(|part| sum.merge(part));
    sum
}

fn assert_same_films(a: &Gathered, b: &Gathered) {
    assert!(a.film == b.film, "the films differ");
    assert!(a.emission == b.emission, "the films of emission differ");
    assert_eq!((a.passes, a.counters), (b.passes, b.counters));
}

#[test]
fn ranges_add_up_to_the_whole_with_every_uniform_method() {
    let world = world();
    for method in [Method::Ppt, Method::Ppbt, Method::Apa, Method::Ppb] {
        let parameters = parameters(method);
        let whole = gathered(&world, &parameters, 0, 7);
        assert_same_films(&merged(&world, &parameters, &[0, 1, 4, 7]), &whole);
    }
}

#[test]
fn given_photons_and_jitters_of_several_passes_add_up() {
    let world = world();
    let parameters =
        Parameters { photons: 3000, jitter_every: 2, layers: true, ..parameters(Method::Ppt) };
    let whole = gathered(&world, &parameters, 0, 7);
    let merged = merged(&world, &parameters, &[0, 2, 6, 7]);
    assert_same_films(&merged, &whole);
    assert!(merged.layers == whole.layers);
    let [merged, whole] = [merged, whole].map(|gathered| gathered.error.unwrap());
    let [merged, whole] = [merged, whole].map(|error| error.estimate().unwrap());
    assert_eq!(merged.jitters, whole.jitters);
    assert!((merged.relative / whole.relative - 1.0).abs() < 1e-4, "{merged:?} {whole:?}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(12))]

    #[test]
    fn random_splits_add_up(cuts in prop::collection::btree_set(1..9u32, 0..5)) {
        let world = world();
        let parameters = Parameters { photons: 500, ..parameters(Method::Ppt) };
        let marks: Vec<u32> = [0].into_iter().chain(cuts).chain([9]).collect();
        let whole = gathered(&world, &parameters, 0, 9);
        assert_same_films(&merged(&world, &parameters, &marks), &whole);
    }
}

/// A render that takes up what another gathered is the render that was never interrupted, the trend of its errors included.
#[test]
fn what_is_taken_up_goes_on() {
    let world = world();
    let parameters = Parameters { passes: 6, ..parameters(Method::Ppbt) };
    let whole = gathered(&world, &parameters, 0, 6);
    for done in [0, 1, 4, 6] {
        let mut first = method::begin(&world, &parameters).unwrap();
        (0..done).for_each(|_| first.advance().unwrap());
        let mut second = method::begin(&world, &parameters).unwrap();
        second.take_up(first.gathered().clone());
        assert_eq!(second.progress().passes_done, done);
        (done..6).for_each(|_| second.advance().unwrap());
        let film = second.film();
        let outcome = second.finish().unwrap();
        assert!(film == outcome.film);
        assert_same_films(&outcome.gathered, &whole);
        assert!(outcome.gathered.error == whole.error, "{done}");
    }
}

/// The jitter under way is in the film, and not in what others can take up.
#[test]
fn only_whole_jitters_are_gathered() {
    let world = world();
    let parameters = Parameters { photons: 500, jitter_every: 3, ..parameters(Method::Ppt) };
    let mut render = method::begin(&world, &parameters).unwrap();
    (0..4).for_each(|_| render.advance().unwrap());
    assert_eq!((render.progress().passes_done, render.gathered().passes), (4, 3));
    let so_far = render.film();
    let outcome = render.finish().unwrap();
    assert!(so_far == outcome.film);
    assert_eq!(outcome.gathered.passes, 4);
}

#[test]
fn jitters_cannot_be_split() {
    let world = world();
    let split = Parameters { first_pass: 6, jitter_every: 4, ..parameters(Method::Ppt) };
    let Err(RenderError::Parameter(error)) = method::begin(&world, &split).map(drop) else {
        panic!("a jitter was split")
    };
    let message = error.to_string();
    for part in ["begin at 6", "4 passes (jitter_every)", "begin at 4 or 8"] {
        assert!(message.contains(part), "no {part:?} in: {message}");
    }
    // `apa` jitters in every pass, whatever the parameter.
    let apa = Parameters { method: Method::Apa, ..split };
    assert!(method::begin(&world, &apa).is_ok());
}

/// Chains begin anew with each range: other samples of the same estimator. The counts that normalise them add up.
#[test]
fn chains_of_ranges_render_the_same_picture() {
    let world = world();
    let parameters = Parameters { photons: 20_000, ..parameters(Method::PptMetro) };
    let whole = gathered(&world, &parameters, 0, 16);
    let merged = merged(&world, &parameters, &[0, 4, 8, 16]);
    assert_eq!(merged.passes, 16);
    let medium = merged.shooting.medium;
    assert_eq!(medium.mode, Mode::Metropolis);
    let share = medium.visible_walks as f64 / medium.uniform_walks as f64;
    assert!((medium.visible_share - share).abs() < 1e-12 && share > 0.0 && share < 1.0);
    let mean = |gathered: &Gathered| {
        let film = gathered.picture(5).means(5);
        film.iter().flatten().map(|&value| f64::from(value)).sum::<f64>() / (3 * film.len()) as f64
    };
    // 16 passes of 20,000 walks over 30 pixels: each mean is known to well below 1 %.
    let ratio = mean(&merged) / mean(&whole);
    assert!((ratio - 1.0).abs() < 0.03, "{ratio}");
}
