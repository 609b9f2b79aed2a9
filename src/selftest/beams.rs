//! Photons and view rays side by side, and beams without length or without end.

use super::case::Case;
use super::closed_forms::integrate;
use super::trial::{Expected, Trial};
use super::worlds::{empty, one_pass, up_to_depth, BEAMS, FOG, POINTS};
use super::SelftestError;
use crate::analytic::{Camera, Contents, Fog, Lamp, Material, Projection, Shape, Surface, World};
use crate::effect::Effects;
use crate::math::Rgb;
use crate::method::{Method, Parameters};
use crate::scene::{Phase, VACUUM};
use crate::transport::photon_beam::BeamKind;
use glam::DVec3;
use std::f64::consts::PI;

pub const CASES: &[Case] = &[
    Case {
        name: "narrow_lobes",
        claim: "a laser in fog of |g| up to 0.9999 shows E int sigma_s p exp(-sigma_t s) ds at 0 to 0.01 from its axis",
        run: narrow_lobes,
    },
    Case {
        name: "laser_beams",
        claim: "photon beams show the same laser at 0.01 from its axis and, by their ends, straight into it",
        run: laser_beams,
    },
    Case {
        name: "coloured_laser",
        claim: "a laser shows the same integral in channels whose sigma_t is 0.01, 1 and 100",
        run: coloured_laser,
    },
    Case {
        name: "grazing_laser",
        claim: "a laser that grazes dense fog at a cosine of 1e-2 and 3e-3 shows the same integral",
        run: grazing_laser,
    },
    Case {
        name: "beams_of_no_length",
        claim: "a layer of fog thinner than a rounding of its coordinates shows the lit floor behind it",
        run: beams_of_no_length,
    },
    Case {
        name: "endless_fog",
        claim: "fog without an end shows int I/d² exp(-sigma_t (d+t)) sigma_s/(4 pi) dt of a point lamp",
        run: endless_fog,
    },
];

/// Of the slab, along z; its half-width, and the film's.
const DEPTH: f64 = 1.0;
const HALF_WIDTH: f64 = 1.0;
const WINDOW: f64 = 0.4;
const SIGMA_T: f64 = 0.5;
const ALBEDO: f32 = 0.8;
const RADIUS: f64 = 0.2;

/// A slab of fog from z = -1 to 0 under parallel light of irradiance 1, at an angle to the vertical; seen along
/// the vertical, from below where the fog scatters forward, else from above.
fn laser(sigma_t: Rgb, g: f32, angle: f64) -> Contents {
    let (half_u, half_v) = (HALF_WIDTH * DVec3::X, HALF_WIDTH * DVec3::Y);
    let top = Shape::Rectangle { center: DVec3::ZERO, half_u, half_v };
    let bottom = Shape::Rectangle { center: -DEPTH * DVec3::Z, half_u, half_v };
    let into_light = if g > 0.0 { DVec3::Z } else { -DVec3::Z };
    let eye = -0.5 * DEPTH * DVec3::Z - 2.0 * into_light;
    let camera = Camera::new(eye, into_light, [4, 4], Projection::Orthographic { width: WINDOW });
    let direction = DVec3::new(angle.sin(), 0.0, -angle.cos());
    let phase = Phase::HenyeyGreenstein { g };
    Contents {
        surfaces: vec![
            Surface::new(top, Material::Null).between(VACUUM, FOG),
            Surface::new(bottom, Material::Null).between(FOG, VACUUM),
        ],
        fogs: vec![Fog::uniform(sigma_t, Rgb::splat(ALBEDO), phase)],
        lamps: vec![Lamp::Sun { direction, irradiance: Rgb::ONE }],
        ..empty(camera)
    }
}

