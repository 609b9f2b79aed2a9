//! The chains of one family, in lockstep.

use super::batches::batching;
use super::mutation::{Mutation, MutationSize};
use super::recorded::{Mutated, Record, Recorded, Replayed};
use super::state::State;
use super::trails::{Seen, Trail, Trails};
use crate::math::uniform::{self, Purpose};
use crate::scene::work;
use crate::scene::{Batching, Scene, SceneResult};
use crate::transport::counters::Counters;
use crate::transport::deposits::{Deposits, PixelSums};
use crate::transport::numbers::Numbers;
use crate::transport::photon::{Family, PerFamily};
use crate::transport::target::Target;
use rand::Rng;
use rayon::prelude::*;
use std::sync::Arc;

/// Share of the states that may be lost at new receivers before chains start anew.
const LOST_SHARE: f64 = 0.05;
/// Deposits that the states of one family may hold: 256 MiB.
const STORED_DEPOSITS: usize = 1 << 24;
/// Chains that one task gives new states.
const CHAINS_PER_TASK: usize = 2048;

#[derive(Debug, Clone, Default)]
struct Chain {
    /// Nothing but memory until the first visible walk of the uniform stream.
    state: State,
    /// Iterations of which the state is a sample and whose deposits were not made yet.
    repetitions: u32,
    /// Whether the uniform stream gave the state in this very iteration.
    is_fresh: bool,
}

impl Chain {
    fn has_state(&self) -> bool {
        !self.state.deposits.is_empty()
    }

    /// Makes the deposits that are owed.
    fn settle(&mut self, out: &mut Deposits) {
        let weight = std::mem::take(&mut self.repetitions) as f32;
        if weight > 0.0 {
            for deposit in &self.state.deposits {
                out.push(deposit.times(weight));
            }
        }
    }
}

/// What chains did, counted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
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
    pub fn add(&mut self, o: &ChainCounts) {
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
    /// Former states: memory for others.
    spares: Vec<State>,
}

/// What a group of chains did.
struct GroupResult {
    deposits: Deposits,
    counters: Counters,
    counts: ChainCounts,
    samples: u64,
    /// States that were replaced: memory for others.
    spares: Vec<State>,
}

impl GroupResult {
    fn new(places: usize) -> Self {
        let (counters, counts) = (Counters::default(), ChainCounts::default());
        let (deposits, spares) = (Deposits::new(places), Vec::new());
        GroupResult { deposits, counters, counts, samples: 0, spares }
    }
}

