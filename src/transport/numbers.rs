//! Where walks take their uniform numbers from: a point in primary sample space. [Kelemen 2002]

use crate::math::uniform;
use crate::scene::work;
use crate::scene::{Scene, EMIT_DIMENSIONS, PHOTON_STEP_DIMENSIONS};
use rand_pcg::Pcg64Mcg;
use std::ops::Range;

/// Numbers that one task draws; fewer are sooner drawn than handed to another thread.
const PER_TASK: usize = 1 << 15;

/// The numbers of a batch of walks, asked for as the walks go on. The scene of the walks lends the threads that draw them.
pub trait Numbers {
    /// Whether [`Numbers::steps`] reads which walks are alive.
    const KNOWS_WALKS: bool = true;

    /// [`EMIT_DIMENSIONS`] planes of `walks` numbers each.
    fn emission(&mut self, scene: &dyn Scene, walks: usize, out: &mut Vec<f32>);

    /// For each of these steps [`PHOTON_STEP_DIMENSIONS`] planes for the walks that are `alive` before the first of them.
    fn steps(&mut self, scene: &dyn Scene, steps: Range<usize>, alive: Alive, out: &mut Vec<f32>);

    /// May take the numbers that [`Numbers::steps`] gave last, once walks have used them, and which walks were alive before.
    fn used(&mut self, _alive: &mut Vec<u32>, _planes: &mut Vec<f32>) {}

    /// By walk, what its flux is multiplied by because of how its emission was drawn; none where that is 1.
    fn weights(&self) -> Option<&[f32]> {
        None
    }
}

/// Walks that have not ended.
#[derive(Debug, Clone, Copy)]
pub struct Alive<'a> {
    pub count: usize,
    /// Their indices within the batch, ascending; empty where [`Numbers::KNOWS_WALKS`] says that nobody reads them.
    pub walks: &'a [u32],
}

/// The next numbers of a stream, drawn by the threads that a scene lends.
pub fn draw(rng: &mut Pcg64Mcg, scene: &dyn Scene, out: &mut Vec<f32>, count: usize) {
    out.resize(count, 0.0);
    let parts = out.chunks_mut(PER_TASK).map(|part| (uniform::split_off(rng, part.len()), part));
    work::for_each(scene, parts.collect(), |(mut rng, part)| uniform::fill_slice(&mut rng, part));
}

/// Independent numbers from a stream.
pub struct Uniform(pub Pcg64Mcg);

impl Numbers for Uniform {
    const KNOWS_WALKS: bool = false;

    fn emission(&mut self, scene: &dyn Scene, walks: usize, out: &mut Vec<f32>) {
        draw(&mut self.0, scene, out, EMIT_DIMENSIONS * walks);
    }

    fn steps(&mut self, scene: &dyn Scene, steps: Range<usize>, alive: Alive, out: &mut Vec<f32>) {
        draw(&mut self.0, scene, out, steps.len() * PHOTON_STEP_DIMENSIONS * alive.count);
    }
}
