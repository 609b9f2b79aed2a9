//! The photon map of the volume, asked by view beams: the beam radiance estimate [Jarosz 2008].

use glam::Vec3;

use super::bvh::{Bvh, Stats};
use crate::math::{Aabb, Segment};

/// Photons in a hierarchy that finds those whose disks of a radius a view beam pierces.
///
/// The dual of [`ViewBeamTree`]: it has the same pairs, but holds the photons of one pass. Coordinates
/// and radii are in scene units.
///
/// [`ViewBeamTree`]: super::ViewBeamTree
#[derive(Clone, Debug)]
pub struct PhotonDisks {
    bvh: Bvh,
    /// In the order of the leaves.
    positions: Vec<Vec3>,
}

impl PhotonDisks {
    /// Builds over the positions of a pass. Those that are not finite have no pairs and are left out;
    /// [`PhotonDisks::stats`] counts them. The result does not depend on the number of threads.
    ///
    /// # Panics
    ///
    /// If there are more than `u32::MAX` photons.
    pub fn build(positions: &[Vec3]) -> Self {
        let boxes: Vec<_> = positions.iter().map(|&p| Aabb { min: p, max: p }).collect();
        let bvh = Bvh::build(&boxes);
        let positions = bvh.order().iter().map(|&index| positions[index as usize]).collect();
        Self { bvh, positions }
    }

    /// Calls `visit(index, t, distance_squared)` once for every photon that contributes to
    /// `view_beam`: `t` is in `[0, length)` and the distance below `radius` (scene units), both as
    /// computed by [`Segment::project`].
    ///
    /// Pair by pair what [`ViewBeamTree::query`] finds, to the last bit; the order is that of the
    /// leaves. A view beam that is not finite has no pairs, and if `radius` is NaN or `<= 0` there
    /// are none.
    ///
    /// [`ViewBeamTree::query`]: super::ViewBeamTree::query
    #[inline]
    pub fn query(&self, view_beam: &Segment, radius: f32, mut visit: impl FnMut(u32, f32, f32)) {
        if !view_beam.is_finite() || radius.is_nan() || radius <= 0.0 {
            return;
        }
        let radius_squared = radius * radius;
        self.bvh.for_each_leaf(view_beam, radius, |leaf| {
            for (&p, &index) in self.positions[leaf.clone()].iter().zip(&self.bvh.order()[leaf]) {
                let (t, distance_squared) = view_beam.project(p);
                let is_pair =
                    (distance_squared < radius_squared) & (t >= 0.0) & (t < view_beam.length);
                if is_pair {
                    visit(index, t, distance_squared);
                }
            }
        });
    }

    /// Counts of photons, nodes and leaves.
    pub fn stats(&self) -> Stats {
        self.bvh.stats()
    }

    /// Bytes on the heap.
    pub fn memory_bytes(&self) -> usize {
        self.bvh.memory_bytes() + size_of_val(&self.positions[..])
    }
}
