//! Shoots a pass by the uniform stream and, for each family that profits, by chains.

use super::batches::batching;
use super::chains::{ChainCounts, Clock, Population};
use super::recorded::Recorded;
use super::state::State;
use super::trails::{Seen, Trails};
use crate::math::uniform::{self, Purpose};
use crate::plan::Steering;
use crate::scene::{Batch, SceneResult};
use crate::transport::counters::Counters;
use crate::transport::deposits::{Deposits, PixelSums};
use crate::transport::numbers::Uniform;
use crate::transport::photon::{Family, PerFamily};
use crate::transport::photons::UniformShooter;
use crate::transport::target::Target;
use serde::{Deserialize, Serialize};
use std::sync::Mutex;

/// Where the visible share is larger, `auto` shoots uniformly: a chain's states resemble one another, so
/// that some twenty mutations are worth one independent walk.
const UNIFORM_ABOVE: f64 = 0.05;
/// `auto` probes with the first pass's walks divided by this.
const PROBE_SHARE: u64 = 10;
/// Effort of the uniform stream for one of the chains.
const UNIFORM_EFFORT: f64 = 0.5;
/// Iterations per pass that the automatic number of chains leaves room for. The fewer chains, the further
/// each gets; but a renderer that computes a batch in one kernel wants it full.
const ITERATIONS_ALONE: u64 = 256;
const ITERATIONS_BY_KERNEL: u64 = 32;
/// Iterations and walks of a round where threads work side by side, and rounds that a pass has at least.
const ITERATIONS_PER_ROUND: u64 = 16;
const WALKS_PER_ROUND: u64 = 4096;
const ROUNDS: u64 = 8;
/// The automatic number of chains: at least this many, and at most what keeps threads or a kernel busy. More
/// would cost memory, and each would get less far.
const FEWEST_CHAINS: u64 = 64;
const MOST_CHAINS_ALONE: u64 = 1 << 10;
const MOST_CHAINS_BY_KERNEL: u64 = 1 << 16;

/// How one family is shot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// Nothing of this family can be seen: there are no receivers.
    #[default]
    Off,
    Uniform,
    Metropolis,
}

/// What is known of one family's shooting so far.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct FamilyReport {
    /// In the last pass.
    pub mode: Mode,
    /// Share of the uniform stream's walks that were visible, over all passes.
    pub visible_share: f64,
    pub visible_walks: u64,
    /// What the share is one of.
    pub uniform_walks: u64,
    pub chains: usize,
    /// Share of all mutations that were accepted.
    pub acceptance: f64,
    pub mutation_size: f32,
    #[serde(flatten)]
    pub counts: ChainCounts,
}

impl FamilyReport {
    /// Of these passes and later ones together.
    pub fn and(self, later: FamilyReport) -> FamilyReport {
        let mut counts = self.counts;
        counts.add(&later.counts);
        let visible_walks = self.visible_walks + later.visible_walks;
        let uniform_walks = self.uniform_walks + later.uniform_walks;
        FamilyReport {
            visible_share: share(visible_walks, uniform_walks),
            visible_walks,
            uniform_walks,
            acceptance: share(counts.accepted_walks, counts.mutated_walks),
            counts,
            ..later
        }
    }
}

/// Shoots the photons of one pass after another.
#[derive(Debug)]
pub struct ChainShooter {
    seed: u64,
    /// Chains per family; 0 = from the photons per pass.
    chains: u64,
    uniform: UniformShooter,
    populations: PerFamily<Option<Population>>,
    modes: PerFamily<Mode>,
    /// Visible share of the last pass; none before the first.
    last_share: Option<PerFamily<f64>>,
    total: Counters,
    /// Uniform walks for each mutated one.
    balance: f64,
    has_new_receivers: bool,
    /// Former states of chains: memory for those that the uniform stream offers.
    spares: Mutex<Vec<State>>,
}

/// What a pass has so far from its two streams; `splat` holds what families without chains add.
struct Streams<'a> {
    splat: &'a mut PixelSums,
    uniform: &'a mut Counters,
    mutated: &'a mut Counters,
}

