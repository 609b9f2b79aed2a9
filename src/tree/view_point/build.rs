use glam::Vec3;
use rayon::prelude::*;

use super::vicinity::Vicinity;
use super::{bucket_start, Bucket, Plane, ViewPointTree, BUCKET_SIZE};
use crate::math::Aabb;

/// Points below which one thread makes a subtree.
const ALONE: usize = 1 << 15;

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
    let splits = Splits { count: points.len(), levels };
    let shared = (0..levels).take_while(|level| points.len() >> level > ALONE).count() as u32;
    let (mut planes, mut ranges) = (Vec::with_capacity((1 << levels) - 1), vec![points]);
    for level in 0..shared {
        let halves: Vec<_> = (ranges.into_par_iter().enumerate())
            .map(|(number, range)| splits.split(level, number, range))
            .collect();
        planes.extend(halves.iter().map(|(plane, _)| *plane));
        ranges = halves.into_iter().flat_map(|(_, halves)| halves).collect();
    }
    let below = |(number, range)| splits.below(shared, number, range);
    let numbered = ranges.into_iter().enumerate();
    let subtrees: Vec<Vec<Plane>> = match shared {
        // Other threads would have to be woken for a single task.
        0 => numbered.map(below).collect(),
        _ => numbered.collect::<Vec<_>>().into_par_iter().map(below).collect(),
    };
    for level in 0..levels - shared {
        let of_level = (1 << level) - 1..(2 << level) - 1;
        subtrees.iter().for_each(|subtree| planes.extend(&subtree[of_level.clone()]));
    }
    planes
}

/// How points fall to the two sides of planes.
struct Splits {
    count: usize,
    levels: u32,
}

impl Splits {
    /// Splits what one node of a level divides.
    fn split<'a>(
        &self,
        level: u32,
        number: usize,
        points: &'a mut [Point],
    ) -> (Plane, [&'a mut [Point]; 2]) {
        let buckets = 1_usize << (self.levels - level);
        let start = |bucket| bucket_start(self.count, self.levels, bucket);
        split(points, start(number * buckets + buckets / 2) - start(number * buckets))
    }

    /// The planes of a node and of all below it, level by level, in one thread.
    fn below(&self, level: u32, number: usize, points: &mut [Point]) -> Vec<Plane> {
        let (mut planes, mut ranges) = (Vec::new(), vec![points]);
        for below in 0..self.levels - level {
            let mut halves = Vec::with_capacity(2 << below);
            for (range, number) in ranges.into_iter().zip(number << below..) {
                let (plane, own) = self.split(level + below, number, range);
                planes.push(plane);
                halves.extend(own);
            }
            ranges = halves;
        }
        planes
    }
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
