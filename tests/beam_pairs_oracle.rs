//! Pairs of view beams and photon beams: the tree over view beams and the map of photon beams against
//! brute force, the same pairs to the last bit, each exactly once.

use glam::{Vec3, Vec3Swizzles};
use proptest::prelude::*;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use vpt::math::{Approach, Segment};
use vpt::tree::view_beam::{BuildOptions, SplitAxis};
use vpt::tree::{PhotonBeams, ViewBeamTree};

#[path = "support/segment_sets.rs"]
mod segment_sets;
#[path = "support/strategies.rs"]
mod strategies;
use segment_sets::{box_of, pinhole, random_direction, random_in_cube, random_segments};
use strategies::{place, segment};

/// View beam, photon beam, bits of the approach.
type Pair = (u32, u32, [u32; 4]);

fn bits(approach: Approach) -> [u32; 4] {
    let Approach { t, t_other, distance_squared, sine } = approach;
    [t, t_other, distance_squared, sine].map(f32::to_bits)
}

fn pairs_by_brute_force(views: &[Segment], photons: &[Segment], radius: f32) -> Vec<Pair> {
    let mut pairs = Vec::new();
    for (view_index, view) in (0..).zip(views).filter(|(_, view)| view.is_finite()) {
        for (index, photon) in (0..).zip(photons).filter(|(_, photon)| photon.is_finite()) {
            let is_pair = |approach: &Approach| {
                (0.0..view.length).contains(&approach.t)
                    && (0.0..photon.length).contains(&approach.t_other)
                    && radius > 0.0
                    && approach.distance_squared < radius * radius
            };
            let approach = view.approach(photon).filter(is_pair);
            pairs.extend(approach.map(|approach| (view_index, index, bits(approach))));
        }
    }
    pairs
}

fn pairs_of_tree(tree: &ViewBeamTree, photons: &[Segment], radius: f32) -> Vec<Pair> {
    let mut pairs = Vec::new();
    for (index, photon) in (0..).zip(photons) {
        tree.query_segment(photon, radius, |view, approach| {
            pairs.push((view, index, bits(approach)));
        });
    }
    pairs.sort_unstable();
    pairs
}

fn pairs_of_map(map: &PhotonBeams, views: &[Segment], radius: f32) -> Vec<Pair> {
    let mut pairs = Vec::new();
    for (view_index, view) in (0..).zip(views) {
        map.query(view, radius, |index, approach| pairs.push((view_index, index, bits(approach))));
    }
    pairs.sort_unstable();
    pairs
}

/// The default, and a tree cut as finely as it goes.
fn option_sets() -> [BuildOptions; 2] {
    let finest = BuildOptions {
        leaf_size: 1,
        max_depth: 40,
        references_per_beam: 100,
        split_axis: SplitAxis::Largest,
    };
    [BuildOptions::default(), finest]
}

/// Compares for all radii; returns how many pairs there were.
fn check(views: &[Segment], photons: &[Segment], radii: &[f32]) -> usize {
    let trees = option_sets().map(|options| ViewBeamTree::build_with(views, &options));
    let map = PhotonBeams::build(photons);
    let mut count = 0;
    for &radius in radii {
        let expected = pairs_by_brute_force(views, photons, radius);
        for tree in &trees {
            assert!(pairs_of_tree(tree, photons, radius) == expected, "tree, radius {radius}");
        }
        assert!(pairs_of_map(&map, views, radius) == expected, "map, radius {radius}");
        count += expected.len();
    }
    count
}

/// Compares with radii from far below to above the size of the view beams' box.
fn check_set(views: &[Segment], photons: &[Segment]) {
    let (min, max) = box_of(views);
    let radii = [1e-7, 1e-5, 1e-3, 0.03, 0.4, 3.0].map(|share| share * (max - min).max_element());
    assert!(check(views, photons, &radii) > 0, "the set tests nothing");
}

