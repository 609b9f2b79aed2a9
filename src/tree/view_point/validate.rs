use super::{bucket_start, ViewPointTree, BUCKET_SIZE};
use crate::math::Aabb;

impl ViewPointTree {
    /// Checks every invariant that [`ViewPointTree::query`] relies on and describes the first
    /// violation: a perfect tree, finite points, each index once, and each point in the closed cell
    /// of its bucket.
    pub fn validate(&self) -> Result<(), String> {
        if self.planes.len() + 1 != 1 << self.levels {
            return Err(format!("{} planes do not make {} levels", self.planes.len(), self.levels));
        }
        let mut indices: Vec<u32> = (0..self.count).map(|place| self.index(place)).collect();
        indices.sort_unstable();
        if indices.windows(2).any(|pair| pair[0] == pair[1]) {
            return Err("a point is stored twice".into());
        }
        self.check_cell(0, Aabb::UNBOUNDED)
    }

    fn check_cell(&self, position: usize, cell: Aabb) -> Result<(), String> {
        let Some(plane) = self.planes.get(position) else {
            return self.check_bucket(position - self.planes.len(), &cell);
        };
        let axis = plane.axis as usize;
        if axis >= 3 || !(cell.min[axis] <= plane.position && plane.position <= cell.max[axis]) {
            return Err(format!("{plane:?}, number {position}, lies outside {cell:?}"));
        }
        let (mut left, mut right) = (cell, cell);
        left.max[axis] = plane.position;
        right.min[axis] = plane.position;
        self.check_cell(2 * position + 1, left)?;
        self.check_cell(2 * position + 2, right)
    }

    fn check_bucket(&self, bucket: usize, cell: &Aabb) -> Result<(), String> {
        let start = bucket_start(self.count, self.levels, bucket);
        let count = bucket_start(self.count, self.levels, bucket + 1) - start;
        for lane in 0..BUCKET_SIZE {
            let point = self.buckets[bucket].position(lane);
            let belongs = if lane < count {
                point.is_finite()
                    && cell.is_within_reach(point, 0.0)
                    && self.may_find(point, f32::MIN_POSITIVE)
            } else {
                point.is_nan()
            };
            if !belongs {
                return Err(format!(
                    "{point}, number {lane} of {count}, is in bucket {bucket}, {cell:?}"
                ));
            }
        }
        Ok(())
    }
}
