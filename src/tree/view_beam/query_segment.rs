use glam::Vec3;

use super::{Leaf, ViewBeamTree};
use crate::math::{Aabb, Approach, Segment};
use crate::tree::beam::for_each_pair_along;
use crate::tree::interval::Interval;

/// Least slope of a photon beam against any axis, so that reciprocals are finite. Over the length
/// of the beam it moves a point by at most 4e-10 of the largest coordinate, which the reach covers.
const MIN_SLOPE: f32 = 1e-10;

impl ViewBeamTree {
    /// Calls `visit(index, approach)` once for every view beam that the photon beam contributes to.
    ///
    /// That is, [`Segment::approach`] of view beam and photon beam exists, `t` is in `[0, length)`
    /// of the view beam, `t_other` in `[0, length)` of the photon beam, and the distance is below
    /// `radius` (scene units), all as computed. The order of the calls is that of the leaves. A
    /// photon beam that is not finite has no pairs: callers clip those that leave the scene. If
    /// `radius` is NaN or `<= 0`, there are none either.
    #[inline]
    pub fn query_segment(
        &self,
        photon_beam: &Segment,
        radius: f32,
        mut visit: impl FnMut(u32, Approach),
    ) {
        if !photon_beam.is_finite() || radius.is_nan() || radius <= 0.0 {
            return;
        }
        let ray = WideRay::new(photon_beam, self.reach_of_segment(photon_beam, radius));
        let radius_squared = radius * radius;
        let divide = |part, axis, plane| ray.divide(part, axis, plane);
        self.descend(ray.whole, divide, |leaf, interval| {
            if ray.meets(&leaf.bounds, interval) {
                self.visit_owned_by_segment(leaf, photon_beam, radius_squared, &mut visit);
            }
        });
    }

    /// `radius`, widened by what rounding may put between a photon beam and the closest point that
    /// owns its pair, and by what the traversal rounds.
    ///
    /// With u = ε/2 and per coordinate: `approach` computes `r = fl(fl(fl(p − o) + B) − A)` with `A =
    /// fl(t·d)` and `B = fl(t_other·e)`, p and o the origins; the view beam's point is `c = fl(o +
    /// A)`. A pair has `fl(r²) < fl(radius²)`, so `|r| < radius`. Let q be the largest coordinate of
    /// the photon beam; it bounds `p + B` because [`Segment::at`] is monotone. Adding up the
    /// roundings, `|p + t_other·e − c| <= |r| + u(4|r| + 5q + 2|o|)` to first order. A parameter
    /// where the beam passes a plane, computed in [`WideRay`] by five roundings, is off by less than
    /// `u(8q + 5 radius)` in terms of the coordinate. The sum, `u(9 radius + 13q + 2|o|)`, is doubled;
    /// the last term covers underflow.
    #[inline]
    fn reach_of_segment(&self, photon_beam: &Segment, radius: f32) -> f32 {
        let end = photon_beam.at(photon_beam.length);
        let q = photon_beam.origin.abs().max(end.abs()).max_element();
        radius + 16.0 * f32::EPSILON * (radius + q + self.max_origin) + f32::MIN_POSITIVE
    }

    #[inline]
    fn visit_owned_by_segment(
        &self,
        leaf: &Leaf,
        photon_beam: &Segment,
        radius_squared: f32,
        visit: &mut impl FnMut(u32, Approach),
    ) {
        let places = &self.references[leaf.range()];
        for_each_pair_along(&self.beams, places, photon_beam, radius_squared, |beam, approach| {
            if leaf.cell.owns(beam.segment.at(approach.t)) {
                visit(beam.index, approach);
            }
        });
    }
}

/// A photon beam and how far around it a pair may lie.
struct WideRay {
    /// Four coordinates, so that the two bits of an axis need no bounds check.
    origin: [f32; 4],
    inverse_slope: [f32; 4],
    /// The reach in units of the parameter, per axis.
    reach: [f32; 4],
    whole: Interval,
}

impl WideRay {
    #[inline]
    fn new(segment: &Segment, reach: f32) -> Self {
        let slope = segment.direction.abs().max(Vec3::splat(MIN_SLOPE));
        let inverse_slope = slope.copysign(segment.direction).recip();
        Self {
            origin: segment.origin.extend(0.0).to_array(),
            inverse_slope: inverse_slope.extend(1.0).to_array(),
            reach: (reach * inverse_slope.abs()).extend(0.0).to_array(),
            whole: Interval { start: 0.0, end: segment.length },
        }
    }

    /// The parts of an interval that lie below a plane and above it, or within reach of it; none where a part is empty. The
    /// parameter of a pair fulfils the widened condition of every plane above the leaf that owns the pair, so it is never lost.
    ///
    /// Where an overflow makes NaN, `min` and `max` keep the old end.
    #[inline]
    fn divide(&self, interval: Interval, axis: usize, plane: f32) -> [Option<Interval>; 2] {
        let crossing = (plane - self.origin[axis]) * self.inverse_slope[axis];
        let first = Interval { end: interval.end.min(crossing + self.reach[axis]), ..interval };
        let second =
            Interval { start: interval.start.max(crossing - self.reach[axis]), ..interval };
        let sides = if self.inverse_slope[axis] > 0.0 { [first, second] } else { [second, first] };
        sides.map(|part| (!part.is_empty()).then_some(part))
    }

    /// Whether the interval comes within reach of a box on all axes at once.
    #[inline]
    fn meets(&self, bounds: &Aabb, mut interval: Interval) -> bool {
        for axis in 0..3 {
            let at = |plane: f32| (plane - self.origin[axis]) * self.inverse_slope[axis];
            let (min, max) = (at(bounds.min[axis]), at(bounds.max[axis]));
            interval.start = interval.start.max(min.min(max) - self.reach[axis]);
            interval.end = interval.end.min(min.max(max) + self.reach[axis]);
        }
        !interval.is_empty()
    }
}
