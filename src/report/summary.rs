//! What a comparison comes to, method by method.

use super::curve::{band, BandPoint, Curve, Reached};
use super::metrics::Errors;
use super::results::{Comparison, Method, Metric};
use super::text;
use serde::{Deserialize, Serialize};

/// Relative errors of which the time is told.
pub const LEVELS: [f64; 4] = [0.10, 0.05, 0.02, 0.01];

/// Share of the smallest error measured that the reference's own error may have: a third of it adds 5 % to what is
/// measured.
const REFERENCE_SHARE: f64 = 1.0 / 3.0;
/// Noise relative to a noisy picture's own pixels saturates: beyond this it is only known to be large.
const REFERENCE_LIMIT: f64 = 0.1;

/// One method in a few numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    pub name: String,
    /// Geometric mean over the seeds of the errors in the end.
    pub last: Option<Errors>,
    /// Exponent of time that the RMSE follows, mean over the seeds, and its standard error from two seeds on.
    pub rate: Option<f64>,
    pub rate_error: Option<f64>,
    /// One for each of [`LEVELS`].
    pub times: Vec<TimeTo>,
}

/// The time to a relative error.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TimeTo {
    pub level: f64,
    /// Of the mean over seeds.
    #[serde(flatten)]
    pub reached: Reached,
    /// Fastest and slowest seed, where all of them reached it.
    pub range: Option<[f64; 2]>,
    /// Seconds of the fastest Mitsuba integrator over these seconds: above 1 is faster than Mitsuba.
    pub speed_up: Option<f64>,
}

/// Summaries of all methods, in their order.
pub fn summarize(comparison: &Comparison) -> Vec<Summary> {
    let mut summaries: Vec<Summary> = comparison.methods.iter().map(summary).collect();
    for index in 0..LEVELS.len() {
        let best = comparison
            .methods
            .iter()
            .zip(&summaries)
            .filter(|(method, _)| !method.ours && method.flaw.is_none())
            .filter_map(|(_, summary)| summary.times[index].reached.seconds())
            .reduce(f64::min);
        for summary in &mut summaries {
            let time = &mut summary.times[index];
            time.speed_up = best.zip(time.reached.seconds()).map(|(best, own)| best / own);
        }
    }
    summaries
}

/// What is known of the reference's error, noise and bias together, relative; None for a file from elsewhere.
pub fn reference_error(comparison: &Comparison) -> Option<f64> {
    let noise = comparison.reference.noise?;
    Some(noise.relative_mse.sqrt().hypot(comparison.reference.bias.unwrap_or(0.0)))
}

/// A sentence where the reference's error is no longer small, by itself or beside the smallest error measured, which is
/// then told too large or, by a method that shares the reference's bias, too small.
pub fn noise_of_reference_matters(comparison: &Comparison) -> Option<String> {
    let known = reference_error(comparison)?;
    let usable = comparison.methods.iter().filter(|method| method.flaw.is_none());
    let last = usable.filter_map(|method| Some((last_errors(method)?.relative(), &method.name)));
    let (least, name) = last.min_by(|a, b| a.0.total_cmp(&b.0))?;
    let (own, least_told) = (text::percent(known), text::percent(least));
    if known > REFERENCE_LIMIT {
        Some(format!(
            "the reference's own error ({own}) is so large that no error told here is to be trusted; give it more \
             --reference-time, or another --reference-method"
        ))
    } else if known > REFERENCE_SHARE * least {
        Some(format!(
            "the reference's own error ({own}) is more than {:.0} % of the smallest error measured ({least_told} by \
             {name}), so that the smallest errors and the times to them are not to be trusted; give it more \
             --reference-time",
            100.0 * REFERENCE_SHARE
        ))
    } else {
        None
    }
}

/// One measure of a method over time, by seed.
pub fn curves(method: &Method, measure: impl Fn(&Errors) -> f64) -> Vec<Curve> {
    let curve = |run: &super::results::Run| {
        Curve::new(run.snapshots.iter().map(|shot| (shot.seconds, measure(&shot.errors))))
    };
    let curves = method.runs.iter().map(curve);
    curves.filter(|curve| !curve.points().is_empty()).collect()
}

/// One measure of a method over time with its spread over the seeds.
pub fn method_band(method: &Method, metric: Metric) -> Vec<BandPoint> {
    band(&curves(method, |errors| metric.of(errors)))
}

fn summary(method: &Method) -> Summary {
    let rates: Vec<f64> =
        curves(method, |errors| errors.rmse).iter().filter_map(Curve::rate).collect();
    let relative = curves(method, Errors::relative);
    let mean = Curve::new(band(&relative).iter().map(|point| (point.seconds, point.mean)));
    Summary {
        name: method.name.clone(),
        last: last_errors(method),
        rate: mean_of(&rates),
        rate_error: standard_error(&rates),
        times: LEVELS.map(|level| time_to(level, &mean, &relative)).to_vec(),
    }
}

fn time_to(level: f64, mean: &Curve, seeds: &[Curve]) -> TimeTo {
    let times: Option<Vec<f64>> =
        seeds.iter().map(|curve| curve.reached(level).seconds()).collect();
    let range = times.filter(|times| !times.is_empty()).map(|times| {
        let least = times.iter().copied().fold(f64::INFINITY, f64::min);
        [least, times.iter().copied().fold(0.0, f64::max)]
    });
    TimeTo { level, reached: mean.reached(level), range, speed_up: None }
}

