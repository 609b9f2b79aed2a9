//! Faults of Mitsuba 3.9.1 that the generator keeps clear of, each with the smallest scene that shows it. A
//! test here that fails says that Mitsuba mended the fault: then the generator may draw such scenes.

use std::path::Path;

use vpt::host::session::{OwnPicture, SceneFile, Session};
use vpt::method::Silent;
use vpt::scene::{PathLimits, UNBOUNDED_DEPTH};

fn load_file(name: &str) -> SceneFile {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/differential/faults");
    let settings = [("photons", "20000"), ("medium_radius", "0.02"), ("surface_radius", "0.02")];
    SceneFile {
        path: folder.join(format!("{name}.xml")),
        settings: settings.map(|(name, value)| (name.to_owned(), value.to_owned())).into(),
        ..SceneFile::default()
    }
}

/// The mean of what an integrator of Mitsuba's own renders.
fn own_mean(session: &Session, scene: &str, integrator: &str, rr_depth: u32, spp: u32) -> f64 {
    let scene = session.load(&load_file(scene)).unwrap();
    let limits = PathLimits { max_depth: UNBOUNDED_DEPTH, rr_depth, hide_emitters: false };
    let integrator = session.integrator(integrator, limits).unwrap();
    let OwnPicture { rgb, .. } = scene.render_with(&integrator, 0, 1, spp).unwrap();
    mean(&rgb)
}

fn mean(rgb: &[f32]) -> f64 {
    rgb.iter().map(|&value| f64::from(value)).sum::<f64>() / rgb.len() as f64
}

/// Every path sees 1 in the mean and none more than a few, so a mean of 144 x 1024 is good to some 0.1 %.
/// Roulette at depth 5 takes 0.7 to 1.7 %, roulette that never begins takes nothing.
#[test]
fn volpathmis_is_dark_where_its_roulette_begins() {
    let session = super::session();
    let early = own_mean(&session, "roulette", "volpathmis", 5, 1024);
    let late = own_mean(&session, "roulette", "volpathmis", 1000, 256);
    assert!(early < 0.996, "{early}: mended?");
    assert!((late - 1.0).abs() < 0.004, "{late}");
}

/// The floor's radiance is 0.5 / pi = 0.159 for photons; with 16 passes of 20,000 the mean over the
/// window is good to 1 %.
#[test]
fn volpath_does_not_see_a_directionalarea_lamp() {
    let session = super::session();
    assert_eq!(own_mean(&session, "directionalarea", "volpath", 1000, 16), 0.0, "mended?");
    let mut scene = session.load(&load_file("directionalarea")).unwrap();
    scene.render(0, 1, Some(16), &mut Silent).unwrap();
    let seen = mean(&scene.read_rgb().unwrap());
    assert!((seen * std::f64::consts::TAU - 1.0).abs() < 0.05, "{seen}");
}
