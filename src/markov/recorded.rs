//! Numbers that are kept, replayed or mutated.

use super::mutation::Mutation;
use crate::crew;
use crate::math::uniform;
use crate::scene::{Scene, EMIT_DIMENSIONS, EMIT_SEED, PHOTON_STEP_DIMENSIONS};
use crate::transport::numbers::Numbers;
use rand::SeedableRng;
use rand_pcg::Pcg64Mcg;
use std::ops::Range;

/// Lanes whose numbers one task draws.
const LANES_PER_TASK: usize = 2048;
/// And those of which several steps are computed at once.
const LANES_AT_ONCE: usize = 256;

/// The numbers that a walk has used: [`EMIT_DIMENSIONS`], then [`PHOTON_STEP_DIMENSIONS`] per step.
pub type PrimarySample = Vec<f32>;

/// Keeps what another source gives.
pub struct Recorded<N> {
    source: N,
    emission: Vec<f32>,
    steps: Vec<Step>,
}

struct Step {
    walks: Vec<u32>,
    planes: Vec<f32>,
}

impl<N: Numbers> Recorded<N> {
    pub fn new(source: N) -> Self {
        Recorded { source, emission: Vec::new(), steps: Vec::new() }
    }

    /// Reads numbers of one walk after another, from this one on.
    pub fn from_walk(&self, first: u32) -> Reader<'_, N> {
        let lane_in = |step: &Step| step.walks.partition_point(|&walk| walk < first);
        Reader { numbers: self, lanes: self.steps.iter().map(lane_in).collect() }
    }
}

/// Reads the numbers of walks in their order.
pub struct Reader<'a, N> {
    numbers: &'a Recorded<N>,
    /// By step, the first lane that the next walk may have.
    lanes: Vec<usize>,
}

impl<N> Reader<'_, N> {
    /// All numbers that a walk has used, which comes behind those that were asked for before.
    pub fn of_walk(&mut self, walk: u32) -> PrimarySample {
        let mut sample = Vec::with_capacity(EMIT_DIMENSIONS + PHOTON_STEP_DIMENSIONS * 8);
        sample.extend(lane_of::<EMIT_DIMENSIONS>(&self.numbers.emission, walk as usize));
        for (step, lane) in self.numbers.steps.iter().zip(&mut self.lanes) {
            *lane += step.walks[*lane..].iter().take_while(|&&other| other < walk).count();
            if step.walks.get(*lane) != Some(&walk) {
                break;
            }
            sample.extend(lane_of::<PHOTON_STEP_DIMENSIONS>(&step.planes, *lane));
        }
        sample
    }
}

/// The numbers of one lane: as many as there are planes.
fn lane_of<const PLANES: usize>(planes: &[f32], lane: usize) -> [f32; PLANES] {
    let lanes = planes.len() / PLANES;
    std::array::from_fn(|plane| planes[plane * lanes + lane])
}

impl<N: Numbers> Numbers for Recorded<N> {
    fn emission(&mut self, walks: usize, out: &mut Vec<f32>) {
        self.source.emission(walks, out);
        self.emission.clone_from(out);
    }

    fn steps(&mut self, steps: Range<usize>, alive: &[u32], lanes: usize, out: &mut Vec<f32>) {
        self.source.steps(steps, alive, lanes, out);
        for planes in out.chunks_exact(PHOTON_STEP_DIMENSIONS * lanes) {
            self.steps.push(Step { walks: alive.to_vec(), planes: planes.to_vec() });
        }
    }
}

/// The numbers of known walks once more.
pub struct Replayed<'a> {
    pub samples: Vec<&'a [f32]>,
}

