//! What one pass works with, and what it does with it.

use super::{Counters, Parameters, RenderError};
use crate::density::radius::Radii;
use crate::markov::FamilyReport;
use crate::plan::Plan;
use crate::scene::{Scene, SceneResult};
use crate::transport::deposits::PixelSums;
use crate::transport::memory::HoldsReceivers;
use crate::transport::pairs::Pairs;
use crate::transport::photon::PerFamily;
use crate::transport::photon_map::PhotonMap;
use crate::transport::photons::UniformShooter;
use crate::transport::receivers::Receivers;
use crate::transport::store::{Storage, StoredPhotons};
use crate::transport::target::{Particles, Target};
use std::cell::Cell;
use std::time::Instant;

/// Numbers that no pass of a picture has: photons of pilots are drawn from streams of their own.
pub const PILOT_PASSES: [u64; 2] = [u64::MAX, u64::MAX - 1];

/// What one pass works with.
pub struct Pass<'a, R> {
    pub scene: &'a dyn Scene,
    pub parameters: &'a Parameters,
    pub plan: &'a Plan,
    pub receivers: &'a R,
    pub radii: Radii,
    pub number: u64,
    /// Walks to be shot; a pilot shoots fewer than other passes do.
    pub walks: u64,
    /// Walks that the method may learn from beforehand, what they add is thrown away; none but where nothing else is kept either.
    pub lessons: u64,
    /// Whether the pass is the first after new ray paths took the place of others.
    pub receivers_changed: bool,
    /// What the shooter reported.
    pub(super) shooting: Cell<PerFamily<FamilyReport>>,
    /// Of wall time spent on building trees over photons.
    pub(super) tree_seconds: Cell<f64>,
}

impl<R: HoldsReceivers> Pass<'_, R> {
    pub fn pairs(&self) -> Pairs<'_> {
        Pairs::new(self.plan, self.receivers.as_ref(), self.radii)
    }

    /// Whether what the pass brings is thrown away.
    pub fn is_pilot(&self) -> bool {
        PILOT_PASSES.contains(&self.number)
    }

    /// Shoots the pass's photons and keeps them.
    pub fn store(&self, particles: Particles) -> SceneResult<(StoredPhotons, Counters)> {
        let seed = self.parameters.seed;
        let (paths, plan) = (self.receivers.as_ref(), self.plan);
        let (wanted, cone) = (paths.wanted(plan), paths.beam_cone);
        let storage = Storage { scene: self.scene, plan, particles, wanted, cone, seed };
        storage.shoot(self.number, self.walks)
    }

    /// Builds the structures over stored photons, on the clock of trees.
    pub fn build_map(&self, stored: StoredPhotons) -> PhotonMap {
        let clock = Instant::now();
        let map = PhotonMap::build(stored);
        self.tree_seconds.set(self.tree_seconds.get() + clock.elapsed().as_secs_f64());
        map
    }

    /// Hands on what the shooter reports, for progress and statistics.
    pub fn report_shooting(&self, report: PerFamily<FamilyReport>) {
        self.shooting.set(report);
    }
}

impl Pass<'_, Receivers> {
    /// A pilot for methods whose photons are not to be shot uniformly: chains begin with their first pass.
    pub fn pilot(
        &self,
        particles: Particles,
        sums: &mut PixelSums,
    ) -> Result<Counters, RenderError> {
        let mut shooter = UniformShooter::new(self.parameters.seed);
        Ok(shooter.shoot(&self.target(particles), self.number, self.walks, sums)?)
    }

    /// What photons are shot at.
    pub fn target(&self, particles: Particles) -> Target<'_> {
        Target {
            scene: self.scene,
            receivers: self.receivers,
            particles,
            radii: self.radii,
            plan: self.plan,
        }
    }
}
