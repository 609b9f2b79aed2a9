//! Faults of Mitsuba 3.9.1 that the generator keeps clear of, each with the smallest scene that shows it. A
//! test here that fails says that Mitsuba mended the fault: then the generator may draw such scenes.

use std::path::Path;

use vpt::host::session::{OwnPicture, SceneFile, Session};
use vpt::method::Silent;
use vpt::scene::{PathLimits, UNBOUNDED_DEPTH};

fn load_file(name: &str) -> SceneFile {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/differential/faults");
    let settings = [("photons", "20000"), ("medium_radius", "0.02"), ("surface_radius", "0.05")];
    SceneFile {
        path: folder.join(format!("{name}.xml")),
        settings: settings.map(|(name, value)| (name.to_owned(), value.to_owned())).into(),
        ..SceneFile::default()
    }
}

/// The mean of what an integrator of Mitsuba's own renders.
fn own_mean(session: &Session, scene: &str, integrator: &str, limits: PathLimits, spp: u32) -> f64 {
    let scene = session.load(&load_file(scene)).unwrap();
    let integrator = session.integrator(integrator, limits).unwrap();
    let OwnPicture { rgb, .. } = scene.render_with(&integrator, 0, 1, spp).unwrap();
    mean(&rgb)
}

fn limits(rr_depth: u32, hide_emitters: bool) -> PathLimits {
    PathLimits { max_depth: UNBOUNDED_DEPTH, rr_depth, hide_emitters }
}

/// The mean of 16 passes of `vpt`.
fn our_mean(session: &Session, scene: &str) -> f64 {
    let mut scene = session.load(&load_file(scene)).unwrap();
    scene.render(0, 1, Some(16), &mut Silent).unwrap();
    mean(&scene.read_rgb().unwrap())
}

fn mean(rgb: &[f32]) -> f64 {
    rgb.iter().map(|&value| f64::from(value)).sum::<f64>() / rgb.len() as f64
}

/// Every path sees 1 in the mean and none more than a few, so a mean of 144 x 1024 is good to some 0.1 %.
/// Roulette at depth 5 takes 0.7 to 1.7 %, roulette that never begins takes nothing.
#[test]
fn volpathmis_is_dark_where_its_roulette_begins() {
    let session = super::session();
    let early = own_mean(&session, "roulette", "volpathmis", limits(5, false), 1024);
    let late = own_mean(&session, "roulette", "volpathmis", limits(1000, false), 256);
    assert!(early < 0.996, "{early}: mended?");
    assert!((late - 1.0).abs() < 0.004, "{late}");
}

/// The floor's radiance is 0.5 / pi = 0.159 for photons; with 16 passes of 20,000 the mean over the
/// window is good to 1 %.
#[test]
fn volpath_does_not_see_a_directionalarea_lamp() {
    let session = super::session();
    let blind = own_mean(&session, "directionalarea", "volpath", limits(1000, false), 16);
    assert_eq!(blind, 0.0, "mended?");
    let seen = our_mean(&session, "directionalarea");
    assert!((seen * std::f64::consts::TAU - 1.0).abs() < 0.05, "{seen}");
}

/// Found by a random scene (seed 17). Of 20,000 photons a share of 0.05² / (4 * 0.4²) = 0.4 % falls into a
/// kernel, so 16 passes are good to 3 %.
#[test]
fn volpath_does_not_hide_a_lamp_in_a_medium() {
    let session = super::session();
    let hidden = own_mean(&session, "hidden_lamp", "volpath", limits(1000, true), 16);
    assert!(hidden < 0.01, "{hidden}: mended?");
    let wall = 0.5 * std::f64::consts::FRAC_1_PI / (0.4 * 0.4);
    let seen = our_mean(&session, "hidden_lamp");
    assert!((seen / wall - 1.0).abs() < 0.1, "{seen} instead of {wall}");
}
