use glam::Vec3;

use super::{bucket_start, Bucket, ViewPointTree, BUCKET_SIZE};
use crate::math::mask;
use crate::tree::MAX_DEPTH;

impl ViewPointTree {
    /// Calls `visit(index, distance_squared)` once for every point closer to `p` than `radius`
    /// (scene units).
    ///
    /// Strictly closer, both squares as computed in single precision. The order of the calls is
    /// that of the buckets. If `p` or `radius` is NaN, or `radius <= 0`, there are none.
    #[inline]
    pub fn query(&self, p: Vec3, radius: f32, mut visit: impl FnMut(u32, f32)) {
        self.query_places(p, radius, |index, _, distance_squared| visit(index, distance_squared));
    }

    /// Whether [`ViewPointTree::query`] may find anything: asked beforehand, it spares a place in the order of photons.
    #[inline]
    pub fn may_find(&self, p: Vec3, radius: f32) -> bool {
        self.vicinity.may_hold(p, radius)
    }

    /// As [`ViewPointTree::query`], with `visit(index, position, distance_squared)`.
    #[inline]
    pub fn query_places(&self, p: Vec3, radius: f32, mut visit: impl FnMut(u32, Vec3, f32)) {
        if radius.is_nan() || radius <= 0.0 {
            return;
        }
        let radius_squared = radius * radius;
        self.for_each_bucket(p, radius, |bucket| {
            let start = bucket_start(self.count, self.levels, bucket);
            let distances = self.buckets[bucket].distances_squared(p);
            let mut near = mask::below(&distances, &[radius_squared; BUCKET_SIZE]);
            while near != 0 {
                let lane = near.trailing_zeros() as usize % BUCKET_SIZE;
                near &= near - 1;
                let position = self.buckets[bucket].position(lane);
                visit(self.index(start + lane), position, distances[lane]);
            }
        });
    }

    /// Calls `visit` for the buckets whose cells come closer to `p` than `radius` on every axis.
    ///
    /// No slack is owed to rounding: a point beyond a plane is no nearer than the plane, and
    /// subtraction, squaring and summation of squares are monotone as computed.
    #[inline]
    fn for_each_bucket(&self, p: Vec3, radius: f32, mut visit: impl FnMut(usize)) {
        // Four coordinates, so that two bits of axis need no bounds check.
        let p = [p.x, p.y, p.z, 0.0];
        let mut postponed = [0_u32; MAX_DEPTH];
        let mut waiting = 0;
        let mut current = 0;
        loop {
            while let Some(plane) = self.planes.get(current) {
                let offset = p[(plane.axis & 3) as usize] - plane.position;
                let (left, right) = (2 * current + 1, 2 * current + 2);
                let (near, far) = if offset < 0.0 { (left, right) } else { (right, left) };
                if offset.abs() < radius {
                    postponed[waiting] = far as u32;
                    waiting += 1;
                }
                current = near;
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