/// A batch of the uniform stream.
struct Offer {
    /// Visible walks by their number within the job.
    states: PerFamily<Vec<(u64, State)>>,
    splat: Deposits,
    counters: Counters,
}

impl ChainShooter {
    pub fn new(seed: u64, chains: u64) -> Self {
        ChainShooter {
            seed,
            chains,
            uniform: UniformShooter::new(seed),
            populations: PerFamily::default(),
            modes: PerFamily::default(),
            last_share: None,
            total: Counters::default(),
            balance: 1.0,
            has_new_receivers: true,
            spares: Mutex::default(),
        }
    }

    /// Says that the next pass shoots at other receivers.
    pub fn receivers_changed(&mut self) {
        self.has_new_receivers = true;
    }

    pub fn population(&self, family: Family) -> Option<&Population> {
        self.populations[family].as_ref()
    }

    pub fn report(&self) -> PerFamily<FamilyReport> {
        PerFamily::from_fn(|family| {
            let population = self.populations[family].as_ref();
            let counts = population.map(Population::counts).unwrap_or_default();
            let visible_walks = self.total.visible_walks[family];
            FamilyReport {
                mode: self.modes[family],
                visible_share: share(visible_walks, self.total.uniform_walks),
                visible_walks,
                uniform_walks: self.total.uniform_walks,
                chains: population.map_or(0, Population::chain_count),
                acceptance: share(counts.accepted_walks, counts.mutated_walks),
                mutation_size: population.map_or(0.0, Population::mutation_size),
                counts,
            }
        })
    }

    /// Shoots about `walks` walks, mutations included, and adds the pass's radiance to `sums`.
    pub fn shoot(
        &mut self,
        target: &Target,
        pass: u64,
        walks: u64,
        sums: &mut PixelSums,
    ) -> SceneResult<Counters> {
        let mut probe = Counters::default();
        if target.plan.steering == Steering::Measured && self.last_share.is_none() {
            probe = self.probe(target, walks)?;
        }
        self.modes = self.choose_modes(target);
        let with_chains = Family::ALL.iter().any(|&f| self.modes[f] == Mode::Metropolis);
        let mut counters = if with_chains {
            self.shoot_with_chains(target, pass, walks, sums)?
        } else {
            self.uniform.shoot(target, pass, walks, sums)?
        };
        self.has_new_receivers = false;
        self.last_share = Some(visible_share(&counters));
        self.total.add(&counters);
        counters.add(&probe);
        Ok(counters)
    }

    /// Measures the visible shares with a few uniform walks and discards what they add: kept, the picture of
    /// a first pass without chains would be as noisy as all later ones are not.
    fn probe(&mut self, target: &Target, walks: u64) -> SceneResult<Counters> {
        let mut clock = Clock { seed: self.seed, pass: u64::MAX, batch: 0 };
        let mut counters = Counters::default();
        for offer in self.shoot_uniform(target, (walks / PROBE_SHARE).max(1), &mut clock)? {
            counters.add(&offer.counters);
        }
        self.last_share = Some(visible_share(&counters));
        Ok(counters)
    }

    fn choose_modes(&self, target: &Target) -> PerFamily<Mode> {
        let wanted = target.wanted();
        let rarely_seen =
            |family| self.last_share.is_some_and(|share| share[family] < UNIFORM_ABOVE);
        PerFamily::from_fn(|family| match (wanted[family], target.plan.steering) {
            (false, _) => Mode::Off,
            (true, Steering::Always) => Mode::Metropolis,
            (true, Steering::Measured) if rarely_seen(family) => Mode::Metropolis,
            (true, Steering::Measured | Steering::Never) => Mode::Uniform,
        })
    }

