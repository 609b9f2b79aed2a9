//! Segments and places that the oracles of the search structures share.

use glam::Vec3;
use rand::rngs::StdRng;
use rand::Rng;
use vpt::math::Segment;

/// Least and greatest corner of the segments' box.
pub fn box_of(segments: &[Segment]) -> (Vec3, Vec3) {
    let kept = segments.iter().filter(|segment| segment.is_finite());
    let ends = kept.flat_map(|segment| [segment.origin, segment.at(segment.length)]);
    ends.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(min, max), end| (min.min(end), max.max(end)))
}

pub fn random_in_cube(rng: &mut StdRng) -> Vec3 {
    Vec3::from_array(rng.random())
}

pub fn random_direction(rng: &mut StdRng) -> Vec3 {
    loop {
        let v = 2.0 * random_in_cube(rng) - 1.0;
        if (0.01..1.0).contains(&v.length_squared()) {
            return v.normalize();
        }
    }
}

pub fn random_segments(count: usize, rng: &mut StdRng) -> Vec<Segment> {
    let between = |_| Segment::between(random_in_cube(rng), random_in_cube(rng));
    (0..count).map(between).collect()
}

/// All rays of a pinhole camera at `apex`.
pub fn pinhole(apex: Vec3, count: usize, rng: &mut StdRng) -> Vec<Segment> {
    let mut ray = |_| Segment {
        origin: apex,
        direction: (Vec3::Z + 0.8 * (random_in_cube(rng) - 0.5)).normalize(),
        length: rng.random_range(0.5..1.5),
    };
    (0..count).map(&mut ray).collect()
}
