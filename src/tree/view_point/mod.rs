//! The kd-tree over visible points, a classic one [Bentley 1975; Collin 2013 §5.1].
//!
//! Perfectly balanced, so neither children nor leaves need pointers: planes lie level by level (the
//! children of plane `i` are `2i + 1` and `2i + 2`), points lie bucket by bucket, and arithmetic
//! finds both. A bucket holds its coordinates axis by axis, so that one instruction tests several points.

mod build;
mod query;
mod validate;
mod vicinity;

use crate::tree::heap_bytes;
use glam::Vec3;
use vicinity::Vicinity;

/// A kd-tree over points that finds those within a radius of a place.
///
/// Coordinates and radii are in scene units. Points keep the index they had in the slice given to
/// `build`.
#[derive(Clone, Debug)]
pub struct ViewPointTree {
    /// `2^levels − 1` planes.
    planes: Vec<Plane>,
    /// `2^levels` buckets of points, equally full but for one point.
    buckets: Vec<Bucket>,
    count: usize,
    /// The index of each point in the order of the buckets; empty once it was taken.
    order: Vec<u32>,
    levels: u32,
    vicinity: Vicinity,
    non_finite: usize,
}

impl ViewPointTree {
    /// Points in the tree.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether no query can find anything.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Points left out because a coordinate is NaN or infinite.
    pub fn non_finite(&self) -> usize {
        self.non_finite
    }

    /// Bytes on the heap.
    pub fn memory_bytes(&self) -> usize {
        let tree = heap_bytes(&self.planes) + heap_bytes(&self.buckets) + heap_bytes(&self.order);
        tree + self.vicinity.memory_bytes()
    }

    /// Hands out the indices of the points in the order of the buckets. From now on points are numbered in that order: an
    /// owner who sorts by it finds neighbours side by side.
    pub fn take_order(&mut self) -> Vec<u32> {
        std::mem::take(&mut self.order)
    }

    fn index(&self, place: usize) -> u32 {
        self.order.get(place).copied().unwrap_or(place as u32)
    }
}

/// Most points in a bucket; testing this many is as cheap as two more planes.
const BUCKET_SIZE: usize = 8;

/// Coordinates by axis; NaN, which is near nothing, where there is no point.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
struct Bucket([[f32; BUCKET_SIZE]; 3]);

impl Bucket {
    #[inline]
    fn position(&self, lane: usize) -> Vec3 {
        Vec3::from(self.0.map(|axis| axis[lane]))
    }
}

/// A splitting plane: coordinates `<= position` on the left, `>= position` on the right.
#[derive(Clone, Copy, Debug)]
struct Plane {
    position: f32,
    axis: u32,
}

/// Where bucket `bucket` starts if `count` points fill `2^levels` buckets evenly.
#[inline]
fn bucket_start(count: usize, levels: u32, bucket: usize) -> usize {
    // 32 bits of points times at most 32 bits of buckets.
    ((count as u64 * bucket as u64) >> levels) as usize
}