/// States that the uniform stream gives to a group: by iteration, the chain's number within the group and
/// its new state.
type Replacements = Vec<Vec<(usize, Arc<State>)>>;

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
    /// `sums` are empty ones for the receivers.
    pub fn new(family: Family, chains: usize, sums: PixelSums) -> Self {
        Population {
            family,
            chains: vec![Chain::default(); chains],
            offers: 0,
            size: MutationSize::default(),
            counts: ChainCounts::default(),
            samples: 0,
            sums,
            spares: Vec::new(),
        }
    }

    /// States that nobody needs any more, for their memory.
    pub fn take_spares(&mut self) -> Vec<State> {
        std::mem::take(&mut self.spares)
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
        self.chains.iter().filter(|chain| chain.has_state()).count()
    }

    /// The states of all chains that have one.
    pub fn states(&self) -> impl Iterator<Item = &State> {
        self.chains.iter().filter(|chain| chain.has_state()).map(|chain| &chain.state)
    }

    /// Walks all states again, now that radii or receivers are others, and drops those that are not seen
    /// any more. Under a smaller radius the rest is uniform on what is visible now. Under other receivers
    /// it is not where a part of that was invisible before. As large as that part is, so large, roughly, is
    /// the part that was lost: where more than `LOST_SHARE` was, all chains start anew.
    pub fn renew(
        &mut self,
        target: &Target,
        clock: &mut Clock,
        has_new_receivers: bool,
    ) -> SceneResult<Counters> {
        let (family, before) = (self.family, self.counts);
        let batching = batching(target, self.chains.len() as u64);
        let nothing = vec![(); self.chains.len().div_ceil(batching.lanes)];
        let counters = self.each_group(
            target.scene,
            batching,
            clock,
            1,
            nothing,
            |(), group, clock, result| renew_group(family, group, target, clock, result),
        )?;
        let lost = (self.counts.lost_states - before.lost_states) as f64;
        let renewed = (self.counts.renewed_walks - before.renewed_walks) as f64;
        if has_new_receivers && lost > LOST_SHARE * renewed {
            self.chains.fill(Chain::default());
            self.offers = 0;
            self.counts.restarts += 1;
        }
        Ok(counters)
    }

    /// Iterates all chains: in each iteration some are replaced by visible walks of the uniform stream
    /// (`offered`, by iteration), the others try a mutation, and every state is a sample. All iterations
    /// have one mutation size.
    pub fn iterate(
        &mut self,
        offered: Vec<Vec<State>>,
        dice: &mut impl Rng,
        target: &Target,
        clock: &mut Clock,
    ) -> SceneResult<Counters> {
        let iterations = offered.len();
        if let Some(first) = offered.iter().find(|states| !states.is_empty() && self.offers == 0) {
            self.bound_memory(first);
        }
        let batching = batching(target, self.chains.len() as u64);
        let (groups, lanes) = (self.chains.len().div_ceil(batching.lanes), batching.lanes);
        let mut replacements: Vec<Replacements> = vec![vec![Vec::new(); iterations]; groups];
        for (iteration, states) in offered.into_iter().enumerate() {
            self.exchange(states, dice, |chain, state| {
                replacements[chain / lanes][iteration].push((chain % lanes, state));
            });
        }
        let (family, size, before) = (self.family, self.size.get(), self.counts);
        let counters = self.each_group(
            target.scene,
            batching,
            clock,
            iterations,
            replacements,
            |replacements, group, clock, result| {
                for (iteration, replaced) in replacements.into_iter().enumerate() {
                    replace(group, replaced, result);
                    let clock = Clock { batch: clock.batch + iteration as u64, ..clock };
                    mutate_group(family, size, group, target, clock, result)?;
                }
                Ok(())
            },
        )?;
        self.size.adapt(
            self.counts.accepted_walks - before.accepted_walks,
            self.counts.mutated_walks - before.mutated_walks,
        );
        Ok(counters)
    }

    /// Replica exchange: offers the chains visible walks of the uniform stream and says which chain gets
    /// which.
    ///
    /// The first starts all chains, the k-th replaces a share of `1/k` of them, so that each walk offered
    /// so far holds an equal number of chains; when there are as many walks as chains, each replaces
    /// one. Which chains is decided by dice alone.
    fn exchange(
        &mut self,
        offered: Vec<State>,
        dice: &mut impl Rng,
        mut replace: impl FnMut(usize, Arc<State>),
    ) {
        let count = self.chains.len();
        for state in offered {
            self.offers += 1;
            let share = count as f64 / self.offers as f64;
            let replaced = ((share + dice.random::<f64>()) as usize).clamp(1, count);
            let state = Arc::new(state);
            for chain in rand::seq::index::sample(dice, count, replaced) {
                replace(chain, state.clone());
            }
            self.counts.exchanges += replaced as u64;
        }
    }

    /// Gives up chains whose states, with as many deposits each as the first ones offered, would not fit
    /// into [`STORED_DEPOSITS`].
    fn bound_memory(&mut self, offered: &[State]) {
        let deposits: usize = offered.iter().map(|state| state.deposits.len()).sum();
        if let Some(mean) = deposits.checked_div(offered.len()) {
            self.chains.truncate((STORED_DEPOSITS / mean.max(1)).max(1));
        }
    }

    /// Ends a pass: adds the mean over all samples, times the visible share, to `sums`.
    // [Chain normalisation]
    pub fn end_pass(&mut self, scene: &dyn Scene, visible_share: f64, sums: &mut PixelSums) {
        let mut deposits = Deposits::new(self.sums.places());
        self.chains.iter_mut().for_each(|chain| chain.settle(&mut deposits));
        self.sums.add(scene, &[deposits], 1.0);
        let samples = std::mem::take(&mut self.samples);
        let scale = if samples > 0 { visible_share / samples as f64 } else { 0.0 };
        sums.drain(&mut self.sums, scale);
    }

    /// Runs `iterations` of a step on groups of chains, each with what is given for it, and adds up what they did in their order.
    fn each_group<T: Send>(
        &mut self,
        scene: &dyn Scene,
        Batching { lanes, concurrent, .. }: Batching,
        clock: &mut Clock,
        iterations: usize,
        given: Vec<T>,
        step: impl Fn(T, &mut [Chain], Clock, &mut GroupResult) -> SceneResult<()> + Sync,
    ) -> SceneResult<Counters> {
        let groups = self.chains.len().div_ceil(lanes);
        assert_eq!(given.len(), groups, "each group is given something");
        let first = clock.take((groups * iterations) as u64);
        let places = self.sums.places();
        let run =
            |((index, group), given): ((usize, &mut [Chain]), T)| -> SceneResult<GroupResult> {
                let clock = Clock { batch: first.batch + (index * iterations) as u64, ..first };
                let mut result = GroupResult::new(places);
                step(given, group, clock, &mut result).map(|()| result)
            };
        let results: Vec<GroupResult> = if concurrent {
            let groups = self.chains.par_chunks_mut(lanes).enumerate();
            groups.zip(given).map(run).collect::<SceneResult<_>>()?
        } else {
            let groups = self.chains.chunks_mut(lanes).enumerate();
            groups.zip(given).map(run).collect::<SceneResult<_>>()?
        };
        let (mut counters, mut deposits) = (Counters::default(), Vec::new());
        for result in results {
            counters.add(&result.counters);
            self.counts.add(&result.counts);
            self.samples += result.samples;
            self.spares.extend(result.spares);
            deposits.push(result.deposits);
        }
        self.sums.add(scene, &deposits, 1.0);
        Ok(counters)
    }
}

