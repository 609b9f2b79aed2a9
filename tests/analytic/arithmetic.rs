//! Formulas that need no scene.

use crate::convergence::shrink;
use statrs::function::gamma::ln_gamma;
use vpt::density::radius::{KernelDimensions, Radii, RadiusSequence, Schedule};

#[test]
fn radii_follow_the_gamma_function() {
    // After n updates by (8), R² is R_1² times prod_{j=1}^n (j + alpha) / (j + 1) =
    // Gamma(n + 1 + alpha) / (Gamma(1 + alpha) Gamma(n + 2)); for large x = n + 1,
    // Gamma(x + alpha) / Gamma(x + 1) = x^(alpha - 1) (1 + alpha (alpha - 1) / 2x + O(1/x²)).
    let alpha = 0.7f32;
    let initial = Radii { surface: 2.0, medium: 3.0 };
    let (points, beams) = (KernelDimensions::POINTS, KernelDimensions::BEAMS);
    for (schedule, kernels, exponent) in [
        (Schedule::Matched, points, 1.0 / 2.0),
        (Schedule::Matched, beams, 1.0),
        (Schedule::Paper, points, 1.0 / 3.0),
        (Schedule::Paper, beams, 1.0 / 3.0),
    ] {
        let mut radii = RadiusSequence::new(initial, alpha, schedule, kernels);
        let close = |radius: f32, expected: f64| {
            assert!((f64::from(radius) / expected - 1.0).abs() < 2e-7, "{radius} for {expected}");
        };
        assert_eq!(radii.current(), initial);
        let alpha = f64::from(alpha);
        for n in 1..=1_000_000u32 {
            radii.advance();
            let x = f64::from(n) + 1.0;
            let product = match n {
                1 | 2 | 10 | 1000 => shrink(alpha, x),
                1_000_000 => {
                    let ratio = x.powf(alpha - 1.0) * (1.0 + alpha * (alpha - 1.0) / (2.0 * x));
                    ratio / ln_gamma(1.0 + alpha).exp()
                }
                _ => continue,
            };
            close(radii.current().surface, 2.0 * product.sqrt());
            close(radii.current().medium, 3.0 * product.powf(exponent));
        }
    }
}

#[test]
fn printed_radiance_update_diverges() {
    // [Collin 2013 (6)] prints L <- (L + L'/N') (N + N' (1 - alpha)) / N, with N photons so far and N'
    // in this pass. The factor is above 1 in every pass. With the same N' in each, N = k N' after pass k,
    // and with the same radiance l of each pass, L_k = (L_{k-1} + l) (1 + (1 - alpha) / k). The solution
    // grows as l k / alpha: neither L nor L/k tends to l. The running mean of the passes is l at once.
    let (alpha, l) = (0.7, 1.0);
    let (mut printed, mut sum) = (0.0, 0.0);
    for k in 1..=100_000 {
        let factor = 1.0 + (1.0 - alpha) / f64::from(k);
        assert!(factor > 1.0);
        printed = (printed + l) * factor;
        sum += l;
        assert!(printed > l * f64::from(k), "pass {k}: {printed}");
        assert_eq!(sum / f64::from(k), l);
    }
    assert!((printed / 1e5 - l / alpha).abs() < 1e-3, "{printed}");
}
