//! Photon walks through the seam (batches, C ABI, outputs) against the same walks in a plain C++ loop
//! of Mitsuba calls. One thread each, `scalar_rgb`; throughput is in path vertices. The walks simulate what a render of
//! the scene would, which the loop does, too: the fog is grey.

use criterion::{criterion_group, criterion_main, Criterion, Throughput};
use std::path::PathBuf;
use vpt::host::session::{SceneFile, Session};
use vpt::math::uniform::{fill, stream, Purpose};
use vpt::method::Parameters;
use vpt::scene::{
    PathLimits, PathRules, PhotonVertices, Scene, EMIT_DIMENSIONS, PHOTON_STEP_DIMENSIONS,
};

const WALKS: u64 = 20_000;
const LIMITS: PathLimits = PathLimits { max_depth: 64, rr_depth: 5, hide_emitters: false };

/// Walks photons batch after batch and returns the number of path vertices.
fn walks_through_seam(scene: &dyn Scene, walks: u64, rules: PathRules) -> u64 {
    let lanes = scene.batching().lanes;
    let (mut numbers, mut out, mut vertices) = (Vec::new(), PhotonVertices::default(), 0);
    for batch in 0..walks / lanes as u64 {
        let mut rng = stream(1, Purpose::Photons, 0, batch);
        fill(&mut rng, &mut numbers, EMIT_DIMENSIONS * lanes);
        let mut photons = scene.emit(lanes, &numbers, rules).expect("emit");
        while photons.lanes() > 0 {
            vertices += photons.lanes() as u64;
            fill(&mut rng, &mut numbers, PHOTON_STEP_DIMENSIONS * photons.lanes());
            photons.step(1, &numbers, &mut out).expect("step");
        }
    }
    vertices
}

fn photon_walk(criterion: &mut Criterion) {
    let path =
        PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/mitsuba_scenes/cornell_fog/scene.xml"));
    let session = Session::start(Some("scalar_rgb"), None, 0).expect("start Mitsuba");
    let file = SceneFile { path, ..SceneFile::default() };
    let loaded = session.load(&file).expect("load the scene");
    let lent = loaded.lend(0).expect("lend the scene");
    let scene = lent.scene();
    let own = loaded.parameters(0).expect("the parameters are right");
    let rules = Parameters { limits: LIMITS, ..own }.plan(scene.description()).rules;

    let mut group = criterion.benchmark_group("photon_walk");
    group.sample_size(10);
    group.throughput(Throughput::Elements(walks_through_seam(scene, WALKS, rules)));
    group.bench_function("seam", |b| b.iter(|| walks_through_seam(scene, WALKS, rules)));
    let bare = loaded.bare_walks(0, WALKS, LIMITS).expect("bare walks");
    group.throughput(Throughput::Elements(bare));
    group.bench_function("bare_cpp_loop", |b| {
        b.iter(|| loaded.bare_walks(0, WALKS, LIMITS).expect("bare walks"));
    });
    group.finish();
}

// Criterion's plots want fonts that a machine may lack.
criterion_group! {
    name = benches;
    config = Criterion::default().without_plots();
    targets = photon_walk
}
criterion_main!(benches);