/// Light comes in over `s / cos(angle)` and goes out over the rest of the slab, or back the way that it came.
fn laser_seen(sigma_t: f64, g: f32, angle: f64) -> f64 {
    let g = f64::from(g);
    // The smaller angle between the view ray's axis and the light's, and 1 - |g| as they enter the lobe.
    let from_peak = 4.0 * (0.5 * angle).sin().powi(2);
    let lobe = ((1.0 - g.abs()).powi(2) + g.abs() * from_peak).powf(1.5);
    let phase = (1.0 - g * g) / (4.0 * PI * lobe);
    // The integral over s of exp(-sigma_t (s / cos(angle) + out)), where out is s, or what is left of the slab.
    let (rate, way_out) =
        if g > 0.0 { (1.0 / angle.cos() - 1.0, DEPTH) } else { (1.0 / angle.cos() + 1.0, 0.0) };
    let depth = sigma_t * rate * DEPTH;
    let mean = if depth > 0.0 { -(-depth).exp_m1() / depth } else { 1.0 };
    let column = DEPTH * mean * (-sigma_t * way_out).exp();
    sigma_t * f64::from(ALBEDO) * phase * column
}

fn narrow_lobes(trial: &mut Trial) -> Result<(), SelftestError> {
    for g in [0.9f32, 0.9999, -0.9999] {
        for angle in [0.0, 1e-4, 1e-2] {
            let world = World::new(laser(Rgb::splat(SIGMA_T as f32), g, angle));
            let parameters = up_to_depth(one_pass(4000, RADIUS), 2);
            let what = format!("g {g}, {angle:.0e}");
            let expected = Expected::grey(laser_seen(SIGMA_T, g, angle));
            trial.film_by(&POINTS, &what, &world, &parameters, expected)?;
        }
    }
    Ok(())
}

fn laser_beams(trial: &mut Trial) -> Result<(), SelftestError> {
    let sigma_t = Rgb::splat(SIGMA_T as f32);
    let (oblique, parallel) = (laser(sigma_t, 0.9, 1e-2), laser(sigma_t, 0.9, 0.0));
    let (oblique, parallel) = (World::new(oblique), World::new(parallel));
    for kind in [BeamKind::Short, BeamKind::Long] {
        let parameters = up_to_depth(one_pass(10_000, RADIUS), 2);
        let parameters = Parameters { photon_beams: kind, ..parameters };
        let expected = Expected::grey(laser_seen(SIGMA_T, 0.9, 1e-2));
        trial.film_by(&BEAMS, &format!("{kind:?}"), &oblique, &parameters, expected)?;
        let expected = Expected::grey(laser_seen(SIGMA_T, 0.9, 0.0));
        trial.film_by(&BEAMS, &format!("{kind:?} into it"), &parallel, &parameters, expected)?;
    }
    Ok(())
}

/// From above, where all channels see something. Light comes in at an angle whose lobe is that of no angle, as g is 0.
fn coloured_laser(trial: &mut Trial) -> Result<(), SelftestError> {
    let sigma_t = [0.01f32, 1.0, 100.0];
    let rgb = Rgb::new(sigma_t[0], sigma_t[1], sigma_t[2]);
    let world = World::new(laser(rgb, 0.0, 0.5));
    let seen = sigma_t.map(|sigma_t| laser_seen(sigma_t.into(), 0.0, 0.5));
    for (kind, methods) in [(BeamKind::Short, &Method::ALL[..]), (BeamKind::Long, &BEAMS)] {
        let parameters = up_to_depth(one_pass(10_000, RADIUS), 2);
        let parameters = Parameters { photon_beams: kind, ..parameters };
        let expected = Expected::rgb(seen).noticing(0.4);
        trial.film_by(methods, &format!("{kind:?}"), &world, &parameters, expected)?;
    }
    Ok(())
}

