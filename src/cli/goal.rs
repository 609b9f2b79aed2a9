//! What ends a render: passes, time, accuracy, whichever comes first.

use vpt::method::{ErrorEstimate, Progress};

/// Passes asked for where accuracy is to end the render: more than anybody waits for, and a number that no
/// sampler rounds.
pub const OPEN_PASSES: u32 = 1 << 20;

/// Errors that are aimed at when none is given, and each a tenth of that, and so on.
const MARKS: [f64; 3] = [0.1, 0.05, 0.02];

/// What ends a render besides its passes.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Goal {
    /// Seconds.
    pub timeout: Option<f64>,
    /// Relative error.
    pub target_error: Option<f64>,
}

impl Goal {
    /// Share of the work that is done.
    pub fn share_done(&self, progress: &Progress) -> f64 {
        let passes = f64::from(progress.passes_done) / f64::from(progress.passes.max(1));
        let seconds = progress.seconds - progress.seconds_before;
        let time = self.timeout.map_or(0.0, |timeout| seconds / timeout);
        let accuracy = self.factor_to_target(progress).map_or(0.0, |factor| 1.0 / factor);
        passes.max(time).max(accuracy).min(1.0)
    }

    /// Seconds that are left, while some are and there is a pass to judge by.
    pub fn seconds_left(&self, progress: &Progress) -> Option<f64> {
        let Progress { passes_done, passes, seconds, .. } = *progress;
        if passes_done == 0 || passes_done >= passes {
            return None;
        }
        let for_passes = (passes != OPEN_PASSES)
            .then(|| seconds / f64::from(passes_done) * f64::from(passes - passes_done));
        let for_time = self.timeout.map(|timeout| timeout - (seconds - progress.seconds_before));
        let for_target = self.factor_to_target(progress).map(|factor| seconds * (factor - 1.0));
        [for_passes, for_time, for_target]
            .into_iter()
            .flatten()
            .reduce(f64::min)
            .map(|s| s.max(0.0))
    }

    fn factor_to_target(&self, progress: &Progress) -> Option<f64> {
        progress.error?.passes_factor(self.target_error?)
    }

    /// The target, or the next round number below the present error; and when it is reached, in seconds
    /// from now.
    pub fn next_mark(&self, progress: &Progress) -> Option<(f64, f64)> {
        let error = progress.error?;
        let mark = self.target_error.unwrap_or_else(|| mark_below(&error));
        let factor = error.passes_factor(mark)?;
        (factor > 1.0).then_some((mark, progress.seconds * (factor - 1.0)))
    }
}

fn mark_below(error: &ErrorEstimate) -> f64 {
    let marks = (0..).flat_map(|tenths| MARKS.map(|mark| mark / 10f64.powi(tenths)));
    // A mark that is all but reached says nothing.
    marks.take(60).find(|mark| *mark < 0.9 * error.relative).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use vpt::density::radius::Radii;
    use vpt::transport::photon::PerFamily;

    fn progress(passes_done: u32, seconds: f64, error: Option<f64>) -> Progress {
        Progress {
            first_pass: 0,
            passes_done,
            passes: 20,
            walks: 0,
            radii: Radii { surface: 0.01, medium: 0.02 },
            seconds,
            seconds_before: 0.0,
            shooting: PerFamily::default(),
            // Noise alone, of which the square falls as 1/n.
            error: error.map(|relative| ErrorEstimate {
                relative,
                noise: relative,
                noise_decay: 1.0,
                bias_decay: 0.6,
                jitters: 4,
                ..ErrorEstimate::default()
            }),
        }
    }

    #[test]
    fn time_left_is_the_nearest_of_passes_timeout_and_accuracy() {
        let none = Goal::default();
        assert_eq!(none.seconds_left(&progress(0, 1.0, None)), None);
        assert_eq!(none.seconds_left(&progress(20, 1.0, None)), None);
        assert_eq!(none.seconds_left(&progress(5, 10.0, None)), Some(30.0));
        let timed = |timeout| Goal { timeout: Some(timeout), target_error: None };
        assert_eq!(timed(25.0).seconds_left(&progress(5, 10.0, None)), Some(15.0));
        assert_eq!(timed(9.0).seconds_left(&progress(5, 10.0, None)), Some(0.0));
        let exact = Goal { timeout: None, target_error: Some(0.02) };
        let left = exact.seconds_left(&progress(5, 10.0, Some(0.04)));
        // Half the error takes four times the passes, but the passes end at twenty: both 30 s.
        assert!((left.unwrap() - 30.0).abs() < 1e-6, "{left:?}");
        let open = Progress { passes: OPEN_PASSES, ..progress(5, 10.0, None) };
        assert_eq!(exact.seconds_left(&open), None);
    }

    #[test]
    fn share_counts_passes_time_or_accuracy() {
        let goal = |timeout, target_error| Goal { timeout, target_error };
        assert_eq!(goal(None, None).share_done(&progress(5, 10.0, None)), 0.25);
        assert_eq!(goal(Some(20.0), None).share_done(&progress(5, 10.0, None)), 0.5);
        assert_eq!(goal(Some(5.0), None).share_done(&progress(5, 10.0, None)), 1.0);
        let share = goal(None, Some(0.02)).share_done(&progress(1, 10.0, Some(0.04)));
        assert!((share - 0.25).abs() < 1e-6, "{share}");
    }

    #[test]
    fn marks_are_round_numbers_below_the_error() {
        let mark = |error| Goal::default().next_mark(&progress(5, 10.0, Some(error))).unwrap();
        for (error, below) in [(0.5, 0.1), (0.1, 0.05), (0.021, 0.01), (0.0104, 0.005)] {
            assert!((mark(error).0 - below).abs() < 1e-12, "{error}");
        }
        assert!((mark(0.1).1 - 30.0).abs() < 1e-6);
    }
}
