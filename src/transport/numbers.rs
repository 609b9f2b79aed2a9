//! Where walks take their uniform numbers from: a point in primary sample space. [Kelemen 2002]

use crate::math::uniform;
use crate::scene::{EMIT_DIMENSIONS, PHOTON_STEP_DIMENSIONS};
use rand_pcg::Pcg64Mcg;

/// The numbers of a batch of walks, asked for as the walks go on.
pub trait Numbers {
    /// Whether [`Numbers::step`] reads which walks are alive.
    const KNOWS_WALKS: bool = true;

    /// [`EMIT_DIMENSIONS`] planes of `walks` numbers each.
    fn emission(&mut self, walks: usize, out: &mut Vec<f32>);

    /// [`PHOTON_STEP_DIMENSIONS`] planes for step `step` of the walks that are `alive` (indices within the
    /// batch, ascending).
    fn step(&mut self, step: usize, alive: &[u32], lanes: usize, out: &mut Vec<f32>);
}

/// Independent numbers from a stream.
pub struct Uniform(pub Pcg64Mcg);

impl Numbers for Uniform {
    const KNOWS_WALKS: bool = false;

    fn emission(&mut self, walks: usize, out: &mut Vec<f32>) {
        uniform::fill(&mut self.0, out, EMIT_DIMENSIONS * walks);
    }

    fn step(&mut self, _: usize, _: &[u32], lanes: usize, out: &mut Vec<f32>) {
        uniform::fill(&mut self.0, out, PHOTON_STEP_DIMENSIONS * lanes);
    }
}
