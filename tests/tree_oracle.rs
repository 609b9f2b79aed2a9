//! Both kd-trees against brute force: the same pairs, to the last bit of `t` and distance, each
//! exactly once.

use glam::Vec3;
use proptest::prelude::*;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use vpt::math::Segment;
use vpt::tree::view_beam::{BuildOptions, SplitAxis};
use vpt::tree::{ViewBeamTree, ViewPointTree};

#[path = "support/segment_sets.rs"]
mod segment_sets;
#[path = "support/strategies.rs"]
mod strategies;
use segment_sets::{box_of, pinhole, random_direction, random_in_cube, random_segments};
use strategies::{place, segment};

/// Index, bits of `t`, bits of the squared distance.
type Pair = (u32, u32, u32);

fn beam_pairs_by_brute_force(segments: &[Segment], p: Vec3, radius: f32) -> Vec<Pair> {
    let mut pairs = Vec::new();
    for (index, segment) in (0..).zip(segments) {
        let (t, distance_squared) = segment.project(p);
        let is_beside = 0.0 <= t && t < segment.length;
        if segment.is_finite() && is_beside && radius > 0.0 && distance_squared < radius * radius {
            pairs.push((index, t.to_bits(), distance_squared.to_bits()));
        }
    }
    pairs
}

/// In the order of the calls.
fn beam_pairs(tree: &ViewBeamTree, p: Vec3, radius: f32) -> Vec<Pair> {
    let mut pairs = Vec::new();
    tree.query(p, radius, |index, t, distance_squared| {
        pairs.push((index, t.to_bits(), distance_squared.to_bits()));
    });
    pairs
}

/// Of each photon, in the order of the calls.
fn beam_pairs_of_all(tree: &ViewBeamTree, photons: &[Vec3], radius: f32) -> Vec<Vec<Pair>> {
    let mut pairs = vec![Vec::new(); photons.len()];
    tree.query_all(photons, radius, |which, index, t, distance_squared| {
        pairs[which].push((index, t.to_bits(), distance_squared.to_bits()));
    });
    pairs
}

/// Compares for all photons and radii; returns how many pairs there were.
fn check_beams(
    segments: &[Segment],
    options: &BuildOptions,
    photons: &[Vec3],
    radii: &[f32],
) -> usize {
    let tree = ViewBeamTree::build_with(segments, options);
    tree.validate().unwrap();
    let stats = tree.stats();
    assert_eq!(stats.beams + stats.empty + stats.non_finite, segments.len());
    assert!(stats.references <= stats.beams * options.references_per_beam.max(1));
    assert!(stats.depth <= options.max_depth);
    let mut count = 0;
    for &radius in radii {
        let together = beam_pairs_of_all(&tree, photons, radius);
        for (&p, together) in photons.iter().zip(together) {
            let mut alone = beam_pairs(&tree, p, radius);
            assert_eq!(together, alone, "photon {p} beside others, radius {radius}, {options:?}");
            alone.sort_unstable();
            let expected = beam_pairs_by_brute_force(segments, p, radius);
            assert_eq!(alone, expected, "photon {p}, radius {radius}, {options:?}");
            count += expected.len();
        }
    }
    count
}

/// The default, and trees cut as finely as it goes by either rule.
fn option_sets() -> [BuildOptions; 3] {
    let finest = |split_axis| BuildOptions {
        leaf_size: 1,
        max_depth: 40,
        references_per_beam: 100,
        split_axis,
    };
    [BuildOptions::default(), finest(SplitAxis::Largest), finest(SplitAxis::Relative)]
}

/// Photons where mistakes hide: on beams and their ends, on the planes of a tree that halves the
/// box, and anywhere.
fn photons_around(segments: &[Segment], count: usize, rng: &mut StdRng) -> Vec<Vec3> {
    let (min, max) = box_of(segments);
    let mut photons = vec![Vec3::ZERO, min, max, max + (max - min)];
    for _ in 0..count {
        let segment = segments[rng.random_range(0..segments.len())];
        if segment.is_finite() {
            photons.extend(
                [0.0, 1.0, rng.random(), 1.1].map(|share: f32| segment.at(share * segment.length)),
            );
        }
        let dyadic =
            Vec3::from_array(std::array::from_fn(|_| rng.random_range(0..=16) as f32 / 16.0));
        photons.push(min + dyadic * (max - min));
        photons.push(min + random_in_cube(rng) * (max - min));
    }
    photons
}

