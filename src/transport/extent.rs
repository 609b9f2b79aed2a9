//! How far along a ray anything can be seen.

use crate::math::{Aabb, Rgb};

/// Beyond this optical depth (transmittance 1e-9) a view beam shows nothing that a pixel could hold.
pub const OPAQUE_DEPTH: f32 = 20.7;
/// A segment that meets nothing is followed for this many scene diagonals.
const FAR_DIAGONALS: f32 = 1e4;
/// Where a scene has no surface to measure lengths by: its square is still a number of single precision.
const FAR_IN_NOTHING: f32 = 1e15;

/// Distance that no segment needs to go beyond where a scene has these bounds.
pub fn far(bounds: &Aabb) -> f32 {
    if bounds.is_empty() {
        FAR_IN_NOTHING
    } else {
        FAR_DIAGONALS * bounds.diagonal().max(f32::MIN_POSITIVE)
    }
}

/// Length after which a beam in a constant medium shows nothing more: no channel that scatters is left.
pub fn visible_length(sigma_t: Rgb, bounds: &Aabb) -> f32 {
    let scattering = [sigma_t.r, sigma_t.g, sigma_t.b].into_iter().filter(|sigma| *sigma > 0.0);
    let opaque = OPAQUE_DEPTH / scattering.fold(f32::INFINITY, f32::min);
    opaque.min(far(bounds))
}
