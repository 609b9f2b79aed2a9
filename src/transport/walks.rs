//! Walks of photons from the lamps to their ends, a batch at a time.

use super::counters::Counters;
use super::numbers::{Alive, Numbers};
use crate::effect::Effect;
use crate::plan::Plan;
use crate::scene::{PhotonVertices, Scene, SceneResult, VACUUM};

/// A batch of walks that is to be traced.
#[derive(Clone, Copy)]
pub struct Walks<'a> {
    pub scene: &'a dyn Scene,
    pub plan: &'a Plan,
    pub count: usize,
    /// Whether the segments between vertices are wanted, too.
    pub with_segments: bool,
}

impl Walks<'_> {
    /// Traces all walks to their ends and hands on the vertices of each step, which may be taken if others are left.
    pub fn trace<N: Numbers>(
        &self,
        numbers: &mut N,
        mut visit: impl FnMut(&mut PhotonVertices, &mut Counters) -> SceneResult<()>,
    ) -> SceneResult<Counters> {
        let mut counters = Counters { walks: self.count as u64, ..Counters::default() };
        let (mut planes, mut alive) = (Vec::new(), Vec::new());
        let segments = self.with_segments.then(Default::default);
        let lamp_density = self.plan.rules.glossy_chains.then(Vec::new);
        let mut vertices = PhotonVertices { segments, lamp_density, ..PhotonVertices::default() };
        numbers.emission(self.scene, self.count, &mut planes);
        let mut photons = self.scene.emit(self.count, &planes, self.plan.rules)?;
        let (batching, mut done) = (self.scene.batching(), 0);
        while photons.lanes() > 0 {
            let lanes = photons.lanes();
            let steps = done..done + batching.steps(lanes);
            if N::KNOWS_WALKS {
                photons.alive(&mut alive)?;
            }
            let now = Alive { count: lanes, walks: &alive };
            numbers.steps(self.scene, steps.clone(), now, &mut planes);
            photons.step(steps.len(), &planes, &mut vertices)?;
            done = steps.end;
            if steps.len() > 1 {
                vertices.keep_present(self.scene);
            }
            if let Some(weights) = numbers.weights() {
                vertices.weigh(self.scene, weights);
            }
            numbers.used(&mut alive, &mut planes);
            counters.segments += vertices.event.len() as u64;
            self.count(&vertices, &mut counters);
            visit(&mut vertices, &mut counters)?;
        }
        Ok(counters)
    }

    /// What the segments of a step were made of.
    fn count(&self, v: &PhotonVertices, counters: &mut Counters) {
        if self.plan.simulates(Effect::MultipleScattering) {
            let scattered = v.depth.iter().filter(|depth| **depth > 0).count();
            counters.scattered_segments += scattered as u64;
        }
        if self.plan.simulates(Effect::MediumSampling) {
            let flights = v.medium.iter().filter(|medium| **medium != VACUUM).count() as u64;
            counters.flights += flights;
            if self.plan.simulates(Effect::ColouredExtinction) {
                counters.weighed_flights += flights;
            }
        }
    }
}
