//! Uniform shooting: walks in batches, deposited into the receivers that they pass, and forgotten. Memory
//! does not depend on how many are shot. [Collin 2013 §5.2]

use super::counters::Counters;
use super::deposits::{Deposit, Deposits, PixelSums, Sink};
use super::gather::Target;
use super::numbers::Uniform;
use super::photon::{Family, PerFamily};
use crate::math::uniform::{self, Purpose};
use crate::scene::{Batching, SceneResult};
use rayon::prelude::*;

/// Deposits that a round of batches may hold before they are added up; bounds memory.
const DEPOSITS_PER_ROUND: usize = 1 << 20;
/// Batches per round at most.
const BATCHES_PER_ROUND: usize = 64;

/// Shoots the uniform photons of one pass after another.
#[derive(Debug)]
pub struct UniformShooter {
    seed: u64,
    batches_per_round: usize,
}

impl UniformShooter {
    pub fn new(seed: u64) -> Self {
        UniformShooter { seed, batches_per_round: 4 }
    }

    /// Emits `walks` walks and adds the pass's radiance to `sums`.
    pub fn shoot(
        &mut self,
        target: &Target,
        pass: u64,
        walks: u64,
        sums: &mut PixelSums,
    ) -> SceneResult<Counters> {
        let Batching { lanes, concurrent } = target.scene.batching();
        let lanes = (lanes as u64).min(walks);
        let pixels = target.receivers.pixels();
        let seed = self.seed;
        let run = |batch: u64| -> SceneResult<(Splat, Counters)> {
            let count = lanes.min(walks - batch * lanes) as usize;
            let mut numbers = Uniform(uniform::stream(seed, Purpose::Photons, pass, batch));
            let mut tables = uniform::stream(seed, Purpose::PhotonTables, pass, batch);
            let both = PerFamily { surface: true, medium: true };
            target.shoot(count, &mut numbers, &mut tables, both, || Splat::new(pixels))
        };
        let mut counters = Counters::default();
        let (mut next, end) = (0, walks.div_ceil(lanes));
        while next < end {
            let results: Vec<(Splat, Counters)> = if concurrent {
                let round = next..end.min(next + self.batches_per_round as u64);
                round.into_par_iter().map(run).collect::<SceneResult<_>>()?
            } else {
                vec![run(next)?]
            };
            next += results.len() as u64;
            let mut deposits = Vec::with_capacity(results.len());
            for (splat, counts) in results {
                counters.add(&counts);
                counters.uniform_walks += counts.walks;
                counters.add_visible(splat.visible_walks(lanes as usize));
                deposits.push(splat.deposits);
            }
            // [Collin 2013 (2), (3)]: the sum over photons divided by the number of emitted walks.
            sums.add(&deposits, 1.0 / walks as f64);
            self.plan_round(&deposits);
        }
        Ok(counters)
    }

    /// Sizes the next round by what the last one held.
    fn plan_round(&mut self, deposits: &[Deposits]) {
        let total: usize = deposits.iter().map(Deposits::count).sum();
        let per_batch = total.div_ceil(deposits.len().max(1)).max(1);
        self.batches_per_round = (DEPOSITS_PER_ROUND / per_batch).clamp(1, BATCHES_PER_ROUND);
    }
}

/// Deposits by share of the pixels, and which walks were seen.
struct Splat {
    deposits: Deposits,
    /// A walk and family for each vertex or beam that added something; neighbours are not repeated.
    seen: Vec<(u32, Family)>,
}

impl Splat {
    fn new(pixels: usize) -> Self {
        Splat { deposits: Deposits::new(pixels), seen: Vec::new() }
    }

    /// The number of walks, out of a batch of `lanes`, that added something, by family.
    fn visible_walks(&self, lanes: usize) -> PerFamily<u64> {
        PerFamily::from_fn(|family| {
            let mut is_seen = vec![false; lanes];
            for &(walk, _) in self.seen.iter().filter(|(_, of)| *of == family) {
                is_seen[walk as usize] = true;
            }
            is_seen.iter().filter(|seen| **seen).count() as u64
        })
    }
}

impl Sink for Splat {
    fn push(&mut self, walk: u32, family: Family, deposit: Deposit) {
        self.deposits.push(deposit);
        if self.seen.last() != Some(&(walk, family)) {
            self.seen.push((walk, family));
        }
    }

    fn append(&mut self, mut other: Self) {
        self.deposits.append(other.deposits);
        self.seen.append(&mut other.seen);
    }
}
