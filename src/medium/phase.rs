//! Phase functions [1/sr]. The angle is between directions of *travel*, before and after scattering.

use glam::Vec3;
use std::f32::consts::PI;

pub const ISOTROPIC: f32 = 1.0 / (4.0 * PI);

/// Henyey-Greenstein with mean cosine `g`, between unit vectors of travel.
///
/// `1 + g² - 2 g cos = (1-|g|)² + |g| |after ∓ before|²`: where `|g|` is near 1 the lobe is narrower than
/// the rounding of a cosine, but not than that of directions.
// [Henyey 1941]
pub fn henyey_greenstein(g: f32, before: Vec3, after: Vec3) -> f32 {
    let from_peak = after - before * 1f32.copysign(g);
    let narrowness = 1.0 - g.abs();
    let square = narrowness * narrowness + g.abs() * from_peak.length_squared();
    ISOTROPIC * narrowness * (1.0 + g.abs()) / (square * square.sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At 1e-4 from the axis a lobe of g = 0.9999 has fallen to 2^-1.5 of its peak, though the cosine rounds to 1.
    #[test]
    fn narrow_lobes_are_resolved() {
        for g in [0.9999f32, -0.9999] {
            let axis = Vec3::Z * 1f32.copysign(g);
            let peak = henyey_greenstein(g, Vec3::Z, axis);
            let beside = henyey_greenstein(g, Vec3::Z, axis + 1e-4 * Vec3::X);
            assert!((beside / peak / 0.5f32.powf(1.5) - 1.0).abs() < 2e-3, "{}", beside / peak);
        }
    }

    /// The integral over the sphere is 1 and the mean cosine is g, by the midpoint rule in the cosine.
    #[test]
    fn henyey_greenstein_is_normalised_with_mean_cosine_g() {
        for g in [-0.7f32, 0.0, 0.3, 0.9] {
            let n = 200_000;
            let (mut total, mut mean) = (0.0f64, 0.0f64);
            for i in 0..n {
                let cosine = -1.0 + 2.0 * (i as f64 + 0.5) / f64::from(n);
                let after = Vec3::new((1.0 - cosine * cosine).sqrt() as f32, 0.0, cosine as f32);
                let value = f64::from(henyey_greenstein(g, Vec3::Z, after));
                total += value * 4.0 * std::f64::consts::PI / f64::from(n);
                mean += cosine * value * 4.0 * std::f64::consts::PI / f64::from(n);
            }
            assert!((total - 1.0).abs() < 1e-4, "g = {g}: integral {total}");
            assert!((mean - f64::from(g)).abs() < 1e-4, "g = {g}: mean cosine {mean}");
        }
    }
}
