//! Whose turn it is: the contestant that has used least time goes on next, so that whatever slows the machine
//! down for a while slows all of them.

use super::contestants::Contestant;
use crate::cli::interrupt::Interrupt;
use crate::cli::memory;
use anyhow::Result;
use std::time::Instant;
use vpt::report::metrics::Judge;
use vpt::report::picture::Picture;
use vpt::report::results::{Run, Snapshot};

/// Pictures are judged at times that grow by this factor, up to the end.
const GROWTH: f64 = std::f64::consts::SQRT_2;
/// How many such times there are before the end.
const SNAPSHOTS: i32 = 14;

/// A contestant with its clock and what was measured of it.
pub struct Lane<'a> {
    contestant: Box<dyn Contestant + 'a>,
    /// Wall time that its steps took [s].
    clock: f64,
    /// When its picture is judged next [s].
    next: f64,
    /// Resident memory that it holds between steps; it may give back more than it took.
    held: i64,
    run: Run,
}

impl<'a> Lane<'a> {
    /// `preparation` is the time [s] that was spent on it before.
    pub fn new(contestant: Box<dyn Contestant + 'a>, seed: u32, preparation: f64) -> Self {
        let run = Run { seed, ..Run::default() };
        Lane { contestant, clock: preparation, next: 0.0, held: 0, run }
    }

    /// Makes one step, and judges the picture if it is time to.
    fn step(&mut self, budget: f64, judge: &Judge) -> Result<()> {
        memory::forget_peak();
        let before = memory::resident();
        let start = Instant::now();
        self.contestant.advance()?;
        self.clock += start.elapsed().as_secs_f64();
        self.note_memory(before);
        if self.clock >= self.next {
            let errors = judge.errors(&self.contestant.picture()?);
            let work = self.contestant.work();
            self.run.snapshots.push(Snapshot { seconds: self.clock, work, errors });
            self.next = next_time(self.clock, budget);
        }
        Ok(())
    }

    fn note_memory(&mut self, before: Option<u64>) {
        let (Some(before), Some(after), Some(peak)) = (before, memory::resident(), memory::peak())
        else {
            return;
        };
        let most = (self.held + peak as i64 - before as i64).max(0) as u64;
        self.run.peak_memory_bytes = self.run.peak_memory_bytes.max(Some(most));
        self.held += after as i64 - before as i64;
    }

    /// What was measured, and the last picture if a step was made.
    pub fn finish(mut self) -> Result<(Run, Option<Picture>)> {
        if self.run.snapshots.is_empty() {
            return Ok((self.run, None));
        }
        self.run.work = self.contestant.work();
        self.run.phases = self.contestant.phases();
        let picture = self.contestant.picture()?;
        Ok((self.run, Some(picture)))
    }
}

/// Lets the lanes take turns until each has used `budget` seconds, or the user has enough. Each makes one step at
/// least. `report` is told the seconds that all have used.
pub fn take_turns(
    lanes: &mut [Lane],
    budget: f64,
    judge: &Judge,
    interrupt: &Interrupt,
    mut report: impl FnMut(f64),
) -> Result<()> {
    while !interrupt.requested() {
        let due = lanes.iter_mut().filter(|l| l.clock < budget || l.run.snapshots.is_empty());
        let Some(lane) = due.min_by(|a, b| a.clock.total_cmp(&b.clock)) else { break };
        lane.step(budget, judge)?;
        report(lanes.iter().map(|lane| lane.clock.min(budget)).sum());
    }
    Ok(())
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

        fn picture(&self) -> Result<Picture> {
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
        let lane = |pause| {
            let pause = Duration::from_millis(pause);
            Lane::new(Box::new(Sleeper { steps: 0, pause }), 0, 0.0)
        };
        vec![lane(5), lane(20), lane(300)]
    }

    fn judge() -> Judge {
        Judge::new(Picture::from_fn(2, 2, |_, _| [1.0; 3]))
    }

    #[test]
    fn all_get_the_same_time_and_at_least_a_step() {
        let mut lanes = lanes();
        take_turns(&mut lanes, 0.2, &judge(), &Interrupt::default(), |_| ()).unwrap();
        let (fast, slow, late) = (&lanes[0], &lanes[1], &lanes[2]);
        for lane in [fast, slow] {
            assert!((0.2..0.3).contains(&lane.clock), "{}", lane.clock);
        }
        assert_eq!(late.run.snapshots.len(), 1);
        assert!(fast.run.snapshots.len() > 4);
        assert!(fast.run.snapshots.windows(2).all(|w| w[0].errors.rmse > w[1].errors.rmse));
    }

    #[test]
    fn interrupt_keeps_what_was_measured() {
        let (mut lanes, interrupt) = (lanes(), Interrupt::default());
        take_turns(&mut lanes, 1e9, &judge(), &interrupt, |used| {
            if used > 0.4 {
                interrupt.request();
            }
        })
        .unwrap();
        let (run, picture) = lanes.remove(0).finish().unwrap();
        assert!(!run.snapshots.is_empty() && picture.is_some());
    }

    #[test]
    fn snapshots_end_with_the_budget() {
        assert_eq!(next_time(0.0, 128.0), 128.0 * GROWTH.powi(-SNAPSHOTS));
        assert!((next_time(100.0, 128.0) - 128.0).abs() < 1e-9);
        assert_eq!(next_time(128.0, 128.0), f64::INFINITY);
    }
}