impl Numbers for Replayed<'_> {
    fn emission(&mut self, walks: usize, out: &mut Vec<f32>) {
        assert_eq!(walks, self.samples.len());
        out.resize(EMIT_DIMENSIONS * walks, 0.0);
        for (walk, sample) in self.samples.iter().enumerate() {
            for dimension in 0..EMIT_DIMENSIONS {
                out[dimension * walks + walk] = sample[dimension];
            }
        }
    }

    fn steps(&mut self, steps: Range<usize>, alive: &[u32], lanes: usize, out: &mut Vec<f32>) {
        out.resize(steps.len() * PHOTON_STEP_DIMENSIONS * lanes, 0.0);
        for (step, planes) in steps.zip(out.chunks_exact_mut(PHOTON_STEP_DIMENSIONS * lanes)) {
            let first = EMIT_DIMENSIONS + PHOTON_STEP_DIMENSIONS * step;
            for (lane, &walk) in alive.iter().enumerate() {
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
    /// Lends the threads that draw.
    pub scene: &'a dyn Scene,
}

/// The same lanes of several planes.
struct Lanes<'a> {
    first: usize,
    planes: Vec<&'a mut [f32]>,
    /// What their numbers are drawn from, whichever thread does it.
    rng: Pcg64Mcg,
}

impl Lanes<'_> {
    /// Mutates the number that is `known` for each lane, by its index in all, and plane; draws one where none is.
    fn fill(mut self, mutation: Mutation, known: impl Fn(usize, usize) -> Option<f32>) {
        let mut before = [f32::NAN; LANES_AT_ONCE];
        for (number, plane) in self.planes.iter_mut().enumerate() {
            for (part, first) in plane.chunks_mut(LANES_AT_ONCE).zip((self.first..).step_by(LANES_AT_ONCE)) {
                uniform::fill_all(&mut self.rng, part);
                for (lane, before) in (first..).zip(&mut before[..part.len()]) {
                    *before = known(lane, number).unwrap_or(f32::NAN);
                }
                for (drawn, &before) in part.iter_mut().zip(&before) {
                    let mutated = mutation.of(before, *drawn);
                    *drawn = if before.is_nan() { *drawn } else { mutated };
                }
            }
        }
    }
}

/// Cuts planes into the lanes of tasks.
fn cut<'a>(planes: &'a mut [f32], lanes: usize, rng: &mut Pcg64Mcg) -> Vec<Lanes<'a>> {
    let start = |first| Lanes { first, planes: Vec::new(), rng: Pcg64Mcg::from_rng(rng) };
    let mut tasks: Vec<_> = (0..lanes).step_by(LANES_PER_TASK).map(start).collect();
    for plane in planes.chunks_exact_mut(lanes.max(1)) {
        for (task, part) in tasks.iter_mut().zip(plane.chunks_mut(LANES_PER_TASK)) {
            task.planes.push(part);
        }
    }
    tasks
}

impl Numbers for Mutated<'_> {
    fn emission(&mut self, walks: usize, out: &mut Vec<f32>) {
        assert_eq!(walks, self.samples.len());
        out.resize(EMIT_DIMENSIONS * walks, 0.0);
        let (samples, mutation) = (&self.samples, self.mutation);
        let known = |walk: usize, dimension: usize| Some(samples[walk][dimension]);
        crew::for_each(self.scene, cut(out, walks, &mut self.rng), |lanes| {
            lanes.fill(mutation, known);
        });
        // The seed names a stream of hashes: a neighbour of it has nothing in common with it.
        for (seed, sample) in out[EMIT_SEED * walks..].iter_mut().zip(samples) {
            *seed = sample[EMIT_SEED];
        }
    }

    fn steps(&mut self, steps: Range<usize>, alive: &[u32], lanes: usize, out: &mut Vec<f32>) {
        out.resize(steps.len() * PHOTON_STEP_DIMENSIONS * lanes, 0.0);
        let (samples, mutation) = (&self.samples, self.mutation);
        let first = EMIT_DIMENSIONS + PHOTON_STEP_DIMENSIONS * steps.start;
        let known = |lane: usize, number: usize| {
            samples[alive[lane] as usize].get(first + number).copied()
        };
        crew::for_each(self.scene, cut(out, lanes, &mut self.rng), |lanes| {
            lanes.fill(mutation, known);
        });
    }
}
