use crate::math::{mask, Aabb};
use glam::Vec3;

/// The boxes that photons reach, axis by axis, so that one comparison with a plane serves several of them [Wald 2001].
pub(super) struct Packet<const LANES: usize> {
    /// Lower and upper ends; NaN, which reaches nothing, where there is no photon. A fourth axis, so that the two bits of an
    /// axis need no bounds check.
    low: [[f32; LANES]; 4],
    high: [[f32; LANES]; 4],
}

impl<const LANES: usize> Packet<LANES> {
    /// At most `LANES` photons, and how far from its place each reaches along every axis.
    #[inline]
    pub fn new(places: &[Vec3], reach: impl Fn(Vec3) -> f32) -> Self {
        let nowhere = [[f32::NAN; LANES]; 4];
        let mut packet = Packet { low: nowhere, high: nowhere };
        for (lane, &p) in places.iter().enumerate() {
            let reach = reach(p);
            for axis in 0..3 {
                packet.low[axis][lane] = p[axis] - reach;
                packet.high[axis][lane] = p[axis] + reach;
            }
        }
        packet
    }

    /// A bit for each photon that reaches the left side of a plane, and for each that reaches its right side.
    #[inline]
    pub fn sides(&self, axis: usize, plane: f32) -> [u32; 2] {
        let plane = [plane; LANES];
        [mask::at_most(&self.low[axis], &plane), mask::at_most(&plane, &self.high[axis])]
    }

    /// A bit for each photon that reaches a box.
    #[inline]
    pub fn reaching(&self, bounds: &Aabb) -> u32 {
        (0..3).fold(u32::MAX, |all, axis| {
            let (min, max) = ([bounds.min[axis]; LANES], [bounds.max[axis]; LANES]);
            all & mask::at_most(&self.low[axis], &max) & mask::at_most(&min, &self.high[axis])
        })
    }
}
