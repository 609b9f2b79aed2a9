//! Only what a scene calls for is simulated: an effect that is off takes no work, and the picture is the one
//! with everything forced on.
//!
//! Both renders use the same random numbers, and no effect draws from the stream of another. So they trace the
//! same view rays and photons, and differ by the rounding of formulas that are equal on paper alone: a table of a
//! constant extinction against its exponential, Mitsuba's phase function against ours, `x * (1 / x)` against 1.

#[path = "../support/image.rs"]
#[allow(dead_code)]
mod image;
#[path = "../support/llvm.rs"]
mod llvm;

use image::Image;
use llvm::llvm_or_skip;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{Mutex, MutexGuard, OnceLock};
use vpt::effect::{Effect, Effects};
use vpt::host::session::{SceneFile, Session};
use vpt::method::{self, Method, Outcome, Parameters, Silent};
use vpt::scene::Scene;

const PHOTONS: u64 = 1500;
/// Rounding, as a share of a pixel or the mean: 5e-7 in all scenes but one, where tables are 10 000 diagonals of the
/// scene long, and 7e-5 there. No photon changes sides at the rim of a disk.
const ROUNDING: f64 = 2e-4;

/// Mitsuba has one variant per process, and renders of several tests would take turns anyway.
fn session() -> MutexGuard<'static, Session> {
    static SESSION: OnceLock<Mutex<Session>> = OnceLock::new();
    let start = || Mutex::new(Session::start(Some("scalar_rgb"), Some(2), 0).unwrap());
    SESSION.get_or_init(start).lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// All scenes of the agreement table, and those that were made for this test.
fn scenes() -> Vec<PathBuf> {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests");
    let folders = ["agreement/scenes", "effects/scenes"];
    let files = folders.iter().flat_map(|folder| std::fs::read_dir(tests.join(folder)).unwrap());
    let paths = files.map(|file| file.unwrap().path());
    let mut scenes: Vec<_> = paths
        .filter(|path| {
            let name = path.file_name().unwrap().to_str().unwrap();
            name.ends_with(".xml") && !name.ends_with(".reference.xml")
        })
        .collect();
    scenes.sort();
    scenes
}

fn name(scene: &Path) -> &str {
    scene.file_stem().unwrap().to_str().unwrap()
}

/// Renders a scene with a method and these effects forced on.
fn render(
    session: &Session,
    scene: &Path,
    preset: &str,
    method: Method,
    effects: Effects,
) -> Outcome {
    let settings = vec![("preset".to_owned(), preset.to_owned())];
    let file = SceneFile { path: scene.to_owned(), settings, ..SceneFile::default() };
    let loaded = session.load(&file).unwrap();
    let lent = loaded.lend(0).unwrap();
    let parameters = Parameters {
        method,
        effects,
        passes: 2,
        jitter_every: 1,
        photons: PHOTONS,
        estimate_error: false,
        // What is learnt hangs on rounding: one box more or less, and all photons are others. A trial also finds other receivers
        // where effects are forced on.
        guided_emission: false,
        connections: Some(preset == "fast"),
        connection_samples: 4,
        ..loaded.parameters(0).unwrap()
    };
    method::render(lent.scene() as &dyn Scene, &parameters, &mut Silent).unwrap()
}

fn work(outcome: &Outcome, effect: Effect) -> u64 {
    outcome.stats.effects[effect as usize].work.total()
}

/// For every method and scene; each effect is off in some scene and on in another, or this would prove nothing.
#[test]
fn an_effect_that_is_off_takes_no_work() {
    let session = session();
    let (mut on, mut off) = (BTreeMap::new(), BTreeMap::new());
    for scene in scenes() {
        for method in Method::ALL {
            // Photons carry all light: what is called for has work to do.
            let outcome = render(&session, &scene, "paper", method, Effects::NONE);
            for report in &outcome.stats.effects {
                let effect = report.finding.effect;
                let place = format!("{} in {} of {}", effect.name(), name(&scene), method.name());
                let work = report.work.total();
                assert_eq!(report.finding.on, work > 0, "{place}: {} {}", work, report.unit);
                *if report.finding.on { &mut on } else { &mut off }.entry(effect).or_insert(0) += 1;
            }
        }
    }
    for effect in Effect::ALL {
        assert!(on.contains_key(&effect), "{} is on nowhere", effect.name());
        assert!(off.contains_key(&effect), "{} is off nowhere", effect.name());
    }
}

