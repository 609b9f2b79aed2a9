//! What it saves to leave out an effect that a scene does not call for: time of a pass with the effect forced on,
//! over that of one as the scene calls for it. Prints a table; measures nothing else.
//!
//! The two take turns, so that drift of the machine hits both alike; the table holds medians over the turns and
//! the quartiles of their ratios. `cargo bench --bench effects -- llvm_ad_rgb` measures in another variant.

mod turns;

use std::path::Path;
use std::time::Instant;
use vpt::effect::{Effect, Effects};
use vpt::host::session::{LentScene, LoadedScene, SceneFile, Session};
use vpt::method::{self, Parameters, Progressive};

const TURNS: usize = 15;
const PHOTONS: u64 = 20_000;

/// An effect, and a scene of the tests that does not call for it; all effects at once at last.
const CASES: [(Option<Effect>, &str); 11] = [
    (Some(Effect::SurfaceGathering), "agreement/scenes/fog_unbounded.xml"),
    (Some(Effect::ViewBeams), "effects/scenes/absorbing.xml"),
    (Some(Effect::MediumSampling), "agreement/scenes/room_diffuse.xml"),
    (Some(Effect::MultipleScattering), "agreement/scenes/single_scatter.xml"),
    (Some(Effect::TransmittanceTables), "agreement/scenes/fog_room.xml"),
    (Some(Effect::ColouredExtinction), "agreement/scenes/smoke_spot.xml"),
    (Some(Effect::AnisotropicPhase), "agreement/scenes/fog_room.xml"),
    (Some(Effect::SpecularChains), "agreement/scenes/room_diffuse.xml"),
    (Some(Effect::DirectEmission), "agreement/scenes/hidden_lamp.xml"),
    (Some(Effect::DepthOfField), "agreement/scenes/room_diffuse.xml"),
    (None, "agreement/scenes/room_diffuse.xml"),
];

fn main() {
    // Cargo passes arguments of its own.
    let variant = std::env::args().find(|argument| argument.ends_with("_rgb"));
    let session = Session::start(variant.as_deref(), None, 0).expect("Mitsuba starts");
    println!("{}, {PHOTONS} photons per pass, ppt", session.variant());
    println!(
        "{:<22} {:<16} {:>12} {:>12}  forced / called for",
        "effect", "scene", "called for", "forced"
    );
    for (effect, scene) in CASES {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests").join(scene);
        let file = SceneFile { path: path.clone(), ..SceneFile::default() };
        let loaded = session.load(&file).expect("the scene loads");
        let forced = effect.map_or(Effects::ALL, |effect| Effects::NONE.with(effect));
        let name = effect.map_or("all", Effect::name);
        print_row(name, path.file_stem().unwrap().to_str().unwrap(), measure(&loaded, forced));
    }
}

/// Seconds of a jitter with one pass, with effects forced on and as the scene calls for it, by turn.
fn measure(loaded: &LoadedScene, forced: Effects) -> Vec<[f64; 2]> {
    let lent: LentScene = loaded.lend(0).expect("the scene is lent");
    let parameters = |effects| Parameters {
        effects,
        photons: PHOTONS,
        jitter_every: 1,
        passes: u32::MAX,
        estimate_error: false,
        ..loaded.parameters(0).expect("the parameters are right")
    };
    let [forced, plain] = [forced, Effects::NONE].map(parameters);
    let mut renders = [&forced, &plain].map(|p| method::begin(lent.scene(), p).expect("it begins"));
    turns::take(TURNS, || renders.each_mut().map(pass))
}

fn pass(render: &mut Box<dyn Progressive + '_>) -> f64 {
    let clock = Instant::now();
    render.advance().expect("a pass");
    clock.elapsed().as_secs_f64()
}

fn print_row(effect: &str, scene: &str, turns: Vec<[f64; 2]>) {
    let [forced, plain] = [0, 1].map(|which| 1e3 * turns::median(&turns, which));
    let ratio = turns::ratio(&turns, 3);
    println!("{effect:<22} {scene:<16} {plain:>10.2}ms {forced:>10.2}ms  {ratio}");
}
