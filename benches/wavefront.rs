//! How near shooting comes to the best rate at which the renderer traces walks that nobody looks at, in path vertices per second.
//! Prints a table for each scene; measures nothing else. Contestants take turns, the table holds medians.
//!
//! `cargo bench --bench wavefront -- scalar_rgb` measures in another variant.

use std::path::Path;
use std::time::Instant;

use vpt::density::radius::Radii;
use vpt::host::session::{LoadedScene, SceneFile, Session};
use vpt::markov::{ChainShooter, Population};
use vpt::math::uniform::{self, Purpose};
use vpt::method::{Method, Parameters, Preset, Shooting, Silent};
use vpt::plan::Plan;
use vpt::scene::Scene;
use vpt::transport::deposits::PixelSums;
use vpt::transport::numbers::Uniform;
use vpt::transport::photon::Family;
use vpt::transport::photons::UniformShooter;
use vpt::transport::receivers::Receivers;
use vpt::transport::target::{Particles, Target};
use vpt::transport::view;
use vpt::transport::walks::Walks;

const SCENES: [&str; 3] = ["cornell_fog", "window_room", "smoke"];
/// Walks of a batch, as powers of two.
const LANES: [u32; 5] = [12, 14, 16, 18, 20];
const WALKS: u64 = 1 << 20;
const TURNS: usize = 3;
const SEED: u64 = 1;

fn main() {
    // `cargo test --benches` asks benches to run as tests; this one is for `cargo bench` alone.
    if !std::env::args().any(|argument| argument == "--bench") {
        return;
    }
    let variant = std::env::args().find(|argument| argument.ends_with("_rgb"));
    let variant = variant.as_deref().unwrap_or("llvm_ad_rgb");
    let session = Session::start(Some(variant), None, 0).expect("Mitsuba starts");
    println!("{}, {} threads", session.variant(), rayon::current_num_threads());
    for name in SCENES {
        measure(name, &mut load(&session, name));
    }
}

fn load<'a>(session: &'a Session, name: &str) -> LoadedScene<'a> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("mitsuba_scenes").join(name);
    let size = |axis: &str| (axis.to_owned(), "160".to_owned());
    let defines = vec![size("resx"), size("resy")];
    let file = SceneFile { path: folder.join("scene.xml"), defines, ..SceneFile::default() };
    session.load(&file).expect("the scene loads")
}

fn measure(name: &str, loaded: &mut LoadedScene) {
    let radii = loaded.render(0, 1, Some(1), &mut Silent).expect("it renders").initial_radii;
    let own = loaded.parameters(0).expect("the parameters are right");
    let parameters = Parameters { limits: own.limits, ..Preset::Paper.parameters() };
    let chains = Parameters {
        method: Method::PptMetro,
        shooting: Some(Shooting::Metropolis),
        ..parameters.clone()
    };
    let lent = loaded.lend(0).expect("the scene is lent");
    let scene = lent.scene();
    let [plan, chain_plan] = [parameters, chains].map(|p| p.plan(scene.description()));
    let receivers = Receivers::build(scene, view::trace(scene, &plan, SEED, 0).expect("rays"));

    let mut uniform = UniformShooter::new(SEED);
    let mut chains = ChainShooter::new(SEED, 0);
    seen(scene, &chain_plan, &receivers, radii, |target, sums| {
        chains.shoot(target, u64::MAX, WALKS, sums).expect("walks").segments
    });
    let of_family = |family| chains.population(family).map_or(0, Population::chain_count);
    let chain_lanes = Family::ALL.map(of_family).into_iter().max().expect("there are families");

    let own_lanes = scene.batching().lanes;
    let mut lanes: Vec<usize> = LANES.map(|power| 1 << power).to_vec();
    lanes.extend([own_lanes, chain_lanes]);
    lanes.sort_unstable();
    lanes.dedup();
    let mut rows: Vec<(String, Vec<f64>)> = lanes
        .iter()
        .map(|lanes| (format!("nobody looks, batches of {lanes}"), Vec::new()))
        .collect();
    rows.push((format!("uniform shooting, batches of {own_lanes}"), Vec::new()));
    rows.push((format!("chains, {chain_lanes} of them"), Vec::new()));
    // The first turn compiles programs.
    for turn in 0..=TURNS as u64 {
        let mut rates: Vec<f64> =
            lanes.iter().map(|&lanes| unseen(scene, &plan, lanes, turn)).collect();
        rates.push(seen(scene, &plan, &receivers, radii, |target, sums| {
            uniform.shoot(target, turn, WALKS, sums).expect("walks").segments
        }));
        rates.push(seen(scene, &chain_plan, &receivers, radii, |target, sums| {
            chains.shoot(target, turn, WALKS, sums).expect("walks").segments
        }));
        if turn > 0 {
            rows.iter_mut().zip(rates).for_each(|((_, all), rate)| all.push(rate));
        }
    }
    print(name, rows, lanes.len());
}

/// Vertices per second of walks that are traced and forgotten.
fn unseen(scene: &dyn Scene, plan: &Plan, lanes: usize, turn: u64) -> f64 {
    let start = Instant::now();
    let mut vertices = 0;
    for batch in 0..WALKS / lanes as u64 {
        let mut numbers = Uniform(uniform::stream(SEED, Purpose::Photons, turn, batch));
        let walks = Walks { scene, plan, count: lanes, with_segments: false };
        vertices += walks.trace(&mut numbers, |_, _| Ok(())).expect("walks").segments;
    }
    vertices as f64 / start.elapsed().as_secs_f64()
}

/// The same of walks whose photons look for receivers.
fn seen(
    scene: &dyn Scene,
    plan: &Plan,
    receivers: &Receivers,
    radii: Radii,
    shoot: impl FnOnce(&Target, &mut PixelSums) -> u64,
) -> f64 {
    let target = Target { scene, receivers, particles: Particles::Points, radii, plan };
    let mut sums = receivers.paths.new_sums();
    let start = Instant::now();
    let vertices = shoot(&target, &mut sums);
    vertices as f64 / start.elapsed().as_secs_f64()
}

/// The best rate is that of the first rows, which nobody looks at.
fn print(name: &str, rows: Vec<(String, Vec<f64>)>, unseen: usize) {
    let medians: Vec<f64> = rows
        .iter()
        .map(|(_, rates)| {
            let mut rates = rates.clone();
            rates.sort_by(f64::total_cmp);
            rates[rates.len() / 2]
        })
        .collect();
    let best = medians[..unseen].iter().copied().fold(0.0, f64::max);
    println!("\n{:<40} {:>18} {:>10}", name, "vertices/s", "of best");
    for ((row, _), median) in rows.iter().zip(medians) {
        println!("{row:<40} {:>16.2} M {:>10.2}", median / 1e6, median / best);
    }
}
