//! The hierarchy over boxes and the photon map on it against brute force and against the tree over
//! view beams: the same pairs, to the last bit.

use glam::{DVec3, Vec3};
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use vpt::math::{Aabb, Segment};
use vpt::tree::{Bvh, PhotonDisks, ViewBeamTree};

#[path = "support/segment_sets.rs"]
mod segment_sets;
use segment_sets::{box_of, pinhole, random_direction, random_in_cube, random_segments};

/// View beam, photon, bits of `t`, bits of the squared distance.
type Pair = (u32, u32, u32, u32);

fn pairs_of_disks(map: &PhotonDisks, views: &[Segment], radius: f32) -> Vec<Pair> {
    let mut pairs = Vec::new();
    for (view_index, view) in (0..).zip(views) {
        map.query(view, radius, |index, t, distance_squared| {
            pairs.push((view_index, index, t.to_bits(), distance_squared.to_bits()));
        });
    }
    pairs.sort_unstable();
    pairs
}

fn pairs_of_tree(tree: &ViewBeamTree, photons: &[Vec3], radius: f32) -> Vec<Pair> {
    let mut pairs = Vec::new();
    for (index, &p) in (0..).zip(photons) {
        tree.query(p, radius, |view, t, distance_squared| {
            pairs.push((view, index, t.to_bits(), distance_squared.to_bits()));
        });
    }
    pairs.sort_unstable();
    pairs
}

fn pairs_by_brute_force(views: &[Segment], photons: &[Vec3], radius: f32) -> Vec<Pair> {
    let mut pairs = Vec::new();
    for (view_index, view) in (0..).zip(views).filter(|(_, view)| view.is_finite()) {
        for (index, &p) in (0..).zip(photons) {
            let (t, distance_squared) = view.project(p);
            let is_beside = (0.0..view.length).contains(&t);
            if is_beside && radius > 0.0 && distance_squared < radius * radius {
                pairs.push((view_index, index, t.to_bits(), distance_squared.to_bits()));
            }
        }
    }
    pairs
}

/// Compares for all radii; returns how many pairs there were.
fn check_disks(views: &[Segment], photons: &[Vec3], radii: &[f32]) -> usize {
    let (tree, map) = (ViewBeamTree::build(views), PhotonDisks::build(photons));
    let mut count = 0;
    for &radius in radii {
        let expected = pairs_by_brute_force(views, photons, radius);
        assert!(pairs_of_disks(&map, views, radius) == expected, "map, radius {radius}");
        assert!(pairs_of_tree(&tree, photons, radius) == expected, "tree, radius {radius}");
        count += expected.len();
    }
    count
}

/// Photons on the beams and anywhere in their box, and radii of all sizes.
fn check_disks_around(views: &[Segment], seed: u64) {
    let mut rng = StdRng::seed_from_u64(seed);
    let (min, max) = box_of(views);
    let mut photons = vec![min, max, max + (max - min)];
    for _ in 0..150 {
        let view = views[rng.random_range(0..views.len())];
        photons.extend([0.0, 1.0, rng.random()].map(|share: f32| view.at(share * view.length)));
        photons.push(min + random_in_cube(&mut rng) * (max - min));
    }
    let radii = [0.0, 1e-6, 1e-3, 0.05, 0.4, 3.0].map(|share| share * (max - min).max_element());
    assert!(check_disks(views, &photons, &radii) > 0, "the set tests nothing");
}

#[test]
fn disks_around_beams_of_all_kinds() {
    let mut rng = StdRng::seed_from_u64(1);
    check_disks_around(&random_segments(200, &mut rng), 2);
    check_disks_around(&pinhole(Vec3::new(0.3, 0.7, 0.1), 200, &mut rng), 3);
    for direction in [Vec3::X, -Vec3::Z, Vec3::new(1.0, 1e-7, -1e-30)] {
        let mut shifted =
            |_| Segment { origin: 0.2 * random_in_cube(&mut rng), direction, length: 1.0 };
        check_disks_around(&(0..100).map(&mut shifted).collect::<Vec<_>>(), 4);
    }
    for scale in [1e-4, 1e-15] {
        let scaled =
            |s: Segment| Segment { origin: scale * s.origin, length: scale * s.length, ..s };
        let small: Vec<_> = random_segments(100, &mut rng).into_iter().map(scaled).collect();
        check_disks_around(&small, 5);
    }
}

