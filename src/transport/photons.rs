//! Uniform shooting: walks in batches, deposited into the receivers that they pass, and forgotten. Memory
//! does not depend on how many are shot. [Collin 2013 §5.2]

use super::counters::Counters;
use super::deposits::{Deposits, PixelSums};
use super::guided::Guided;
use super::lessons::{learn_guide, Course};
use super::splat::Splat;
use super::target::Target;
use crate::guide::EmissionGuide;
use crate::math::uniform::{self, Purpose};
use crate::plan::Connections;
use crate::scene::{Batch, SceneResult};

/// Deposits that a round of batches may hold before they are added up; bounds memory, at 20 bytes each.
const DEPOSITS_PER_ROUND: usize = 1 << 22;
/// Batches per round at most.
const BATCHES_PER_ROUND: u64 = 64;

/// Shoots the uniform photons of one pass after another.
#[derive(Debug)]
pub struct UniformShooter {
    seed: u64,
    batches_per_round: u64,
    /// Whether emission is guided.
    is_guided: bool,
    guides: Vec<Learnt>,
    /// Rounds of lessons so far.
    rounds: u64,
}

/// What was learnt about photons that leave out what these connections find.
#[derive(Debug)]
struct Learnt {
    connections: Connections,
    /// None where no photon was seen.
    guide: Option<EmissionGuide>,
    /// Walks that it might have been learnt from.
    lessons: u64,
}

impl UniformShooter {
    pub fn new(seed: u64) -> Self {
        UniformShooter::of(seed, false)
    }

    /// The same, its emission guided to where photons are seen if wanted, once that is learnt.
    pub fn of(seed: u64, is_guided: bool) -> Self {
        UniformShooter { seed, batches_per_round: 4, is_guided, guides: Vec::new(), rounds: 0 }
    }

    /// Learns where photons are seen from so many walks at most, if that is wanted and was not done before from as many.
    pub fn learn(&mut self, target: &Target, lessons: u64) -> SceneResult<()> {
        let connections = target.plan.connections;
        let is_known = |known: &Learnt| {
            known.connections.are_made_like(connections) && known.lessons >= lessons
        };
        if lessons == 0
            || !self.is_guided
            || !wants_photons(target)
            || self.guides.iter().any(is_known)
        {
            return Ok(());
        }
        let (seed, first_round) = (self.seed, self.rounds);
        let course = Course { seed, first_round, walks: lessons, guide: self.guide(target) };
        let (guide, rounds) = learn_guide(target, course)?;
        self.rounds += rounds;
        self.guides.retain(|known| !known.connections.are_made_like(connections));
        self.guides.push(Learnt { connections, guide, lessons });
        Ok(())
    }

    /// The guide for what photons carry or, if there is none, for what they carried first.
    fn guide(&self, target: &Target) -> Option<&EmissionGuide> {
        let of = |known: &&Learnt| known.connections.are_made_like(target.plan.connections);
        let known = self.guides.iter().find(of).or(self.guides.first());
        known.and_then(|known| known.guide.as_ref())
    }

    /// Emits `walks` walks and adds the pass's radiance to `sums`.
    pub fn shoot(
        &mut self,
        target: &Target,
        pass: u64,
        walks: u64,
        sums: &mut PixelSums,
    ) -> SceneResult<Counters> {
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
            sums.add(target.scene, &deposits, 1.0 / walks as f64);
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
        let mut numbers = Guided::new(stream(Purpose::Photons), self.guide(target));
        let mut tables = stream(Purpose::PhotonTables);
        let (wanted, places) = (target.wanted(), target.receivers.paths.places());
        target.shoot(batch.lanes, &mut numbers, &mut tables, wanted, || Splat::new(places))
    }

    /// Sizes the next round by what the last one held.
    fn plan_round(&mut self, deposits: &[Deposits]) {
        let total: usize = deposits.iter().map(Deposits::count).sum();
        let per_batch = total.div_ceil(deposits.len().max(1)).max(1);
        // As many for each thread, since all wait for the last one; how many there are in a round changes nothing but memory.
        let threads = rayon::current_num_threads() as u64;
        let batches = ((DEPOSITS_PER_ROUND / per_batch) as u64).min(BATCHES_PER_ROUND);
        self.batches_per_round = batches.next_multiple_of(threads).max(threads);
    }
}

fn wants_photons(target: &Target) -> bool {
    let wanted = target.wanted();
    wanted.surface || wanted.medium
}
