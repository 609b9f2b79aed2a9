//! Segments and places for property tests: round numbers, so that planes and ties are hit, and odd ones.

use glam::Vec3;
use proptest::prelude::*;
use vpt::math::Segment;

fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![(-8_i32..=8).prop_map(|i| i as f32 / 8.0), -1.0_f32..1.0, Just(1e-20), Just(-0.0)]
}

pub fn place() -> impl Strategy<Value = Vec3> {
    [coordinate(), coordinate(), coordinate()].prop_map(Vec3::from_array)
}

pub fn segment() -> impl Strategy<Value = Segment> {
    let length = prop_oneof![0.0_f32..2.0, Just(0.0), Just(1.0), Just(1e-5), Just(1e7)];
    (place(), place(), length).prop_map(|(origin, direction, length)| Segment {
        origin,
        direction: direction.try_normalize().unwrap_or(Vec3::Z),
        length,
    })
}
