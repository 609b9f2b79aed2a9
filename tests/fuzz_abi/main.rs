//! The C ABI under whatever arguments and answers a renderer may come up with: parameters that make no sense,
//! callbacks that fail at any call, values that are not numbers, indices of things that do not exist.
//!
//! What must hold: the call returns (work is bounded by the photons), with a picture of finite values or with a
//! sentence. Bad parameters and failing callbacks are told as such; "internal error" is for renderers that break the
//! promises of the ABI alone.
//!
//! `just fuzz` gives the generators more cases.

#[path = "faulty.rs"]
mod faulty;

use faulty::{Fault, Faulty};
use glam::DVec3;
use proptest::prelude::*;
use proptest::sample::select;
use vpt::analytic::{
    Camera, Contents, Disclosure, Fog, Lamp, Material, Projection, Shape, Surface, World,
};
use vpt::host::loopback::{render, RawParameters, Returned};
use vpt::math::{Aabb, Rgb};
use vpt::method::{self, Method, Parameters, Preset, Silent};
use vpt::scene::{Phase, VACUUM};

const NAMES: [&str; 5] = ["ppt", "", "", "", ""];

/// Fog in glass over a floor, under a lamp and a sky.
fn world(disclosure: Disclosure) -> World {
    let ball = Shape::Sphere { center: DVec3::ZERO, radius: 1.0, inward: false };
    let floor = Shape::Rectangle {
        center: -1.2 * DVec3::Y,
        half_u: 3.0 * DVec3::X,
        half_v: -3.0 * DVec3::Z,
    };
    let bounds = Aabb { min: DVec3::splat(-1.0).as_vec3(), max: DVec3::ONE.as_vec3() };
    let phase = Phase::HenyeyGreenstein { g: 0.4 };
    let fog = Fog::uniform(Rgb::new(0.5, 1.0, 2.0), Rgb::splat(0.8), phase);
    let lens = Projection::Perspective { half_width_tangent: 0.5 };
    World::new(Contents {
        camera: Camera::new(-4.0 * DVec3::Z, DVec3::Z, [6, 4], lens),
        surfaces: vec![
            Surface::new(ball, Material::Dielectric { index: 1.3 }).between(VACUUM, 0),
            Surface::new(floor, Material::Lambertian { reflectance: Rgb::splat(0.6) }),
        ],
        fogs: vec![Fog { bounds, ..fog }],
        lamps: vec![
            Lamp::Point { position: 2.0 * DVec3::Y, intensity: Rgb::ONE, medium: VACUUM },
            Lamp::Sky { radiance: Rgb::splat(0.2) },
        ],
        disclosure,
    })
}

fn small(names: [&str; 5]) -> RawParameters {
    let mut parameters = RawParameters::named(names).unwrap();
    parameters.preset = c"paper".into();
    parameters.numbers.passes = 2;
    parameters.numbers.photons = 300;
    parameters.numbers.threads = 2;
    parameters
}

/// The ABI adds nothing and loses nothing: through it the picture has the very bits of the engine's own.
#[test]
fn a_picture_through_the_abi_has_the_bits_of_the_engine() {
    for disclosure in [Disclosure::Full, Disclosure::OnRequest] {
        let world = world(disclosure);
        for method in Method::ALL {
            let own = Parameters { method, passes: 2, photons: 300, ..Preset::Paper.parameters() };
            let own = method::render(&world, &own, &mut Silent).unwrap();
            let names = [method.name(), "", "", "", ""];
            let returned = render(&world, &small(names), None).unwrap();
            assert_eq!(returned.storage, own.film.values, "{}", method.name());
            assert_eq!(returned.progress_calls, 3);
        }
    }
}

/// What the observer reads after the last pass is what the render returns, be the last jitter under way (the paper's have
/// four passes) or over.
#[test]
fn the_film_between_passes_has_the_bits_of_the_engine() {
    let world = world(Disclosure::Full);
    for preset in [c"paper", c"fast"] {
        let parameters = RawParameters {
            preset: preset.into(),
            reads_film: true,
            ..small(["", "", "", "", ""])
        };
        let returned = render(&world, &parameters, None).unwrap();
        assert!(returned.storage.iter().any(|value| *value > 0.0));
        assert_eq!(returned.last_film, returned.storage, "{preset:?}");
        assert_eq!(returned.progress_calls, 3);
    }
}