/// Runs a set through all options, with radii from far below to above its size.
fn check_set(segments: &[Segment], seed: u64) {
    let mut rng = StdRng::seed_from_u64(seed);
    let photons = photons_around(segments, 12, &mut rng);
    let (min, max) = box_of(segments);
    let size = (max - min).max_element();
    let radii = [0.0, 1e-6, 1e-3, 0.05, 0.4, 3.0].map(|share| share * size);
    for options in option_sets() {
        assert!(check_beams(segments, &options, &photons, &radii) > 0, "the set tests nothing");
    }
}

#[test]
fn random_beams() {
    let mut rng = StdRng::seed_from_u64(1);
    check_set(&random_segments(400, &mut rng), 2);
}

#[test]
fn one_common_origin() {
    let mut rng = StdRng::seed_from_u64(3);
    check_set(&pinhole(Vec3::new(0.3, 0.7, 0.1), 400, &mut rng), 4);
    check_set(&pinhole(Vec3::ZERO, 400, &mut rng), 5);
}

#[test]
fn parallel_bundles() {
    let mut rng = StdRng::seed_from_u64(6);
    for direction in
        [Vec3::X, -Vec3::Z, Vec3::ONE.normalize(), Vec3::new(1.0, 1e-7, -1e-30).normalize()]
    {
        let mut shifted =
            |_| Segment { origin: 0.2 * random_in_cube(&mut rng), direction, length: 1.0 };
        let bundle: Vec<_> = (0..300).map(&mut shifted).collect();
        check_set(&bundle, 7);
    }
}

#[test]
fn axis_aligned_beams_in_the_planes() {
    let mut grid = Vec::new();
    for (i, j) in (0..8).flat_map(|i| (0..8).map(move |j| (i, j))) {
        let (u, v) = (i as f32 / 8.0, j as f32 / 8.0);
        grid.push(Segment::between(Vec3::new(u, v, 0.0), Vec3::new(u, v, 1.0)));
        grid.push(Segment::between(Vec3::new(1.0, u, v), Vec3::new(0.0, u, v)));
        grid.push(Segment::between(Vec3::new(v, 0.0, u), Vec3::new(v, 1.0, u)));
    }
    check_set(&grid, 8);
}

#[test]
fn identical_beams() {
    for end in [Vec3::ONE, Vec3::X, Vec3::new(1.0, 0.3, -0.2)] {
        let copies = vec![Segment::between(Vec3::ZERO, end); 200];
        check_set(&copies, 9);
        let tree = ViewBeamTree::build(&copies);
        assert_eq!(tree.stats().leaves, 1, "no plane separates copies");
    }
}

#[test]
fn beams_in_one_plane() {
    let mut rng = StdRng::seed_from_u64(10);
    for normal in [Vec3::Y, Vec3::new(0.6, 0.0, 0.8)] {
        let flatten = |p: Vec3| p - p.dot(normal) * normal;
        let mut flat = |_| {
            Segment::between(flatten(random_in_cube(&mut rng)), flatten(random_in_cube(&mut rng)))
        };
        let sheet: Vec<_> = (0..300).map(&mut flat).collect();
        check_set(&sheet, 11);
    }
}

#[test]
fn pieces_of_one_line() {
    let end = Vec3::new(0.9, -0.4, 0.7);
    let piece =
        |i: usize| Segment::between(end * (i as f32 / 200.0), end * ((i + 1) as f32 / 200.0));
    check_set(&(0..200).map(piece).collect::<Vec<_>>(), 12);
}

#[test]
fn far_from_the_origin() {
    let mut rng = StdRng::seed_from_u64(13);
    for offset in [Vec3::splat(1e6), Vec3::new(-1e6, 3.0, 1e4)] {
        let mut distant = |_| {
            Segment::between(offset + random_in_cube(&mut rng), offset + random_in_cube(&mut rng))
        };
        check_set(&(0..300).map(&mut distant).collect::<Vec<_>>(), 14);
    }
}

#[test]
fn tiny_scale() {
    let mut rng = StdRng::seed_from_u64(15);
    for scale in [1e-4, 1e-15] {
        let mut small = |_| {
            Segment::between(scale * random_in_cube(&mut rng), scale * random_in_cube(&mut rng))
        };
        check_set(&(0..300).map(&mut small).collect::<Vec<_>>(), 16);
    }
}

