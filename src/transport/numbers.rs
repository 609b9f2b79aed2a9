//! Where walks take their uniform numbers from: a point in primary sample space. [Kelemen 2002]

use crate::math::uniform;
use crate::scene::{EMIT_DIMENSIONS, PHOTON_STEP_DIMENSIONS};
use rand_pcg::Pcg64Mcg;
use std::ops::Range;

/// The numbers of a batch of walks, asked for as the walks go on.
pub trait Numbers {
    /// Whether [`Numbers::steps`] reads which walks are alive.
    const KNOWS_WALKS: bool = true;

    /// [`EMIT_DIMENSIONS`] planes of `walks` numbers each.
    fn emission(&mut self, walks: usize, out: &mut Vec<f32>);

    /// For each of these steps [`PHOTON_STEP_DIMENSIONS`] planes for the walks that are `alive` (indices within the
    /// batch, ascending) before the first of them.
    fn steps(&mut self, steps: Range<usize>, alive: &[u32], lanes: usize, out: &mut Vec<f32>);

    /// By walk, what its flux is multiplied by because of how its emission was drawn; none where that is 1.
    fn weights(&self) -> Option<&[f32]> {
        None
    }
}

/// Independent numbers from a stream.
pub struct Uniform(pub Pcg64Mcg);

impl Numbers for Uniform {
    const KNOWS_WALKS: bool = false;

    fn emission(&mut self, walks: usize, out: &mut Vec<f32>) {
        uniform::fill(&mut self.0, out, EMIT_DIMENSIONS * walks);
    }

    fn steps(&mut self, steps: Range<usize>, _: &[u32], lanes: usize, out: &mut Vec<f32>) {
        uniform::fill(&mut self.0, out, steps.len() * PHOTON_STEP_DIMENSIONS * lanes);
    }
}
