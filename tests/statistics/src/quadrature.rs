//! Numerical integrals of smooth functions, exact to many more digits than the tests look at.

use std::f64::consts::{PI, TAU};
use std::sync::LazyLock;

/// Nodes and weights of one panel.
const ORDER: usize = 16;

static NODES: LazyLock<[(f64, f64); ORDER]> = LazyLock::new(gauss_legendre);

/// Gauss-Legendre nodes and weights on [-1, 1]: roots of the Legendre polynomial by Newton's method.
fn gauss_legendre() -> [(f64, f64); ORDER] {
    std::array::from_fn(|i| {
        let mut x = (PI * (i as f64 + 0.75) / (ORDER as f64 + 0.5)).cos();
        let mut slope = 0.0;
        for _ in 0..100 {
            let (mut previous, mut value) = (1.0, x);
            for k in 2..=ORDER {
                let k = k as f64;
                (previous, value) =
                    (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * previous) / k);
            }
            slope = ORDER as f64 * (x * value - previous) / (x * x - 1.0);
            x -= value / slope;
        }
        (x, 2.0 / ((1.0 - x * x) * slope * slope))
    })
}

/// Integral over `[a, b]`, cut into panels of `ORDER` nodes each.
pub fn integrate(a: f64, b: f64, panels: usize, f: impl Fn(f64) -> f64) -> f64 {
    let nodes = &*NODES;
    let half = 0.5 * (b - a) / panels as f64;
    (0..panels)
        .map(|panel| {
            let center = a + (2 * panel + 1) as f64 * half;
            nodes.iter().map(|(x, w)| w * half * f(center + half * x)).sum::<f64>()
        })
        .sum()
}

/// Mean over the disk of a radius around the origin.
pub fn disk_mean(radius: f64, f: impl Fn(f64, f64) -> f64) -> f64 {
    let area = PI * radius * radius;
    // The periodic direction wants equal steps.
    let angles = 24;
    integrate(0.0, radius, 1, |r| {
        let ring: f64 = (0..angles)
            .map(|i| {
                let (sin, cos) = (TAU * i as f64 / angles as f64).sin_cos();
                f(r * cos, r * sin)
            })
            .sum();
        TAU * r * ring / angles as f64
    }) / area
}

/// Mean over the square `[x - half, x + half] x [y - half, y + half]`.
pub fn square_mean(x: f64, y: f64, half: f64, f: impl Fn(f64, f64) -> f64) -> f64 {
    let area = 4.0 * half * half;
    integrate(x - half, x + half, 1, |x| integrate(y - half, y + half, 1, |y| f(x, y))) / area
}

#[test]
fn rules_are_exact_for_polynomials_and_means_of_constants() {
    assert!((integrate(-1.0, 3.0, 2, |x| x.powi(7)) - (3f64.powi(8) - 1.0) / 8.0).abs() < 1e-9);
    assert!((disk_mean(0.7, |x, y| 1.0 + x * x + y) - (1.0 + 0.49 / 4.0)).abs() < 1e-12);
    assert!((square_mean(1.0, 2.0, 0.5, |x, y| x * y) - 2.0).abs() < 1e-12);
}
