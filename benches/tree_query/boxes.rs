//! The crate `bvh`: a hierarchy over the boxes of receivers, widened by the radius.

use bvh::aabb::{Aabb, Bounded, IntersectsAabb};
use bvh::bounding_hierarchy::BHShape;
use bvh::bvh::Bvh;
use glam::Vec3;
use nalgebra::Point3;
use vpt::math::Segment;

/// Share by which boxes are wider than the radius, for roundings.
const WIDER: f32 = 1e-4;

pub struct Boxes {
    bvh: Bvh<f32, 3>,
    shapes: Vec<Shape>,
}

struct Shape {
    bounds: Aabb<f32, 3>,
    index: usize,
    node: usize,
}

impl Bounded<f32, 3> for Shape {
    fn aabb(&self) -> Aabb<f32, 3> {
        self.bounds
    }
}

impl BHShape<f32, 3> for Shape {
    fn set_bh_node_index(&mut self, node: usize) {
        self.node = node;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

fn point(v: Vec3) -> Point3<f32> {
    Point3::new(v.x, v.y, v.z)
}

fn vector(p: Point3<f32>) -> Vec3 {
    Vec3::new(p.x, p.y, p.z)
}

pub fn around_point(p: Vec3, radius: f32) -> Aabb<f32, 3> {
    let reach = Vec3::splat(radius * (1.0 + WIDER));
    Aabb::with_bounds(point(p - reach), point(p + reach))
}

pub fn around_beam(beam: &Segment, radius: f32) -> Aabb<f32, 3> {
    around_point(beam.origin, radius).join(&around_point(beam.at(beam.length), radius))
}

impl Boxes {
    pub fn over(boxes: impl Iterator<Item = Aabb<f32, 3>>) -> Self {
        let mut shapes: Vec<_> =
            boxes.enumerate().map(|(index, bounds)| Shape { bounds, index, node: 0 }).collect();
        Boxes { bvh: Bvh::build(&mut shapes), shapes }
    }

    /// Receivers whose boxes hold a point.
    pub fn around(&self, p: Vec3, mut visit: impl FnMut(usize)) {
        self.bvh.traverse_iterator(&point(p), &self.shapes).for_each(|shape| visit(shape.index));
    }

    /// Receivers whose boxes a segment meets.
    pub fn along(&self, segment: &Segment, mut visit: impl FnMut(usize)) {
        let ray = Ray { segment: *segment, inverse: segment.direction.recip() };
        self.bvh.traverse_iterator(&ray, &self.shapes).for_each(|shape| visit(shape.index));
    }
}

struct Ray {
    segment: Segment,
    inverse: Vec3,
}

impl IntersectsAabb<f32, 3> for Ray {
    fn intersects_aabb(&self, bounds: &Aabb<f32, 3>) -> bool {
        let at_min = (vector(bounds.min) - self.segment.origin) * self.inverse;
        let at_max = (vector(bounds.max) - self.segment.origin) * self.inverse;
        let enter = at_min.min(at_max).max_element().max(0.0);
        enter <= at_min.max(at_max).min_element().min(self.segment.length)
    }
}
