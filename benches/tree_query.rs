//! Cost of the search structures: per photon, or per pass where photon maps are compared with the
//! trees over what the camera sees.
//!
//! A pinhole camera looks into a unit box from one of its faces, photons lie evenly in the box, and
//! the radius gives the mean photon ten pairs whatever the number of beams, so that sizes can be
//! compared.

use std::f64::consts::PI;
use std::hint::black_box;

use criterion::measurement::WallTime;
use criterion::{
    criterion_group, criterion_main, BenchmarkGroup, BenchmarkId, Criterion, Throughput,
};
use glam::Vec3;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use vpt::math::Segment;
use vpt::tree::{ApexGrid, PhotonBeams, PhotonDisks, ViewBeamTree, ViewPointTree};

const PAIRS: f64 = 10.0;
const PHOTONS: usize = 1 << 16;
/// Pixels along a side where whole passes are compared.
const PASS_SIDE: usize = 256;
/// As many beams have some hundred times the pairs of as many photons.
const PHOTON_BEAMS: usize = 1 << 12;

fn random_in_cube(rng: &mut StdRng) -> Vec3 {
    Vec3::from_array(rng.random())
}

/// One jittered ray per pixel of a `side × side` image, from the face z = 0 to where it leaves the
/// unit box.
fn pinhole(side: usize, rng: &mut StdRng) -> Vec<Segment> {
    let apex = Vec3::new(0.45, 0.55, 0.0);
    let mut ray = |pixel: usize| {
        let corner = Vec3::new((pixel % side) as f32, (pixel / side) as f32, 0.0);
        let on_film = (corner + random_in_cube(rng)) / side as f32 - 0.5;
        let direction = on_film.with_z(0.8).normalize();
        let walls = Vec3::select(direction.cmpgt(Vec3::ZERO), Vec3::ONE, Vec3::ZERO);
        Segment { origin: apex, direction, length: ((walls - apex) / direction).min_element() }
    };
    (0..side * side).map(&mut ray).collect()
}

/// The mean photon meets (cross-section · total length / volume of the box) beams.
fn beam_radius(segments: &[Segment]) -> f32 {
    let total: f64 = segments.iter().map(|segment| f64::from(segment.length)).sum();
    (PAIRS / (PI * total)).sqrt() as f32
}

fn beams(criterion: &mut Criterion) {
    for side in [100, 316, 1000] {
        let mut rng = StdRng::seed_from_u64(1);
        let segments = pinhole(side, &mut rng);
        let radius = beam_radius(&segments);
        let photons: Vec<_> = (0..PHOTONS).map(|_| random_in_cube(&mut rng)).collect();
        let tree = ViewBeamTree::build(&segments);
        eprintln!("{:?}, {} MB", tree.stats(), tree.memory_bytes() >> 20);

        let mut group = criterion.benchmark_group("beams");
        group.sample_size(10);
        group.bench_function(BenchmarkId::new("build", segments.len()), |bencher| {
            bencher.iter(|| ViewBeamTree::build(black_box(&segments)));
        });
        group.throughput(Throughput::Elements(1));
        per_photon(&mut group, "query", segments.len(), &photons, |p, sum| {
            tree.query(p, radius, |_, t, distance_squared| *sum += t + distance_squared);
        });
        apex_grid(&mut group, &segments, radius, &photons);
        accepted_pairs(&mut group, &tree, &segments, radius, &photons);
    }
}

/// The same beams in the grid that photon points use for a pinhole's.
fn apex_grid(
    group: &mut BenchmarkGroup<WallTime>,
    segments: &[Segment],
    radius: f32,
    photons: &[Vec3],
) {
    let indexed: Vec<_> = (0u32..).zip(segments.iter().copied()).collect();
    let grid = ApexGrid::build(&indexed).expect("the beams meet in a point");
    per_photon(group, "grid_query", segments.len(), photons, |p, sum| {
        grid.query(p, radius, |_, t, distance_squared| *sum += t + distance_squared);
    });
}

/// Times a query that adds up what it finds.
fn per_photon(
    group: &mut BenchmarkGroup<WallTime>,
    name: &str,
    beams: usize,
    photons: &[Vec3],
    query: impl Fn(Vec3, &mut f32),
) {
    group.bench_function(BenchmarkId::new(name, beams), |bencher| {
        let mut next = photons.iter().cycle();
        bencher.iter(|| {
            let mut sum = 0.0;
            query(*next.next().expect("there are photons"), &mut sum);
            sum
        });
    });
}

/// A loop over the very pairs that queries accept, with no search at all: what a search can come near to.
fn accepted_pairs(
    group: &mut BenchmarkGroup<WallTime>,
    tree: &ViewBeamTree,
    segments: &[Segment],
    radius: f32,
    photons: &[Vec3],
) {
    let pairs: Vec<Vec<u32>> = photons
        .iter()
        .map(|&p| {
            let mut found = Vec::new();
            tree.query(p, radius, |index, _, _| found.push(index));
            found
        })
        .collect();
    group.bench_function(BenchmarkId::new("no_search", segments.len()), |bencher| {
        let mut next = photons.iter().zip(&pairs).cycle();
        bencher.iter(|| {
            let (&p, found) = next.next().expect("there are photons");
            found.iter().fold(0.0, |sum, &index| {
                let (t, distance_squared) = segments[index as usize].project(p);
                sum + t + distance_squared
            })
        });
    });
}