/// Photon beams where mistakes hide: through the whole box, inside a cell, through or along view
/// beams, from their ends, along the axes and in the planes of a tree that halves the box.
fn photons_around(views: &[Segment], count: usize, rng: &mut StdRng) -> Vec<Segment> {
    let (min, max) = box_of(views);
    let size = max - min;
    let mut photons = vec![Segment::between(min, max), Segment::between(max + size, min - size)];
    for i in 0..count {
        let inside = min + size * random_in_cube(rng);
        let view = views[rng.random_range(0..views.len())];
        let on_view = view.at(rng.random::<f32>() * view.length);
        let dyadic =
            Vec3::from_array(std::array::from_fn(|_| rng.random_range(0..=8) as f32 / 8.0));
        let axis = Vec3::AXES[i % 3] * size.max_element();
        photons.extend([
            Segment::between(inside, min + size * random_in_cube(rng)),
            Segment::between(inside, inside + 1e-3 * size * (random_in_cube(rng) - 0.5)),
            Segment::between(inside, on_view + (on_view - inside)),
            Segment::between(on_view, inside),
            Segment::between(view.origin, inside),
            Segment::between(min + size * dyadic - axis, min + size * dyadic + axis),
            Segment { origin: inside, ..view },
            Segment { direction: (view.direction + 1e-4 * axis).normalize(), ..view },
            Segment::between(inside, inside),
        ]);
    }
    photons
}

fn check_with_photons_around(views: &[Segment], seed: u64) {
    let mut rng = StdRng::seed_from_u64(seed);
    check_set(views, &photons_around(views, 12, &mut rng));
}

#[test]
fn random_beams() {
    let mut rng = StdRng::seed_from_u64(1);
    check_with_photons_around(&random_segments(300, &mut rng), 2);
}

#[test]
fn one_common_origin() {
    let mut rng = StdRng::seed_from_u64(3);
    let (here, there) = (Vec3::new(0.3, 0.7, 0.1), Vec3::new(0.3, 0.7, 0.9));
    let views = pinhole(here, 300, &mut rng);
    check_with_photons_around(&views, 4);
    check_set(&views, &pinhole(here, 100, &mut rng));
    check_set(&views, &pinhole(there, 100, &mut rng));
}

#[test]
fn parallel_bundles() {
    let mut rng = StdRng::seed_from_u64(5);
    for direction in [Vec3::X, -Vec3::Z, Vec3::ONE.normalize()] {
        let mut shifted =
            |_| Segment { origin: 0.2 * random_in_cube(&mut rng), direction, length: 1.0 };
        let bundle: Vec<_> = (0..200).map(&mut shifted).collect();
        check_with_photons_around(&bundle, 6);
        assert_eq!(check(&bundle, &bundle, &[0.5]), 0, "parallel beams have no approach");
    }
}

#[test]
fn axis_aligned_beams_in_the_planes() {
    let mut grid = Vec::new();
    for (i, j) in (0..6).flat_map(|i| (0..6).map(move |j| (i, j))) {
        let (u, v) = (i as f32 / 8.0, j as f32 / 8.0);
        grid.push(Segment::between(Vec3::new(u, v, 0.0), Vec3::new(u, v, 1.0)));
        grid.push(Segment::between(Vec3::new(1.0, u, v), Vec3::new(0.0, u, v)));
        grid.push(Segment::between(Vec3::new(v, 0.0, u), Vec3::new(v, 1.0, u)));
    }
    check_with_photons_around(&grid, 7);
    check_set(&grid, &grid);
    let sevenths: Vec<_> = grid.iter().map(|s| Segment { length: s.length / 7.0, ..*s }).collect();
    check_set(&grid, &sevenths);
}

#[test]
fn identical_beams() {
    let copies = vec![Segment::between(Vec3::ZERO, Vec3::new(1.0, 0.3, -0.2)); 100];
    check_with_photons_around(&copies, 8);
    let crossing = vec![Segment::between(Vec3::new(0.5, 0.0, 0.0), Vec3::new(0.5, 0.3, -0.2)); 40];
    check_set(&copies, &crossing);
}

#[test]
fn far_from_the_origin() {
    let mut rng = StdRng::seed_from_u64(9);
    for offset in [Vec3::splat(1e6), Vec3::new(-1e6, 3.0, 1e4)] {
        let mut distant = |_| {
            Segment::between(offset + random_in_cube(&mut rng), offset + random_in_cube(&mut rng))
        };
        check_with_photons_around(&(0..200).map(&mut distant).collect::<Vec<_>>(), 10);
    }
}

#[test]
fn from_afar_past_the_origin() {
    let mut rng = StdRng::seed_from_u64(11);
    let mut aimed = |_| {
        let direction = random_direction(&mut rng);
        Segment { origin: 0.1 * random_in_cube(&mut rng) - 1e6 * direction, direction, length: 2e6 }
    };
    let (views, photons): (Vec<_>, Vec<_>) = (0..200).map(|i| (aimed(i), aimed(i))).unzip();
    assert!(check(&views, &photons, &[1e-3, 0.1]) > 0);
}