    fn shoot_with_chains(
        &mut self,
        target: &Target,
        pass: u64,
        walks: u64,
        sums: &mut PixelSums,
    ) -> SceneResult<Counters> {
        let mut counters = Counters::default();
        let mut clock = Clock { seed: self.seed, pass, batch: 0 };
        let mut splat = target.receivers.paths.new_sums();
        self.prepare(target, walks, &mut clock, &mut counters)?;
        let uniform_walks = self.uniform_walks_per_iteration().min(walks);
        let iterations = self.iterations_per_round(target, walks, uniform_walks);
        let (mut uniform, mut mutated) = (Counters::default(), Counters::default());
        loop {
            let before = uniform.walks + mutated.walks;
            let mut sums =
                Streams { splat: &mut splat, uniform: &mut uniform, mutated: &mut mutated };
            self.round(target, iterations, uniform_walks, &mut clock, &mut sums)?;
            let done = uniform.walks + mutated.walks;
            // The pass ends where another round like this one would overshoot by more than it adds.
            if done + (done - before) / 2 >= walks {
                break;
            }
        }
        self.balance = balance(&uniform, &mutated);
        counters.add(&uniform);
        counters.add(&mutated);
        sums.drain(&mut splat, 1.0 / counters.uniform_walks as f64);
        for (family, population) in self.in_use() {
            let visible = counters.visible_walks[family];
            let visible_share = share(visible, counters.uniform_walks);
            population.end_pass(target.scene, visible_share, sums);
        }
        Ok(counters)
    }

    /// The populations of the families that have chains in this pass.
    fn in_use(&mut self) -> impl Iterator<Item = (Family, &mut Population)> {
        let modes = self.modes;
        let with_chains = move |family: Family| modes[family] == Mode::Metropolis;
        self.populations.iter_mut().filter_map(move |(family, population)| {
            population.as_mut().filter(|_| with_chains(family)).map(|own| (family, own))
        })
    }

    /// Makes populations, or renews their states under new radii and at new receivers.
    fn prepare(
        &mut self,
        target: &Target,
        walks: u64,
        clock: &mut Clock,
        counters: &mut Counters,
    ) -> SceneResult<()> {
        let chains = self.chain_count(walks, target.scene.batching().concurrent);
        let (modes, has_new_receivers) = (self.modes, self.has_new_receivers);
        for (family, population) in self.populations.iter_mut() {
            if modes[family] == Mode::Metropolis && population.is_none() {
                *population = Some(Population::new(
                    family,
                    chains as usize,
                    target.receivers.paths.new_sums(),
                ));
            }
        }
        for (_, population) in self.in_use() {
            counters.add(&population.renew(target, clock, has_new_receivers)?);
        }
        Ok(())
    }

    /// As many chains as leave room for several iterations of uniform walks and of both families'
    /// mutations, unless the number is given.
    fn chain_count(&self, walks: u64, concurrent: bool) -> u64 {
        let (iterations, most) = if concurrent {
            (ITERATIONS_ALONE, MOST_CHAINS_ALONE)
        } else {
            (ITERATIONS_BY_KERNEL, MOST_CHAINS_BY_KERNEL)
        };
        match self.chains {
            0 => (walks / (3 * iterations)).clamp(FEWEST_CHAINS, most),
            given => given,
        }
    }

    /// Fixed for the whole pass by what was before it, so that the visible share stays unbiased.
    fn uniform_walks_per_iteration(&mut self) -> u64 {
        let balance = self.balance;
        let chains: usize = self.in_use().map(|(_, population)| population.chain_count()).sum();
        ((chains as f64 * balance) as u64).max(1)
    }

    /// Rounds give threads that work side by side something to do, but leave several to a pass, and hold the
    /// deposits of their walks.
    fn iterations_per_round(&mut self, target: &Target, walks: u64, uniform_walks: u64) -> u64 {
        if !target.scene.batching().concurrent {
            return 1;
        }
        let chains: usize = self.in_use().map(|(_, population)| population.chain_count()).sum();
        let per_iteration = uniform_walks + chains as u64;
        let most = (WALKS_PER_ROUND / per_iteration).min(walks / per_iteration / ROUNDS);
        most.clamp(1, ITERATIONS_PER_ROUND)
    }

