//! Where any point is near: most photons land where the eye sees nothing, and one bit tells.

use crate::math::Aabb;
use crate::tree::heap_bytes;
use glam::Vec3;

/// Cells along the longest axis.
const CELLS: std::ops::RangeInclusive<f32> = 4.0..=128.0;
/// Radii in edges of a cell up to which the neighbours of a point's cell hold all that is near it, but for rounding.
const REACH: f32 = 0.99;
/// Roundings of coordinates in an edge of a cell, at least: they are below a hundredth of it.
const RESOLVED: f32 = 1024.0;

/// A bit for each cell of a grid around points that is near one of them.
#[derive(Clone, Debug, Default)]
pub(super) struct Vicinity {
    min: Vec3,
    /// Cells for a unit of length, and along each axis.
    scale: f32,
    size: [usize; 3],
    /// Radii that it is good for.
    reach: f32,
    bits: Vec<u64>,
}

impl Vicinity {
    /// Around finite points, in cells about as many as there are points where these fill space.
    pub fn of(points: impl ExactSizeIterator<Item = Vec3> + Clone) -> Self {
        let mut bounds = Aabb::EMPTY;
        points.clone().for_each(|p| bounds.grow(p));
        let cells = (points.len() as f32).cbrt().clamp(*CELLS.start(), *CELLS.end());
        let edge = bounds.extent().max_element() / cells;
        // Points at one place, or nearly for where they are, or so far apart that the box is infinitely large, are left to the
        // tree.
        let farthest = bounds.min.abs().max(bounds.max.abs()).max_element();
        let is_resolved = edge > RESOLVED * f32::EPSILON * farthest;
        let is_finite = (8.0 * farthest).is_finite() && (1.0 / edge).is_finite();
        if !(is_resolved && edge.is_normal() && is_finite) {
            return Vicinity::default();
        }
        // More than a cell on either side of the box, for what is beyond it and yet near, and for roundings.
        let scale = 1.0 / edge;
        let along = |axis: usize| (bounds.extent()[axis] * scale) as usize + 4;
        let size = [0, 1, 2].map(along);
        let bits = vec![0; size.iter().product::<usize>().div_ceil(64)];
        let min = bounds.min - Vec3::splat(1.25 * edge);
        let mut vicinity = Vicinity { min, scale, size, reach: REACH * edge, bits };
        let mut is_done = vec![false; size.iter().product()];
        for p in points {
            let cell = vicinity.cell(p).expect("it is within");
            if !std::mem::replace(&mut is_done[cell], true) {
                vicinity.mark_around(cell);
            }
        }
        vicinity
    }

    pub fn memory_bytes(&self) -> usize {
        heap_bytes(&self.bits)
    }

    /// Whether a point may be closer to `p` than `radius`; if not, none is.
    #[inline]
    pub fn may_hold(&self, p: Vec3, radius: f32) -> bool {
        radius > self.reach
            || self.cell(p).is_some_and(|cell| self.bits[cell / 64] >> (cell % 64) & 1 == 1)
    }

    /// The cell of a place; none beyond the grid.
    #[inline]
    fn cell(&self, p: Vec3) -> Option<usize> {
        let place = (p - self.min) * self.scale;
        // The cast sends what is negative, or not a number, to 0.
        let [x, y, z] = place.to_array().map(|along| along as usize);
        let [columns, rows, layers] = self.size;
        let is_within = place.cmpge(Vec3::ZERO).all() && x < columns && y < rows && z < layers;
        is_within.then_some((z * rows + y) * columns + x)
    }

    /// Sets the bits of a cell that is none of the outermost, and of all around it.
    fn mark_around(&mut self, cell: usize) {
        let [columns, rows, _] = self.size;
        let (row, layer) = (columns, columns * rows);
        for middle in [cell - layer, cell, cell + layer] {
            for middle in [middle - row, middle, middle + row] {
                for cell in middle - 1..=middle + 1 {
                    self.bits[cell / 64] |= 1 << (cell % 64);
                }
            }
        }
    }
}
