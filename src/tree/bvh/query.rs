use std::ops::Range;

use glam::{Vec3, Vec4};

use super::build::MAX_LEVELS;
use super::{Bvh, Node};
use crate::math::{mask, Segment};

/// Least slope of a ray against any axis, so that reciprocals are finite. On its way through the
/// root's box it moves a point by at most 4e-10 of the largest coordinate.
const MIN_SLOPE: f32 = 1e-10;

/// Three siblings may wait on each level.
const STACK: usize = 3 * MAX_LEVELS;

impl Bvh {
    /// Calls `visit(index)` once for every box that comes within `radius` (scene units) of the
    /// segment on every axis, and for others in the same leaves.
    ///
    /// Wide enough for pairs that [`Segment::project`] and [`Segment::approach`] compute: no box is
    /// missed because of rounding. The segment may be infinitely long, but if its origin or its
    /// direction is not finite, or its length or `radius` is NaN or negative, there are none.
    #[inline]
    pub fn query(&self, segment: &Segment, radius: f32, mut visit: impl FnMut(u32)) {
        self.for_each_leaf(segment, radius, |leaf| {
            self.order[leaf].iter().for_each(|&index| visit(index));
        });
    }

    /// Calls `visit` for the leaves that [`Bvh::query`] finds, with their positions in the order of
    /// the leaves.
    #[inline]
    pub(in crate::tree) fn for_each_leaf(
        &self,
        segment: &Segment,
        radius: f32,
        mut visit: impl FnMut(Range<usize>),
    ) {
        let is_line = segment.origin.is_finite() && segment.direction.is_finite();
        if self.nodes.is_empty() || !is_line || !(segment.length >= 0.0 && radius >= 0.0) {
            return;
        }
        let ray = Ray::new(segment, self.reach(segment, radius));
        let mut waiting = [0_u32; STACK];
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let node = &self.nodes[waiting[count] as usize];
            mask::for_each_lane::<4>(ray.met_children(node), |slot| {
                if node.count[slot] == Node::INTERIOR {
                    waiting[count] = node.first[slot];
                    count += 1;
                } else {
                    let first = node.first[slot] as usize;
                    visit(first..first + node.count[slot] as usize);
                }
            });
        }
    }

    /// `radius`, widened by two roundings.
    ///
    /// With u = ε/2, S the largest coordinate of the root's box and of the segment's origin, and per
    /// coordinate: the slab test adds the reach to the origin, subtracts that from a corner, and
    /// multiplies by a rounded reciprocal, which is worth `u(4 radius + 7S)`. A pair whose distance
    /// is below `radius` as computed may be apart by `u(4 radius + 7S)` more: `approach` subtracts
    /// the origins, adds and subtracts products of at most `2S + radius`, and the point in the box
    /// is [`Segment::at`]'s. The sum is doubled; the last term covers underflow.
    #[inline]
    fn reach(&self, segment: &Segment, radius: f32) -> f32 {
        let corner = self.bounds.min.abs().max(self.bounds.max.abs());
        let scale = corner.max(segment.origin.abs()).max_element();
        radius + 16.0 * f32::EPSILON * (radius + scale) + f32::MIN_POSITIVE
    }
}

/// A segment, ready for slab tests against four boxes [Kay 1986].
struct Ray {
    /// Per axis, which of the corners (0 the least, 1 the greatest) is met first.
    near: [usize; 3],
    /// The origin, moved forward and back by the reach, so that a slab without reach does.
    ahead: [Vec4; 3],
    behind: [Vec4; 3],
    inverse_slope: [Vec4; 3],
    length: Vec4,
}

impl Ray {
    #[inline]
    fn new(segment: &Segment, reach: f32) -> Self {
        let slope = segment.direction.abs().max(Vec3::splat(MIN_SLOPE)).copysign(segment.direction);
        let forward = Vec3::splat(reach).copysign(slope);
        let splat = |v: Vec3| v.to_array().map(Vec4::splat);
        Self {
            near: slope.to_array().map(|slope| usize::from(slope < 0.0)),
            ahead: splat(segment.origin + forward),
            behind: splat(segment.origin - forward),
            inverse_slope: splat(slope.recip()),
            length: Vec4::splat(segment.length),
        }
    }

    /// The children whose boxes the segment meets, one bit each.
    ///
    /// An infinite reach may make NaN of the boxes of absent children; they are leaves of no length.
    #[inline]
    fn met_children(&self, node: &Node) -> u32 {
        let (mut enter, mut leave) = (Vec4::ZERO, self.length);
        for axis in 0..3 {
            let near = node.corners[self.near[axis] & 1][axis];
            let far = node.corners[self.near[axis] & 1 ^ 1][axis];
            enter = ((near - self.ahead[axis]) * self.inverse_slope[axis]).max(enter);
            leave = ((far - self.behind[axis]) * self.inverse_slope[axis]).min(leave);
        }
        enter.cmple(leave).bitmask()
    }
}
