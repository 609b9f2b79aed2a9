//! What a search costs where pairs are worth what they are in a render: photons of a real scene look for their receivers,
//! and every pair is evaluated and deposited; against a loop over the very pairs that does the same without a search. Prints a
//! table; measures nothing else.
//!
//! One thread. Photons come in the order of space within tasks of as many as gathering may have in one, and sorting counts.
//! The two take turns, so that drift of the machine hits both alike; the table holds medians over the turns and the quartiles of
//! their ratios.

mod turns;

use std::hint::black_box;
use std::path::PathBuf;
use std::time::Instant;
use vpt::density::radius::Radii;
use vpt::host::session::{SceneFile, Session};
use vpt::math::Approach;
use vpt::method::Silent;
use vpt::plan::Plan;
use vpt::scene::Scene;
use vpt::transport::gathering::per_task;
use vpt::transport::pairs::{Gathered, Pairs};
use vpt::transport::photon::{MediumPhoton, SurfacePhoton};
use vpt::transport::photon_beam::{BeamKind, PhotonBeam, PhotonBeams};
use vpt::transport::receivers::Receivers;
use vpt::transport::splat::Splat;
use vpt::transport::store::{Storage, StoredPhotons};
use vpt::transport::target::Particles;
use vpt::transport::view;

const SCENES: [&str; 2] = ["cornell_fog", "window_room"];
const WALKS: u64 = 20_000;
/// Photons of a full step, by which tasks are cut.
const BATCH: usize = 131_072;
/// Walks whose photons are beams, which make many more pairs each.
const BEAM_WALKS: u64 = 2_000;
const SEED: u64 = 1;
const TURNS: usize = 41;
/// Pairs of a turn at least, so that clocks can tell.
const PAIRS_IN_A_TURN: usize = 100_000;

type Out = Gathered<Splat>;

/// What photons are shot at.
struct Stage<'a> {
    receivers: &'a Receivers,
    pairs: Pairs<'a>,
}

/// One kind of photons and receivers.
trait Kind {
    type Photon;
    type Pair: Copy;
    fn photons(&self) -> &[Self::Photon];
    /// The pairs of one task's photons.
    fn search<'a>(
        &self,
        stage: &Stage,
        photons: &'a [Self::Photon],
        visit: impl FnMut(&'a Self::Photon, Self::Pair),
    );
    fn add(&self, stage: &Stage, photon: &Self::Photon, pair: Self::Pair, out: &mut Out);
}

struct PointsOnBeams<'a>(&'a [MediumPhoton]);

impl Kind for PointsOnBeams<'_> {
    type Photon = MediumPhoton;
    type Pair = (u32, f32, f32);

    fn photons(&self) -> &[MediumPhoton] {
        self.0
    }

    fn search<'a>(
        &self,
        stage: &Stage,
        photons: &'a [MediumPhoton],
        mut visit: impl FnMut(&'a MediumPhoton, Self::Pair),
    ) {
        let radius = stage.pairs.radii.medium;
        let visit = |photon, i, t, d2| visit(photon, (i, t, d2));
        stage.receivers.beams_around_each(photons.iter(), radius, visit);
    }

    fn add(&self, stage: &Stage, photon: &MediumPhoton, (i, t, d2): Self::Pair, out: &mut Out) {
        stage.pairs.point_on_beam(photon, stage.receivers.view_beam(i), t, d2, out);
    }
}

struct PointsOnPoints<'a>(&'a [SurfacePhoton]);

impl Kind for PointsOnPoints<'_> {
    type Photon = SurfacePhoton;
    type Pair = (u32, glam::Vec3, f32);

    fn photons(&self) -> &[SurfacePhoton] {
        self.0
    }

    fn search<'a>(
        &self,
        stage: &Stage,
        photons: &'a [SurfacePhoton],
        mut visit: impl FnMut(&'a SurfacePhoton, Self::Pair),
    ) {
        let (receivers, radius) = (stage.receivers, stage.pairs.radii.surface);
        let may_find = |p: &&SurfacePhoton| receivers.point_tree.may_find(p.position, radius);
        let visit = |photon, i, place, d2| visit(photon, (i, place, d2));
        receivers.points_around_each(photons.iter().filter(may_find), radius, visit);
    }

    fn add(&self, stage: &Stage, photon: &SurfacePhoton, (i, p, d2): Self::Pair, out: &mut Out) {
        let point = &stage.receivers.paths.points[i as usize];
        stage.pairs.photon_on_point(photon, point, p, d2, out);
    }
}

struct BeamsOnBeams<'a>(&'a PhotonBeams);

