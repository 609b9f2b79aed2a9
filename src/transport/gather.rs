//! A batch of walks, from the lamps to the last deposit.

use super::counters::Counters;
use super::deposits::Sink;
use super::gathering::Gathering;
use super::numbers::Numbers;
use super::overlap;
use super::pairs::Pairs;
use super::photon::PerFamily;
use super::target::{Particles, Target};
use super::walks::Walks;
use crate::scene::SceneResult;
use rand_pcg::Pcg64Mcg;

impl Target<'_> {
    /// Shoots one batch of walks and gathers what those of the wanted families add. `tables` is the
    /// stream of numbers for transmittance tables along photon beams.
    pub fn shoot<S: Sink>(
        &self,
        walks: usize,
        numbers: &mut impl Numbers,
        tables: &mut Pcg64Mcg,
        wanted: PerFamily<bool>,
        sink: impl Fn() -> S + Sync,
    ) -> SceneResult<(S, Counters)> {
        let with_segments = matches!(self.particles, Particles::Beams(_)) && wanted.medium;
        let Target { scene, plan, .. } = *self;
        let walks = Walks { scene, plan, count: walks, with_segments };
        let pairs = Pairs::new(plan, &self.receivers.paths, self.radii);
        let gathering = Gathering { target: self, pairs, wanted };
        let gathered = if scene.batching().concurrent {
            gathering.step_by_step(walks, numbers, tables, sink())
        } else {
            overlap::while_tracing(&gathering, walks, numbers, tables, &sink)
        }?;
        Ok((gathered.sink, gathered.counters))
    }
}
