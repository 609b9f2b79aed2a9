//! Whose turn it is: the contestant that has used least time goes on next, so that whatever slows the machine
//! down for a while slows all of them.

use super::contestants::Contestant;
use super::meter::Meter;
use crate::cli::interrupt::Interrupt;
use anyhow::Result;
use std::time::Instant;
use vpt::report::metrics::Judge;
use vpt::report::picture::Picture;
use vpt::report::results::{Run, Snapshot};

/// Pictures are judged at times that grow by this factor, up to the end.
const GROWTH: f64 = std::f64::consts::SQRT_2;
/// How many such times there are before the end.
const SNAPSHOTS: i32 = 14;

/// Who is told what lanes come to.
pub trait Watch {
    /// All lanes together have used so many seconds.
    fn used(&mut self, seconds: f64);
    /// The picture of a method was judged; its errors are the run's last.
    fn judged(&mut self, method: usize, run: &Run, picture: &Picture) -> Result<()>;
}

/// A contestant with its clock and what was measured of it.
pub struct Lane<'a> {
    /// Its index among the methods of the comparison.
    method: usize,
    contestant: Box<dyn Contestant + 'a>,
    /// Wall time that its steps took [s].
    clock: f64,
    /// When its picture is judged next [s].
    next: f64,
    meter: Meter,
    run: Run,
}

impl<'a> Lane<'a> {
    /// `preparation` is the time [s] that was spent on it before.
    pub fn new(
        method: usize,
        contestant: Box<dyn Contestant + 'a>,
        seed: u32,
        preparation: f64,
    ) -> Self {
        let (run, meter) = (Run { seed, ..Run::default() }, Meter::default());
        Lane { method, contestant, clock: preparation, next: 0.0, meter, run }
    }

    /// Whether it has time left, or made no step yet.
    fn is_due(&self, budget: f64) -> bool {
        self.clock < budget || self.run.snapshots.is_empty()
    }

    /// Makes one step, and judges the picture if it is time to.
    fn step(&mut self, budget: f64, judge: &Judge, watch: &mut impl Watch) -> Result<()> {
        let (contestant, clock) = (&mut self.contestant, &mut self.clock);
        self.meter.around(|| -> Result<()> {
            let start = Instant::now();
            contestant.advance()?;
            *clock += start.elapsed().as_secs_f64();
            Ok(())
        })?;
        if self.clock >= self.next {
            self.next = next_time(self.clock, budget);
            self.run.complete = self.clock >= budget;
            self.judge(judge, watch)?;
        }
        Ok(())
    }

    fn judge(&mut self, judge: &Judge, watch: &mut impl Watch) -> Result<()> {
        let picture = self.contestant.picture()?;
        let (seconds, work) = (self.clock, self.contestant.work());
        let errors = judge.errors(&picture);
        self.run.snapshots.push(Snapshot { seconds, work, errors, image: None });
        self.run.work = work;
        self.run.phases = self.contestant.phases();
        self.run.peak_memory_bytes = self.contestant.memory().or(self.meter.most());
        watch.judged(self.method, &self.run, &picture)
    }

    /// Judges the picture of steps that were made since it was judged last.
    fn conclude(&mut self, judge: &Judge, watch: &mut impl Watch) -> Result<()> {
        match self.run.snapshots.last() {
            Some(last) if last.work < self.contestant.work() => self.judge(judge, watch),
            _ => Ok(()),
        }
    }
}

/// Lets the lanes take turns until each has used `budget` seconds, or the user has enough. Each makes one step at
/// least.
pub fn take_turns(
    lanes: &mut [Lane],
    budget: f64,
    judge: &Judge,
    interrupt: &Interrupt,
    watch: &mut impl Watch,
) -> Result<()> {
    while !interrupt.requested() {
        let due = lanes.iter_mut().filter(|lane| lane.is_due(budget));
        let Some(lane) = due.min_by(|a, b| a.clock.total_cmp(&b.clock)) else { break };
        lane.step(budget, judge, watch)?;
        watch.used(lanes.iter().map(|lane| lane.clock.min(budget)).sum());
    }
    lanes.iter_mut().try_for_each(|lane| lane.conclude(judge, watch))
}