fn only(family: Family) -> PerFamily<bool> {
    PerFamily::from_fn(|other| other == family)
}

/// Walks a batch and returns what the walks added, and their numbers.
fn trace<N: Numbers>(
    family: Family,
    walks: usize,
    numbers: N,
    target: &Target,
    clock: Clock,
) -> SceneResult<(Trail, Record, Counters)> {
    let mut numbers = Recorded::new(numbers);
    let mut tables = uniform::stream(clock.seed, Purpose::PhotonTables, clock.pass, clock.batch);
    let places = target.receivers.paths.places();
    let sink = || Trails::new(only(family), places);
    let (mut trails, counters) =
        target.shoot(walks, &mut numbers, &mut tables, only(family), sink)?;
    Ok((trails.take(family, walks), numbers.into_record(), counters))
}

fn renew_group(
    family: Family,
    group: &mut [Chain],
    target: &Target,
    clock: Clock,
    result: &mut GroupResult,
) -> SceneResult<()> {
    let with_state = || group.iter().filter(|chain| chain.has_state());
    let samples: Vec<&[f32]> = with_state().map(|chain| chain.state.sample.as_slice()).collect();
    if samples.is_empty() {
        return Ok(());
    }
    let (trail, record, counters) =
        trace(family, samples.len(), Replayed { samples }, target, clock)?;
    result.counters.add(&counters);
    let seen = Seen { trail, record: &record };
    let mut reader = seen.reader_at(0);
    for (walk, chain) in (0..).zip(group.iter_mut().filter(|chain| chain.has_state())) {
        result.counts.renewed_walks += 1;
        if reader.is_seen(walk) {
            reader.read(walk, &mut chain.state);
        } else {
            result.counts.lost_states += 1;
            *chain = Chain::default();
        }
    }
    Ok(())
}

/// Gives chains the states that were offered to them. For each of those at most one becomes spare.
fn replace(group: &mut [Chain], replaced: Vec<(usize, Arc<State>)>, result: &mut GroupResult) {
    for (chain, state) in replaced {
        let chain = &mut group[chain];
        chain.settle(&mut result.deposits);
        match Arc::try_unwrap(state) {
            Ok(state) => result.spares.push(std::mem::replace(&mut chain.state, state)),
            // One offer for several chains: the last of them gets its memory.
            Err(shared) => chain.state.copy_from(&shared),
        }
        chain.is_fresh = true;
    }
}