/// Layers through the ABI are those of the engine; without them there are zeros.
#[test]
fn layers_through_the_abi_have_the_bits_of_the_engine() {
    let world = world(Disclosure::Full);
    for layers in [true, false] {
        let own = Parameters { layers, passes: 2, photons: 300, ..Preset::Paper.parameters() };
        let own = method::render(&world, &own, &mut Silent).unwrap();
        let mut parameters = small(["ppt", "", "", "", ""]);
        parameters.numbers.layers = layers.into();
        let returned = render(&world, &parameters, None).unwrap();
        assert_eq!(own.layers.is_some(), layers);
        assert!(own.layers.is_none_or(|own| own == returned.layers));
        assert_eq!(returned.layers.iter().any(|value| *value > 0.0), layers);
        assert_eq!(returned.storage, own.film.values);
    }
}

/// The world at wavelengths of which a number says how much fog there is, and on the film how red they are.
fn spectral_world() -> World {
    let at = |number: f32| {
        let mut contents = world(Disclosure::Full).contents().clone();
        contents.fogs[0].sigma_t = Rgb::new(0.5, 1.0, 2.0) * number;
        (contents, [Rgb::new(number, 0.5, 0.0), Rgb::new(0.0, 1.0, number), Rgb::splat(0.3)])
    };
    World::spectral(world(Disclosure::Full).contents().clone(), at)
}

/// So it is for a scene that is tuned anew for each jitter.
#[test]
fn a_picture_of_wavelengths_through_the_abi_has_the_bits_of_the_engine() {
    let world = spectral_world();
    let own = Parameters {
        passes: 3,
        jitter_every: 1,
        photons: 300,
        layers: true,
        ..Preset::Paper.parameters()
    };
    let own = method::render(&world, &own, &mut Silent).unwrap();
    let mut parameters = small(NAMES);
    (parameters.numbers.passes, parameters.numbers.jitter_every) = (3, 1);
    parameters.numbers.layers = 1;
    let returned = render(&world, &parameters, None).unwrap();
    assert_eq!(returned.storage, own.film.values);
    assert_eq!(Some(returned.layers), own.layers);
}

/// A storage of another size than the film's is refused before anything is written to it.
#[test]
fn a_storage_of_the_wrong_size_is_refused() {
    for size in [0, 1, 6 * 4 * 5 - 1, 6 * 4 * 5 + 1] {
        let error = render(&world(Disclosure::Full), &small(NAMES), Some(size)).unwrap_err();
        assert!(error.contains(&format!("holds {size} values")), "{error}");
    }
}

/// Found by the generator below: sums of contributions that are finite each overflowed single precision on the film.
#[test]
fn enormous_answers_leave_a_finite_picture() {
    for method in Method::ALL {
        for disclosure in [Disclosure::Full, Disclosure::OnRequest] {
            for call in 0..20 {
                let world = world(disclosure);
                let faulty = Faulty::new(&world, Fault::Enormous, call);
                let _ = checked(render(&faulty, &small([method.name(), "", "", "", ""]), None));
            }
        }
    }
}

fn odd_integer() -> impl Strategy<Value = i64> {
    prop_oneof![select(vec![i64::MIN, -1, 0, 1, 2, 1 << 32, i64::MAX]), -3_i64..40]
}

fn odd_float() -> impl Strategy<Value = f32> {
    prop_oneof![
        select(vec![0.0, -0.0, f32::NAN, f32::INFINITY, -1.0, 1e-45, 1e-30, f32::MAX]),
        0.0_f32..2.0,
    ]
}

fn name(known: &'static [&'static str]) -> impl Strategy<Value = String> {
    prop_oneof![
        8 => select(known).prop_map(str::to_owned),
        1 => "[ -~]{0,12}",
        1 => "\\PC{0,4}",
    ]
}