#[test]
fn huge_lengths() {
    let mut rng = StdRng::seed_from_u64(17);
    let mut long = |i| Segment {
        origin: random_in_cube(&mut rng),
        direction: random_direction(&mut rng),
        length: if i % 3 == 0 { 1.0 } else { 1e7 },
    };
    let segments: Vec<_> = (0..300).map(&mut long).collect();
    check_set(&segments, 18);
    let near: Vec<_> = (0..60).map(|_| 2.0 * random_in_cube(&mut rng)).collect();
    for options in option_sets() {
        assert!(check_beams(&segments, &options, &near, &[1e-3, 0.05, 1.0]) > 0);
    }
}

#[test]
fn subnormal_slopes() {
    let mut rng = StdRng::seed_from_u64(23);
    let mut nearly_level = |i: usize| Segment {
        origin: Vec3::new(rng.random(), (i % 3) as f32 - 1.0, rng.random()),
        direction: Vec3::new(1.0, f32::from_bits((i % 7) as u32) * (i % 2) as f32, -1e-40),
        length: 2.0,
    };
    let mut segments: Vec<_> = (0..300).map(&mut nearly_level).collect();
    check_set(&segments, 24);
    segments.iter_mut().for_each(|segment| segment.direction.y *= -1.0);
    check_set(&segments, 25);
}

#[test]
fn from_afar_past_the_origin() {
    let mut rng = StdRng::seed_from_u64(26);
    let mut aimed = |_| {
        let direction = random_direction(&mut rng);
        Segment { origin: 0.1 * random_in_cube(&mut rng) - 1e6 * direction, direction, length: 2e6 }
    };
    let segments: Vec<_> = (0..300).map(&mut aimed).collect();
    let photons: Vec<_> = (0..200).map(|_| 0.4 * random_in_cube(&mut rng) - 0.2).collect();
    for options in option_sets() {
        assert!(check_beams(&segments, &options, &photons, &[1e-3, 0.1]) > 0);
    }
}

#[test]
fn beams_are_half_open_and_the_radius_is_strict() {
    let tree = ViewBeamTree::build(&[Segment::between(Vec3::ZERO, Vec3::X)]);
    let count = |x, radius| beam_pairs(&tree, Vec3::new(x, 0.5, 0.0), radius).len();
    assert_eq!(
        [count(0.0, 1.0), count(1.0, 1.0), count(-1e-6, 1.0), count(0.999, 1.0)],
        [1, 0, 0, 1]
    );
    assert_eq!([count(0.5, 0.5), count(0.5, 0.500_001)], [0, 1]);
}

#[test]
fn nothing_to_find() {
    let tree = ViewBeamTree::build(&[]);
    tree.validate().unwrap();
    assert!(beam_pairs(&tree, Vec3::ZERO, f32::INFINITY).is_empty());
    assert_eq!(tree.stats().references, 0);
}

#[test]
fn empty_and_non_finite_segments_are_counted_and_left_out() {
    let good = Segment::between(Vec3::ZERO, Vec3::X);
    let segments = [
        Segment { length: 0.0, ..good },
        Segment { length: -1.0, ..good },
        Segment::between(Vec3::ONE, Vec3::ONE),
        Segment { length: f32::NAN, ..good },
        Segment { length: f32::INFINITY, ..good },
        Segment { origin: Vec3::new(0.0, f32::NAN, 0.0), ..good },
        Segment { direction: Vec3::splat(f32::NAN), ..good },
        Segment { origin: Vec3::splat(f32::MAX), direction: Vec3::X, length: f32::MAX },
        good,
    ];
    let stats = ViewBeamTree::build(&segments).stats();
    assert_eq!((stats.beams, stats.empty, stats.non_finite), (1, 3, 5));
    let photons = [Vec3::ZERO, Vec3::new(0.5, 0.1, 0.0), Vec3::X];
    assert_eq!(check_beams(&segments, &BuildOptions::default(), &photons, &[0.05, 0.5]), 3);
}

#[test]
fn odd_queries_find_what_brute_force_finds() {
    let mut rng = StdRng::seed_from_u64(19);
    let segments = random_segments(100, &mut rng);
    let photons = [
        Vec3::NAN,
        Vec3::INFINITY,
        Vec3::new(0.5, f32::NAN, 0.5),
        Vec3::splat(1e30),
        Vec3::splat(0.5),
    ];
    let radii = [-1.0, 0.0, 1e-30, 1e20, f32::INFINITY, f32::NAN];
    for options in option_sets() {
        check_beams(&segments, &options, &photons, &radii);
    }
}