/// One iteration: every chain that was not replaced tries a mutation; every state is a sample.
fn mutate_group(
    family: Family,
    size: f32,
    group: &mut [Chain],
    target: &Target,
    clock: Clock,
    result: &mut GroupResult,
) -> SceneResult<()> {
    let mut mutants: Vec<&mut Chain> = Vec::new();
    for chain in group.iter_mut().filter(|chain| chain.has_state()) {
        chain.repetitions += 1;
        result.samples += 1;
        if !std::mem::take(&mut chain.is_fresh) {
            mutants.push(chain);
        }
    }
    if mutants.is_empty() {
        return Ok(());
    }
    let purpose = match family {
        Family::Surface => Purpose::SurfaceMutations,
        Family::Medium => Purpose::MediumMutations,
    };
    let numbers = Mutated {
        samples: mutants.iter().map(|chain| chain.state.sample.as_slice()).collect(),
        mutation: Mutation::of_size(size),
        rng: uniform::stream(clock.seed, purpose, clock.pass, clock.batch),
    };
    let (trail, record, counters) = trace(family, mutants.len(), numbers, target, clock)?;
    result.counters.add(&counters);
    result.counts.mutated_walks += mutants.len() as u64;
    accept(mutants, &Seen { trail, record: &record }, target.scene, result);
    Ok(())
}

/// Chains, from the walk on that the first of them has tried, and room for what they leave behind.
struct Acceptance<'a, 'b> {
    first: u32,
    chains: &'a mut [&'b mut Chain],
    accepted: u64,
    deposits: Deposits,
}

/// Gives chains the states of those of their mutations that were visible. The scene lends the threads that do it.
fn accept(
    mut chains: Vec<&mut Chain>,
    mutations: &Seen,
    scene: &dyn Scene,
    result: &mut GroupResult,
) {
    let places = result.deposits.places();
    let parts = (0..).step_by(CHAINS_PER_TASK).zip(chains.chunks_mut(CHAINS_PER_TASK));
    let task = |(first, chains)| Acceptance {
        first,
        chains,
        accepted: 0,
        deposits: Deposits::new(places),
    };
    let mut tasks: Vec<Acceptance> = parts.map(task).collect();
    work::for_each(scene, tasks.iter_mut().collect(), |task| task.run(mutations));
    for task in tasks {
        result.counts.accepted_walks += task.accepted;
        result.deposits.append(task.deposits);
    }
}

impl Acceptance<'_, '_> {
    fn run(&mut self, mutations: &Seen) {
        let mut reader = mutations.reader_at(self.first);
        for (walk, chain) in (self.first..).zip(&mut *self.chains) {
            if reader.is_seen(walk) {
                // This iteration is a sample of the new state.
                chain.repetitions -= 1;
                chain.settle(&mut self.deposits);
                reader.read(walk, &mut chain.state);
                chain.repetitions = 1;
                self.accepted += 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rgb;
    use crate::transport::deposits::Deposit;
    use rand_pcg::Pcg64Mcg;

    const CHAINS: usize = 50;

    fn state(number: u32) -> State {
        let deposit = Deposit { pixel: 0, radiance: Rgb::ONE, bias: 0.0 };
        State { sample: vec![number as f32], deposits: vec![deposit] }
    }

    /// However often chains start anew, no more states become spare than were offered: memory stays.
    #[test]
    fn spare_states_are_no_more_than_offers() {
        let mut dice = uniform::stream(3, Purpose::MediumExchange, 0, 0);
        let mut population = Population::new(Family::Medium, CHAINS, PixelSums::new(1));
        for start in 0..20 {
            population.chains.fill(Chain::default());
            population.offers = 0;
            for round in 0..3 {
                let offers = (0..7).map(|offer| state(100 * start + 10 * round + offer)).collect();
                let spares = offer(&mut population, offers, &mut dice);
                assert!(spares <= 7, "{spares} states are spare after 7 offers");
                assert_eq!(population.active(), CHAINS);
            }
        }
    }

    /// Offers these states and returns how many became spare.
    fn offer(population: &mut Population, states: Vec<State>, dice: &mut Pcg64Mcg) -> usize {
        let (mut replaced, mut result) = (Vec::new(), GroupResult::new(1));
        population.exchange(states, dice, |chain, state| replaced.push((chain, state)));
        replace(&mut population.chains, replaced, &mut result);
        result.spares.len()
    }
}
