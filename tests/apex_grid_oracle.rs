//! The grid over beams through a pinhole against brute force: the same pairs, to the last bit of `t` and distance, each
//! exactly once.

use glam::{Quat, Vec3};
use proptest::prelude::*;
use rand::rngs::StdRng;
use rand::{Rng, SeedableRng};
use vpt::math::{Approach, Segment};
use vpt::tree::ApexGrid;

#[allow(dead_code)]
#[path = "support/segment_sets.rs"]
mod segment_sets;
use segment_sets::{random_direction, random_in_cube, random_segments};

/// Index, bits of `t`, bits of the squared distance.
type Pair = (u32, u32, u32);

fn by_brute_force(beams: &[(u32, Segment)], p: Vec3, radius: f32) -> Vec<Pair> {
    let mut pairs = Vec::new();
    for (index, segment) in beams {
        let (t, d2) = segment.project(p);
        if segment.is_finite()
            && 0.0 <= t
            && t < segment.length
            && radius > 0.0
            && d2 < radius * radius
        {
            pairs.push((*index, t.to_bits(), d2.to_bits()));
        }
    }
    pairs.sort_unstable();
    pairs
}

fn by_grid(grid: &ApexGrid, p: Vec3, radius: f32) -> Vec<Pair> {
    let mut pairs = Vec::new();
    grid.query(p, radius, |index, t, d2| pairs.push((index, t.to_bits(), d2.to_bits())));
    pairs.sort_unstable();
    pairs
}

/// Index, bits of the approach.
type BeamPair = (u32, [u32; 4]);

fn bits(approach: Approach) -> [u32; 4] {
    [approach.t, approach.t_other, approach.distance_squared, approach.sine].map(f32::to_bits)
}

fn along_by_brute_force(
    beams: &[(u32, Segment)],
    photon_beam: &Segment,
    radius: f32,
) -> Vec<BeamPair> {
    let is_pair = |segment: &Segment, approach: &Approach| {
        segment.is_finite()
            && photon_beam.is_finite()
            && radius > 0.0
            && approach.distance_squared < radius * radius
            && (0.0..segment.length).contains(&approach.t)
            && (0.0..photon_beam.length).contains(&approach.t_other)
    };
    let mut pairs = Vec::new();
    for (index, segment) in beams {
        let approach = segment.approach(photon_beam).filter(|found| is_pair(segment, found));
        pairs.extend(approach.map(|found| (*index, bits(found))));
    }
    pairs.sort_unstable();
    pairs
}

fn along_by_grid(grid: &ApexGrid, photon_beam: &Segment, radius: f32) -> Vec<BeamPair> {
    let mut pairs = Vec::new();
    grid.query_segment(photon_beam, radius, |index, found| pairs.push((index, bits(found))));
    pairs.sort_unstable();
    pairs
}

/// Photon beams of many kinds: across the view, towards the apex and through it, along a beam, along an axis, from behind.
fn photon_beams(beams: &[(u32, Segment)], apex: Vec3, rng: &mut StdRng) -> Vec<Segment> {
    let mut photons = Vec::new();
    for _ in 0..24 {
        let beam = beams[rng.random_range(0..beams.len())].1;
        let length = if beam.length.is_finite() { beam.length } else { 1.0 };
        let on_beam = beam.at(rng.random::<f32>() * length);
        let [here, there] = [0.3, 1.5].map(|spread| on_beam + spread * random_direction(rng));
        let near = |p: Vec3, rng: &mut StdRng| p + 0.01 * random_direction(rng);
        let turned = (beam.direction + 1e-3 * random_direction(rng)).normalize();
        let axis = Vec3::AXES[rng.random_range(0..3)];
        photons.extend([
            Segment::between(here, there),
            Segment::between(on_beam, there),
            Segment::between(there, near(apex, rng)),
            Segment::between(there, apex + apex - near(there, rng)),
            Segment::between(near(apex, rng), near(beam.at(length), rng)),
            Segment { origin: near(on_beam, rng), direction: turned, length: 1.0 },
            Segment { origin: near(on_beam, rng), direction: -turned, length: 1.0 },
            Segment { direction: beam.direction, ..Segment::between(here, there) },
            Segment { origin: on_beam - 0.5 * axis, direction: axis, length: 1.0 },
            Segment { length: 100.0, ..Segment::between(there, here) },
            Segment::between(on_beam, on_beam),
        ]);
    }
    photons
}

/// A camera: where its apex is, where it looks, how wide, from which near plane on, and by how much rays miss the apex.
#[derive(Debug, Clone, Copy)]
struct Pinhole {
    apex: Vec3,
    turn: Quat,
    tangent: f32,
    near: f32,
    miss: f32,
}

impl Pinhole {
    fn beams(&self, count: u32, rng: &mut StdRng) -> Vec<(u32, Segment)> {
        let mut beam = |index: u32| {
            let on_film = self.tangent * (2.0 * random_in_cube(rng) - 1.0);
            let direction = self.turn * on_film.with_z(1.0).normalize();
            let origin = self.apex + self.near * direction + self.miss * random_direction(rng);
            // Indices as they are in a larger set.
            (3 * index + 1, Segment { origin, direction, length: rng.random_range(0.2..2.0) })
        };
        (0..count).map(&mut beam).collect()
    }
}

