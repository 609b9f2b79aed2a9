//! Cost of the search structures: per pair that they find, or per pass where photon maps are compared with the
//! trees over what the camera sees.
//!
//! A pinhole camera looks into a unit box from one of its faces, photons lie evenly in the box, and
//! the radius gives the mean photon ten pairs whatever the number of receivers, so that sizes can be
//! compared. Every contestant must find the very pairs of the others; one whose cost grows too fast has a share of the
//! photons, or is left out. `no_search` is a loop over the accepted pairs alone: what a search can come near to.

mod boxes;
mod cells;
mod contest;

use std::f64::consts::PI;
use std::hint::black_box;
use std::time::Duration;

use contest::{Contest, Found};
use criterion::{criterion_group, criterion_main, BenchmarkId, Criterion};
use glam::Vec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use vpt::math::{Aabb, MortonCurve, Segment};
use vpt::tree::{ApexGrid, PhotonBeams, PhotonDisks, ViewBeamTree, ViewPointTree};

const PAIRS: f64 = 10.0;
const PHOTONS: usize = 1 << 16;
/// Receivers, and how many beams there are of them with a pixel each in a square.
const SIDES: [usize; 3] = [100, 316, 1000];
const COUNTS: [usize; 3] = [10_000, 100_000, 1_000_000];
/// More beams than this have too many boxes and cells around each photon.
const MANY_BEAMS: usize = 200_000;
/// Share of the photons for contestants that take a hundred times longer.
const SLOW: usize = 32;
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
        Segment {
            origin: apex,
            direction,
            length: ((walls - apex) / direction).abs().min_element(),
        }
    };
    (0..side * side).map(&mut ray).collect()
}

/// The mean photon meets (cross-section · total length / volume of the box) beams.
fn beam_radius(segments: &[Segment]) -> f32 {
    let total: f64 = segments.iter().map(|segment| f64::from(segment.length)).sum();
    (PAIRS / (PI * total)).sqrt() as f32
}

/// Photon points among the beams of a pinhole.
fn points_on_beams(criterion: &mut Criterion) {
    for side in SIDES {
        let mut rng = StdRng::seed_from_u64(1);
        let segments = pinhole(side, &mut rng);
        let radius = beam_radius(&segments);
        let photons: Vec<_> = (0..PHOTONS).map(|_| random_in_cube(&mut rng)).collect();
        let tree = ViewBeamTree::build(&segments);
        let indexed: Vec<_> = (0..).zip(segments.iter().copied()).collect();
        let grid = ApexGrid::build(&indexed).expect("the beams meet in a point");
        eprintln!("{:?}, {} MB", tree.stats(), tree.memory_bytes() >> 20);

        let value = |&p: &Vec3, index: u32| {
            let (t, distance_squared) = segments[index as usize].project(p);
            t + distance_squared
        };
        let find = |&p: &Vec3, found: &mut Vec<u32>| tree.query(p, radius, |i, _, _| found.push(i));
        let mut contest = Contest::new(criterion, "photons on beams", &photons, side * side);
        contest.no_search(find, value);
        contest.enter("ViewBeamTree", 1, |&p, found| {
            tree.query(p, radius, |_, t, distance_squared| found.add(t + distance_squared));
        });
        let curve = curve_through_cube();
        contest.enter_sorted(
            "ViewBeamTree_sorted",
            |&p| curve.place(p),
            |photons, found| {
                tree.query_all(photons, radius, |_, _, t, d2| found.add(t + d2));
            },
        );
        let in_grid = |&p: &Vec3, found: &mut Found| {
            grid.query(p, radius, |_, t, distance_squared| found.add(t + distance_squared));
        };
        contest.enter("ApexGrid", 1, in_grid);
        contest.enter_sorted(
            "ApexGrid_sorted",
            |&p| grid.place(p),
            |photons, found| {
                photons.iter().for_each(|photon| in_grid(photon, found));
            },
        );
        if segments.len() > MANY_BEAMS {
            continue;
        }
        let boxes =
            boxes::Boxes::over(segments.iter().map(|beam| boxes::around_beam(beam, radius)));
        contest.enter("bvh", SLOW, |&p, found| {
            boxes.around(p, |index| {
                if let Some(value) = pair(&segments[index], p, radius) {
                    found.add(value);
                }
            });
        });
        let cells = cells::BeamCells::over(&segments, radius);
        contest.enter("uniform_grid", 1, |&p, found| {
            for &index in cells.around(p) {
                if let Some(value) = pair(&segments[index as usize], p, radius) {
                    found.add(value);
                }
            }
        });
    }
}

/// Places in it put neighbours one after another.
fn curve_through_cube() -> MortonCurve {
    MortonCurve::through(&Aabb { min: Vec3::ZERO, max: Vec3::ONE })
}

/// What a photon and a beam add, as all contestants judge them.
fn pair(beam: &Segment, p: Vec3, radius: f32) -> Option<f32> {
    let (t, distance_squared) = beam.project(p);
    let is_pair = (distance_squared < radius * radius) & (t >= 0.0) & (t < beam.length);
    is_pair.then_some(t + distance_squared)
}