#[test]
fn budget_bounds_the_references_and_is_used() {
    let mut rng = StdRng::seed_from_u64(20);
    let segments = pinhole(Vec3::ZERO, 5000, &mut rng);
    for references_per_beam in [0, 1, 2, 8, 32] {
        let options = BuildOptions { references_per_beam, ..BuildOptions::default() };
        let tree = ViewBeamTree::build_with(&segments, &options);
        tree.validate().unwrap();
        let references = tree.stats().references;
        assert!(references <= 5000 * references_per_beam.max(1));
        assert!(
            2 * references >= 5000 * references_per_beam,
            "{references} references leave much unused"
        );
    }
}

#[test]
#[should_panic(expected = "max_depth 65 exceeds 64")]
fn too_deep_a_tree_is_refused() {
    let options = BuildOptions { max_depth: 65, ..BuildOptions::default() };
    ViewBeamTree::build_with(&[], &options);
}

#[test]
fn beam_tree_does_not_depend_on_the_number_of_threads() {
    let mut rng = StdRng::seed_from_u64(21);
    let segments = pinhole(Vec3::ZERO, 40_000, &mut rng);
    let options = BuildOptions { references_per_beam: 8, ..BuildOptions::default() };
    let photons: Vec<_> = (0..1000).map(|_| random_in_cube(&mut rng)).collect();
    let visits_with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let tree = pool.install(|| ViewBeamTree::build_with(&segments, &options));
        let mut visits = Vec::new();
        for &p in &photons {
            tree.query(p, 0.02, |index, t, _| visits.push((index, t.to_bits())));
        }
        (tree.stats(), visits)
    };
    let alone = visits_with(1);
    assert!(alone.1.len() > 1000);
    assert!(alone == visits_with(4));
}

fn options() -> impl Strategy<Value = BuildOptions> {
    let split_axis = prop_oneof![Just(SplitAxis::Largest), Just(SplitAxis::Relative)];
    (0_usize..6, 0_usize..40, 0_usize..200, split_axis).prop_map(
        |(leaf_size, max_depth, references_per_beam, split_axis)| BuildOptions {
            leaf_size,
            max_depth,
            references_per_beam,
            split_axis,
        },
    )
}

/// Scale and shift of a whole scene.
fn placement() -> impl Strategy<Value = (f32, Vec3)> {
    let shift = prop_oneof![Just(Vec3::ZERO), Just(Vec3::new(1e6, -10.0, 1e3)), place()];
    (prop_oneof![Just(1.0_f32), Just(1e-4), Just(1e3)], shift)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_beams_and_photons(
        mut segments in prop::collection::vec(segment(), 1..60),
        mut photons in prop::collection::vec(place(), 1..20),
        on_beams in prop::collection::vec((any::<prop::sample::Index>(), 0.0_f32..1.0), 10),
        radius in prop_oneof![0.0_f32..0.3, 0.0_f32..3.0, Just(1e-6)],
        options in options(),
        (scale, shift) in placement(),
    ) {
        for segment in &mut segments {
            segment.origin = scale * segment.origin + shift;
            segment.length *= scale;
        }
        photons.iter_mut().for_each(|p| *p = scale * *p + shift);
        for (index, share) in on_beams {
            let segment = index.get(&segments);
            photons.push(segment.at(share * segment.length.min(scale)));
        }
        check_beams(&segments, &options, &photons, &[scale * radius]);
    }

    #[test]
    fn any_points(
        mut points in prop::collection::vec(place(), 0..300),
        mut places in prop::collection::vec(place(), 1..20),
        radius in prop_oneof![0.0_f32..0.3, 0.0_f32..3.0, Just(1e-6), Just(0.125), Just(0.25)],
        (scale, shift) in placement(),
    ) {
        points.iter_mut().chain(&mut places).for_each(|p| *p = scale * *p + shift);
        check_points(&points, &places, &[scale * radius]);
    }
}

