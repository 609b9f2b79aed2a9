//! Estimates are judged by Student's t-test, not by an epsilon.
//!
//! Every comparison asks two things: is the mean of independent renders compatible with the closed
//! form, and would a fault of `DETECTABLE` have been noticed? The first alone could be passed by
//! noise.

use statrs::distribution::{ChiSquared, ContinuousCDF, StudentsT};

/// Probability that a right engine fails any comparison of the suite, for a fresh set of seeds.
const FAMILY_LEVEL: f64 = 0.01;
/// No fewer than the comparisons in the suite (Bonferroni's correction).
const FAMILY_SIZE: f64 = 100.0;
/// Two-sided level of one comparison.
const LEVEL: f64 = FAMILY_LEVEL / FAMILY_SIZE;
/// Relative fault that has to be noticed with a probability of at least [`POWER`], with an effort of 1.
const DETECTABLE: f64 = 0.01;
const POWER: f64 = 0.95;
/// Relative rounding of the single-precision seam.
const ROUNDING: f64 = 2e-6;

/// How many times as many renders as usual are made: `VPT_TEST_EFFORT`, or 1.
pub fn effort() -> u64 {
    let effort = std::env::var("VPT_TEST_EFFORT").map(|value| value.parse());
    effort.unwrap_or(Ok(1)).expect("VPT_TEST_EFFORT is a whole number")
}

/// Relative fault that a comparison has to notice.
fn detectable() -> f64 {
    DETECTABLE / (effort() as f64).sqrt()
}

/// Mean of independent estimates, with the standard error of that mean.
#[derive(Debug, Clone, Copy)]
pub struct Estimate {
    pub mean: f64,
    pub standard_error: f64,
    pub count: usize,
}

impl Estimate {
    pub fn of(values: &[f64]) -> Self {
        let count = values.len();
        let mean = values.iter().sum::<f64>() / count as f64;
        let standard_error = (variance(values) / count as f64).sqrt();
        Estimate { mean, standard_error, count }
    }

    /// Deviation in standard errors that a right estimate stays below.
    fn critical(&self) -> f64 {
        self.students_t().inverse_cdf(1.0 - 0.5 * LEVEL)
    }

    fn students_t(&self) -> StudentsT {
        StudentsT::new(0.0, 1.0, (self.count - 1) as f64).expect("two values at least")
    }

    /// Fails unless the mean is `expected`, give or take a relative `bias` that the test has
    /// derived a bound for.
    #[track_caller]
    pub fn assert_equals(&self, name: &str, expected: f64, bias: f64) {
        self.assert_noticing(detectable(), name, expected, bias);
    }

    /// As [`Estimate::assert_equals`], with the relative fault that has to be noticed.
    #[track_caller]
    pub fn assert_noticing(&self, detectable: f64, name: &str, expected: f64, bias: f64) {
        let allowed = (bias + ROUNDING) * expected.abs();
        let deviation = (self.mean - expected).abs();
        let noise = self.critical() * self.standard_error;
        println!(
            "{name}: {:.6} ± {:.6}, expected {expected:.6}, off by {:+.3} % ± {:.3} %",
            self.mean,
            self.standard_error,
            100.0 * (self.mean / expected - 1.0),
            100.0 * self.standard_error / expected,
        );
        assert!(
            deviation <= noise + allowed,
            "{name}: {} instead of {expected}, allowed ±{}",
            self.mean,
            noise + allowed
        );
        let margin = self.students_t().inverse_cdf(POWER) * self.standard_error;
        assert!(
            noise + margin + allowed <= detectable * expected.abs(),
            "{name}: too noisy to notice a fault of {} %: standard error {:.3} %",
            100.0 * detectable,
            100.0 * self.standard_error / expected.abs()
        );
    }
}

/// Unbiased sample variance.
pub fn variance(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (values.len() - 1) as f64
}

/// Fails unless the variance of independent, nearly normal values is `expected`.
#[track_caller]
pub fn assert_variance(name: &str, values: &[f64], expected: f64) {
    let freedom = (values.len() - 1) as f64;
    let ratio = variance(values) / expected;
    let chi_squared = ChiSquared::new(freedom).expect("two values at least");
    let low = chi_squared.inverse_cdf(0.5 * LEVEL) / freedom;
    let high = chi_squared.inverse_cdf(1.0 - 0.5 * LEVEL) / freedom;
    println!("{name}: variance {ratio:.3} times the expected, allowed {low:.3} to {high:.3}");
    assert!((low..=high).contains(&ratio), "{name}: variance is {ratio} times {expected}");
}

/// Slope of the straight line through points by least squares.
pub fn slope(points: &[(f64, f64)]) -> f64 {
    let n = points.len() as f64;
    let mean_x = points.iter().map(|p| p.0).sum::<f64>() / n;
    let mean_y = points.iter().map(|p| p.1).sum::<f64>() / n;
    let covariance: f64 = points.iter().map(|p| (p.0 - mean_x) * (p.1 - mean_y)).sum();
    let spread: f64 = points.iter().map(|p| (p.0 - mean_x).powi(2)).sum();
    covariance / spread
}
