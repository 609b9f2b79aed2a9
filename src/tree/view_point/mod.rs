//! The kd-tree over visible points, a classic one [Bentley 1975; Collin 2013 §5.1].
//!
//! Perfectly balanced, so neither children nor leaves need pointers: planes lie level by level (the
//! children of plane `i` are `2i + 1` and `2i + 2`), points lie bucket by bucket, and arithmetic
//! finds both.

mod build;
mod query;
mod validate;

use glam::Vec3;

/// A kd-tree over points that finds those within a radius of a place.
///
/// Coordinates and radii are in scene units. Points keep the index they had in the slice given to
/// `build`.
#[derive(Clone, Debug)]
pub struct ViewPointTree {
    /// `2^levels − 1` planes.
    planes: Vec<Plane>,
    /// `2^levels` buckets of points, equally full but for one point.
    points: Vec<Point>,
    levels: u32,
    non_finite: usize,
}

impl ViewPointTree {
    /// Points in the tree.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether no query can find anything.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// Points left out because a coordinate is NaN or infinite.
    pub fn non_finite(&self) -> usize {
        self.non_finite
    }

    /// Bytes on the heap.
    pub fn memory_bytes(&self) -> usize {
        size_of_val(&self.planes[..]) + size_of_val(&self.points[..])
    }
}

/// A point and its index in the caller's slice.
#[derive(Clone, Copy, Debug)]
struct Point {
    position: Vec3,
    index: u32,
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
