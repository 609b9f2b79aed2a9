//! Uniform shooting: walks in batches, deposited into the receivers that they pass, and forgotten. Memory
//! does not depend on how many are shot. [Collin 2013 §5.2]

use super::counters::Counters;
use super::deposits::{Deposits, PixelSums};
use super::gather::Target;
use super::guided::Guided;
use super::lessons::learn_guide;
use super::splat::Splat;
use crate::guide::EmissionGuide;
use crate::math::uniform::{self, Purpose};
use crate::scene::{Batch, SceneResult};

/// Deposits that a round of batches may hold before they are added up; bounds memory.
const DEPOSITS_PER_ROUND: usize = 1 << 20;
/// Batches per round at most.
const BATCHES_PER_ROUND: u64 = 64;

/// Shoots the uniform photons of one pass after another.
#[derive(Debug)]
pub struct UniformShooter {
    seed: u64,
    batches_per_round: u64,
    guidance: Guidance,
}

/// Whether emission is guided, and by what.
#[derive(Debug)]
enum Guidance {
    None,
    /// By what is to be learnt before the first photon.
    Wanted,
    Learnt(EmissionGuide),
}

impl Guidance {
    fn guide(&self) -> Option<&EmissionGuide> {
        match self {
            Guidance::Learnt(guide) => Some(guide),
            Guidance::None | Guidance::Wanted => None,
        }
    }
}

impl UniformShooter {
    pub fn new(seed: u64) -> Self {
        UniformShooter { seed, batches_per_round: 4, guidance: Guidance::None }
    }

    /// The same, its emission guided to where photons are seen if wanted; that is learnt from the target of the first pass.
    pub fn of(seed: u64, guided: bool) -> Self {
        let guidance = if guided { Guidance::Wanted } else { Guidance::None };
        UniformShooter { guidance, ..UniformShooter::new(seed) }
    }

    /// Learns where photons are seen, if that is wanted and was not done before; passes have so many walks.
    pub fn learn(&mut self, target: &Target, walks_per_pass: u64) -> SceneResult<()> {
        if matches!(self.guidance, Guidance::Wanted) {
            self.guidance = Guidance::None;
            if wants_photons(target) {
                let learnt = learn_guide(target, self.seed, walks_per_pass)?;
                self.guidance = learnt.map_or(Guidance::None, Guidance::Learnt);
            }
        }
        Ok(())
    }

    /// Emits `walks` walks and adds the pass's radiance to `sums`.
    pub fn shoot(
        &mut self,
        target: &Target,
        pass: u64,
        walks: u64,
        sums: &mut PixelSums,
    ) -> SceneResult<Counters> {
        self.learn(target, walks)?;
        if !wants_photons(target) {
            return Ok(Counters::default());
        }
        let batching = target.scene.batching();
        let (mut counters, mut next, end) = (Counters::default(), 0, batching.count(walks));
        while next < end {
            let batches = if batching.concurrent { self.batches_per_round } else { 1 };
            let round = next..end.min(next + batches);
            next = round.end;
            let results =
                batching.run(walks, round, |batch| self.shoot_batch(target, pass, batch))?;
            let mut deposits = Vec::with_capacity(results.len());
            for (splat, counts) in results {
                counters.add(&counts);
                counters.add_visible(splat.visible_walks());
                deposits.push(splat.deposits);
            }
            // [Collin 2013 (2), (3)]: the sum over photons divided by the number of emitted walks.
            sums.add(&deposits, 1.0 / walks as f64);
            self.plan_round(&deposits);
        }
        counters.uniform_walks = counters.walks;
        Ok(counters)
    }

    fn shoot_batch(
        &self,
        target: &Target,
        pass: u64,
        batch: Batch,
    ) -> SceneResult<(Splat, Counters)> {
        let stream = |purpose| uniform::stream(self.seed, purpose, pass, batch.number);
        let mut numbers = Guided::new(stream(Purpose::Photons), self.guidance.guide());
        let mut tables = stream(Purpose::PhotonTables);
        let (wanted, places) = (target.wanted(), target.receivers.paths.places());
        target.shoot(batch.lanes, &mut numbers, &mut tables, wanted, || Splat::new(places))
    }

    /// Sizes the next round by what the last one held.
    fn plan_round(&mut self, deposits: &[Deposits]) {
        let total: usize = deposits.iter().map(Deposits::count).sum();
        let per_batch = total.div_ceil(deposits.len().max(1)).max(1);
        // No thread is left without a batch; how many there are in a round changes nothing but memory.
        let threads = rayon::current_num_threads() as u64;
        self.batches_per_round = ((DEPOSITS_PER_ROUND / per_batch) as u64)
            .clamp(threads, BATCHES_PER_ROUND.max(threads));
    }
}

fn wants_photons(target: &Target) -> bool {
    let wanted = target.wanted();
    wanted.surface || wanted.medium
}