impl Kind for BeamsOnBeams<'_> {
    type Photon = PhotonBeam;
    type Pair = (u32, Approach);

    fn photons(&self) -> &[PhotonBeam] {
        &self.0.beams
    }

    fn search<'a>(
        &self,
        stage: &Stage,
        photons: &'a [PhotonBeam],
        mut visit: impl FnMut(&'a PhotonBeam, Self::Pair),
    ) {
        let radius = stage.pairs.radii.medium;
        for photon in photons {
            let visit = |index, approach| visit(photon, (index, approach));
            stage.receivers.beams_along(&photon.segment, radius, visit);
        }
    }

    fn add(&self, stage: &Stage, photon: &PhotonBeam, (i, approach): Self::Pair, out: &mut Out) {
        let view = stage.receivers.view_beam(i);
        stage.pairs.beam_on_beam(photon, &self.0.tables, view, &approach, out);
    }
}

/// Prints a row of the table: search and flat loop over the same pairs.
fn contest<K: Kind>(name: &str, stage: &Stage, kind: &K) {
    let (mut flat, photons) = (Vec::new(), kind.photons());
    for photons in photons.chunks(per_task(BATCH)) {
        kind.search(stage, photons, |photon, pair| flat.push((photon, pair)));
    }
    let pairs = flat.len();
    let out = || Gathered::new(Splat::new(stage.receivers.paths.new_sums().places()));
    let without_search = || {
        let mut out = out();
        flat.iter().for_each(|&(photon, pair)| kind.add(stage, photon, pair, &mut out));
        out
    };
    let search = || {
        let mut out = out();
        for photons in photons.chunks(per_task(BATCH)) {
            kind.search(stage, photons, |photon, pair| kind.add(stage, photon, pair, &mut out));
        }
        out
    };
    let rounds = PAIRS_IN_A_TURN.div_ceil(pairs);
    let turns = turns::take(TURNS, || {
        let seconds = [seconds(rounds, search), seconds(rounds, without_search)];
        seconds.map(|seconds| 1e-6 * (rounds * pairs) as f64 / seconds)
    });
    let [searched, alone] = [0, 1].map(|which| turns::median(&turns, which));
    let ratio = turns::ratio(&turns, 2);
    println!("{name:<38} {:>7} {pairs:>7} {searched:>12.1} {alone:>12.1}  {ratio}", photons.len());
}

fn seconds<T>(rounds: usize, run: impl Fn() -> T) -> f64 {
    let clock = Instant::now();
    for _ in 0..rounds {
        black_box(run());
    }
    clock.elapsed().as_secs_f64()
}

/// The photons of so many walks.
fn shoot(
    scene: &dyn Scene,
    plan: &Plan,
    at: &Receivers,
    particles: Particles,
    walks: u64,
) -> StoredPhotons {
    let (wanted, cone) = (at.paths.wanted(plan), at.paths.beam_cone);
    let storage = Storage { scene, plan, particles, wanted, cone, seed: SEED };
    storage.shoot(0, walks).expect("photons").0
}

fn main() {
    let session = Session::start(Some("scalar_rgb"), None, 0).expect("start Mitsuba");
    println!(
        "{:<38} {:>7} {:>7} {:>12} {:>12}  ratio",
        "million pairs per second", "photons", "pairs", "search", "no search"
    );
    for name in SCENES {
        let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
            .join(format!("mitsuba_scenes/{name}/scene.xml"));
        let side = |axis: &str| (axis.to_owned(), "160".to_owned());
        let defines = vec![side("resx"), side("resy")];
        let settings = vec![("preset".to_owned(), "paper".to_owned())];
        let file = SceneFile { path, defines, settings, ..SceneFile::default() };
        let mut loaded = session.load(&file).expect("load the scene");
        let radii: Radii =
            loaded.render(0, 1, Some(1), &mut Silent).expect("it renders").initial_radii;
        let lent = loaded.lend(0).expect("lend the scene");
        let scene = lent.scene();
        let plan = loaded.parameters(0).expect("parameters").plan(scene.description());
        let receivers = Receivers::build(scene, view::trace(scene, &plan, SEED, 0).expect("rays"));
        let stage =
            Stage { receivers: &receivers, pairs: Pairs::new(&plan, &receivers.paths, radii) };

        let points = shoot(scene, &plan, &receivers, Particles::Points, WALKS);
        let long = Particles::Beams(BeamKind::Long);
        let beams = shoot(scene, &plan, &receivers, long, BEAM_WALKS).beams;
        let named = |kind: &str| format!("{name}, {kind}");
        let in_media = PointsOnBeams(&points.in_media);
        contest(&named("photons on beams"), &stage, &in_media);
        let on_surfaces = PointsOnPoints(&points.on_surfaces);
        contest(&named("photons on points"), &stage, &on_surfaces);
        contest(&named("photon beams on beams"), &stage, &BeamsOnBeams(&beams));
    }
}
