//! Constant kernels, normalised over the space in which a photon misses its receiver.

use std::f32::consts::PI;

/// `K2` [1/area]: constant over a disk of the given radius; integrates to 1 over the plane.
// [Kernel 2D]
pub fn disk(radius: f32) -> f32 {
    1.0 / (PI * radius * radius)
}

/// `K1` [1/length]: constant over an interval of the given radius; integrates to 1 over the line that is
/// normal to both beams.
// [Kernel 1D]
pub fn interval(radius: f32) -> f32 {
    0.5 / radius
}
