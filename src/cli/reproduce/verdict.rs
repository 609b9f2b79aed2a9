//! What repeated measurements can decide.

use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// What a run says of a claim.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    NotSupported,
    NotDecided,
    Supported,
}

impl Verdict {
    pub fn text(self) -> &'static str {
        match self {
            Verdict::Supported => "supported",
            Verdict::NotSupported => "not supported",
            Verdict::NotDecided => "not decided",
        }
    }
}

/// Where a quantity lies, with 95 % confidence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    pub mean: f64,
    pub low: f64,
    pub high: f64,
}

/// Two-sided.
const CONFIDENCE: f64 = 0.95;

impl Interval {
    /// The difference of the expectations of two samples of unlike variance [Welch 1947]; None where one of them has
    /// fewer than two values.
    pub fn difference(a: &[f64], b: &[f64]) -> Option<Self> {
        let ((mean_a, error_a), (mean_b, error_b)) = (moments(a)?, moments(b)?);
        let square = error_a + error_b;
        let parts = |error: f64, count: usize| error * error / (count - 1) as f64;
        let freedom = square * square / (parts(error_a, a.len()) + parts(error_b, b.len()));
        Some(around(mean_a - mean_b, square.sqrt(), freedom))
    }

    /// The expectation of a sample.
    pub fn mean(a: &[f64]) -> Option<Self> {
        let (mean, square) = moments(a)?;
        Some(around(mean, square.sqrt(), (a.len() - 1) as f64))
    }

    /// Whether the quantity is at most `bound`.
    pub fn at_most(&self, bound: f64) -> Verdict {
        match (self.high <= bound, self.low > bound) {
            (true, _) => Verdict::Supported,
            (_, true) => Verdict::NotSupported,
            _ => Verdict::NotDecided,
        }
    }

    /// Whether the quantity is at least `bound`.
    pub fn at_least(&self, bound: f64) -> Verdict {
        Interval { mean: -self.mean, low: -self.high, high: -self.low }.at_most(-bound)
    }
}

/// The mean and the square of its standard error.
fn moments(values: &[f64]) -> Option<(f64, f64)> {
    if values.len() < 2 || values.iter().any(|value| !value.is_finite()) {
        return None;
    }
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    Some((mean, squares / (count - 1.0) / count))
}

fn around(mean: f64, error: f64, freedom: f64) -> Interval {
    // Equal values have no error, and no degrees of freedom either.
    let quantile = match StudentsT::new(0.0, 1.0, freedom) {
        Ok(student) if error > 0.0 => student.inverse_cdf(0.5 + 0.5 * CONFIDENCE),
        _ => 0.0,
    };
    Interval { mean, low: mean - quantile * error, high: mean + quantile * error }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn interval_of_a_mean_is_students() {
        let interval = Interval::mean(&[1.0, 2.0, 3.0]).unwrap();
        // t(0.975, 2) = 4.302653, standard error 1/sqrt(3).
        assert!((interval.high - 2.0 - 4.302_653 / 3f64.sqrt()).abs() < 1e-5);
        assert_eq!(Interval::mean(&[1.0]), None);
        assert_eq!(Interval::mean(&[1.0, f64::NAN]), None);
    }

    #[test]
    fn interval_of_a_difference_is_welchs() {
        let interval = Interval::difference(&[2.0, 3.0, 4.0], &[0.0, 1.0, 2.0]).unwrap();
        // Equal variances: 4 degrees of freedom, t(0.975, 4) = 2.776445, standard error sqrt(2/3).
        assert!((interval.mean - 2.0).abs() < 1e-12);
        assert!((interval.low - 2.0 + 2.776_445 * (2f64 / 3.0).sqrt()).abs() < 1e-5);
        let equal = Interval::difference(&[1.0, 1.0], &[0.5, 0.5]).unwrap();
        assert_eq!(equal, Interval { mean: 0.5, low: 0.5, high: 0.5 });
    }

    #[test]
    fn bounds_are_met_missed_or_within() {
        let interval = Interval { mean: 0.0, low: -1.0, high: 1.0 };
        let verdicts = [1.5, -1.5, 0.5].map(|bound| interval.at_most(bound));
        assert_eq!(verdicts, [Verdict::Supported, Verdict::NotSupported, Verdict::NotDecided]);
        let verdicts = [-1.5, 1.5, 0.5].map(|bound| interval.at_least(bound));
        assert_eq!(verdicts, [Verdict::Supported, Verdict::NotSupported, Verdict::NotDecided]);
    }
}