#[test]
fn disks_far_from_the_origin() {
    let mut rng = StdRng::seed_from_u64(6);
    for offset in [Vec3::splat(1e6), Vec3::new(-1e6, 3.0, 1e4)] {
        let mut distant = |_| {
            Segment::between(offset + random_in_cube(&mut rng), offset + random_in_cube(&mut rng))
        };
        check_disks_around(&(0..150).map(&mut distant).collect::<Vec<_>>(), 7);
    }
    let mut aimed = |_| {
        let direction = random_direction(&mut rng);
        Segment { origin: 0.1 * random_in_cube(&mut rng) - 1e6 * direction, direction, length: 2e6 }
    };
    let views: Vec<_> = (0..100).map(&mut aimed).collect();
    let photons: Vec<_> = (0..200).map(|_| 0.4 * random_in_cube(&mut rng) - 0.2).collect();
    assert!(check_disks(&views, &photons, &[1e-3, 0.1]) > 0);
}

#[test]
fn odd_photons_beams_and_radii() {
    let mut rng = StdRng::seed_from_u64(8);
    let mut views = random_segments(30, &mut rng);
    for length in [f32::NAN, f32::INFINITY, 0.0, -1.0, 1e30] {
        views.push(Segment { length, ..views[0] });
    }
    let mut photons: Vec<_> = (0..50).map(|_| random_in_cube(&mut rng)).collect();
    photons.extend([Vec3::NAN, Vec3::INFINITY, Vec3::splat(f32::MAX), Vec3::splat(1e30)]);
    let radii = [-1.0, 0.0, 1e-30, 0.1, 1e20, f32::INFINITY, f32::NAN];
    assert!(check_disks(&views, &photons, &radii) > 0);
    assert_eq!(PhotonDisks::build(&photons).stats().non_finite, 2);
    assert_eq!(check_disks(&views, &[], &[1.0]) + check_disks(&[], &photons, &[1.0]), 0);
}

/// Whether a segment meets a box widened by `radius`, in double precision; unsure within rounding.
fn surely_meets(segment: &Segment, bounds: &Aabb, radius: f32) -> bool {
    let (o, d) = (segment.origin.as_dvec3(), segment.direction.as_dvec3());
    let wide = DVec3::splat(f64::from(radius));
    let (min, max) = (bounds.min.as_dvec3() - wide, bounds.max.as_dvec3() + wide);
    let (mut start, mut end) = (0.0, f64::from(segment.length));
    for axis in 0..3 {
        if d[axis] == 0.0 {
            if o[axis] < min[axis] || o[axis] > max[axis] {
                return false;
            }
            continue;
        }
        let (a, b) = ((min[axis] - o[axis]) / d[axis], (max[axis] - o[axis]) / d[axis]);
        start = f64::max(start, a.min(b));
        end = f64::min(end, a.max(b));
    }
    start <= end
}

/// Queries along segments of all kinds miss no box; returns the share of boxes found in vain.
fn check_boxes(boxes: &[Aabb], segments: &[Segment], radius: f32) -> f64 {
    let bvh = Bvh::build(boxes);
    bvh.validate(boxes).unwrap();
    let (mut met_boxes, mut found_boxes) = (0, 0);
    for segment in segments {
        let mut found = Vec::new();
        bvh.query(segment, radius, |index| found.push(index));
        found.sort_unstable();
        assert!(found.windows(2).all(|pair| pair[0] < pair[1]), "a box is met twice");
        for (index, bounds) in (0..).zip(boxes) {
            let is_met = surely_meets(segment, bounds, radius);
            assert!(
                !is_met || found.binary_search(&index).is_ok(),
                "{segment:?} misses {bounds:?}"
            );
            met_boxes += usize::from(is_met);
        }
        found_boxes += found.len();
    }
    (found_boxes - met_boxes) as f64 / (boxes.len() * segments.len()) as f64
}