/// Returns how many pairs there were.
fn check(beams: &[(u32, Segment)], apex: Vec3, rng: &mut StdRng) -> usize {
    let grid = ApexGrid::build(beams).expect("they meet in a point");
    grid.validate().unwrap();
    let mut sorted = grid.clone();
    let order = sorted.take_order();
    let mut count = 0;
    for photon in 0..120 {
        let spread = [2.0, 0.2, 0.01][photon % 3];
        let beam = beams[rng.random_range(0..beams.len())].1;
        let near_beam = beam.at(rng.random::<f32>() * beam.length);
        let middle = if photon % 2 == 0 { near_beam } else { apex };
        let p = middle + spread * (2.0 * random_in_cube(rng) - 1.0);
        for radius in [0.3, 0.02, 0.001, 0.0, f32::NAN] {
            let expected = by_brute_force(beams, p, radius);
            assert_eq!(by_grid(&grid, p, radius), expected, "photon at {p}, radius {radius}");
            let mut in_order = by_grid(&sorted, p, radius);
            in_order.iter_mut().for_each(|pair| pair.0 = order[pair.0 as usize]);
            in_order.sort_unstable();
            assert_eq!(
                in_order, expected,
                "photon at {p}, radius {radius}, after the order was taken"
            );
            count += expected.len();
        }
    }
    count + check_along(&grid, beams, apex, rng)
}

/// Returns how many pairs there were.
fn check_along(grid: &ApexGrid, beams: &[(u32, Segment)], apex: Vec3, rng: &mut StdRng) -> usize {
    let mut count = 0;
    for photon_beam in photon_beams(beams, apex, rng) {
        for radius in [0.3, 0.02, 0.001, 0.0, f32::NAN] {
            let expected = along_by_brute_force(beams, &photon_beam, radius);
            let found = along_by_grid(grid, &photon_beam, radius);
            assert_eq!(found, expected, "{photon_beam:?}, radius {radius}");
            count += expected.len();
        }
    }
    count
}

#[test]
fn cameras_anywhere_and_of_any_width() {
    let mut rng = StdRng::seed_from_u64(7);
    for apex in [Vec3::ZERO, Vec3::new(1.0, -2.0, 30.0), Vec3::new(1e4, 1e4, -1e4)] {
        for tangent in [0.01, 0.5, 3.0] {
            for (near, miss) in [(0.0, 0.0), (0.1, 0.0), (0.01, 1e-4)] {
                let turn = Quat::from_rotation_arc(Vec3::Z, random_direction(&mut rng));
                let camera = Pinhole { apex, turn, tangent, near, miss };
                let beams = camera.beams(1500, &mut rng);
                assert!(check(&beams, apex, &mut rng) > 1000, "{camera:?} sees next to nothing");
            }
        }
    }
}

#[test]
fn beams_of_one_direction_and_broken_ones() {
    let mut rng = StdRng::seed_from_u64(8);
    let camera =
        Pinhole { apex: Vec3::ONE, turn: Quat::IDENTITY, tangent: 0.4, near: 0.01, miss: 0.0 };
    let mut beams = camera.beams(500, &mut rng);
    let same = beams[0].1;
    beams.extend((2000..2300).map(|index| (index, same)));
    beams.push((5000, Segment { length: f32::NAN, ..same }));
    beams.push((5001, Segment { length: f32::INFINITY, ..same }));
    beams.push((5002, Segment { length: 0.0, ..same }));
    assert!(check(&beams, camera.apex, &mut rng) > 1000);
}

#[test]
fn what_does_not_meet_is_refused() {
    let mut rng = StdRng::seed_from_u64(9);
    let indexed = |segments: Vec<Segment>| (0u32..).zip(segments).collect::<Vec<_>>();
    assert!(ApexGrid::build(&indexed(random_segments(300, &mut rng))).is_none());
    let parallel = (0..300).map(|_| Segment {
        origin: random_in_cube(&mut rng).with_z(0.0),
        direction: Vec3::Z,
        length: 1.0,
    });
    assert!(ApexGrid::build(&indexed(parallel.collect())).is_none());
    let camera =
        Pinhole { apex: Vec3::ZERO, turn: Quat::IDENTITY, tangent: 0.4, near: 0.0, miss: 0.0 };
    assert!(ApexGrid::build(&camera.beams(10, &mut rng)).is_none());
    let thin_lens = Pinhole { miss: 0.05, ..camera };
    assert!(ApexGrid::build(&thin_lens.beams(300, &mut rng)).is_none());
    let all_around = (0..300).map(|_| Segment {
        origin: Vec3::ZERO,
        direction: random_direction(&mut rng),
        length: 1.0,
    });
    assert!(ApexGrid::build(&indexed(all_around.collect())).is_none());
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_pinhole_finds_what_brute_force_finds(
        seed in any::<u64>(),
        tangent in 1e-3_f32..10.0,
        near in 0.0_f32..0.5,
        scale in -4_i32..5,
    ) {
        let mut rng = StdRng::seed_from_u64(seed);
        let scale = 10f32.powi(scale);
        let turn = Quat::from_rotation_arc(Vec3::Z, random_direction(&mut rng));
        let apex = scale * (2.0 * random_in_cube(&mut rng) - 1.0);
        let camera = Pinhole { apex, turn, tangent, near, miss: 0.0 };
        let beams = camera.beams(200, &mut rng);
        if let Some(grid) = ApexGrid::build(&beams) {
            prop_assert_eq!(grid.validate(), Ok(()));
            for _ in 0..20 {
                let p = apex + 2.0 * (2.0 * random_in_cube(&mut rng) - 1.0);
                let radius = 0.5 * rng.random::<f32>().powi(3);
                prop_assert_eq!(by_grid(&grid, p, radius), by_brute_force(&beams, p, radius));
                let end = apex + 2.0 * (2.0 * random_in_cube(&mut rng) - 1.0);
                let photon_beam = Segment::between(p, end);
                let expected = along_by_brute_force(&beams, &photon_beam, radius);
                prop_assert_eq!(along_by_grid(&grid, &photon_beam, radius), expected);
            }
        }
    }
}
