//! What a pass costs: the paper's methods against the baselines at equal photons and view beams, two threads against one, and
//! the share of a render that goes into trees. Prints tables; measures nothing else.
//!
//! Contestants take turns, so that drift of the machine hits both alike; the tables hold medians over the turns and the
//! quartiles of their ratios. `cargo bench --bench passes -- llvm_ad_rgb` measures in another variant.

mod turns;

use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::path::Path;
use std::time::Instant;
use turns::median;
use vpt::host::session::{LoadedScene, SceneFile, Session};
use vpt::math::uniform::{self, Purpose};
use vpt::method::{self, Method, Parameters, PhaseSeconds, Preset, Progressive};
use vpt::scene::Scene;
use vpt::transport::numbers::Uniform;
use vpt::transport::walks::Walks;

const SCENES: [&str; 3] = ["cornell_fog", "window_room", "smoke"];
const TURNS: usize = 5;
/// Passes of a turn: those that the paper's preset shoots at one set of view beams.
const PASSES: u32 = 4;

/// How much there is to do in a pass.
struct Load {
    /// Pixels along an edge of the picture, a view ray each.
    side: u32,
    /// Walks whose photons are points.
    points: u64,
    /// Walks whose photons are beams.
    beams: u64,
}

/// Several photons for each pixel.
const MANY_PHOTONS: Load = Load { side: 160, points: 100_000, beams: 20_000 };
/// As the publication renders its simplest scene. [Collin 2013, table 2, dragon smokes]
const PUBLICATION: Load = Load { side: 768, points: 50_000, beams: 5_000 };

fn main() {
    // Cargo passes arguments of its own.
    let variant = std::env::args().find(|argument| argument.ends_with("_rgb"));
    let session = Session::start(variant.as_deref(), None, 0).expect("Mitsuba starts");
    println!("{}, {} threads", session.variant(), rayon::current_num_threads());
    against_baselines(&session, &PUBLICATION, &[PASSES]);
    against_baselines(&session, &MANY_PHOTONS, &[PASSES, 1]);
    let scenes = scenes(&session, &MANY_PHOTONS);
    if session.variant().starts_with("scalar") {
        against_one_thread(&scenes);
    }
    trees(&scenes);
}

fn scenes<'a>(session: &'a Session, load: &Load) -> [(&'static str, LoadedScene<'a>); 3] {
    SCENES.map(|name| {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("mitsuba_scenes").join(name);
        let size = |axis: &str| (axis.to_owned(), load.side.to_string());
        let defines = vec![size("resx"), size("resy")];
        let file = SceneFile { path: folder.join("scene.xml"), defines, ..SceneFile::default() };
        (name, session.load(&file).expect("the scene loads"))
    })
}

/// The paper's preset. View beams that stay for several passes are part of its advantage: with `jitter_every` 1 the method
/// traces as many as a baseline.
fn paper(loaded: &LoadedScene, load: &Load, method: Method, jitter_every: u32) -> Parameters {
    let limits = loaded.parameters(0).expect("the parameters are right").limits;
    Parameters {
        method,
        jitter_every,
        photons: if shoots_points(method) { load.points } else { load.beams },
        limits,
        passes: u32::MAX,
        estimate_error: false,
        ..Preset::Paper.parameters()
    }
}

fn shoots_points(method: Method) -> bool {
    matches!(method, Method::Ppt | Method::Apa)
}

fn against_baselines(session: &Session, load: &Load, jitters: &[u32]) {
    let Load { side, points, beams } = load;
    println!("\n{side}x{side}, {points} walks with points, {beams} with beams");
    println!(
        "{:<28} {:>12} {:>12}  {:<22} {:>12}  bound",
        "passes per second", "method", "baseline", "ratio", "walks alone"
    );
    for (name, loaded) in &scenes(session, load) {
        let lent = loaded.lend(0).expect("the scene is lent");
        let begin = |parameters| begin(lent.scene(), &parameters);
        for (method, baseline) in [(Method::Ppt, Method::Apa), (Method::Ppbt, Method::Ppb)] {
            for &jitter_every in jitters {
                let mut first = begin(paper(loaded, load, method, jitter_every));
                let mut second = begin(paper(loaded, load, baseline, 1));
                let walks = paper(loaded, load, method, jitter_every);
                let turns = turns::take(TURNS, || {
                    let pair = [passes_per_second(&mut first), passes_per_second(&mut second)];
                    let alone = walks_per_second(lent.scene(), &walks);
                    [pair[0], pair[1], alone]
                });
                let (method, baseline) = (method.name(), baseline.name());
                let row = row(&format!("{name} {method}({jitter_every}) {baseline}"), &turns);
                let [second, alone] = [1, 2].map(|which| median(&turns, which));
                println!("{row} {alone:>12.2}  {:.2}", alone / second);
            }
        }
    }
}

