use glam::Vec3;

use super::{bucket_start, Bucket, ViewPointTree, BUCKET_SIZE};
use crate::math::{mask, Aabb};
use crate::tree::MAX_DEPTH;

/// Places that look together at most.
const PACKET: usize = 32;
/// Edge of the box around them at most, in radii.
const PACKET_EDGE: f32 = 4.0;

impl ViewPointTree {
    /// Calls `visit(index, distance_squared)` once for every point closer to `p` than `radius`
    /// (scene units).
    ///
    /// Strictly closer, both squares as computed in single precision. The order of the calls is
    /// that of the buckets. If `p` or `radius` is NaN, or `radius <= 0`, there are none.
    #[inline]
    pub fn query(&self, p: Vec3, radius: f32, mut visit: impl FnMut(u32, f32)) {
        self.query_packet(&[p], radius, |_, index, _, distance_squared| {
            visit(index, distance_squared)
        });
    }

    /// Whether [`ViewPointTree::query`] may find anything: asked beforehand, it spares a place in the order of photons.
    #[inline]
    pub fn may_find(&self, p: Vec3, radius: f32) -> bool {
        self.vicinity.may_hold(p, radius)
    }

    /// For many places, neighbours in space one after another: calls `visit(which, index, position, distance_squared)` for
    /// every point closer to `places[which]` than `radius`, as [`ViewPointTree::query`] does. Those that lie close together
    /// look for the buckets around them once.
    #[inline]
    pub fn query_all(
        &self,
        places: &[Vec3],
        radius: f32,
        mut visit: impl FnMut(usize, u32, Vec3, f32),
    ) {
        let mut first = 0;
        while first < places.len() {
            let end = first + packet(&places[first..], PACKET_EDGE * radius);
            self.query_packet(&places[first..end], radius, |which, index, position, d2| {
                visit(first + which, index, position, d2);
            });
            first = end;
        }
    }

    #[inline]
    fn query_packet(
        &self,
        places: &[Vec3],
        radius: f32,
        mut visit: impl FnMut(usize, u32, Vec3, f32),
    ) {
        if radius.is_nan() || radius <= 0.0 {
            return;
        }
        let radius_squared = radius * radius;
        let mut bounds = Aabb::EMPTY;
        places.iter().filter(|p| !p.is_nan()).for_each(|&p| bounds.grow(p));
        self.for_each_bucket(&bounds, radius, |bucket| {
            let start = bucket_start(self.count, self.levels, bucket);
            let points = &self.buckets[bucket];
            for (which, &p) in places.iter().enumerate() {
                let distances = points.distances_squared(p);
                let near = mask::below(&distances, &[radius_squared; BUCKET_SIZE]);
                mask::for_each_lane::<BUCKET_SIZE>(near, |lane| {
                    let index = self.index(start + lane);
                    visit(which, index, points.position(lane), distances[lane]);
                });
            }
        });
    }

    /// Calls `visit` for the buckets whose cells come closer to a box than `radius` on every axis.
    ///
    /// No slack is owed to rounding: a point beyond a plane is no nearer than the plane, and
    /// subtraction, squaring and summation of squares are monotone as computed.
    #[inline]
    fn for_each_bucket(&self, around: &Aabb, radius: f32, mut visit: impl FnMut(usize)) {
        // Four coordinates, so that two bits of axis need no bounds check.
        let [low, high] = [around.min, around.max].map(|p| [p.x, p.y, p.z, 0.0]);
        let mut postponed = [0_u32; MAX_DEPTH];
        let mut waiting = 0;
        let mut current = 0;
        loop {
            while let Some(plane) = self.planes.get(current) {
                let axis = (plane.axis & 3) as usize;
                let (left, right) = (2 * current + 1, 2 * current + 2);
                let goes_left = low[axis] - plane.position < radius;
                let goes_right = high[axis] - plane.position > -radius;
                if goes_left && goes_right {
                    postponed[waiting] = right as u32;
                    waiting += 1;
                }
                current = if goes_left { left } else { right };
            }
            visit(current - self.planes.len());
            if waiting == 0 {
                return;
            }
            waiting -= 1;
            current = postponed[waiting] as usize;
        }
    }
}

/// How many of the first places look together: those in a box of this edge, one at least.
#[inline]
fn packet(places: &[Vec3], edge: f32) -> usize {
    let mut bounds = Aabb::EMPTY;
    let fits = |&p: &Vec3| {
        bounds.grow(p);
        bounds.extent().max_element() <= edge
    };
    places.iter().take(PACKET).copied().take_while(fits).count().max(1)
}

impl Bucket {
    /// As [`Vec3::distance_squared`], bit by bit.
    #[inline]
    fn distances_squared(&self, p: Vec3) -> [f32; BUCKET_SIZE] {
        let [x, y, z] = &self.0;
        std::array::from_fn(|lane| {
            let (x, y, z) = (x[lane] - p.x, y[lane] - p.y, z[lane] - p.z);
            x * x + y * y + z * z
        })
    }
}
