//! The chains of one family, in lockstep.

use super::mutation::MutationSize;
use super::recorded::{Mutated, PrimarySample, Recorded, Replayed};
use super::shooter::batching;
use super::trails::Trails;
use crate::math::uniform::{self, Purpose};
use crate::scene::SceneResult;
use crate::transport::counters::Counters;
use crate::transport::deposits::{Deposit, Deposits, PixelSums};
use crate::transport::gather::Target;
use crate::transport::numbers::Numbers;
use crate::transport::photon::{Family, PerFamily};
use rand::Rng;
use rayon::prelude::*;
use std::sync::Arc;

/// Share of the states that may be lost at new receivers before chains start anew.
const LOST_SHARE: f64 = 0.05;

/// A visible walk and what it adds to the picture.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    pub sample: PrimarySample,
    pub deposits: Vec<Deposit>,
}

#[derive(Debug, Clone, Default)]
struct Chain {
    /// None until the first visible walk of the uniform stream. Chains that start from one walk share it.
    state: Option<Arc<State>>,
    /// Iterations of which the state is a sample and whose deposits were not made yet.
    repetitions: u32,
    /// Whether the uniform stream gave the state in this very iteration.
    is_fresh: bool,
}

impl Chain {
    /// Makes the deposits that are owed and forgets the state.
    fn leave(&mut self, out: &mut Deposits) -> Option<Arc<State>> {
        let state = self.state.take()?;
        let weight = std::mem::take(&mut self.repetitions) as f32;
        if weight > 0.0 {
            for deposit in &state.deposits {
                out.push(Deposit { radiance: deposit.radiance * weight, ..*deposit });
            }
        }
        Some(state)
    }
}

/// What chains did, counted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize)]
pub struct ChainCounts {
    /// Mutations tried, and those that were visible and became states.
    pub mutated_walks: u64,
    pub accepted_walks: u64,
    /// States that were taken over from the uniform stream.
    pub exchanges: u64,
    /// States that were walked again under a smaller radius, and those that were no longer visible.
    pub renewed_walks: u64,
    pub lost_states: u64,
    /// Times that all chains started anew, because too many states were lost at once.
    pub restarts: u64,
}

impl ChainCounts {
    fn add(&mut self, o: &ChainCounts) {
        self.mutated_walks += o.mutated_walks;
        self.accepted_walks += o.accepted_walks;
        self.exchanges += o.exchanges;
        self.renewed_walks += o.renewed_walks;
        self.lost_states += o.lost_states;
        self.restarts += o.restarts;
    }
}

/// Chains of one family, and the sums of the pass that is under way.
#[derive(Debug)]
pub struct Population {
    family: Family,
    chains: Vec<Chain>,
    /// Visible walks that the uniform stream has offered since the chains started.
    offers: u64,
    size: MutationSize,
    counts: ChainCounts,
    /// Iterations of this pass, summed over the chains that had a state.
    samples: u64,
    sums: PixelSums,
}

/// What a group of chains did in one step.
#[derive(Default)]
struct GroupResult {
    deposits: Vec<Deposits>,
    counters: Counters,
    counts: ChainCounts,
    samples: u64,
}

/// Numbers each batch of a pass, so that no two draw from one stream.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    pub seed: u64,
    pub pass: u64,
    pub batch: u64,
}

impl Clock {
    /// Takes `count` numbers of batches.
    pub fn take(&mut self, count: u64) -> Clock {
        let first = *self;
        self.batch += count;
        first
    }
}

impl Population {
    pub fn new(family: Family, chains: usize, pixels: usize) -> Self {
        Population {
            family,
            chains: vec![Chain::default(); chains],
            offers: 0,
            size: MutationSize::default(),
            counts: ChainCounts::default(),
            samples: 0,
            sums: PixelSums::new(pixels),
        }
    }

    pub fn counts(&self) -> ChainCounts {
        self.counts
    }

    pub fn mutation_size(&self) -> f32 {
        self.size.get()
    }

    pub fn chain_count(&self) -> usize {
        self.chains.len()
    }

    /// Chains that have a state.
    pub fn active(&self) -> usize {
        self.chains.iter().filter(|chain| chain.state.is_some()).count()
    }