fn check_points(points: &[Vec3], places: &[Vec3], radii: &[f32]) -> usize {
    let tree = ViewPointTree::build(points);
    tree.validate().unwrap();
    assert_eq!(tree.len() + tree.non_finite(), points.len());
    let mut sorted = tree.clone();
    let order = sorted.take_order();
    sorted.validate().unwrap();
    for &radius in radii {
        check_all_at_once(&tree, places, radius);
    }
    let mut count = 0;
    for &p in places {
        for &radius in radii {
            let mut found = Vec::new();
            tree.query(p, radius, |index, distance_squared| {
                found.push((index, distance_squared.to_bits()))
            });
            found.sort_unstable();
            let near = |&(_, q): &(u32, &Vec3)| {
                radius > 0.0 && q.is_finite() && q.distance_squared(p) < radius * radius
            };
            let squared = |(index, q): (u32, &Vec3)| (index, q.distance_squared(p).to_bits());
            let expected: Vec<_> = (0..).zip(points).filter(near).map(squared).collect();
            assert_eq!(found, expected, "place {p}, radius {radius}");
            let is_left_out = !expected.is_empty() && !tree.may_find(p, radius);
            assert!(!is_left_out, "place {p}, radius {radius}: nothing may be found");
            count += expected.len();
            let mut in_order = Vec::new();
            sorted
                .query(p, radius, |place, d2| in_order.push((order[place as usize], d2.to_bits())));
            in_order.sort_unstable();
            assert_eq!(in_order, expected, "place {p}, radius {radius}, after the order was taken");
        }
    }
    count
}

/// Asked all at once, as they come, each place finds what it finds alone.
fn check_all_at_once(tree: &ViewPointTree, places: &[Vec3], radius: f32) {
    let mut together = vec![Vec::new(); places.len()];
    tree.query_all(places, radius, |which, index, _, d2| {
        together[which].push((index, d2.to_bits()))
    });
    for (&p, mut together) in places.iter().zip(together) {
        let mut alone = Vec::new();
        tree.query(p, radius, |index, d2| alone.push((index, d2.to_bits())));
        alone.sort_unstable();
        together.sort_unstable();
        assert_eq!(together, alone, "place {p}, radius {radius}, beside others");
    }
}

#[test]
fn points_of_all_kinds() {
    let mut rng = StdRng::seed_from_u64(22);
    let cloud: Vec<_> = (0..2000).map(|_| random_in_cube(&mut rng)).collect();
    let sheet: Vec<_> = cloud.iter().map(|p| Vec3::new(p.x, 0.25, p.z)).collect();
    let line: Vec<_> = cloud.iter().map(|p| Vec3::splat(p.x)).collect();
    let lattice: Vec<_> = cloud.iter().map(|p| (4.0 * *p).floor() / 4.0).collect();
    let distant: Vec<_> = cloud.iter().map(|p| *p + 1e6).collect();
    let tiny: Vec<_> = cloud.iter().map(|p| 1e-22 * *p).collect();
    let same = vec![Vec3::splat(0.3); 500];
    for points in [cloud, sheet, line, lattice, distant, tiny, same] {
        let size = points[0].distance(points[1]).max(1e-22);
        let radii = [0.0, 1e-3, 0.1, 0.5, 10.0].map(|share| share * size);
        let places: Vec<_> = points
            .iter()
            .step_by(60)
            .map(|p| *p + size * 0.05 * random_in_cube(&mut rng))
            .collect();
        assert!(check_points(&points, &points[..30], &radii) > 0);
        check_points(&points, &places, &radii);
    }
}

#[test]
fn odd_points_and_places() {
    assert_eq!(check_points(&[], &[Vec3::ZERO], &[1.0]), 0);
    let points = [Vec3::NAN, Vec3::ZERO, Vec3::INFINITY, Vec3::new(f32::MAX, 0.0, 0.0)];
    let places = [Vec3::ZERO, Vec3::NAN, Vec3::INFINITY, Vec3::splat(f32::MAX)];
    let radii = [-1.0, 0.0, 1.0, f32::MAX, f32::INFINITY, f32::NAN];
    assert_eq!(ViewPointTree::build(&points).non_finite(), 2);
    check_points(&points, &places, &radii);
}

/// So many that the first planes are found by all threads together, and each subtree by one of them.
#[test]
fn more_points_than_one_thread_sorts() {
    let mut rng = StdRng::seed_from_u64(27);
    let points: Vec<_> = (0..100_003).map(|_| random_in_cube(&mut rng)).collect();
    assert!(check_points(&points, &points[..20], &[0.01, 0.05]) > 100);
    let order_with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| ViewPointTree::build(&points)).take_order()
    };
    assert!(order_with(1) == order_with(4));
}
