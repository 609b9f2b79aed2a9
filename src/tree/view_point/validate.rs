use super::{bucket_start, ViewPointTree};
use crate::math::Aabb;

impl ViewPointTree {
    /// Checks every invariant that [`ViewPointTree::query`] relies on and describes the first
    /// violation: a perfect tree, finite points, each index once, and each point in the closed cell
    /// of its bucket.
    pub fn validate(&self) -> Result<(), String> {
        if self.planes.len() + 1 != 1 << self.levels {
            return Err(format!("{} planes do not make {} levels", self.planes.len(), self.levels));
        }
        let mut indices: Vec<u32> = self.points.iter().map(|point| point.index).collect();
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
        let start = bucket_start(self.points.len(), self.levels, bucket);
        let end = bucket_start(self.points.len(), self.levels, bucket + 1);
        let stray = self.points[start..end].iter().find(|point| {
            !(point.position.is_finite() && cell.is_within_reach(point.position, 0.0))
        });
        match stray {
            Some(point) => Err(format!("{point:?} lies outside bucket {bucket}, {cell:?}")),
            None => Ok(()),
        }
    }
}