fn random_boxes(count: usize, size: f32, rng: &mut StdRng) -> Vec<Aabb> {
    let mut around = |_| {
        let (min, extent) = (random_in_cube(rng), size * random_in_cube(rng));
        Aabb { min, max: min + extent }
    };
    (0..count).map(&mut around).collect()
}

#[test]
fn no_box_is_missed() {
    let mut rng = StdRng::seed_from_u64(9);
    let mut segments = random_segments(50, &mut rng);
    for i in 0..50 {
        let origin = 3.0 * random_in_cube(&mut rng) - 1.0;
        let direction =
            if i % 2 == 0 { random_direction(&mut rng) } else { Vec3::AXES[i % 3] * -1.0 };
        segments.push(Segment { origin, direction, length: f32::INFINITY });
    }
    for (size, radius) in [(0.0, 0.0), (0.0, 0.02), (0.1, 0.0), (0.5, 0.1), (0.01, 5.0)] {
        let in_vain = check_boxes(&random_boxes(2000, size, &mut rng), &segments, radius);
        assert!(in_vain < 0.2, "{in_vain} of all boxes are found in vain");
    }
}

#[test]
fn degenerate_boxes() {
    let mut rng = StdRng::seed_from_u64(10);
    let segments = random_segments(20, &mut rng);
    let copies = vec![Aabb { min: Vec3::splat(0.3), max: Vec3::splat(0.6) }; 3000];
    check_boxes(&copies, &segments, 0.0);
    let shrinking: Vec<_> =
        (0..3000).map(|i| Vec3::splat(0.97_f32.powi(i))).map(|p| Aabb { min: p, max: p }).collect();
    check_boxes(&shrinking, &segments, 0.01);
    let flat: Vec<_> = random_boxes(1000, 0.1, &mut rng)
        .into_iter()
        .map(|b| Aabb { min: b.min.with_y(0.5), max: b.max.with_y(0.5) })
        .collect();
    check_boxes(&flat, &segments, 0.01);
    let mut odd = random_boxes(20, 0.1, &mut rng);
    odd.extend([Aabb::EMPTY, Aabb::UNBOUNDED, Aabb { min: Vec3::NAN, max: Vec3::ONE }]);
    odd.push(Aabb { min: Vec3::splat(f32::MIN), max: Vec3::splat(f32::MAX) });
    let bvh = Bvh::build(&odd);
    bvh.validate(&odd).unwrap();
    assert_eq!((bvh.stats().boxes, bvh.stats().non_finite), (21, 3));
    Bvh::build(&[]).validate(&[]).unwrap();
}

#[test]
fn odd_segments_meet_nothing() {
    let boxes = random_boxes(100, 0.1, &mut StdRng::seed_from_u64(11));
    let bvh = Bvh::build(&boxes);
    let good = Segment::between(Vec3::ZERO, Vec3::ONE);
    let count = |segment: Segment, radius| {
        let mut count = 0;
        bvh.query(&segment, radius, |_| count += 1);
        count
    };
    assert_eq!(count(good, f32::INFINITY), 100);
    assert_eq!(count(good, f32::NAN) + count(good, -1.0), 0);
    assert_eq!(count(Segment { length: f32::NAN, ..good }, 1.0), 0);
    assert_eq!(count(Segment { length: -1.0, ..good }, 1.0), 0);
    assert_eq!(count(Segment { origin: Vec3::NAN, ..good }, 1.0), 0);
    assert_eq!(count(Segment { direction: Vec3::INFINITY, ..good }, 1.0), 0);
}

#[test]
fn hierarchy_does_not_depend_on_the_number_of_threads() {
    let boxes = random_boxes(60_000, 0.02, &mut StdRng::seed_from_u64(12));
    let order_with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let bvh = pool.install(|| Bvh::build(&boxes));
        bvh.validate(&boxes).unwrap();
        (bvh.stats(), bvh.order().to_vec())
    };
    assert!(order_with(1) == order_with(4));
}
