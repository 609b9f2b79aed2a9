//! Phase functions. The cosine is that between the directions of travel before and after.

use super::warp;
use crate::scene::Phase;
use glam::DVec3;
use std::f64::consts::TAU;

/// Mean cosine, which is also the parameter of Henyey and Greenstein's function.
fn mean_cosine(phase: Phase) -> f64 {
    match phase {
        Phase::HenyeyGreenstein { g } => f64::from(g),
        Phase::Isotropic | Phase::Opaque => 0.0,
    }
}

/// Value [1/sr]; integrates to 1 over the sphere.
// [Henyey 1941]
pub(super) fn eval(phase: Phase, cosine: f64) -> f64 {
    let g = mean_cosine(phase);
    (1.0 - g * g) / (warp::FULL_SPHERE * (1.0 + g * g - 2.0 * g * cosine).powf(1.5))
}

/// A direction of travel after scattering, with density [`eval`].
pub(super) fn sample(phase: Phase, travel: DVec3, u: [f64; 2]) -> DVec3 {
    let g = mean_cosine(phase);
    let cosine = if g.abs() < 1e-3 {
        2.0 * u[0] - 1.0
    } else {
        let ratio = (1.0 - g * g) / (1.0 - g + 2.0 * g * u[0]);
        (1.0 + g * g - ratio * ratio) / (2.0 * g)
    };
    warp::around(travel, cosine.clamp(-1.0, 1.0), TAU * u[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Midpoint rule over the cosine.
    fn integrate(f: impl Fn(f64) -> f64) -> f64 {
        let steps = 20_000;
        let width = 2.0 / f64::from(steps);
        (0..steps).map(|i| f(-1.0 + (f64::from(i) + 0.5) * width) * width).sum()
    }

    #[test]
    fn value_is_normalised_and_has_mean_cosine_g() {
        for g in [-0.8f32, 0.0, 0.6] {
            let phase = Phase::HenyeyGreenstein { g };
            let norm = integrate(|mu| TAU * eval(phase, mu));
            let mean = integrate(|mu| TAU * mu * eval(phase, mu));
            assert!((norm - 1.0).abs() < 1e-6, "norm {norm} for g = {g}");
            assert!((mean - f64::from(g)).abs() < 1e-6, "mean {mean} for g = {g}");
        }
    }

    #[test]
    fn samples_are_quantiles_of_the_cosine() {
        // The share of light that is scattered at a smaller angle than the sample at u.
        for (phase, larger_cosine_share) in [
            (Phase::HenyeyGreenstein { g: -0.8 }, 0.1),
            (Phase::HenyeyGreenstein { g: 0.6 }, 0.9),
            (Phase::Isotropic, 0.25),
        ] {
            let u = [1.0 - larger_cosine_share, 0.3];
            let cosine = sample(phase, DVec3::X, u).dot(DVec3::X);
            let share = integrate(|mu| if mu > cosine { TAU * eval(phase, mu) } else { 0.0 });
            assert!((share - larger_cosine_share).abs() < 1e-3, "{share} for {phase:?}");
        }
    }
}
