//! Glass around fog, and many reflections between panes.

use crate::method::{Method, Parameters};
use crate::selftest::case::Case;
use crate::selftest::trial::{Expected, Trial};
use crate::selftest::worlds::{one_pass, POINTS};
use crate::selftest::SelftestError;
use std::f64::consts::PI;

pub const CASES: &[Case] = &[
    Case {
        name: "inside_glass",
        claim: "within glass that lies in white fog under a sky of radiance 1 it is n² = 2.25, with fog in the glass or not",
        run: inside_glass,
    },
    Case {
        name: "double_glazing",
        claim: "panes 1e-4 or more apart with N boundaries of reflectance r pass (1-r)/(1+(N-1)r), to the eye and to photons",
        run: double_glazing,
    },
];

const GLASS: &str = include_str!("../scenes/inside_glass.xml");
/// Reflectance of the floor behind the panes.
const FLOOR: f64 = 1e-3;
const GLAZING: &str = include_str!("../scenes/double_glazing.xml");

/// From the middle all rays meet the glass at right angles. Where the glass holds fog, the kernel reaches past the end of
/// a ray by R²/2 at most.
fn inside_glass(trial: &mut Trial) -> Result<(), SelftestError> {
    for sigma_t in ["1", "0"] {
        let scene = trial.bench.load(GLASS, &[("sigma_t", sigma_t.to_owned())])?;
        let lent = scene.lend(0)?;
        let expected = Expected::grey(2.25).with_bias(0.02).noticing(0.6);
        let what = format!("sigma_t {sigma_t}");
        trial.film_by(
            &[Method::Ppt, Method::PptMetro, Method::Ppbt],
            &what,
            lent.scene(),
            &one_pass(4000, 0.2),
            expected,
        )?;
    }
    Ok(())
}

/// Light that is reflected between any number of boundaries. At n = 300 each reflects 0.987, and 70 % of what passes takes more
/// than 200 reflections: whoever stops there is seen.
fn double_glazing(trial: &mut Trial) -> Result<(), SelftestError> {
    for (index, passes) in [(1.5f64, 50), (300.0, 400)] {
        let reflected = ((index - 1.0) / (index + 1.0)).powi(2);
        let passed = (1.0 - reflected) / (1.0 + 3.0 * reflected);
        let defines = [("ior", index.to_string())];
        let scene = trial.bench.load(GLAZING, &defines)?;
        let lent = scene.lend(0)?;
        let limits = crate::scene::PathLimits { rr_depth: 100_000, ..one_pass(1, 0.1).limits };
        let parameters = Parameters { limits, passes, ..one_pass(1, 0.1) };
        let expected = Expected::grey(passed);
        trial.film(&format!("seen, n {index}"), lent.scene(), &parameters, expected)?;
    }
    let defines = [
        ("ior", "1.5".to_owned()),
        ("lamp", "directionalarea".to_owned()),
        ("floor", FLOOR.to_string()),
        // Mitsuba's rays start up to 5e-4 behind a boundary here, 4 from the middle, and would pass over a gap of 1e-4.
        ("place", "0.02".to_owned()),
        ("origin", "0, -1, -1".to_owned()),
        ("target", "0, 0, -2".to_owned()),
    ];
    let scene = trial.bench.load(GLAZING, &defines)?;
    let lent = scene.lend(0)?;
    // What the floor sends up and the panes send back down is less than what the floor reflects of all light.
    let expected = Expected::grey(FLOOR / PI * 0.96 / 1.12).with_bias(FLOOR);
    trial.film_by(&POINTS, "lit", lent.scene(), &one_pass(20_000, 0.3), expected)
}
