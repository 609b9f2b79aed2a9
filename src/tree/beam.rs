use crate::math::{Approach, Segment};
use glam::Vec3;

/// A segment and its index in the caller's slice; aligned so that a test touches one cache line.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(super) struct Beam {
    pub segment: Segment,
    pub index: u32,
}

impl Beam {
    /// Parameter and squared distance of a photon that makes a pair with the beam; see
    /// [`super::ViewBeamTree::query`].
    #[inline]
    pub fn pair(&self, p: Vec3, radius_squared: f32) -> Option<(f32, f32)> {
        let (t, distance_squared) = self.segment.project(p);
        // One branch instead of three: nearly all candidates fail, each for another reason.
        let is_pair = (distance_squared < radius_squared) & (t >= 0.0) & (t < self.segment.length);
        is_pair.then_some((t, distance_squared))
    }

    /// The approach to a photon beam that makes a pair with the beam; see [`super::ViewBeamTree::query_segment`].
    #[inline]
    pub fn pair_along(&self, photon_beam: &Segment, radius_squared: f32) -> Option<Approach> {
        let approach = self.segment.approach(photon_beam)?;
        let is_pair = (approach.distance_squared < radius_squared)
            & (approach.t >= 0.0)
            & (approach.t < self.segment.length)
            & (approach.t_other >= 0.0)
            & (approach.t_other < photon_beam.length);
        is_pair.then_some(approach)
    }
}

/// Hands out the indices of beams in their order, and numbers them in that order from now on.
pub(super) fn take_order(beams: &mut [Beam]) -> Vec<u32> {
    (0..).zip(beams).map(|(place, beam)| std::mem::replace(&mut beam.index, place)).collect()
}