#[test]
fn tiny_scale_and_flat_slopes() {
    let mut rng = StdRng::seed_from_u64(12);
    for scale in [1e-4, 1e-15] {
        let mut small = |_| {
            Segment::between(scale * random_in_cube(&mut rng), scale * random_in_cube(&mut rng))
        };
        check_with_photons_around(&(0..150).map(&mut small).collect::<Vec<_>>(), 13);
    }
    let mut nearly_level = |i: usize| Segment {
        origin: Vec3::new(rng.random(), (i % 3) as f32 - 1.0, rng.random()),
        direction: Vec3::new(1.0, f32::from_bits((i % 7) as u32), -(10_f32).powi(-(i as i32 % 20))),
        length: 2.0,
    };
    let mut level: Vec<_> = (0..200).map(&mut nearly_level).collect();
    level.iter_mut().for_each(|segment| segment.direction = segment.direction.normalize());
    check_with_photons_around(&level, 14);
    let turn = |s: &Segment| Segment { direction: s.direction.zxy(), origin: s.origin.zxy(), ..*s };
    check_set(&level, &level.iter().map(turn).collect::<Vec<_>>());
}

#[test]
fn beams_are_half_open_and_the_radius_is_strict() {
    let view = Segment::between(Vec3::ZERO, Vec3::X);
    let photon = |x, y: f32| Segment::between(Vec3::new(x, y, 0.5), Vec3::new(x, y + 1.0, 0.5));
    let count = |x, y, radius| check(&[view], &[photon(x, y)], &[radius]);
    assert_eq!([count(0.0, -0.5, 1.0), count(1.0, -0.5, 1.0), count(-1e-6, -0.5, 1.0)], [1, 0, 0]);
    assert_eq!([count(0.5, 0.0, 1.0), count(0.5, -1.0, 1.0)], [1, 0]);
    assert_eq!([count(0.5, -0.5, 0.5), count(0.5, -0.5, 0.500_001)], [0, 1]);
}

#[test]
fn odd_beams_and_radii() {
    let mut rng = StdRng::seed_from_u64(15);
    let good = random_segments(60, &mut rng);
    let spoil = |segment: Segment| {
        [
            Segment { length: f32::NAN, ..segment },
            Segment { length: f32::INFINITY, ..segment },
            Segment { length: 0.0, ..segment },
            Segment { length: -1.0, ..segment },
            Segment { length: 1e30, ..segment },
            Segment { origin: Vec3::splat(f32::MAX), ..segment },
            Segment { origin: Vec3::NAN, ..segment },
            Segment { direction: Vec3::NAN, ..segment },
            Segment { direction: Vec3::ZERO, ..segment },
        ]
    };
    let odd: Vec<_> = good.iter().take(5).copied().flat_map(spoil).chain(good.clone()).collect();
    let radii = [-1.0, 0.0, 1e-30, 0.1, 1e20, f32::INFINITY, f32::NAN];
    assert!(check(&good, &odd, &radii) > 0);
    assert!(check(&odd, &good, &radii) > 0);
    let map = PhotonBeams::build(&odd);
    assert_eq!((map.non_finite(), map.empty()), (20, 10));
    assert_eq!(check(&[], &good, &[1.0]) + check(&good, &[], &[1.0]), 0);
}

#[test]
fn pieces_are_bounded_in_number() {
    let mut rng = StdRng::seed_from_u64(16);
    let mut beams = random_segments(500, &mut rng);
    beams.push(Segment { length: 1e6, ..beams[0] });
    assert!(PhotonBeams::build(&beams).stats().boxes <= 9 * beams.len());
    let along_axis = vec![Segment::between(Vec3::ZERO, Vec3::X); 10];
    assert_eq!(PhotonBeams::build(&along_axis).stats().boxes, 10);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_beams(
        mut views in prop::collection::vec(segment(), 1..60),
        mut photons in prop::collection::vec(segment(), 1..60),
        radius in prop_oneof![0.0_f32..0.3, 0.0_f32..3.0, Just(1e-6), Just(0.125)],
        scale in prop_oneof![Just(1.0_f32), Just(1e-4), Just(1e3)],
        shift in prop_oneof![Just(Vec3::ZERO), Just(Vec3::new(1e6, -10.0, 1e3)), place()],
    ) {
        for segment in views.iter_mut().chain(&mut photons) {
            segment.origin = scale * segment.origin + shift;
            segment.length *= scale;
        }
        check(&views, &photons, &[scale * radius]);
    }
}