    // [Hachisuka 2011], all chains at once
    fn round(
        &mut self,
        target: &Target,
        iterations: u64,
        uniform_walks: u64,
        clock: &mut Clock,
        sums: &mut Streams,
    ) -> SceneResult<()> {
        let mut offers = self.shoot_uniform(target, iterations * uniform_walks, clock)?;
        offers.iter().for_each(|offer| sums.uniform.add(&offer.counters));
        for (family, population) in self.in_use() {
            let purpose = match family {
                Family::Surface => Purpose::SurfaceExchange,
                Family::Medium => Purpose::MediumExchange,
            };
            let mut dice = uniform::stream(clock.seed, purpose, clock.pass, clock.batch);
            let mut offered = vec![Vec::new(); iterations as usize];
            for (walk, state) in offers.iter_mut().flat_map(|offer| offer.states[family].drain(..))
            {
                offered[(walk / uniform_walks) as usize].push(state);
            }
            sums.mutated.add(&population.iterate(offered, &mut dice, target, clock)?);
        }
        let spares = self.populations.iter_mut().filter_map(|(_, population)| population.as_mut());
        let spares = spares.flat_map(Population::take_spares);
        self.spares.get_mut().expect("no thread panicked").extend(spares);
        let deposits: Vec<Deposits> = offers.into_iter().map(|offer| offer.splat).collect();
        sums.splat.add(target.scene, &deposits, 1.0);
        Ok(())
    }

    /// Walks of the uniform stream: states for the families with chains, deposits for the others.
    fn shoot_uniform(
        &self,
        target: &Target,
        walks: u64,
        clock: &mut Clock,
    ) -> SceneResult<Vec<Offer>> {
        let batching = batching(target, walks);
        let first = clock.take(batching.count(walks));
        batching.run_all(walks, |batch| {
            self.offer(target, batch, Clock { batch: first.batch + batch.number, ..first })
        })
    }

    fn offer(&self, target: &Target, batch: Batch, clock: Clock) -> SceneResult<Offer> {
        let stream = |purpose| uniform::stream(clock.seed, purpose, clock.pass, clock.batch);
        let mut numbers = Recorded::new(Uniform(stream(Purpose::Photons)));
        let mut tables = stream(Purpose::PhotonTables);
        let has_chains = PerFamily::from_fn(|family| self.modes[family] == Mode::Metropolis);
        let wanted = target.wanted();
        let places = target.receivers.paths.places();
        let sink = || Trails::new(has_chains, places);
        let (mut trails, mut counters) =
            target.shoot(batch.lanes, &mut numbers, &mut tables, wanted, sink)?;
        let record = &numbers.into_record();
        let states = PerFamily::from_fn(|family| -> Vec<(u64, State)> {
            if !has_chains[family] {
                return Vec::new();
            }
            let seen = Seen { trail: trails.take(family, batch.lanes), record };
            let states = seen.states(target.scene, &self.spares);
            states.into_iter().map(|(walk, state)| (batch.first + u64::from(walk), state)).collect()
        });
        let splat = trails.into_splat();
        counters.uniform_walks = counters.walks;
        counters.add_visible(splat.visible_walks());
        counters.add_visible(PerFamily::from_fn(|family| states[family].len() as u64));
        Ok(Offer { states, splat: splat.deposits, counters })
    }
}

/// Uniform walks for each mutated one, such that the uniform stream takes [`UNIFORM_EFFORT`] of what the
/// chains take. Where little is visible, uniform walks often end at once and mutated ones do not; one for
/// one, the stream that finds new places and measures the visible share would starve.
fn balance(uniform: &Counters, mutated: &Counters) -> f64 {
    let cost = |of: &Counters| of.effort() as f64 / of.walks.max(1) as f64;
    if mutated.walks == 0 {
        return 1.0;
    }
    (UNIFORM_EFFORT * cost(mutated) / cost(uniform).max(1.0)).max(UNIFORM_EFFORT)
}

fn visible_share(counters: &Counters) -> PerFamily<f64> {
    PerFamily::from_fn(|family| share(counters.visible_walks[family], counters.uniform_walks))
}

fn share(part: u64, whole: u64) -> f64 {
    if whole == 0 {
        0.0
    } else {
        part as f64 / whole as f64
    }
}
