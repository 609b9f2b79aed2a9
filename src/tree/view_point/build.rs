use glam::Vec3;
use rayon::prelude::*;

use super::vicinity::Vicinity;
use super::{bucket_start, Bucket, Plane, ViewPointTree, BUCKET_SIZE};
use crate::math::Aabb;

/// A point and its index in the caller's slice.
#[derive(Clone, Copy, Debug)]
struct Point {
    position: Vec3,
    index: u32,
}

impl ViewPointTree {
    /// Builds by median splits across the largest axis of the points' box.
    ///
    /// Points that are not finite have no neighbours and are left out;
    /// [`ViewPointTree::non_finite`] counts them. The result does not depend on the number of
    /// threads.
    ///
    /// # Panics
    ///
    /// If there are more than `u32::MAX` points.
    pub fn build(points: &[Vec3]) -> Self {
        assert!(u32::try_from(points.len()).is_ok(), "{} points exceed 32 bits", points.len());
        let mut kept: Vec<Point> = (0..)
            .zip(points)
            .filter(|(_, position)| position.is_finite())
            .map(|(index, &position)| Point { position, index })
            .collect();
        let levels = kept.len().div_ceil(BUCKET_SIZE).max(1).next_power_of_two().trailing_zeros();
        let planes = sort_into_buckets(&mut kept, levels);
        let bucket = |number| {
            let start = bucket_start(kept.len(), levels, number);
            fill(&kept[start..bucket_start(kept.len(), levels, number + 1)])
        };
        Self {
            planes,
            levels,
            vicinity: Vicinity::of(kept.iter().map(|point| point.position)),
            non_finite: points.len() - kept.len(),
            buckets: (0..1 << levels).map(bucket).collect(),
            count: kept.len(),
            order: kept.iter().map(|point| point.index).collect(),
        }
    }
}

fn fill(points: &[Point]) -> Bucket {
    let mut bucket = Bucket([[f32::NAN; BUCKET_SIZE]; 3]);
    for (lane, point) in points.iter().enumerate() {
        for axis in 0..3 {
            bucket.0[axis][lane] = point.position[axis];
        }
    }
    bucket
}

/// Orders the points by bucket and returns the planes between them, level by level.
fn sort_into_buckets(points: &mut [Point], levels: u32) -> Vec<Plane> {
    let count = points.len();
    let mut planes = Vec::with_capacity((1 << levels) - 1);
    let mut ranges = vec![points];
    for level in 0..levels {
        let buckets = 1_usize << (levels - level);
        let halves: Vec<_> = (ranges.into_par_iter().enumerate())
            .map(|(number, range)| {
                let first = bucket_start(count, levels, number * buckets);
                let middle = bucket_start(count, levels, number * buckets + buckets / 2);
                split(range, middle - first)
            })
            .collect();
        planes.extend(halves.iter().map(|(plane, _)| *plane));
        ranges = halves.into_iter().flat_map(|(_, halves)| halves).collect();
    }
    planes
}

/// Moves the `middle` points with the smallest coordinates on the largest axis to the front.
fn split(points: &mut [Point], middle: usize) -> (Plane, [&mut [Point]; 2]) {
    let mut bounds = Aabb::EMPTY;
    for point in points.iter() {
        bounds.grow(point.position);
    }
    let axis = bounds.extent().max_position();
    let by_coordinate = |a: &Point, b: &Point| a.position[axis].total_cmp(&b.position[axis]);
    points.select_nth_unstable_by(middle, by_coordinate);
    let plane = Plane { position: points[middle].position[axis], axis: axis as u32 };
    let (left, right) = points.split_at_mut(middle);
    (plane, [left, right])
}