fn points(criterion: &mut Criterion) {
    let mut rng = StdRng::seed_from_u64(2);
    // Visible points lie on surfaces: three walls of the box, and photons land on them.
    let mut on_walls = |count: usize| -> Vec<Vec3> {
        let mut on_wall =
            |number: usize| random_in_cube(&mut rng) * (Vec3::ONE - Vec3::AXES[number % 3]);
        (0..count).map(&mut on_wall).collect()
    };
    for count in [10_000, 100_000, 1_000_000] {
        let visible = on_walls(count);
        let photons = on_walls(PHOTONS);
        let radius = (PAIRS * 3.0 / (PI * count as f64)).sqrt() as f32;
        let tree = ViewPointTree::build(&visible);

        let mut group = criterion.benchmark_group("points");
        group.sample_size(10);
        group.bench_function(BenchmarkId::new("build", count), |bencher| {
            bencher.iter(|| ViewPointTree::build(black_box(&visible)));
        });
        group.throughput(Throughput::Elements(1));
        group.bench_function(BenchmarkId::new("query", count), |bencher| {
            let mut next = photons.iter().cycle();
            bencher.iter(|| {
                let mut sum = 0.0;
                let &p = next.next().unwrap_or(&Vec3::ZERO);
                tree.query(p, radius, |_, distance_squared| sum += distance_squared);
                sum
            });
        });
    }
}

/// The pairs of one pass, from either side: photons against the tree over view beams, and view beams
/// against the map of photons. The structures find the same pairs.
fn disk_pairs(criterion: &mut Criterion) {
    let mut rng = StdRng::seed_from_u64(3);
    let views = pinhole(PASS_SIDE, &mut rng);
    let radius = beam_radius(&views);
    let photons: Vec<_> = (0..PHOTONS).map(|_| random_in_cube(&mut rng)).collect();
    let (tree, map) = (ViewBeamTree::build(&views), PhotonDisks::build(&photons));
    eprintln!("tree {} MB, map {} MB", tree.memory_bytes() >> 20, map.memory_bytes() >> 20);

    let mut group = criterion.benchmark_group("disk pairs of a pass");
    group.sample_size(10);
    group.bench_function("ViewBeamTree::query", |bencher| {
        bencher.iter(|| {
            let mut sum = 0.0;
            for &p in &photons {
                tree.query(p, radius, |_, t, distance_squared| sum += t + distance_squared);
            }
            sum
        });
    });
    group.bench_function("PhotonDisks::build", |bencher| {
        bencher.iter(|| PhotonDisks::build(black_box(&photons)));
    });
    group.bench_function("PhotonDisks::query", |bencher| {
        bencher.iter(|| {
            let mut sum = 0.0;
            for view in &views {
                map.query(view, radius, |_, t, distance_squared| sum += t + distance_squared);
            }
            sum
        });
    });
}

/// As `disk_pairs`, with photon beams between random places instead of photons.
fn beam_pairs(criterion: &mut Criterion) {
    let mut rng = StdRng::seed_from_u64(4);
    let views = pinhole(PASS_SIDE, &mut rng);
    let mut photon_beam = |_| Segment::between(random_in_cube(&mut rng), random_in_cube(&mut rng));
    let photons: Vec<_> = (0..PHOTON_BEAMS).map(&mut photon_beam).collect();
    let radius = beam_radius(&views);
    let (tree, map) = (ViewBeamTree::build(&views), PhotonBeams::build(&photons));
    eprintln!("tree {} MB, map {} MB", tree.memory_bytes() >> 20, map.memory_bytes() >> 20);

    let mut group = criterion.benchmark_group("beam pairs of a pass");
    group.sample_size(10);
    group.bench_function("ViewBeamTree::query_segment", |bencher| {
        bencher.iter(|| {
            let mut sum = 0.0;
            for photon in &photons {
                tree.query_segment(photon, radius, |_, pair| sum += pair.t / pair.sine);
            }
            sum
        });
    });
    group.bench_function("PhotonBeams::build", |bencher| {
        bencher.iter(|| PhotonBeams::build(black_box(&photons)));
    });
    group.bench_function("PhotonBeams::query", |bencher| {
        bencher.iter(|| {
            let mut sum = 0.0;
            for view in &views {
                map.query(view, radius, |_, pair| sum += pair.t / pair.sine);
            }
            sum
        });
    });
}

// Criterion's plots want fonts that a machine may lack.
criterion_group! {
    name = benches;
    config = Criterion::default().without_plots();
    targets = beams, points, disk_pairs, beam_pairs
}
criterion_main!(benches);