#[test]
fn the_picture_is_the_one_with_everything_forced_on() {
    let session = session();
    let mut forced = Effects::NONE;
    for scene in scenes() {
        let variations = [
            (Method::Ppt, "fast"),
            (Method::Ppbt, "fast"),
            (Method::Ppt, "paper"),
            (Method::Ppbt, "paper"),
        ];
        for (method, preset) in variations {
            let [plain, all] = [Effects::NONE, Effects::ALL]
                .map(|effects| render(&session, &scene, preset, method, effects));
            for report in plain.stats.effects.iter().filter(|report| !report.finding.on) {
                if work(&all, report.finding.effect) > 0 {
                    forced = forced.with(report.finding.effect);
                }
            }
            let worst = difference(&plain, &all);
            let place = format!("{} of {}, {preset}", name(&scene), method.name());
            assert!(worst <= ROUNDING, "{place}: a value differs by {worst:.1e} of the mean");
        }
    }
    // The others need something to be done on: a medium, a boundary, a smooth surface in view.
    let forceable = [
        Effect::SurfaceGathering,
        Effect::ViewBeams,
        Effect::MultipleScattering,
        Effect::TransmittanceTables,
        Effect::ColouredExtinction,
        Effect::AnisotropicPhase,
        Effect::DirectEmission,
        Effect::Environment,
        Effect::DepthOfField,
    ];
    assert_eq!(forced.to_string(), Effects::from_iter(forceable).to_string());
}

/// In kernels that leave out what is off, too: media, surfaces, delta lobes, emitters, the sky.
#[test]
fn the_picture_is_the_one_with_everything_forced_on_in_llvm_ad_rgb() {
    let Some(llvm) = llvm_or_skip("the picture with everything forced on") else { return };
    let folder = tempfile::tempdir().unwrap();
    for scene in ["room_diffuse", "ball_rayleigh", "hidden_lamp", "single_scatter", "absorbing"] {
        let path = scenes().into_iter().find(|path| name(path) == scene).unwrap();
        let [plain, all] = ["auto", "all"].map(|effects| {
            let picture = folder.path().join(format!("{scene}_{effects}.exr"));
            let output = Command::new(env!("CARGO_BIN_EXE_vpt"))
                .env("DRJIT_LIBLLVM_PATH", &llvm)
                .arg("render")
                .arg(&path)
                .args(["-q", "--variant", "llvm_ad_rgb", "--passes", "2", "--effects", effects])
                .args(["--set", "guided_emission=false", "--set", "connections=true"])
                .args(["--set", "connection_samples=4"])
                .args(["--set", &format!("photons={PHOTONS}"), "-o"])
                .arg(&picture)
                .output()
                .unwrap();
            let errors = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{scene}, effects {effects}: {errors}");
            Image::read_exr(&picture, "").unwrap()
        });
        let mean =
            plain.pixels.as_flattened().iter().sum::<f32>() / (3 * plain.pixels.len()) as f32;
        assert!(mean > 0.0, "{scene} is black");
        for (a, b) in plain.pixels.as_flattened().iter().zip(all.pixels.as_flattened()) {
            let apart = (a - b).abs() / a.abs().max(mean);
            assert!(f64::from(apart) <= ROUNDING, "{scene}: {a} and {b}, the mean is {mean}");
        }
    }
}

/// The largest difference between two values of the film, over the larger of their own and the mean.
fn difference(a: &Outcome, b: &Outcome) -> f64 {
    let (a, b) = (&a.film.values, &b.film.values);
    assert_eq!(a.len(), b.len());
    let mean = a.iter().map(|v| v.abs()).sum::<f64>() / a.len() as f64;
    let apart = a.iter().zip(b).map(|(a, b)| (a - b).abs() / a.abs().max(mean));
    apart.fold(0.0, f64::max)
}
