//! How work on a scene is cut into batches.

use super::SceneResult;
use rayon::prelude::*;
use std::ops::Range;

/// How a host likes its batches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Batching {
    /// Lanes per batch.
    pub lanes: usize,
    /// Whether several threads may drive batches of their own at the same time.
    pub concurrent: bool,
    /// Vertices that a call of [`super::PhotonWalk::step`] or [`super::ViewWalk::step`] should yield, where few walks by several steps each: what a call
    /// costs is the less felt. 1 where calls cost nothing.
    pub launch: usize,
}

/// Steps that such a call is asked for at most.
const MAX_STEPS: usize = 16;

/// A share of a job that is done in batches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Batch {
    pub number: u64,
    /// The number of its first lane within the whole job.
    pub first: u64,
    pub lanes: usize,
}

impl Batching {
    /// How many steps to ask for in one call while so many walks are alive.
    pub fn steps(self, alive: usize) -> usize {
        (self.launch / alive.max(1)).clamp(1, MAX_STEPS)
    }

    /// How many batches a job of `lanes` takes.
    pub fn count(self, lanes: u64) -> u64 {
        lanes.div_ceil(self.lanes as u64)
    }

    /// Runs the batches `numbers` of a job of `lanes`, side by side where the host allows it. Results
    /// are in the order of the numbers.
    pub fn run<T: Send>(
        self,
        lanes: u64,
        numbers: Range<u64>,
        run: impl Fn(Batch) -> SceneResult<T> + Sync,
    ) -> SceneResult<Vec<T>> {
        let batch = |number: u64| {
            let first = number * self.lanes as u64;
            Batch { number, first, lanes: (lanes - first).min(self.lanes as u64) as usize }
        };
        if self.concurrent {
            // One by one: a thread that took several would leave the others idle at the end.
            let count = (numbers.end - numbers.start) as usize;
            let one_by_one = (0..count).into_par_iter().with_max_len(1);
            one_by_one.map(|index| run(batch(numbers.start + index as u64))).collect()
        } else {
            numbers.map(|number| run(batch(number))).collect()
        }
    }

    /// Runs all batches of a job of `lanes`.
    pub fn run_all<T: Send>(
        self,
        lanes: u64,
        run: impl Fn(Batch) -> SceneResult<T> + Sync,
    ) -> SceneResult<Vec<T>> {
        self.run(lanes, 0..self.count(lanes), run)
    }
}
