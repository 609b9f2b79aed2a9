//! How a mean of independent renders is held against its closed form.

use statrs::distribution::{ContinuousCDF, StudentsT};

/// Probability that a right engine fails any reading of the table, for a fresh set of seeds.
pub const FAMILY_LEVEL: f64 = 1e-3;
/// No fewer than the readings of the whole table (Bonferroni's correction).
pub const FAMILY_SIZE: usize = 1000;
/// Probability with which the fault that a reading must notice is noticed.
const POWER: f64 = 0.95;
/// Deviations in standard errors are told up to here.
const FAR: f64 = 999.0;
/// Relative rounding of sums of single-precision values.
const ROUNDING: f64 = 1e-5;

/// Mean of independent values, and the standard error of that mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    pub mean: f64,
    pub standard_error: f64,
    count: usize,
}

impl Estimate {
    pub fn of(values: &[f64]) -> Self {
        let count = values.len();
        let mean = values.iter().sum::<f64>() / count as f64;
        let squares: f64 = values.iter().map(|x| (x - mean) * (x - mean)).sum();
        let standard_error = (squares / (count * (count - 1)) as f64).sqrt();
        Estimate { mean, standard_error, count }
    }

    fn students_t(&self) -> StudentsT {
        StudentsT::new(0.0, 1.0, (self.count - 1) as f64).expect("two values at least")
    }

    /// Deviation that a right estimate stays below, by noise alone.
    fn noise(&self) -> f64 {
        let level = FAMILY_LEVEL / FAMILY_SIZE as f64;
        self.students_t().inverse_cdf(1.0 - 0.5 * level) * self.standard_error
    }

    /// Deviation from an interval in standard errors, cut off at `FAR`: 0 inside, and 0 where rounding alone
    /// is left.
    pub fn z(&self, low: f64, high: f64) -> f64 {
        let deviation = self.mean - self.mean.clamp(low, high);
        let rounding = ROUNDING * low.abs().max(high.abs());
        match deviation.abs() {
            d if d <= rounding => 0.0,
            _ => (deviation / self.standard_error).clamp(-FAR, FAR),
        }
    }

    /// Why the mean is not compatible with any value from `low` to `high`, or why a fault of `noticed`
    /// (in the unit of the values) could hide in its noise.
    pub fn fault(&self, low: f64, high: f64, noticed: f64) -> Option<String> {
        let deviation = (self.mean - self.mean.clamp(low, high)).abs();
        let allowed = self.noise() + ROUNDING * low.abs().max(high.abs());
        if !self.mean.is_finite() || deviation > allowed {
            return Some(format!("off by {deviation:.3e}, where noise allows {allowed:.3e}"));
        }
        let margin = self.students_t().inverse_cdf(POWER) * self.standard_error;
        let hidden = self.noise() + margin;
        (hidden > noticed).then(|| {
            format!("too noisy: a fault of {noticed:.3e} could hide, {hidden:.3e} would be noticed")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_is_refused_for_being_off_and_for_being_noisy() {
        let sharp = Estimate::of(&[0.99, 1.01, 1.0, 1.0, 0.99, 1.01, 1.0, 1.0]);
        assert_eq!(sharp.fault(1.0, 1.0, 0.2), None);
        assert!(sharp.fault(1.2, 1.2, 0.2).unwrap().contains("off by"));
        assert!(sharp.fault(1.0, 1.0, 0.01).unwrap().contains("too noisy"));
        assert!(Estimate::of(&[f64::NAN, 1.0]).fault(1.0, 1.0, 9.0).is_some());
        assert_eq!(Estimate::of(&[2.0, 2.0]).fault(2.0, 2.0, 1e-9), None);
    }
}
