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

/// By which the difference between a kernel and one of half its measure is multiplied to reach to a kernel
/// of no extent, where bias falls with the radius: it does so at edges, where most of it is. (Where radiance
/// is smooth it falls with the square of the radius, and factors of 2 and 4/3 would do.)
const DISK_REACH: f32 = 2.0 + std::f32::consts::SQRT_2;
const INTERVAL_REACH: f32 = 2.0;

/// The share of a contribution at this squared distance from the middle of a disk that is added to the
/// estimate of the disk's bias: the outer half of the area counts for it, the inner half against it.
// [Bias of a kernel]
pub fn disk_bias_share(distance_squared: f32, radius: f32) -> f32 {
    let is_outer = 2.0 * distance_squared > radius * radius;
    if is_outer {
        DISK_REACH
    } else {
        -DISK_REACH
    }
}

/// As [`disk_bias_share`], for the halves of an interval.
// [Bias of a kernel]
pub fn interval_bias_share(distance_squared: f32, radius: f32) -> f32 {
    let is_outer = 4.0 * distance_squared > radius * radius;
    if is_outer {
        INTERVAL_REACH
    } else {
        -INTERVAL_REACH
    }
}
