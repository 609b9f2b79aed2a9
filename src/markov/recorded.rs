//! Numbers that are kept, replayed or mutated.

use super::mutation::Mutation;
use crate::math::uniform;
use crate::scene::work;
use crate::scene::{Scene, EMIT_DIMENSIONS, EMIT_SEED, PHOTON_STEP_DIMENSIONS};
use crate::transport::numbers::{Alive, Numbers};
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use std::ops::Range;

/// Lanes whose numbers one task draws.
const LANES_PER_TASK: usize = 2048;
/// And those of which several steps are computed at once.
const LANES_AT_ONCE: usize = 64;

/// The numbers that a walk has used: [`EMIT_DIMENSIONS`], then [`PHOTON_STEP_DIMENSIONS`] per step.
pub type PrimarySample = Vec<f32>;

/// Keeps what another source gives.
pub struct Recorded<N> {
    source: N,
    record: Record,
}

/// The numbers of a batch of walks.
#[derive(Default)]
pub struct Record {
    emission: Vec<f32>,
    blocks: Vec<Block>,
}

/// The numbers of steps that were taken in one go.
struct Block {
    /// Walks that were alive before the first of them.
    walks: Vec<u32>,
    /// [`PHOTON_STEP_DIMENSIONS`] for each step.
    planes: Vec<f32>,
}

impl<N: Numbers> Recorded<N> {
    pub fn new(source: N) -> Self {
        Recorded { source, record: Record::default() }
    }

    /// What was kept.
    pub fn into_record(self) -> Record {
        self.record
    }
}

impl Record {
    /// Reads numbers of one walk after another, from this one on.
    pub fn reader_at(&self, first: u32) -> Reader<'_> {
        let lane_in = |block: &Block| block.walks.partition_point(|&walk| walk < first);
        Reader { record: self, lanes: self.blocks.iter().map(lane_in).collect() }
    }
}

/// Reads the numbers of walks in their order.
pub struct Reader<'a> {
    record: &'a Record,
    /// By block, the first lane that the next walk may have.
    lanes: Vec<usize>,
}

impl Reader<'_> {
    /// Replaces a sample by all numbers that a walk has used, which comes behind those that were asked for before.
    pub fn read(&mut self, walk: u32, sample: &mut PrimarySample) {
        sample.clear();
        let emission = &self.record.emission;
        sample.extend(lane_of(emission, emission.len() / EMIT_DIMENSIONS, walk as usize));
        for (Block { walks, planes }, lane) in self.record.blocks.iter().zip(&mut self.lanes) {
            *lane += walks[*lane..].iter().take_while(|&&other| other < walk).count();
            if walks.get(*lane) != Some(&walk) {
                break;
            }
            sample.extend(lane_of(planes, walks.len(), *lane));
        }
    }
}

/// The numbers of one lane in planes of so many.
fn lane_of(planes: &[f32], lanes: usize, lane: usize) -> impl Iterator<Item = f32> + '_ {
    planes.chunks_exact(lanes).map(move |plane| plane[lane])
}

impl<N: Numbers> Numbers for Recorded<N> {
    fn emission(&mut self, scene: &dyn Scene, walks: usize, out: &mut Vec<f32>) {
        self.source.emission(scene, walks, out);
        self.record.emission.clone_from(out);
    }

    fn steps(&mut self, scene: &dyn Scene, steps: Range<usize>, alive: Alive, out: &mut Vec<f32>) {
        self.source.steps(scene, steps, alive, out);
    }

    fn used(&mut self, alive: &mut Vec<u32>, planes: &mut Vec<f32>) {
        let (walks, planes) = (std::mem::take(alive), std::mem::take(planes));
        self.record.blocks.push(Block { walks, planes });
    }
}

/// The numbers of known walks once more.
pub struct Replayed<'a> {
    pub samples: Vec<&'a [f32]>,
}

impl Numbers for Replayed<'_> {
    fn emission(&mut self, _: &dyn Scene, walks: usize, out: &mut Vec<f32>) {
        assert_eq!(walks, self.samples.len());
        out.resize(EMIT_DIMENSIONS * walks, 0.0);
        for (walk, sample) in self.samples.iter().enumerate() {
            for dimension in 0..EMIT_DIMENSIONS {
                out[dimension * walks + walk] = sample[dimension];
            }
        }
    }

    fn steps(&mut self, _: &dyn Scene, steps: Range<usize>, alive: Alive, out: &mut Vec<f32>) {
        let lanes = alive.count;
        out.resize(steps.len() * PHOTON_STEP_DIMENSIONS * lanes, 0.0);
        for (step, planes) in steps.zip(out.chunks_exact_mut(PHOTON_STEP_DIMENSIONS * lanes)) {
            let first = EMIT_DIMENSIONS + PHOTON_STEP_DIMENSIONS * step;
            for (lane, &walk) in alive.walks.iter().enumerate() {
                let sample = self.samples[walk as usize];
                for dimension in 0..PHOTON_STEP_DIMENSIONS {
                    // A walk is a function of its numbers: it reads those that it did before, and has ended after them.
                    let number = sample.get(first + dimension).copied().unwrap_or_default();
                    planes[dimension * lanes + lane] = number;
                }
            }
        }
    }
}

