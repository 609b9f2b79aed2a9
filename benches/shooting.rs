//! What Metropolis shooting gains at equal time, and what `auto` costs where nothing is to be gained.
//! Prints two tables; measures nothing else.
//!
//! Gain: variance of a pixel over independent seeds, relative to its squared mean, times seconds; that of
//! uniform shooting over that of chains. Renders take turns, so that drift of the machine hits all alike.
//! Pixels that see the window itself are left out: their noise is that of view rays.

use std::path::{Path, PathBuf};
use vpt::host::session::{LoadedScene, SceneFile, Session};
use vpt::method::Silent;

const SEEDS: u32 = 6;
/// Pixels brighter than so many times the median show a lamp.
const LAMP: f64 = 20.0;

struct Contender<'a> {
    name: String,
    scene: LoadedScene<'a>,
    seconds: f64,
    pictures: Vec<Vec<f64>>,
}

impl<'a> Contender<'a> {
    fn new(session: &'a Session, scene: &Path, method: &str, shooting: &str, photons: u32) -> Self {
        let settings = [("shooting", shooting), ("photons", &photons.to_string())]
            .map(|(name, value)| (name.to_owned(), value.to_owned()));
        let file = SceneFile {
            path: scene.to_owned(),
            method: Some(method.to_owned()),
            settings: settings.to_vec(),
            ..SceneFile::default()
        };
        let scene = session.load(&file).expect("the scene loads");
        let name = format!("{method}, {shooting}");
        Contender { name, scene, seconds: 0.0, pictures: Vec::new() }
    }

    fn render(&mut self, seed: u32, passes: u32) {
        let stats = self.scene.render(0, seed, Some(passes), &mut Silent).expect("it renders");
        self.seconds += stats.seconds;
        self.pictures.push(
            self.scene.read_rgb().expect("a picture").iter().copied().map(f64::from).collect(),
        );
    }

    /// Mean over the pixels of variance over squared mean, lamps left out.
    fn relative_variance(&self) -> f64 {
        let count = self.pictures.len() as f64;
        let values = self.pictures[0].len();
        let moments: Vec<(f64, f64)> = (0..values)
            .map(|value| {
                let of_seeds = self.pictures.iter().map(|picture| picture[value]);
                let mean = of_seeds.clone().sum::<f64>() / count;
                (mean, of_seeds.map(|x| (x - mean).powi(2)).sum::<f64>() / (count - 1.0))
            })
            .collect();
        let mut means: Vec<f64> = moments.iter().map(|(mean, _)| *mean).collect();
        means.sort_by(f64::total_cmp);
        let lamp = LAMP * means[values / 2];
        let seen: Vec<f64> = moments
            .iter()
            .filter(|(mean, _)| *mean > 0.0 && *mean < lamp)
            .map(|(mean, variance)| variance / (mean * mean))
            .collect();
        seen.iter().sum::<f64>() / seen.len() as f64
    }
}

fn compete(contenders: &mut [Contender], passes: u32) {
    for seed in 0..SEEDS {
        contenders.iter_mut().for_each(|contender| contender.render(seed, passes));
    }
    println!("{:24} {:>8} {:>10} {:>6}", "", "seconds", "variance", "gain");
    let cost = |c: &Contender| c.relative_variance() * c.seconds;
    let first = cost(&contenders[0]);
    for contender in contenders.iter() {
        println!(
            "{:24} {:8.2} {:10.5} {:6.2}",
            contender.name,
            contender.seconds / f64::from(SEEDS),
            contender.relative_variance(),
            first / cost(contender)
        );
    }
}

fn main() {
    // `cargo test --benches` asks benches to run as tests; this one is for `cargo bench` alone.
    if !std::env::args().any(|argument| argument == "--bench") {
        return;
    }
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let session = Session::start(Some("scalar_rgb"), None, 0).expect("Mitsuba starts");
    let new = |scene: &Path, method, shooting, photons| {
        Contender::new(&session, scene, method, shooting, photons)
    };

    let window = root.join("benches/scenes/small_window.xml");
    println!("light through a small double-glazed window");
    let mut contenders = [
        new(&window, "ppt", "uniform", 300_000),
        new(&window, "ppt_metro", "metropolis", 100_000),
        new(&window, "ppt_metro", "auto", 100_000),
        new(&window, "ppbt", "uniform", 300_000),
        new(&window, "ppbt_metro", "metropolis", 100_000),
    ];
    compete(&mut contenders, 24);

    let fog = root.join("mitsuba_scenes/cornell_fog/scene.xml");
    println!("\na closed room, where almost every photon is seen");
    let mut contenders =
        [new(&fog, "ppt", "uniform", 50_000), new(&fog, "ppt_metro", "auto", 50_000)];
    compete(&mut contenders, 4);
    println!("auto takes {:.3} of uniform's time", contenders[1].seconds / contenders[0].seconds);
}
