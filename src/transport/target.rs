//! What the photons of a pass are shot at.

use super::photon::PerFamily;
use super::photon_beam::BeamKind;
use super::receivers::Receivers;
use crate::density::radius::Radii;
use crate::plan::Plan;
use crate::scene::Scene;

/// What a photon is while it crosses a medium.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Particles {
    #[default]
    Points,
    Beams(BeamKind),
}

/// What the photons of one pass are shot at, and how they are seen.
#[derive(Clone, Copy)]
pub struct Target<'a> {
    pub scene: &'a dyn Scene,
    pub receivers: &'a Receivers,
    pub particles: Particles,
    pub radii: Radii,
    pub plan: &'a Plan,
}

impl Target<'_> {
    /// The families that any receiver is there for.
    pub fn wanted(&self) -> PerFamily<bool> {
        self.receivers.paths.wanted(self.plan)
    }
}