/// Mutations of known walks. Where a mutated walk goes further than the known one, that one's further
/// numbers are still undrawn: they are drawn now, and a mutation of them is as uniform as they are.
pub struct Mutated<'a> {
    pub samples: Vec<&'a [f32]>,
    pub mutation: Mutation,
    pub rng: Pcg64Mcg,
}

/// The same lanes of several planes.
struct Lanes<'a> {
    first: usize,
    planes: Vec<&'a mut [f32]>,
    /// What their numbers are drawn from, whichever thread does it.
    rng: Pcg64Mcg,
}

impl<'a> Lanes<'_> {
    /// Mutates the numbers that are `known` for each lane, by its index in all, one for each plane; draws those that are not.
    fn fill(mut self, mutation: Mutation, known: impl Fn(usize) -> &'a [f32]) {
        let lanes = self.planes.first().map_or(0, |plane| plane.len());
        let (mut numbers, mut before) = ([[].as_slice(); LANES_AT_ONCE], [0.0; LANES_AT_ONCE]);
        for start in (0..lanes).step_by(LANES_AT_ONCE) {
            let end = lanes.min(start + LANES_AT_ONCE);
            for (lane, numbers) in (self.first + start..self.first + end).zip(&mut numbers) {
                *numbers = known(lane);
            }
            for lane in start..end {
                self.planes.iter_mut().for_each(|plane| plane[lane] = uniform::next(&mut self.rng));
            }
            let longest = numbers.iter().map(|numbers| numbers.len()).max().unwrap_or_default();
            for (number, plane) in self.planes.iter_mut().enumerate().take(longest) {
                // Side by side, so that none waits for another's memory.
                for (before, numbers) in before.iter_mut().zip(&numbers) {
                    *before = numbers.get(number).copied().unwrap_or(f32::NAN);
                }
                mutate_all(mutation, &before, &mut plane[start..end]);
            }
        }
    }
}

/// Replaces uniform numbers by mutations of those that are known, which the others are not a number.
fn mutate_all(mutation: Mutation, known: &[f32; LANES_AT_ONCE], drawn: &mut [f32]) {
    for (drawn, &known) in drawn.iter_mut().zip(known) {
        let mutated = mutation.of(known, *drawn);
        *drawn = if known.is_nan() { *drawn } else { mutated };
    }
}

/// The lanes of each task.
fn tasks<'a>(planes: &'a mut [f32], lanes: usize, rng: &mut Pcg64Mcg) -> Vec<Lanes<'a>> {
    let parts = (0..).step_by(LANES_PER_TASK).zip(work::cut(planes, lanes, LANES_PER_TASK));
    parts.map(|(first, planes)| Lanes { first, planes, rng: Pcg64Mcg::from_rng(rng) }).collect()
}

impl Numbers for Mutated<'_> {
    fn emission(&mut self, scene: &dyn Scene, walks: usize, out: &mut Vec<f32>) {
        assert_eq!(walks, self.samples.len());
        out.resize(EMIT_DIMENSIONS * walks, 0.0);
        let (samples, mutation) = (&self.samples, self.mutation);
        let known = |walk: usize| samples[walk];
        // The seed, which comes last, names a stream of hashes: a neighbour of it has nothing in common with it.
        let (mutated, seeds) = out.split_at_mut(EMIT_SEED * walks);
        work::for_each(scene, tasks(mutated, walks, &mut self.rng), |lanes| {
            lanes.fill(mutation, known);
        });
        for (seed, sample) in seeds.iter_mut().zip(samples) {
            *seed = sample[EMIT_SEED];
        }
    }

    fn steps(&mut self, scene: &dyn Scene, steps: Range<usize>, alive: Alive, out: &mut Vec<f32>) {
        let Alive { count: lanes, walks } = alive;
        out.resize(steps.len() * PHOTON_STEP_DIMENSIONS * lanes, 0.0);
        let (samples, mutation) = (&self.samples, self.mutation);
        let first = EMIT_DIMENSIONS + PHOTON_STEP_DIMENSIONS * steps.start;
        let known = |lane: usize| samples[walks[lane] as usize].get(first..).unwrap_or_default();
        work::for_each(scene, tasks(out, lanes, &mut self.rng), |lanes| {
            lanes.fill(mutation, known);
        });
    }
}
