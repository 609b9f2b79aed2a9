//! From the unit square to directions and disks.

use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Two unit vectors that form a right-handed frame with `axis`.
pub(super) fn tangents(axis: DVec3) -> (DVec3, DVec3) {
    axis.any_orthonormal_pair()
}

/// The unit vector at `cosine` and `azimuth` around `axis`.
pub(super) fn around(axis: DVec3, cosine: f64, azimuth: f64) -> DVec3 {
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    let (tangent, bitangent) = tangents(axis);
    let (y, x) = azimuth.sin_cos();
    (sine * x * tangent + sine * y * bitangent + cosine * axis).normalize()
}

/// Uniform over the sphere; density `1 / (4 pi)` [1/sr].
pub(super) fn sphere(u: [f64; 2]) -> DVec3 {
    around(DVec3::Z, 1.0 - 2.0 * u[0], TAU * u[1])
}

/// Proportional to the cosine over the hemisphere around `normal`; density `cos / pi` [1/sr].
pub(super) fn cosine_hemisphere(normal: DVec3, u: [f64; 2]) -> DVec3 {
    around(normal, (1.0 - u[0]).sqrt(), TAU * u[1])
}

/// Uniform over the unit disk perpendicular to `axis`; density `1 / pi` [1/area].
pub(super) fn disk(axis: DVec3, u: [f64; 2]) -> DVec3 {
    let (tangent, bitangent) = tangents(axis);
    let (y, x) = (TAU * u[1]).sin_cos();
    u[0].sqrt() * (x * tangent + y * bitangent)
}

/// Solid angle of all directions [sr].
pub(super) const FULL_SPHERE: f64 = 4.0 * PI;
