use crate::math::{mask, Aabb};
use glam::Vec3;

/// Photons that look together, and the boxes that they reach, axis by axis, so that one comparison with a plane serves several of
/// them [Wald 2001]. A set of them has a bit for each.
pub(super) struct Packet<'a, const LANES: usize> {
    pub places: &'a [Vec3],
    pub radius_squared: f32,
    /// Lower and upper ends; NaN, which reaches nothing, where there is no photon. A fourth axis, so that the two bits of an
    /// axis need no bounds check.
    low: [[f32; LANES]; 4],
    high: [[f32; LANES]; 4],
}

impl<'a, const LANES: usize> Packet<'a, LANES> {
    /// At most `LANES` photons, and how far from its place each reaches along every axis.
    #[inline]
    pub fn new(places: &'a [Vec3], radius: f32, reach: impl Fn(Vec3) -> f32) -> Self {
        let nowhere = [[f32::NAN; LANES]; 4];
        let radius_squared = radius * radius;
        let mut packet = Packet { places, radius_squared, low: nowhere, high: nowhere };
        for (lane, &p) in places.iter().enumerate() {
            let reach = reach(p);
            for axis in 0..3 {
                packet.low[axis][lane] = p[axis] - reach;
                packet.high[axis][lane] = p[axis] + reach;
            }
        }
        packet
    }

    /// The photons of a part that reach the left side of a plane, and those that reach its right side; none where it is no one.
    #[inline]
    pub fn divide(&self, part: u32, axis: usize, plane: f32) -> [Option<u32>; 2] {
        let plane = [plane; LANES];
        let left = mask::at_most(&self.low[axis], &plane);
        let right = mask::at_most(&plane, &self.high[axis]);
        [left, right].map(|side| Some(part & side).filter(|&part| part != 0))
    }

    /// The photons that reach a box.
    #[inline]
    pub fn reaching(&self, bounds: &Aabb) -> u32 {
        (0..3).fold(u32::MAX, |all, axis| {
            let (min, max) = ([bounds.min[axis]; LANES], [bounds.max[axis]; LANES]);
            all & mask::at_most(&self.low[axis], &max) & mask::at_most(&min, &self.high[axis])
        })
    }
}