/// Every turn renders anew, since a render stays with the threads that it began with.
fn against_one_thread(scenes: &[(&str, LoadedScene)]) {
    let pools = [2, 1].map(|threads| ThreadPoolBuilder::new().num_threads(threads).build());
    let [two, one] = pools.map(|pool| pool.expect("threads start"));
    println!("\n{:<28} {:>12} {:>12}  ratio", "passes per second", "2 threads", "1 thread");
    let turns =
        turns::take(TURNS, || [&two, &one].map(|pool| pool.install(arithmetic_per_second::<1>)));
    println!("{}", row("arithmetic, one orbit", &turns));
    let turns =
        turns::take(TURNS, || [&two, &one].map(|pool| pool.install(arithmetic_per_second::<24>)));
    println!("{}", row("arithmetic, 24 orbits", &turns));
    for (name, loaded) in scenes {
        let lent = loaded.lend(0).expect("the scene is lent");
        let scene = lent.scene();
        for method in [Method::Ppt, Method::Ppbt] {
            let parameters = paper(loaded, &MANY_PHOTONS, method, PASSES);
            let on = |pool: &ThreadPool| {
                pool.install(|| passes_per_second(&mut begin(scene, &parameters)))
            };
            let turns = turns::take(TURNS, || [on(&two), on(&one)]);
            println!("{}", row(&format!("{name} {}", method.name()), &turns));
        }
    }
}

/// What the machine gives to two threads that share nothing: how often a second 64 tasks of a million steps of the logistic map
/// are done. One orbit waits for itself, many fill a core; others on the same metal may have a share of it.
fn arithmetic_per_second<const ORBITS: usize>() -> f64 {
    let clock = Instant::now();
    let orbits = |task: u32| {
        let start: [f64; ORBITS] =
            std::array::from_fn(|orbit| 0.1 + 0.01 * f64::from(task) + 0.001 * orbit as f64);
        let step = |orbits: [f64; ORBITS], _| orbits.map(|x| 3.9 * x * (1.0 - x));
        (0..1_000_000).fold(start, step).into_iter().sum::<f64>()
    };
    let sum: f64 = (0..64).into_par_iter().with_max_len(1).map(orbits).sum();
    assert!(sum.is_finite());
    clock.elapsed().as_secs_f64().recip()
}

fn trees(scenes: &[(&str, LoadedScene)]) {
    println!("\n{:<28} {:>12} {:>12}  share", "default preset", "trees", "render");
    for (name, loaded) in scenes {
        for method in [Method::Ppt, Method::Ppbt] {
            let own = loaded.parameters(0).expect("the parameters are right");
            let parameters = Parameters { method, passes: 16, ..own };
            let lent = loaded.lend(0).expect("the scene is lent");
            let mut render = begin(lent.scene(), &parameters);
            for _ in 0..parameters.passes {
                render.advance().expect("a pass");
            }
            let PhaseSeconds { view, trees, photons, film } = render.phase_seconds();
            let whole = view + trees + photons + film;
            println!(
                "{:<28} {:>10.1}ms {:>10.1}ms  {:.3}",
                format!("{name} {}", method.name()),
                1e3 * trees,
                1e3 * whole,
                trees / whole
            );
        }
    }
}

fn begin<'a>(scene: &'a dyn Scene, parameters: &Parameters) -> Box<dyn Progressive + 'a> {
    method::begin(scene, parameters).expect("it begins")
}

fn passes_per_second(render: &mut Box<dyn Progressive + '_>) -> f64 {
    let clock = Instant::now();
    for _ in 0..PASSES {
        render.advance().expect("a pass");
    }
    f64::from(PASSES) / clock.elapsed().as_secs_f64()
}

/// What passes would take if all that is done with photons, view rays and trees cost nothing.
fn walks_per_second(scene: &dyn Scene, parameters: &Parameters) -> f64 {
    let plan = parameters.plan(scene.description());
    let with_segments = !shoots_points(parameters.method);
    let clock = Instant::now();
    for pass in 0..PASSES {
        let walk = |batch: vpt::scene::Batch| {
            let stream = uniform::stream(1, Purpose::Photons, u64::from(pass), batch.number);
            let walks = Walks { scene, plan: &plan, count: batch.lanes, with_segments };
            walks.trace(&mut Uniform(stream), |_, _| Ok(()))
        };
        scene.batching().run_all(parameters.photons, walk).expect("walks");
    }
    f64::from(PASSES) / clock.elapsed().as_secs_f64()
}

/// The medians of the first two, and their ratio.
fn row<const N: usize>(name: &str, turns: &[[f64; N]]) -> String {
    let [first, second] = [0, 1].map(|which| median(turns, which));
    format!("{name:<28} {first:>12.2} {second:>12.2}  {:<22}", turns::ratio(turns, 2))
}
