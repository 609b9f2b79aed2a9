//! Random scenes, rendered by every method and by Mitsuba's own path tracers, which must mean the same
//! picture.
//!
//! A scene is a function of its seed (`generator`). `ppt`, `ppbt` and both with chains are held to
//! `volpath`, or to `volpathmis` where extinction is coloured, by Welch's t-test on the mean of the image
//! and on blocks of 4 x 4 pixels (`judge`). `apa` and `ppb` are held to the pictures of `ppt` and `ppbt`
//! with the same photons, which they must give again. All tests of a run together raise a false alarm with
//! a probability of 0.001 at most. Where an error of 10 % of the image (20 % with chains) could hide, more
//! is rendered, and at last the picture is undecided; more than a quarter of such pictures (a half in
//! the short run) fail the run.
//!
//! What disagrees is shrunk (`shrink`) and left in `target/differential/<seed>`: `scene.xml` as it was
//! drawn, `small/scene.xml`, and the pictures of both sides.
//!
//! `VPT_FUZZ_SEED` and `VPT_FUZZ_SCENES` say with which scene the long run begins and how many it takes.

#[allow(dead_code)]
#[path = "../support/image.rs"]
mod image;
#[allow(dead_code)]
#[path = "../support/stats.rs"]
mod stats;

mod faults;
mod generator;
mod judge;
mod mended;
mod scene;
mod shrink;
mod xml;

use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Instant;
use std::{env, fs};

use judge::{Effort, Judge, Judgement, Levels, Ruling, Run};
use scene::Scene;
use vpt::host::session::Session;
use vpt::method::Method;

const FEW: u64 = 20;
/// The short run begins behind a hall of mirrors in fog that takes as long as ten other scenes.
const FIRST_OF_FEW: u64 = 10;
const MANY: u64 = 200;
/// Shares of the pictures that may be undecided: few scenes get little time.
const UNDECIDED_OF_FEW: f64 = 0.5;
const UNDECIDED_OF_MANY: f64 = 0.25;

#[test]
fn few_scenes_agree() {
    run(FIRST_OF_FEW, FEW, Effort::SHORT, UNDECIDED_OF_FEW);
}

#[test]
#[ignore = "long: just fuzz"]
fn many_scenes_agree() {
    let (first, scenes) = (number("VPT_FUZZ_SEED", 1), number("VPT_FUZZ_SCENES", MANY));
    run(first, scenes, Effort::LONG, UNDECIDED_OF_MANY);
}

/// In the short run a scene is rendered by `ppt` and its twin, and by the other methods in turn.
fn methods(seed: u64, effort: Effort) -> Vec<Method> {
    if effort == Effort::LONG {
        return Method::ALL.to_vec();
    }
    let mut methods = vec![Method::Ppt, Method::Apa];
    methods.extend(match seed % 3 {
        0 => vec![Method::Ppbt, Method::Ppb],
        1 => vec![Method::PptMetro],
        _ => vec![Method::PpbtMetro],
    });
    methods
}

fn number(name: &str, default: u64) -> u64 {
    env::var(name).map_or(default, |value| value.parse().expect("a whole number"))
}

/// Mitsuba, which has one variant per process; the lock keeps tests apart.
fn session() -> MutexGuard<'static, Session> {
    static SESSION: OnceLock<Mutex<Session>> = OnceLock::new();
    let start = || Mutex::new(Session::start(Some("scalar_rgb"), None, 0).unwrap());
    SESSION.get_or_init(start).lock().unwrap_or_else(PoisonError::into_inner)
}

fn run(first: u64, scenes: u64, effort: Effort, may_be_undecided: f64) {
    let session = session();
    let run = Run { effort, levels: Levels::new(scenes as usize * Method::ALL.len()) };
    let (mut faults, mut undecided, mut pictures) = (Vec::new(), 0, 0);
    for seed in first..first + scenes {
        let start = Instant::now();
        let scene = generator::generate(seed);
        let judgements = judge_all(&session, &scene, run, &folder(seed), &methods(seed, effort));
        let judgements = judgements.unwrap_or_else(|fault| panic!("seed {seed}: {fault}"));
        print_row(seed, &judgements, start.elapsed().as_secs_f64());
        pictures += judgements.len();
        undecided += judgements.iter().filter(|j| j.ruling == Ruling::Undecided).count();
        if let Some(worst) = judgements.iter().find(|j| matches!(j.ruling, Ruling::Disagrees(_))) {
            faults.push(save(&session, seed, &scene, worst, run));
        }
    }
    println!("{undecided} of {pictures} pictures undecided");
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
    let share = undecided as f64 / pictures as f64;
    assert!(share <= may_be_undecided, "{undecided} of {pictures} pictures are undecided");
}

fn judge_all(
    session: &Session,
    scene: &Scene,
    run: Run,
    folder: &Path,
    methods: &[Method],
) -> Result<Vec<Judgement>, String> {
    xml::write(scene, folder).map_err(|e| e.to_string())?;
    let judge = Judge::new(session, folder, scene, run)?;
    methods.iter().map(|&method| judge.judge(method)).collect()
}

fn print_row(seed: u64, judgements: &[Judgement], seconds: f64) {
    print!("seed {seed:4} |");
    for Judgement { method, ruling, deviation, pictures } in judgements {
        let mark = match ruling {
            Ruling::Agrees => "",
            Ruling::Undecided => "?",
            Ruling::Disagrees(_) => "!",
        };
        print!(" {} {:+6.2} % of {pictures:2}{mark:1} |", method.name(), 100.0 * deviation);
    }
    println!(" {seconds:5.1} s");
}

/// Shrinks the scene and leaves it with both pictures; returns what to tell.
fn save(session: &Session, seed: u64, scene: &Scene, found: &Judgement, run: Run) -> String {
    let method = found.method;
    let small_folder = folder(seed).join("small");
    let disagrees = |scene: &Scene| -> bool {
        let judged = xml::write(scene, &small_folder)
            .map_err(|e| e.to_string())
            .and_then(|()| Judge::new(session, &small_folder, scene, run)?.judge(method));
        matches!(judged, Ok(Judgement { ruling: Ruling::Disagrees(_), .. }))
    };
    let small = shrink::shrink(scene.clone(), disagrees);
    let evidence = Judge::new(session, &folder(seed), scene, run)
        .and_then(|judge| judge.evidence(method)?.write(&folder(seed)));
    fs::remove_dir_all(&small_folder).expect("it was written");
    xml::write(&small, &small_folder).expect("it was written before");
    let Ruling::Disagrees(why) = &found.ruling else { unreachable!("it disagrees") };
    let evidence = evidence.map_or_else(|e| format!("; no pictures: {e}"), |()| String::new());
    format!(
        "seed {seed}, {}: {why}; see {}{evidence}; again: VPT_FUZZ_SEED={seed} VPT_FUZZ_SCENES=1 just fuzz\n{small:#?}",
        method.name(),
        small_folder.join("scene.xml").display()
    )
}

/// `target/differential/<seed>`, wherever `target` is.
fn folder(seed: u64) -> PathBuf {
    let target =
        Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("target/tmp lies in target");
    target.join("differential").join(seed.to_string())
}