fn last_errors(method: &Method) -> Option<Errors> {
    let last: Vec<Errors> =
        method.runs.iter().filter_map(|run| Some(run.snapshots.last()?.errors)).collect();
    let geometric = |measure: fn(&Errors) -> f64| {
        (last.iter().map(|errors| measure(errors).ln()).sum::<f64>() / last.len() as f64).exp()
    };
    (!last.is_empty()).then(|| Errors {
        rmse: geometric(|errors| errors.rmse),
        relative_mse: geometric(|errors| errors.relative_mse),
        flip: geometric(|errors| errors.flip),
    })
}

fn mean_of(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Of the mean; None for fewer than two values.
fn standard_error(values: &[f64]) -> Option<f64> {
    let (mean, count) = (mean_of(values)?, values.len() as f64);
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (values.len() > 1).then(|| (squares / (count - 1.0) / count).sqrt())
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::report::results::{Noise, Phase, Reference, Run, Snapshot};

    /// Two seeds whose relative error is `scale / sqrt(t)`, times 1.1 and over 1.1.
    fn method(name: &str, ours: bool, scale: f64) -> Method {
        let run = |seed: u32, factor: f64| {
            let snapshot = |k: i32| {
                let seconds = 2f64.powi(k);
                let error = scale * factor / seconds.sqrt();
                let errors = Errors { rmse: 2.0 * error, relative_mse: error * error, flip: error };
                Snapshot { seconds, work: 1 << k, errors, image: None }
            };
            let phases = vec![Phase { name: "photons".into(), seconds: 3.0 }];
            let snapshots = (0..7).map(snapshot).collect();
            let peak_memory_bytes = Some(3 << 20);
            Run { seed, complete: true, work: 64, snapshots, phases, peak_memory_bytes }
        };
        Method {
            name: name.into(),
            variant: "scalar_rgb".into(),
            ours,
            flaw: None,
            shares_reference: false,
            runs: vec![run(0, 1.1), run(1, 1.0 / 1.1)],
        }
    }

    /// `ppt` beside a Mitsuba integrator with twice the error.
    pub fn comparison() -> Comparison {
        Comparison {
            version: "0".into(),
            scene: "a <b>.xml".into(),
            variant: "scalar_rgb".into(),
            film_size: [8, 6],
            seconds: 64.0,
            seeds: 2,
            settings: Default::default(),
            interrupted: false,
            peak_memory_bytes: Some(9 << 20),
            reference: Reference {
                origin: "a file".into(),
                mean: 1.0,
                noise: Some(Noise { rmse: 0.01, relative_mse: 1e-4 }),
                bias: None,
                estimator: None,
            },
            methods: vec![method("ppt", true, 0.2), method("volpath", false, 0.4)],
            notes: vec!["a note".into()],
        }
    }

    #[test]
    fn power_laws_are_summed_up_in_closed_form() {
        let summaries = summarize(&comparison());
        let (ppt, volpath) = (&summaries[0], &summaries[1]);
        assert!((ppt.rate.unwrap() + 0.5).abs() < 1e-12);
        assert!(ppt.rate_error.unwrap() < 1e-12);
        assert!((ppt.last.unwrap().relative() - 0.2 / 8.0).abs() < 1e-12);
        let ten = &ppt.times[0];
        assert!((ten.reached.seconds().unwrap() - 4.0).abs() < 1e-9);
        assert!((ten.speed_up.unwrap() - 4.0).abs() < 1e-9);
        let [fast, slow] = ten.range.unwrap();
        assert!((slow / fast - 1.1f64.powi(4)).abs() < 1e-9);
        assert_eq!(volpath.times[0].speed_up, Some(1.0));
        assert_eq!(volpath.times[3].reached, Reached::Never);
        assert_eq!(ppt.times[3].speed_up, None);
    }

    #[test]
    fn flawed_integrators_are_no_yardstick() {
        let mut comparison = comparison();
        comparison.methods[1].flaw = Some("it sees no media".into());
        assert_eq!(summarize(&comparison)[0].times[0].speed_up, None);
    }

    #[test]
    fn noise_of_the_reference_is_told_where_it_matters() {
        // The smallest error is 0.025, the noise 0.01: more than a third.
        let mut comparison = comparison();
        let sentence = noise_of_reference_matters(&comparison).unwrap();
        assert!(sentence.contains("1.00 %") && sentence.contains("2.50 % by ppt"), "{sentence}");
        let noise = |relative: f64| Some(Noise { rmse: 1.0, relative_mse: relative * relative });
        comparison.reference.noise = noise(0.008);
        assert_eq!(noise_of_reference_matters(&comparison), None);
        comparison.reference.bias = Some(0.006);
        assert!(noise_of_reference_matters(&comparison).is_some());
        comparison.reference.noise = noise(0.2);
        let sentence = noise_of_reference_matters(&comparison).unwrap();
        assert!(
            sentence.contains("20.0 %") && sentence.contains("no error told here"),
            "{sentence}"
        );
        comparison.reference.noise = None;
        assert_eq!(noise_of_reference_matters(&comparison), None);
    }

    #[test]
    fn method_without_snapshots_has_no_numbers() {
        let mut comparison = comparison();
        comparison.methods[0].runs.clear();
        let summary = &summarize(&comparison)[0];
        assert_eq!((summary.last, summary.rate), (None, None));
        assert_eq!(summary.times[0].reached, Reached::Never);
    }
}
