//! Answers that are worked out rather than rendered.

use std::f64::consts::PI;

/// Midpoint rule with as many steps.
pub fn integrate(from: f64, to: f64, steps: usize, f: impl Fn(f64) -> f64) -> f64 {
    let width = (to - from) / steps as f64;
    (0..steps).map(|i| f(from + (i as f64 + 0.5) * width) * width).sum()
}

/// Chandrasekhar's H function at a cosine, for isotropic scattering.
///
/// `1/H(mu) = sqrt(1-albedo) + (albedo/2) int_0^1 mu' H(mu')/(mu+mu') dmu'`, iterated on the nodes of a
/// midpoint rule. [Chandrasekhar 1960 §37]
fn chandrasekhar_h(albedo: f64, cosine: f64) -> f64 {
    const NODES: usize = 400;
    let node = |i: usize| (i as f64 + 0.5) / NODES as f64;
    let mut h = vec![1.0; NODES];
    let next = |h: &[f64], mu: f64| {
        let sum: f64 = (0..NODES).map(|j| node(j) * h[j] / (mu + node(j))).sum();
        1.0 / ((1.0 - albedo).sqrt() + 0.5 * albedo * sum / NODES as f64)
    };
    for _ in 0..200 {
        // The mean with the step before: the iteration alone swings about its limit.
        h = (0..NODES).map(|i| 0.5 * (h[i] + next(&h, node(i)))).collect();
    }
    next(&h, cosine)
}

/// Radiance out of a half-space that scatters isotropically, under a sky of radiance 1:
/// `1 - sqrt(1-albedo) H(cosine)`, whatever its extinction. [Chandrasekhar 1960 §38]
pub fn half_space(albedo: f64, cosine: f64) -> f64 {
    1.0 - (1.0 - albedo).sqrt() * chandrasekhar_h(albedo, cosine)
}

/// The same of light that was scattered up to `orders` times alone.
///
/// With `A(t) = arctan(t)/t`, `ln H(mu) = -(mu/pi) int_0^inf ln(1 - albedo A(t)) / (1 + mu² t²) dt`
/// [Chandrasekhar 1960 §39], so that the logarithm of `sqrt(1-albedo) H` is a power series of the albedo, whose
/// exponential is taken term by term.
pub fn half_space_up_to(albedo: f64, cosine: f64, orders: usize) -> f64 {
    let log = |k: usize| {
        let term = |u: f64| (u.tan() / cosine).atan() / (u.tan() / cosine);
        integrate(0.0, 0.5 * PI, 2000, |u| term(u).powi(k as i32)) / PI / k as f64 - 0.5 / k as f64
    };
    let logs: Vec<f64> = (0..=orders).map(|k| if k == 0 { 0.0 } else { log(k) }).collect();
    let mut terms = vec![1.0];
    for n in 1..=orders {
        let sum: f64 = (1..=n).map(|k| k as f64 * logs[k] * terms[n - k]).sum();
        terms.push(sum / n as f64);
    }
    -(1..=orders).map(|n| terms[n] * albedo.powi(n as i32)).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All orders together are the half-space; the first is known by itself.
    #[test]
    fn orders_add_up_to_the_half_space() {
        for cosine in [0.3, 1.0] {
            let (all, sum) = (half_space(0.8, cosine), half_space_up_to(0.8, cosine, 60));
            assert!((sum / all - 1.0).abs() < 1e-3, "{sum} {all}");
        }
        let single = 0.4 * (1.0 - 2f64.ln());
        assert!((half_space_up_to(0.8, 1.0, 1) / single - 1.0).abs() < 1e-5);
    }

    /// `int_0^1 H = 2 (1 - sqrt(1-albedo)) / albedo`, and limits: a black half-space is black, a white one white.
    #[test]
    fn half_space_agrees_with_its_moment_and_limits() {
        let moment = integrate(0.0, 1.0, 20, |mu| chandrasekhar_h(0.8, mu));
        assert!((moment - 2.5 * (1.0 - 0.2f64.sqrt())).abs() < 1e-3, "{moment}");
        assert!((chandrasekhar_h(1.0, 1.0) - 2.9078).abs() < 5e-3);
        assert!(half_space(0.0, 1.0).abs() < 1e-12);
        assert!((half_space(1.0, 1.0) - 1.0).abs() < 1e-12);
        // Single scattering: albedo/2 int_0^1 mu'/(1 + mu') dmu'.
        let single = 0.5e-6 * (1.0 - 2f64.ln());
        assert!(
            (half_space(1e-6, 1.0) / single - 1.0).abs() < 1e-3,
            "{}",
            half_space(1e-6, 1.0) / single
        );
    }

    #[test]
    fn midpoint_rule_integrates() {
        assert!((integrate(0.0, 2.0, 1000, |x| x * x) - 8.0 / 3.0).abs() < 1e-5);
    }
}
