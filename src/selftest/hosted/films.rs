//! Films of one pixel, scenes of nothing.

use crate::effect::Effects;
use crate::method::{Method, Parameters};
use crate::selftest::case::Case;
use crate::selftest::trial::{Expected, Trial};
use crate::selftest::worlds::{one_pass, POINTS};
use crate::selftest::SelftestError;
use std::f64::consts::PI;

pub const CASES: &[Case] = &[
    Case { name: "one_pixel", claim: "films of 1 x 1 show what others show", run: one_pixel },
    Case {
        name: "empty_scene",
        claim: "a sky alone is 1; fog without bounds hides it",
        run: empty_scene,
    },
];

const LAMP: &str = include_str!("../scenes/small_lamp.xml");
const EMPTY: &str = include_str!("../scenes/empty.xml");

fn one_pixel(trial: &mut Trial) -> Result<(), SelftestError> {
    let (radius, radiance) = (0.1f64, 100.0 / PI);
    let defines = [
        ("film", "1".to_owned()),
        ("radius", radius.to_string()),
        ("radiance", radiance.to_string()),
    ];
    let scene = trial.bench.load(LAMP, &defines)?;
    let lent = scene.lend(0)?;
    let expected = Expected::grey(0.5 / PI).with_bias(0.01);
    trial.film_by(&POINTS, "floor", lent.scene(), &one_pass(60_000, 0.1), expected)?;
    drop(lent);
    drop(scene);
    // Radii are chosen by the spacing of pixels, of which there is one.
    let scene = trial.bench.load(EMPTY, &[])?;
    let lent = scene.lend(0)?;
    let automatic = one_pass(1000, 0.0);
    trial.film_by(&Method::ALL, "sky", lent.scene(), &automatic, Expected::grey(1.0))
}

fn empty_scene(trial: &mut Trial) -> Result<(), SelftestError> {
    for (sigma_t, seen) in [("0", 1.0), ("1", 0.0)] {
        let defines = [("film", "4".to_owned()), ("sigma_t", sigma_t.to_owned())];
        let scene = trial.bench.load(EMPTY, &defines)?;
        let lent = scene.lend(0)?;
        let what = format!("sigma_t {sigma_t}");
        let automatic = one_pass(1000, 0.0);
        trial.film_by(&Method::ALL, &what, lent.scene(), &automatic, Expected::grey(seen))?;
        let forced = Parameters { effects: Effects::ALL, ..automatic };
        let what = format!("{what}, all effects");
        trial.film_by(&Method::ALL, &what, lent.scene(), &forced, Expected::grey(seen))?;
    }
    Ok(())
}
