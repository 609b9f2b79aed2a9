//! Walks of photons from the lamps to their ends, a batch at a time.

use super::counters::Counters;
use super::numbers::Numbers;
use crate::scene::{PathLimits, PhotonVertices, Scene, SceneResult};

/// A batch of walks that is to be traced.
#[derive(Clone, Copy)]
pub struct Walks<'a> {
    pub scene: &'a dyn Scene,
    pub limits: PathLimits,
    pub count: usize,
    /// Whether the segments between vertices are wanted, too.
    pub with_segments: bool,
}

impl Walks<'_> {
    /// Traces all walks to their ends and hands on the vertices of each step.
    pub fn trace<N: Numbers>(
        &self,
        numbers: &mut N,
        mut visit: impl FnMut(&PhotonVertices, &mut Counters) -> SceneResult<()>,
    ) -> SceneResult<Counters> {
        let mut counters = Counters { walks: self.count as u64, ..Counters::default() };
        let (mut planes, mut alive) = (Vec::new(), Vec::new());
        let segments = self.with_segments.then(Default::default);
        let mut vertices = PhotonVertices { segments, ..PhotonVertices::default() };
        numbers.emission(self.count, &mut planes);
        let mut photons = self.scene.emit(self.count, &planes, self.limits)?;
        for step in 0.. {
            let lanes = photons.lanes();
            if lanes == 0 {
                break;
            }
            if N::KNOWS_WALKS {
                photons.alive(&mut alive)?;
            }
            numbers.step(step, &alive, lanes, &mut planes);
            photons.step(&planes, &mut vertices)?;
            counters.segments += lanes as u64;
            visit(&vertices, &mut counters)?;
        }
        Ok(counters)
    }
}