    /// The states of all chains that have one.
    pub fn states(&self) -> impl Iterator<Item = &State> {
        self.chains.iter().filter_map(|chain| chain.state.as_deref())
    }

    /// Walks all states again, now that radii or receivers are others, and drops those that are not seen
    /// any more. Under a smaller radius the rest is uniform on what is visible now. Under other receivers
    /// it is not where a part of that was invisible before. As large as that part is, so large, roughly, is
    /// the part that was lost: where more than [`LOST_SHARE`] was, all chains start anew.
    pub fn renew(
        &mut self,
        target: &Target,
        clock: &mut Clock,
        has_new_receivers: bool,
    ) -> SceneResult<Counters> {
        let (family, before) = (self.family, self.counts);
        let counters = self
            .each_group(target, clock, |group, clock| renew_group(family, group, target, clock))?;
        let lost = (self.counts.lost_states - before.lost_states) as f64;
        let renewed = (self.counts.renewed_walks - before.renewed_walks) as f64;
        if has_new_receivers && lost > LOST_SHARE * renewed {
            self.chains.fill(Chain::default());
            self.offers = 0;
            self.counts.restarts += 1;
        }
        Ok(counters)
    }

    /// Replica exchange: offers the chains visible walks of the uniform stream.
    ///
    /// The first starts all chains, the k-th replaces a share of `1/k` of them, so that each walk offered
    /// so far holds an equal number of chains; when there are as many walks as chains, each replaces
    /// one. Which chains is decided by dice alone.
    pub fn exchange(&mut self, offered: Vec<State>, rng: &mut impl Rng) {
        let mut deposits = Deposits::new(self.sums.len());
        let count = self.chains.len();
        for state in offered {
            self.offers += 1;
            let share = count as f64 / self.offers as f64;
            let replaced = ((share + rng.random::<f64>()) as usize).clamp(1, count);
            let state = Arc::new(state);
            for index in rand::seq::index::sample(rng, count, replaced) {
                let chain = &mut self.chains[index];
                chain.leave(&mut deposits);
                *chain = Chain { state: Some(state.clone()), repetitions: 0, is_fresh: true };
            }
            self.counts.exchanges += replaced as u64;
        }
        self.sums.add(&[deposits], 1.0);
    }

    /// One iteration: every chain that was not replaced tries a mutation; every state is a sample.
    pub fn mutate(&mut self, target: &Target, clock: &mut Clock) -> SceneResult<Counters> {
        let (family, size, before) = (self.family, self.size.get(), self.counts);
        let counters = self.each_group(target, clock, |group, clock| {
            mutate_group(family, size, group, target, clock)
        })?;
        self.size.adapt(
            self.counts.accepted_walks - before.accepted_walks,
            self.counts.mutated_walks - before.mutated_walks,
        );
        Ok(counters)
    }

    /// Ends a pass: adds the mean over all samples, times the visible share, to `sums`.
    // [Chain normalisation]
    pub fn end_pass(&mut self, visible_share: f64, sums: &mut PixelSums) {
        let mut deposits = Deposits::new(self.sums.len());
        for chain in &mut self.chains {
            if let Some(state) = chain.leave(&mut deposits) {
                chain.state = Some(state);
            }
        }
        self.sums.add(&[deposits], 1.0);
        let samples = std::mem::take(&mut self.samples);
        let scale = if samples > 0 { visible_share / samples as f64 } else { 0.0 };
        sums.drain(&mut self.sums, scale);
    }

    /// Runs a step on all chains, a batch of lanes at a time, and adds up what the groups did in their
    /// order.
    fn each_group(
        &mut self,
        target: &Target,
        clock: &mut Clock,
        step: impl Fn(&mut [Chain], Clock) -> SceneResult<GroupResult> + Sync,
    ) -> SceneResult<Counters> {
        let batching = batching(target);
        let first = clock.take(self.chains.len().div_ceil(batching.lanes) as u64);
        let at = |index: usize| Clock { batch: first.batch + index as u64, ..first };
        let results: Vec<GroupResult> = if batching.concurrent {
            let groups = self.chains.par_chunks_mut(batching.lanes).enumerate();
            groups.map(|(index, group)| step(group, at(index))).collect::<SceneResult<_>>()?
        } else {
            let groups = self.chains.chunks_mut(batching.lanes).enumerate();
            groups.map(|(index, group)| step(group, at(index))).collect::<SceneResult<_>>()?
        };
        let (mut counters, mut deposits) = (Counters::default(), Vec::new());
        for mut result in results {
            counters.add(&result.counters);
            deposits.append(&mut result.deposits);
            self.counts.add(&result.counts);
            self.samples += result.samples;
        }
        self.sums.add(&deposits, 1.0);
        Ok(counters)
    }
}

