//! Photon walks: shot in batches, deposited into the receivers that they pass, and forgotten. Memory
//! does not depend on how many are shot. [Collin 2013 §5.2]

use crate::density::radius::Radii;
use crate::math::uniform;
use crate::scene::*;
use crate::transport::counters::Counters;
use crate::transport::deposits::{Deposits, PixelSums};
use crate::transport::gather::{Asked, Gather, Gathered};
use crate::transport::receivers::Receivers;
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

/// Deposits that a round of batches may hold before they are added up; bounds memory.
const DEPOSITS_PER_ROUND: usize = 1 << 20;
/// Batches per round at most.
const BATCHES_PER_ROUND: usize = 64;
/// Vertices per task of a gather, and tasks after which pairs are handed to the scene.
const VERTICES_PER_TASK: usize = 1024;
const TASKS_PER_HANDOVER: usize = 8;

/// Shoots the uniform photons of one pass after another.
#[derive(Debug)]
pub struct PhotonShooter {
    seed: u64,
    limits: PathLimits,
    batches_per_round: usize,
}

impl PhotonShooter {
    pub fn new(seed: u64, limits: PathLimits) -> Self {
        PhotonShooter { seed, limits, batches_per_round: 4 }
    }

    /// Emits `walks` walks and adds the pass's radiance to `sums`.
    pub fn shoot(
        &mut self,
        scene: &dyn Scene,
        receivers: &Receivers,
        radii: Radii,
        pass: u64,
        walks: u64,
        sums: &mut PixelSums,
    ) -> SceneResult<Counters> {
        let Batching { lanes, concurrent } = scene.batching();
        let lanes = (lanes as u64).min(walks);
        let (seed, limits) = (self.seed, self.limits);
        let run = |batch: u64| -> SceneResult<(Deposits, Counters)> {
            let count = lanes.min(walks - batch * lanes) as usize;
            let rng = uniform::stream(seed, uniform::Purpose::Photons, pass, batch);
            Batch::new(scene, receivers, radii, limits).shoot(count, rng)
        };
        let mut counters = Counters::default();
        let (mut next, end) = (0, walks.div_ceil(lanes));
        while next < end {
            let results: Vec<(Deposits, Counters)> = if concurrent {
                let round = next..end.min(next + self.batches_per_round as u64);
                round.into_par_iter().map(run).collect::<SceneResult<_>>()?
            } else {
                vec![run(next)?]
            };
            next += results.len() as u64;
            let (deposits, counts): (Vec<_>, Vec<_>) = results.into_iter().unzip();
            counts.iter().for_each(|count| counters.add(count));
            // [Collin 2013 (2), (3)]: the sum over photons divided by the number of emitted walks.
            sums.add(&deposits, 1.0 / walks as f64);
            self.plan_round(&deposits);
        }
        Ok(counters)
    }

    /// Sizes the next round by what the last one held.
    fn plan_round(&mut self, deposits: &[Deposits]) {
        let total: usize = deposits.iter().map(Deposits::count).sum();
        let per_batch = total.div_ceil(deposits.len().max(1)).max(1);
        self.batches_per_round = (DEPOSITS_PER_ROUND / per_batch).clamp(1, BATCHES_PER_ROUND);
    }
}

/// One batch of walks, from the lamps to the last deposit.
struct Batch<'a> {
    scene: &'a dyn Scene,
    receivers: &'a Receivers,
    gather: Gather<'a>,
    limits: PathLimits,
}

impl<'a> Batch<'a> {
    fn new(
        scene: &'a dyn Scene,
        receivers: &'a Receivers,
        radii: Radii,
        limits: PathLimits,
    ) -> Self {
        let gather = Gather { receivers, media: &scene.description().media, radii, limits };
        Batch { scene, receivers, gather, limits }
    }

    fn shoot(&self, walks: usize, mut rng: Pcg64Mcg) -> SceneResult<(Deposits, Counters)> {
        let mut deposits = Deposits::new(self.receivers.pixels());
        let mut counters = Counters { walks: walks as u64, ..Counters::default() };
        let (mut numbers, mut vertices) = (Vec::new(), PhotonVertices::default());
        uniform::fill(&mut rng, &mut numbers, EMIT_DIMENSIONS * walks);
        let mut photons = self.scene.emit(walks, &numbers, self.limits)?;
        while photons.lanes() > 0 {
            let lanes = photons.lanes();
            uniform::fill(&mut rng, &mut numbers, PHOTON_STEP_DIMENSIONS * lanes);
            photons.step(&numbers, &mut vertices)?;
            self.deposit(&vertices, &mut deposits, &mut counters)?;
        }
        Ok((deposits, counters))
    }

    fn deposit(
        &self,
        vertices: &PhotonVertices,
        deposits: &mut Deposits,
        counters: &mut Counters,
    ) -> SceneResult<()> {
        let lanes = vertices.event.len();
        let tasks: Vec<_> = (0..lanes)
            .step_by(VERTICES_PER_TASK)
            .map(|a| a..lanes.min(a + VERTICES_PER_TASK))
            .collect();
        for group in tasks.chunks(TASKS_PER_HANDOVER) {
            let gathered: Vec<Gathered> =
                group.par_iter().map(|range| self.gather.run(vertices, range.clone())).collect();
            let mut asked = Asked::default();
            for mut part in gathered {
                deposits.append(&mut part.deposits);
                counters.add(&part.counters);
                asked.append(part.asked);
            }
            asked.resolve(self.scene, deposits, counters)?;
        }
        Ok(())
    }
}