/// The first time of the series `budget / GROWTH^k` that is still to come.
fn next_time(clock: f64, budget: f64) -> f64 {
    let times = (0..=SNAPSHOTS).rev().map(|k| budget * GROWTH.powi(-k));
    times.into_iter().find(|&time| time > clock).unwrap_or(f64::INFINITY)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;
    use vpt::report::results::Phase;

    /// Sleeps; its picture is off by 1 / steps.
    struct Sleeper {
        steps: u64,
        pause: Duration,
    }

    impl Contestant for Sleeper {
        fn advance(&mut self) -> Result<()> {
            std::thread::sleep(self.pause);
            self.steps += 1;
            Ok(())
        }

        fn picture(&mut self) -> Result<Picture> {
            Ok(Picture::from_fn(2, 2, |_, _| [1.0 + 1.0 / self.steps as f32; 3]))
        }

        fn work(&self) -> u64 {
            self.steps
        }

        fn phases(&self) -> Vec<Phase> {
            Vec::new()
        }
    }

    fn lanes<'a>() -> Vec<Lane<'a>> {
        let lane = |(method, pause)| {
            let pause = Duration::from_millis(pause);
            Lane::new(method, Box::new(Sleeper { steps: 0, pause }), 0, 0.0)
        };
        [5, 20, 300].into_iter().enumerate().map(lane).collect()
    }

    /// Has enough after so many seconds.
    struct Watcher {
        enough: f64,
        interrupt: Interrupt,
        runs: [Run; 3],
    }

    impl Watcher {
        fn until(enough: f64) -> Self {
            Watcher { enough, interrupt: Interrupt::default(), runs: Default::default() }
        }
    }

    impl Watch for Watcher {
        fn used(&mut self, seconds: f64) {
            if seconds > self.enough {
                self.interrupt.request();
            }
        }

        fn judged(&mut self, method: usize, run: &Run, _: &Picture) -> Result<()> {
            assert_eq!(run.snapshots.len(), self.runs[method].snapshots.len() + 1);
            self.runs[method] = run.clone();
            Ok(())
        }
    }

    fn judge() -> Judge {
        Judge::new(Picture::from_fn(2, 2, |_, _| [1.0; 3]))
    }

    #[test]
    fn all_get_the_same_time_and_at_least_a_step() {
        let (mut lanes, mut watcher) = (lanes(), Watcher::until(1e9));
        take_turns(&mut lanes, 0.2, &judge(), &Interrupt::default(), &mut watcher).unwrap();
        let [fast, _, late] = &watcher.runs;
        for lane in &lanes[..2] {
            assert!((0.2..0.3).contains(&lane.clock), "{}", lane.clock);
        }
        assert_eq!(late.snapshots.len(), 1);
        assert!(fast.snapshots.len() > 4);
        assert!(fast.snapshots.windows(2).all(|w| w[0].errors.rmse > w[1].errors.rmse));
        assert!(watcher.runs.iter().all(|run| run.complete));
    }

    #[test]
    fn interrupt_keeps_what_was_measured() {
        let (mut lanes, mut watcher) = (lanes(), Watcher::until(0.4));
        let interrupt = watcher.interrupt.clone();
        take_turns(&mut lanes, 1e9, &judge(), &interrupt, &mut watcher).unwrap();
        for (run, lane) in watcher.runs.iter().zip(&lanes) {
            assert_eq!(run.snapshots.last().unwrap().work, lane.contestant.work());
            assert!(!run.complete);
        }
    }

    #[test]
    fn snapshots_end_with_the_budget() {
        assert_eq!(next_time(0.0, 128.0), 128.0 * GROWTH.powi(-SNAPSHOTS));
        assert!((next_time(100.0, 128.0) - 128.0).abs() < 1e-9);
        assert_eq!(next_time(128.0, 128.0), f64::INFINITY);
    }
}