prop_compose! {
    /// Parameters as a renderer may fill them in. Photons, passes and threads alone are kept small, since they are
    /// what a render's work is bounded by.
    fn any_parameters()(
        method in name(&["", "ppt", "ppbt", "ppt_metro", "ppbt_metro", "apa", "ppb"]),
        schedule in name(&["", "matched", "paper"]),
        shooting in name(&["", "", "", "uniform", "metropolis", "auto"]),
        beams in name(&["", "short", "long"]),
        effects in name(&["", "auto", "all", "view_beams,depth_of_field", "metropolis_medium"]),
        photons in prop_oneof![select(vec![i64::MIN, -1, 0]), 1_i64..400],
        integers in [odd_integer(), odd_integer(), odd_integer(), odd_integer(), odd_integer()],
        floats in [odd_float(), odd_float(), odd_float()],
        target_error in prop_oneof![Just(0.0), any::<f64>()],
        timeout in prop_oneof![Just(0.0), any::<f64>()],
        (passes, threads, seed, flags) in (0_u32..4, 1_u32..3, any::<u64>(), any::<[bool; 8]>()),
    ) -> RawParameters {
        let names = [&method, &schedule, &shooting, &beams, &effects];
        let names = names.map(|name| name.replace('\0', ""));
        let mut raw = RawParameters::named(names.each_ref().map(String::as_str)).unwrap();
        let numbers = &mut raw.numbers;
        numbers.photons = photons;
        let [chains, jitter_every, max_depth, rr_depth, connection_samples] = integers;
        (numbers.chains, numbers.jitter_every) = (chains, jitter_every);
        (numbers.max_depth, numbers.rr_depth) = (max_depth, rr_depth);
        numbers.connection_samples = connection_samples;
        [numbers.alpha, numbers.surface_radius, numbers.medium_radius] = floats;
        (numbers.target_error, numbers.timeout) = (target_error, timeout);
        (numbers.passes, numbers.threads, numbers.seed) = (passes, threads, seed);
        numbers.hide_emitters = flags[0].into();
        numbers.estimate_error = flags[1].into();
        numbers.connections = u32::from(flags[2]) + u32::from(flags[3]);
        numbers.emission_rays = flags[4].into();
        numbers.glossy_chains = flags[5].into();
        numbers.guided_emission = flags[6].into();
        numbers.layers = flags[7].into();
        raw
    }
}

/// A picture of finite values, or the sentence.
fn checked(result: Result<Returned, String>) -> Result<Returned, String> {
    if let Ok(returned) = &result {
        assert!(returned.storage.iter().all(|value| value.is_finite()));
        assert!(returned.error_image.iter().all(|value| !value.is_nan()));
        assert!(returned.layers.iter().all(|value| value.is_finite()));
    }
    if let Err(sentence) = &result {
        assert!(sentence.len() > 10, "{sentence:?}");
    }
    result
}

/// `PROPTEST_CASES`, or as many as take some seconds.
fn config() -> ProptestConfig {
    let config = ProptestConfig { failure_persistence: None, ..ProptestConfig::default() };
    match std::env::var_os("PROPTEST_CASES") {
        Some(_) => config,
        None => ProptestConfig { cases: 96, ..config },
    }
}

proptest! {
    #![proptest_config(config())]

    /// Whatever the parameters, the engine renders or names what is wrong with them.
    #[test]
    fn any_parameters_end_in_a_picture_or_a_sentence(parameters in any_parameters()) {
        if let Err(sentence) = checked(render(&world(Disclosure::Full), &parameters, None)) {
            prop_assert!(!sentence.contains("internal error"), "{sentence}");
        }
    }

    /// A callback that fails ends the render with its own sentence.
    #[test]
    fn a_failing_callback_is_told(
        method in select(Method::ALL.map(Method::name).to_vec()),
        call in 0_u32..40,
        asks in any::<bool>(),
    ) {
        let disclosure = if asks { Disclosure::OnRequest } else { Disclosure::Full };
        let world = world(disclosure);
        let faulty = Faulty::new(&world, Fault::Fails, call);
        let result = checked(render(&faulty, &small([method, "", "", "", ""]), None));
        match result {
            Ok(_) => prop_assert!(!faulty.struck()),
            Err(sentence) => prop_assert!(sentence.contains("on purpose"), "{sentence}"),
        }
    }

    /// Answers that make no sense: the picture stays finite, and nothing is read or written out of bounds.
    #[test]
    fn senseless_answers_do_no_harm(
        method in select(Method::ALL.map(Method::name).to_vec()),
        fault in select(Fault::SENSELESS.to_vec()),
        call in 0_u32..20,
        asks in any::<bool>(),
    ) {
        let disclosure = if asks { Disclosure::OnRequest } else { Disclosure::Full };
        let world = world(disclosure);
        let faulty = Faulty::new(&world, fault, call);
        let _ = checked(render(&faulty, &small([method, "", "", "", ""]), None));
    }
}
