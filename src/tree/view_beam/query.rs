use glam::Vec3;

use super::{Leaf, ViewBeamTree};
use crate::tree::beam::for_each_pair;
use crate::tree::MAX_DEPTH;

impl ViewBeamTree {
    /// Calls `visit(index, t, distance_squared)` once for every beam that the photon at `p`
    /// contributes to.
    ///
    /// That is, the orthogonal projection of `p` on the beam's line falls on the beam, `t` in `[0,
    /// length)`, and the distance to it is below `radius` (scene units), both as computed by
    /// [`Segment::project`]. There are no end caps: the kernel lives on the plane normal to the
    /// beam. The order of the calls is that of the leaves. If `p` or `radius` is NaN, or `radius <=
    /// 0`, there are none.
    ///
    /// [`Segment::project`]: crate::math::Segment::project
    #[inline]
    pub fn query(&self, p: Vec3, radius: f32, mut visit: impl FnMut(u32, f32, f32)) {
        if radius.is_nan() || radius <= 0.0 {
            return;
        }
        let reach = self.reach(p, radius);
        let radius_squared = radius * radius;
        self.for_each_leaf(p, reach, |leaf| {
            if leaf.bounds.is_within_reach(p, reach) {
                self.visit_owned(leaf, p, radius_squared, &mut visit);
            }
        });
    }

    /// `radius`, widened by what rounding may put between a photon and the closest point that owns
    /// its pair.
    ///
    /// With u = ε/2 and per coordinate: `project` computes `r = fl(fl(p − o) − fl(t·d))`, `at`
    /// computes `c = fl(o + fl(t·d))` from the same product, hence `|p − c| <= (|r| + u(2|p| +
    /// |o|))(1 + 5u)`. A pair has `fl(r²) < fl(radius²)`, so `|r| < radius`. Twice the bound
    /// absorbs the rounding of this function and of the comparisons with planes.
    #[inline]
    fn reach(&self, p: Vec3, radius: f32) -> f32 {
        radius + 2.0 * f32::EPSILON * (p.abs().max_element() + self.max_origin + 2.0 * radius)
    }

    /// Calls `visit` for the leaves whose cells come within `reach` of `p` on every axis.
    #[inline]
    fn for_each_leaf(&self, p: Vec3, reach: f32, mut visit: impl FnMut(&Leaf)) {
        // Four coordinates, so that the two bits of an axis need no bounds check.
        let p = [p.x, p.y, p.z, 0.0];
        let mut postponed = [0_u32; MAX_DEPTH];
        let mut waiting = 0;
        let mut current = 0;
        loop {
            let node = self.nodes[current];
            if !node.is_leaf() {
                let offset = p[node.axis()] - node.plane;
                let (left, right) = (current + 1, node.target());
                let (near, far) = if offset < 0.0 { (left, right) } else { (right, left) };
                if offset.abs() <= reach {
                    postponed[waiting] = far as u32;
                    waiting += 1;
                }
                current = near;
                continue;
            }
            visit(&self.leaves[node.target()]);
            if waiting == 0 {
                return;
            }
            waiting -= 1;
            current = postponed[waiting] as usize;
        }
    }

    #[inline]
    fn visit_owned(
        &self,
        leaf: &Leaf,
        p: Vec3,
        radius_squared: f32,
        visit: &mut impl FnMut(u32, f32, f32),
    ) {
        let places = &self.references[leaf.range()];
        for_each_pair(&self.beams, places, p, radius_squared, |beam, t, distance_squared| {
            if leaf.cell.owns(beam.segment.at(t)) {
                visit(beam.index, t, distance_squared);
            }
        });
    }
}