/// Photons on surfaces among visible points.
fn points_on_points(criterion: &mut Criterion) {
    let mut rng = StdRng::seed_from_u64(2);
    // Visible points lie on surfaces: three walls of the box, and photons land on them.
    let mut on_walls = |count: usize| -> Vec<Vec3> {
        let mut on_wall =
            |number: usize| random_in_cube(&mut rng) * (Vec3::ONE - Vec3::AXES[number % 3]);
        (0..count).map(&mut on_wall).collect()
    };
    for count in COUNTS {
        let visible = on_walls(count);
        let photons = on_walls(PHOTONS);
        let radius = (PAIRS * 3.0 / (PI * count as f64)).sqrt() as f32;
        let tree = ViewPointTree::build(&visible);

        let distance_squared = |p: Vec3, index: usize| visible[index].distance_squared(p);
        let find = |&p: &Vec3, found: &mut Vec<u32>| tree.query(p, radius, |i, _| found.push(i));
        let mut contest = Contest::new(criterion, "photons on points", &photons, count);
        contest.no_search(find, |&p, index| distance_squared(p, index as usize));
        let in_tree = |&p: &Vec3, found: &mut Found| tree.query(p, radius, |_, d2| found.add(d2));
        let curve = curve_through_cube();
        contest.enter("ViewPointTree", 1, in_tree);
        contest.enter_sorted(
            "ViewPointTree_sorted",
            |&p| curve.place(p),
            |photons, found| {
                tree.query_all(photons, radius, |_, _, _, d2| found.add(d2));
            },
        );

        let coordinates: Vec<_> = visible.iter().map(|p| p.to_array()).collect();
        let kiddo: ImmutableKdTree<f32, 3> = ImmutableKdTree::new_from_slice(&coordinates);
        contest.enter("kiddo", 1, |p, found| {
            let within = kiddo.within_unsorted::<SquaredEuclidean>(&p.to_array(), radius * radius);
            within
                .iter()
                .filter(|near| near.distance < radius * radius)
                .for_each(|near| found.add(near.distance));
        });
        let boxes = boxes::Boxes::over(visible.iter().map(|&p| boxes::around_point(p, radius)));
        let cells = cells::PointCells::over(&visible, radius);
        let judge = |found: &mut Found, d2: f32| {
            if d2 < radius * radius {
                found.add(d2);
            }
        };
        contest.enter("bvh", 1, |&p, found| {
            boxes.around(p, |index| judge(found, distance_squared(p, index)));
        });
        contest.enter("uniform_grid", 1, |&p, found| {
            cells.around(p, |near| judge(found, near.distance_squared(p)));
        });
    }
}

/// Photon beams among the beams of a pinhole, at the radius of photon points: the pairs grow with the root of the beams.
fn beams_on_beams(criterion: &mut Criterion) {
    for side in SIDES {
        let mut rng = StdRng::seed_from_u64(5);
        let segments = pinhole(side, &mut rng);
        let radius = beam_radius(&segments);
        let mut photon_beam =
            |_| Segment::between(random_in_cube(&mut rng), random_in_cube(&mut rng));
        let photons: Vec<_> = (0..PHOTON_BEAMS / 4).map(&mut photon_beam).collect();
        let tree = ViewBeamTree::build(&segments);

        let value = |photon: &Segment, index: u32| {
            let approach = segments[index as usize].approach(photon);
            approach.map_or(0.0, |pair| pair.t / pair.sine)
        };
        let find = |photon: &Segment, found: &mut Vec<u32>| {
            tree.query_segment(photon, radius, |index, _| found.push(index));
        };
        let mut contest = Contest::new(criterion, "photon beams on beams", &photons, side * side);
        contest.no_search(find, value);
        contest.enter("ViewBeamTree", 1, |photon, found| {
            tree.query_segment(photon, radius, |_, pair| found.add(pair.t / pair.sine));
        });
        let indexed: Vec<_> = (0..).zip(segments.iter().copied()).collect();
        let grid = ApexGrid::build(&indexed).expect("the beams meet in a point");
        contest.enter("ApexGrid", 1, |photon, found| {
            grid.query_segment(photon, radius, |_, pair| found.add(pair.t / pair.sine));
        });
        if segments.len() > MANY_BEAMS {
            continue;
        }
        let boxes =
            boxes::Boxes::over(segments.iter().map(|beam| boxes::around_beam(beam, radius)));
        contest.enter("bvh", SLOW, |photon, found| {
            boxes.along(photon, |index| {
                let Some(pair) = segments[index].approach(photon) else { return };
                let is_pair = (pair.distance_squared < radius * radius)
                    & (pair.t >= 0.0)
                    & (pair.t < segments[index].length)
                    & (pair.t_other >= 0.0)
                    & (pair.t_other < photon.length);
                if is_pair {
                    found.add(pair.t / pair.sine);
                }
            });
        });
    }
}

/// Building what photons ask.
fn building(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("build");
    group.sample_size(10);
    for side in SIDES {
        let mut rng = StdRng::seed_from_u64(1);
        let segments = pinhole(side, &mut rng);
        let indexed: Vec<_> = (0..).zip(segments.iter().copied()).collect();
        let points: Vec<_> = segments.iter().map(|segment| segment.at(segment.length)).collect();
        group.bench_function(BenchmarkId::new("ViewBeamTree", segments.len()), |bencher| {
            bencher.iter(|| ViewBeamTree::build(black_box(&segments)));
        });
        group.bench_function(BenchmarkId::new("ApexGrid", segments.len()), |bencher| {
            bencher.iter(|| ApexGrid::build(black_box(&indexed)));
        });
        group.bench_function(BenchmarkId::new("ViewPointTree", segments.len()), |bencher| {
            bencher.iter(|| ViewPointTree::build(black_box(&points)));
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
    config = Criterion::default()
        .without_plots()
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(1));
    targets = points_on_beams, points_on_points, beams_on_beams, building, disk_pairs, beam_pairs
}
criterion_main!(benches);
