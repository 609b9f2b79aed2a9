//! An error as a function of time. Everything is linear in the logarithms of both, as Monte Carlo errors are.

use serde::{Deserialize, Serialize};

/// Errors at growing times \[s\]; both above 0.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Curve {
    points: Vec<(f64, f64)>,
}

/// When an error was reached.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(tag = "outcome", rename_all = "snake_case")]
pub enum Reached {
    /// After so many seconds, interpolated.
    After { seconds: f64 },
    /// The first measurement, after so many seconds, was below it already.
    Before { seconds: f64 },
    /// Not within the time measured.
    Never,
}

impl Reached {
    /// Seconds, an upper bound of them where the first measurement was below the error already.
    pub fn seconds(self) -> Option<f64> {
        match self {
            Reached::After { seconds } | Reached::Before { seconds } => Some(seconds),
            Reached::Never => None,
        }
    }
}

impl Curve {
    /// Leaves out points without a logarithm.
    pub fn new(points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let usable = |&(t, e): &(f64, f64)| t > 0.0 && e > 0.0 && t.is_finite() && e.is_finite();
        Curve { points: points.into_iter().filter(usable).collect() }
    }

    pub fn points(&self) -> &[(f64, f64)] {
        &self.points
    }

    /// The exponent `s` of the power law `e ~ t^s` that fits best by least squares in the logarithms; None
    /// for fewer than three points. Independent samples converge with `s = -1/2`.
    pub fn rate(&self) -> Option<f64> {
        if self.points.len() < 3 {
            return None;
        }
        let logs = || self.points.iter().map(|&(t, e)| (t.ln(), e.ln()));
        let count = self.points.len() as f64;
        let mean_x = logs().map(|(x, _)| x).sum::<f64>() / count;
        let mean_y = logs().map(|(_, y)| y).sum::<f64>() / count;
        let covariance: f64 = logs().map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
        let variance: f64 = logs().map(|(x, _)| (x - mean_x).powi(2)).sum();
        (variance > 1e-12).then(|| covariance / variance)
    }

    /// When the error was first at or below `level`.
    pub fn reached(&self, level: f64) -> Reached {
        let Some(index) = self.points.iter().position(|&(_, error)| error <= level) else {
            return Reached::Never;
        };
        let (time, error) = self.points[index];
        if index == 0 {
            return Reached::Before { seconds: time };
        }
        let (before, above) = self.points[index - 1];
        let share = (above / level).ln() / (above / error).ln();
        Reached::After { seconds: before * (time / before).powf(share) }
    }

    /// The error at a time within the curve.
    pub fn at(&self, time: f64) -> Option<f64> {
        let after = self.points.iter().position(|&(t, _)| t >= time)?;
        let (t1, e1) = self.points[after];
        if t1 == time {
            return Some(e1);
        }
        let (t0, e0) = self.points[after.checked_sub(1)?];
        let share = (time / t0).ln() / (t1 / t0).ln();
        Some(e0 * (e1 / e0).powf(share))
    }

    /// As [`Curve::at`], and a little outside of the curve the error at its end.
    fn at_or_near(&self, time: f64) -> Option<f64> {
        let (&(first, early), &(last, late)) = (self.points.first()?, self.points.last()?);
        if time < first {
            return (time * SLACK >= first).then_some(early);
        }
        if time > last {
            return (time <= last * SLACK).then_some(late);
        }
        self.at(time)
    }
}

/// Runs of one method begin and end with whole steps, at slightly different times: up to this factor outside of its
/// span a run counts with its first or last error.
const SLACK: f64 = 1.5;

/// What several runs of one method have in common, at one time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BandPoint {
    pub seconds: f64,
    /// Geometric mean, smallest and largest error of the runs.
    pub mean: f64,
    pub low: f64,
    pub high: f64,
}

/// The runs' errors at the times of the first run that all of them cover.
pub fn band(runs: &[Curve]) -> Vec<BandPoint> {
    let Some(first) = runs.first() else { return Vec::new() };
    let point = |&(seconds, _): &(f64, f64)| {
        let errors: Vec<f64> =
            runs.iter().map(|run| run.at_or_near(seconds)).collect::<Option<_>>()?;
        let mean = (errors.iter().map(|e| e.ln()).sum::<f64>() / errors.len() as f64).exp();
        let low = errors.iter().copied().fold(f64::INFINITY, f64::min);
        let high = errors.iter().copied().fold(0.0, f64::max);
        Some(BandPoint { seconds, mean, low, high })
    };
    first.points.iter().filter_map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `e = c t^s`, at powers of two.
    fn power_law(scale: f64, exponent: f64) -> Curve {
        Curve::new((0..8).map(|k| (2f64.powi(k), scale * 2f64.powi(k).powf(exponent))))
    }

    #[test]
    fn rate_of_a_power_law_is_its_exponent() {
        for exponent in [-0.5, -0.35, 0.0, 0.25] {
            assert!((power_law(3.0, exponent).rate().unwrap() - exponent).abs() < 1e-12);
        }
        assert_eq!(Curve::new([(1.0, 1.0), (2.0, 0.5)]).rate(), None);
        assert_eq!(Curve::new([(1.0, 1.0); 4]).rate(), None);
    }

    #[test]
    fn time_to_an_error_is_interpolated() {
        let curve = power_law(1.0, -0.5);
        let Reached::After { seconds } = curve.reached(0.3) else { panic!("it is reached") };
        assert!((seconds - 0.3f64.powi(-2)).abs() < 1e-9);
        assert_eq!(curve.reached(1.5), Reached::Before { seconds: 1.0 });
        assert_eq!(curve.reached(0.01), Reached::Never);
        assert_eq!(Curve::default().reached(0.1), Reached::Never);
    }

    #[test]
    fn errors_between_points_follow_the_power_law() {
        let curve = power_law(2.0, -0.5);
        assert!((curve.at(3.0).unwrap() - 2.0 / 3f64.sqrt()).abs() < 1e-12);
        assert_eq!(curve.at(1.0), Some(2.0));
        assert_eq!((curve.at(0.5), curve.at(1000.0)), (None, None));
    }

    #[test]
    fn band_spans_the_runs() {
        let band = band(&[power_law(1.0, -0.5), power_law(4.0, -0.5)]);
        assert_eq!(band.len(), 8);
        assert_eq!((band[0].low, band[0].high), (1.0, 4.0));
        assert!((band[0].mean - 2.0).abs() < 1e-12);
    }

    #[test]
    fn band_goes_on_to_the_end_of_runs_that_end_with_whole_steps() {
        let ends_at = |end: f64| Curve::new([(1.0, 0.4), (end, 0.2)]);
        assert_eq!(band(&[ends_at(2.1), ends_at(2.0)]).len(), 2);
        assert_eq!(band(&[ends_at(9.0), ends_at(2.0)]).len(), 1);
    }

    #[test]
    fn points_without_a_logarithm_are_left_out() {
        assert_eq!(Curve::new([(0.0, 1.0), (1.0, 0.0), (1.0, f64::NAN)]), Curve::default());
    }
}