/// All light is scattered within some cosines of a free path below the top, from where it goes straight up.
fn grazing_laser(trial: &mut Trial) -> Result<(), SelftestError> {
    let sigma_t = 50.0;
    for (cosine, photons) in [(1e-2f64, 100_000), (3e-3, 300_000)] {
        let angle = cosine.acos();
        let world = World::new(laser(Rgb::splat(sigma_t), 0.0, angle));
        let parameters = up_to_depth(one_pass(photons, RADIUS), 2);
        let expected = Expected::grey(laser_seen(sigma_t.into(), 0.0, angle)).noticing(0.4);
        // Of the places that connections draw along a view beam, one in a hundred is lit: by default they would be too noisy.
        for method in POINTS {
            let what = format!("{cosine:.0e} {}", method.name());
            let parameters = Parameters { method, ..parameters.clone() };
            trial.film(&what, &world, &parameters, expected)?;
        }
    }
    Ok(())
}

/// The layer lies at z = 1, where coordinates are multiples of 1e-7, and is 1e-9 thick: every beam in it, of
/// view rays and of photons, begins and ends at one point.
fn beams_of_no_length(trial: &mut Trial) -> Result<(), SelftestError> {
    let (half_u, half_v) = (HALF_WIDTH * DVec3::X, HALF_WIDTH * DVec3::Y);
    let at = |z: f64| Shape::Rectangle { center: z * DVec3::Z, half_u, half_v };
    let projection = Projection::Orthographic { width: WINDOW };
    let reflectance = Rgb::splat(0.5);
    let world = World::new(Contents {
        surfaces: vec![
            Surface::new(at(1.0), Material::Null).between(VACUUM, FOG),
            Surface::new(at(1.0 - 1e-9), Material::Null).between(FOG, VACUUM),
            Surface::new(at(0.0), Material::Lambertian { reflectance }),
        ],
        fogs: vec![Fog::uniform(Rgb::ONE, Rgb::splat(ALBEDO), Phase::Isotropic)],
        lamps: vec![Lamp::Sky { radiance: Rgb::ONE }],
        ..empty(Camera::new(2.0 * DVec3::Z, -DVec3::Z, [4, 4], projection))
    });
    let expected = Expected::grey(0.5);
    trial.film_by(&Method::ALL, "", &world, &one_pass(8000, RADIUS), expected)
}

/// The lamp is 1 beside the view rays, whose nearest point lies 1 before the eye. With no surface at all nothing
/// bounds the scene. The kernel's mean over 1/d² is off by about R²/d² at most.
fn endless_fog(trial: &mut Trial) -> Result<(), SelftestError> {
    let camera = Camera::new(
        DVec3::ZERO,
        -DVec3::Z,
        [4, 4],
        Projection::Perspective { half_width_tangent: 0.01 },
    );
    let lamp =
        Lamp::Point { position: DVec3::new(1.0, 0.0, -1.0), intensity: Rgb::ONE, medium: FOG };
    let contents = Contents {
        fogs: vec![Fog::uniform(Rgb::splat(SIGMA_T as f32), Rgb::splat(ALBEDO), Phase::Isotropic)],
        lamps: vec![lamp],
        ..empty(camera.inside(FOG))
    };
    let seen = integrate(0.0, 60.0, 60_000, |t| {
        let distance = 1f64.hypot(t - 1.0);
        (-SIGMA_T * (distance + t)).exp() / (distance * distance)
    });
    let seen = seen * SIGMA_T * f64::from(ALBEDO) / (4.0 * PI);
    let expected = Expected::grey(seen).with_bias(RADIUS * RADIUS);
    let world = World::new(contents);
    let parameters = up_to_depth(one_pass(8000, RADIUS), 2);
    trial.film_by(&Method::ALL, "short", &world, &parameters, expected)?;
    // What is constant is tabulated all the same.
    let forced = Parameters { effects: Effects::ALL, ..parameters.clone() };
    trial.film_by(&POINTS, "all effects", &world, &forced, expected)?;
    let parameters = Parameters { photon_beams: BeamKind::Long, ..parameters };
    trial.film_by(&BEAMS, "long", &world, &parameters, expected)
}
