//! Deposits kept by walk, for as long as a chain may have to repeat them.

use super::recorded::{Reader, Record};
use super::state::State;
use crate::math::Rgb;
use crate::scene::work;
use crate::scene::Scene;
use crate::transport::deposits::{Deposit, Sink};
use crate::transport::photon::{Family, PerFamily};
use crate::transport::splat::Splat;
use std::sync::Mutex;

/// States that one task makes.
const STATES_PER_TASK: usize = 1024;

/// Deposits of the families that have chains, by walk; those of the others are splatted.
pub struct Trails {
    has_chains: PerFamily<bool>,
    trails: PerFamily<Vec<(u32, Deposit)>>,
    splat: Splat,
}

impl Trails {
    pub fn new(has_chains: PerFamily<bool>, places: usize) -> Self {
        Trails { has_chains, trails: PerFamily::default(), splat: Splat::new(places) }
    }

    /// Takes out what each of so many walks added in a family with chains.
    pub fn take(&mut self, family: Family, walks: usize) -> Trail {
        Trail::new(std::mem::take(&mut self.trails[family]), walks)
    }

    /// The deposits of families without chains.
    pub fn into_splat(self) -> Splat {
        self.splat
    }
}

/// Deposits of one family by walk, those of each in their order.
pub struct Trail {
    /// Where those of each walk end, and those of the next begin.
    ends: Vec<u32>,
    deposits: Vec<Deposit>,
}

impl Trail {
    fn new(found: Vec<(u32, Deposit)>, walks: usize) -> Self {
        let mut ends = vec![0; walks];
        found.iter().for_each(|&(walk, _)| ends[walk as usize] += 1);
        let mut begin = 0;
        for end in &mut ends {
            begin += std::mem::replace(end, begin);
        }
        let nothing = Deposit { pixel: 0, radiance: Rgb::ZERO, bias: 0.0 };
        let mut deposits = vec![nothing; found.len()];
        for (walk, deposit) in found {
            let next = &mut ends[walk as usize];
            deposits[*next as usize] = deposit;
            *next += 1;
        }
        Trail { ends, deposits }
    }

    /// What a walk added.
    fn of(&self, walk: u32) -> &[Deposit] {
        let begin = walk.checked_sub(1).map_or(0, |before| self.ends[before as usize]);
        &self.deposits[begin as usize..self.ends[walk as usize] as usize]
    }
}

/// What walks of a batch added in one family, and the numbers that they used.
pub struct Seen<'a> {
    pub trail: Trail,
    pub record: &'a Record,
}

impl Seen<'_> {
    /// Reads the states of one walk after another, from this one on.
    pub fn reader_at(&self, first: u32) -> StateReader<'_> {
        StateReader { trail: &self.trail, numbers: self.record.reader_at(first) }
    }

    /// The walks that added something, and their states, made of spare ones. The scene lends the threads that make them.
    pub fn states(&self, scene: &dyn Scene, spares: &Mutex<Vec<State>>) -> Vec<(u32, State)> {
        let walks = 0..self.trail.ends.len() as u32;
        let seen = walks.filter(|&walk| !self.trail.of(walk).is_empty());
        let mut states: Vec<_> = {
            let mut spares = spares.lock().expect("no thread panicked");
            seen.map(|walk| (walk, spares.pop().unwrap_or_default())).collect()
        };
        work::for_each(scene, states.chunks_mut(STATES_PER_TASK).collect(), |states| {
            let mut reader = self.reader_at(states[0].0);
            states.iter_mut().for_each(|(walk, state)| reader.read(*walk, state));
        });
        states
    }
}

/// Reads the states of walks in their order.
pub struct StateReader<'a> {
    trail: &'a Trail,
    numbers: Reader<'a>,
}

impl StateReader<'_> {
    /// Whether a walk added something.
    pub fn is_seen(&self, walk: u32) -> bool {
        !self.trail.of(walk).is_empty()
    }

    /// Replaces a state by that of a walk which comes behind those that were read before.
    pub fn read(&mut self, walk: u32, state: &mut State) {
        self.numbers.read(walk, &mut state.sample);
        state.deposits.clear();
        state.deposits.extend_from_slice(self.trail.of(walk));
    }
}

impl Sink for Trails {
    fn push(&mut self, walk: u32, family: Family, deposit: Deposit) {
        if self.has_chains[family] {
            self.trails[family].push((walk, deposit));
        } else {
            self.splat.push(walk, family, deposit);
        }
    }

    fn append(&mut self, mut other: Self) {
        self.splat.append(other.splat);
        for family in Family::ALL {
            self.trails[family].append(&mut other.trails[family]);
        }
    }
}