fn only(family: Family) -> PerFamily<bool> {
    PerFamily::from_fn(|other| other == family)
}

/// Walks a batch and returns the visible walks with their states.
fn trace<N: Numbers>(
    family: Family,
    walks: usize,
    numbers: N,
    target: &Target,
    clock: Clock,
) -> SceneResult<(Vec<(u32, State)>, Counters)> {
    let mut numbers = Recorded::new(numbers);
    let mut tables = uniform::stream(clock.seed, Purpose::PhotonTables, clock.pass, clock.batch);
    let pixels = target.receivers.pixels();
    let sink = || Trails::new(only(family), pixels);
    let (mut trails, counters) =
        target.shoot(walks, &mut numbers, &mut tables, only(family), sink)?;
    let states = trails
        .take(family)
        .into_iter()
        .map(|(walk, deposits)| (walk, State { sample: numbers.of_walk(walk), deposits }))
        .collect();
    Ok((states, counters))
}

fn renew_group(
    family: Family,
    group: &mut [Chain],
    target: &Target,
    clock: Clock,
) -> SceneResult<GroupResult> {
    let mut result = GroupResult::default();
    let old: Vec<_> = group
        .iter_mut()
        .filter_map(|chain| chain.state.take().map(|state| (chain, state)))
        .collect();
    if old.is_empty() {
        return Ok(result);
    }
    let samples = old.iter().map(|(_, state)| state.sample.as_slice()).collect();
    let (seen, counters) = trace(family, old.len(), Replayed { samples }, target, clock)?;
    result.counters = counters;
    result.counts.renewed_walks = old.len() as u64;
    result.counts.lost_states = (old.len() - seen.len()) as u64;
    let mut chains: Vec<_> = old.into_iter().map(|(chain, _)| chain).collect();
    for (walk, state) in seen {
        chains[walk as usize].state = Some(Arc::new(state));
    }
    Ok(result)
}

fn mutate_group(
    family: Family,
    size: f32,
    group: &mut [Chain],
    target: &Target,
    clock: Clock,
) -> SceneResult<GroupResult> {
    let mut result = GroupResult::default();
    let mut mutants: Vec<&mut Chain> = Vec::new();
    for chain in group.iter_mut().filter(|chain| chain.state.is_some()) {
        chain.repetitions += 1;
        result.samples += 1;
        if !std::mem::take(&mut chain.is_fresh) {
            mutants.push(chain);
        }
    }
    if mutants.is_empty() {
        return Ok(result);
    }
    let purpose = match family {
        Family::Surface => Purpose::SurfaceMutations,
        Family::Medium => Purpose::MediumMutations,
    };
    let known: Vec<Arc<State>> = mutants.iter().filter_map(|chain| chain.state.clone()).collect();
    let numbers = Mutated {
        samples: known.iter().map(|state| state.sample.as_slice()).collect(),
        size,
        rng: uniform::stream(clock.seed, purpose, clock.pass, clock.batch),
    };
    let (seen, counters) = trace(family, mutants.len(), numbers, target, clock)?;
    result.counters = counters;
    result.counts.mutated_walks = mutants.len() as u64;
    result.counts.accepted_walks = seen.len() as u64;
    let mut deposits = Deposits::new(target.receivers.pixels());
    for (walk, state) in seen {
        let chain = &mut *mutants[walk as usize];
        // This iteration is a sample of the new state.
        chain.repetitions -= 1;
        chain.leave(&mut deposits);
        chain.state = Some(Arc::new(state));
        chain.repetitions = 1;
    }
    result.deposits.push(deposits);
    Ok(result)
}
