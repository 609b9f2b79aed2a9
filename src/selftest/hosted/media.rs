//! Boxes of fog in fog.

use crate::method::{Method, Parameters};
use crate::selftest::case::Case;
use crate::selftest::trial::{Expected, Trial};
use crate::selftest::worlds::one_pass;
use crate::selftest::SelftestError;

pub const CASES: &[Case] = &[
    Case {
        name: "nested_media",
        claim: "white fog in white fog under a sky of radiance 1 is 1, from outside, inside, on and at every boundary",
        run: nested_media,
    },
    Case {
        name: "thin_and_thick_media",
        claim: "boxes of white fog of sigma_t 1e-6 to 1e2 are 1 under a sky of radiance 1",
        run: thin_and_thick_media,
    },
    Case {
        name: "overlapping_media",
        claim: "white fogs that overlap, with boundaries that contradict each other, show no more than their sky",
        run: overlapping_media,
    },
    Case {
        name: "moved_media",
        claim: "white fog in white fog is 1 at 10 and 100 from the origin of Mitsuba's f32 coordinates",
        run: moved_media,
    },
];

const FURNACE: &str = include_str!("../scenes/furnace_boxes.xml");

/// Parallel rays that stand on the boundaries: what the kernel covers beside a ray begins and ends where the ray
/// does, so that it blurs nothing.
fn nested_media(trial: &mut Trial) -> Result<(), SelftestError> {
    for (what, z, medium) in [
        ("outside", "3", "vacuum"),
        ("on the boundary", "1", "vacuum"),
        ("on its inside", "1", "outer"),
        ("inside", "0.75", "outer"),
        ("in the inner", "0", "inner"),
    ] {
        let defines = [("z", z.to_owned()), ("camera_medium", medium.to_owned())];
        let scene = trial.bench.load(FURNACE, &defines)?;
        let lent = scene.lend(0)?;
        let methods: &[Method] = if z == "3" { &Method::ALL } else { &[Method::Ppt, Method::Ppbt] };
        let parameters = one_pass(3000, 0.25);
        trial.film_by(methods, what, lent.scene(), &parameters, Expected::grey(1.0))?;
    }
    Ok(())
}

/// A walk through the box has 4/3 sigma_t segments on average.
fn thin_and_thick_media(trial: &mut Trial) -> Result<(), SelftestError> {
    // Where connections bring what the sky sends straight, photons bring the rest alone. That falls toward the boundaries of the
    // inner box, over half of its width of 1 at its optical depth of 4: their kernel misses half of its square at most (measured:
    // 2.3, 0.7 and 0.3 % at radii of 0.25, 0.125 and 0.08).
    const RADIUS: f64 = 0.25;
    for sigma_t in ["1e-6", "1e-3", "1e2"] {
        let scene = trial.bench.load(FURNACE, &[("sigma_t", sigma_t.to_owned())])?;
        let lent = scene.lend(0)?;
        let what = format!("sigma_t {sigma_t}");
        let methods = [Method::Ppt, Method::Ppbt];
        let expected = Expected::grey(1.0).noticing(0.5).with_bias(0.5 * RADIUS * RADIUS);
        trial.film_by(&methods, &what, lent.scene(), &one_pass(12_000, RADIUS), expected)?;
    }
    Ok(())
}

/// The boxes overlap by half; each says that vacuum is outside of it. Light is then not reciprocal: photons and view rays
/// that come from different sides disagree on the medium between them, and what one of them calls vacuum is dark.
fn overlapping_media(trial: &mut Trial) -> Result<(), SelftestError> {
    let defines = [("inner_x", "0.6".to_owned()), ("outside", "vacuum".to_owned())];
    let scene = trial.bench.load(FURNACE, &defines)?;
    let lent = scene.lend(0)?;
    for method in Method::ALL {
        let parameters = Parameters { method, ..one_pass(3000, 0.25) };
        trial.at_most(method.name(), lent.scene(), &parameters, 1.0)?;
    }
    Ok(())
}

/// Mitsuba moves rays off a boundary by 9e-5 of the coordinate, so that light goes in past a layer of optical depth
/// 4 times that, which scatters what comes out: at most this share more.
fn moved_media(trial: &mut Trial) -> Result<(), SelftestError> {
    for x in [10.0, 100.0] {
        let scene = trial.bench.load(FURNACE, &[("x", x.to_string())])?;
        let lent = scene.lend(0)?;
        let expected = Expected::grey(1.0).with_bias(4.0 * 9e-5 * x);
        let what = format!("by {x:.0e}");
        trial.film_by(&Method::ALL, &what, lent.scene(), &one_pass(3000, 0.25), expected)?;
    }
    Ok(())
}
