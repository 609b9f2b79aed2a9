//! Numbers that are kept, replayed or mutated.

use super::mutation::mutate;
use crate::math::uniform;
use crate::scene::{EMIT_DIMENSIONS, EMIT_SEED, PHOTON_STEP_DIMENSIONS};
use crate::transport::numbers::Numbers;
use rand_pcg::Pcg64Mcg;
use std::ops::Range;

/// The numbers that a walk has used: [`EMIT_DIMENSIONS`], then [`PHOTON_STEP_DIMENSIONS`] per step.
pub type PrimarySample = Vec<f32>;

/// Keeps what another source gives.
pub struct Recorded<N> {
    source: N,
    walks: usize,
    emission: Vec<f32>,
    steps: Vec<Step>,
}

struct Step {
    walks: Vec<u32>,
    planes: Vec<f32>,
}

impl<N: Numbers> Recorded<N> {
    pub fn new(source: N) -> Self {
        Recorded { source, walks: 0, emission: Vec::new(), steps: Vec::new() }
    }

    /// All numbers that a walk has used.
    pub fn of_walk(&self, walk: u32) -> PrimarySample {
        let mut sample = Vec::with_capacity(EMIT_DIMENSIONS + PHOTON_STEP_DIMENSIONS * 8);
        sample.extend(lane_of(&self.emission, self.walks, walk as usize));
        for step in &self.steps {
            let Ok(lane) = step.walks.binary_search(&walk) else { break };
            sample.extend(lane_of(&step.planes, step.walks.len(), lane));
        }
        sample
    }
}

fn lane_of(planes: &[f32], lanes: usize, lane: usize) -> impl Iterator<Item = f32> + '_ {
    planes.iter().skip(lane).step_by(lanes.max(1)).copied()
}

impl<N: Numbers> Numbers for Recorded<N> {
    fn emission(&mut self, walks: usize, out: &mut Vec<f32>) {
        self.source.emission(walks, out);
        self.walks = walks;
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
    pub size: f32,
    pub rng: Pcg64Mcg,
}

impl Mutated<'_> {
    fn number(&mut self, walk: usize, dimension: usize) -> f32 {
        match self.samples[walk].get(dimension) {
            Some(&u) => mutate(u, self.size, &mut self.rng),
            None => uniform::next(&mut self.rng),
        }
    }
}

impl Numbers for Mutated<'_> {
    fn emission(&mut self, walks: usize, out: &mut Vec<f32>) {
        assert_eq!(walks, self.samples.len());
        out.resize(EMIT_DIMENSIONS * walks, 0.0);
        for walk in 0..walks {
            for dimension in 0..EMIT_DIMENSIONS {
                // The seed names a stream of hashes: a neighbour of it has nothing in common with it.
                out[dimension * walks + walk] = match dimension {
                    EMIT_SEED => self.samples[walk][EMIT_SEED],
                    _ => self.number(walk, dimension),
                };
            }
        }
    }

    fn steps(&mut self, steps: Range<usize>, alive: &[u32], lanes: usize, out: &mut Vec<f32>) {
        out.resize(steps.len() * PHOTON_STEP_DIMENSIONS * lanes, 0.0);
        for (step, planes) in steps.zip(out.chunks_exact_mut(PHOTON_STEP_DIMENSIONS * lanes)) {
            let first = EMIT_DIMENSIONS + PHOTON_STEP_DIMENSIONS * step;
            for (lane, &walk) in alive.iter().enumerate() {
                for dimension in 0..PHOTON_STEP_DIMENSIONS {
                    let number = self.number(walk as usize, first + dimension);
                    planes[dimension * lanes + lane] = number;
                }
            }
        }
    }
}
