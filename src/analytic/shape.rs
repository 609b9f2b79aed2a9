use super::ray::{Ray, CLEARANCE};
use super::warp;
use crate::math::Aabb;
use crate::scene::Place;
use glam::DVec3;
use std::f64::consts::PI;

/// A surface without thickness. It has a front, to which its normal points, and a back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// Its front is the outside, or the inside if `inward`.
    Sphere { center: DVec3, radius: f64, inward: bool },
    /// `center ± half_u ± half_v`, edges perpendicular; its front is that of `half_u x half_v`.
    Rectangle { center: DVec3, half_u: DVec3, half_v: DVec3 },
}

impl Shape {
    /// Distance to the first crossing beyond the [`CLEARANCE`].
    pub(super) fn intersect(&self, ray: &Ray) -> Option<f64> {
        let clearance = CLEARANCE * self.largest_coordinate();
        match *self {
            Shape::Sphere { center, radius, .. } => {
                let to_origin = ray.origin - center;
                let b = to_origin.dot(ray.direction);
                // The distance of the line from the center, without cancellation.
                let miss = to_origin - b * ray.direction;
                let half_chord = (radius * radius - miss.length_squared()).sqrt();
                [-b - half_chord, -b + half_chord].into_iter().find(|&t| t > clearance)
            }
            Shape::Rectangle { center, half_u, half_v } => {
                let normal = half_u.cross(half_v);
                let distance = (center - ray.origin).dot(normal) / ray.direction.dot(normal);
                let offset = ray.at(distance) - center;
                let inside = |half: DVec3| offset.dot(half).abs() <= half.length_squared();
                (distance > clearance && inside(half_u) && inside(half_v)).then_some(distance)
            }
        }
    }

    /// The largest distance from the origin that a point of the surface may have along an axis.
    fn largest_coordinate(&self) -> f64 {
        match *self {
            Shape::Sphere { center, radius, .. } => center.abs().max_element() + radius,
            Shape::Rectangle { center, half_u, half_v } => {
                (center.abs() + half_u.abs() + half_v.abs()).max_element()
            }
        }
    }

    /// A ball around it.
    pub(super) fn place(&self) -> Place {
        let (centre, radius) = match *self {
            Shape::Sphere { center, radius, .. } => (center, radius),
            Shape::Rectangle { center, half_u, half_v } => (center, (half_u + half_v).length()),
        };
        Place { centre: centre.as_vec3(), radius: radius as f32 }
    }

    /// Unit normal of the front at a point of the surface.
    pub(super) fn front_normal(&self, position: DVec3) -> DVec3 {
        match *self {
            Shape::Sphere { center, inward, .. } => {
                let outward = (position - center).normalize();
                if inward {
                    -outward
                } else {
                    outward
                }
            }
            Shape::Rectangle { half_u, half_v, .. } => half_u.cross(half_v).normalize(),
        }
    }

    /// A point uniform over the area.
    pub(super) fn sample(&self, u: [f64; 2]) -> DVec3 {
        match *self {
            Shape::Sphere { center, radius, .. } => center + radius * warp::sphere(u),
            Shape::Rectangle { center, half_u, half_v } => {
                center + (2.0 * u[0] - 1.0) * half_u + (2.0 * u[1] - 1.0) * half_v
            }
        }
    }

    pub(super) fn area(&self) -> f64 {
        match *self {
            Shape::Sphere { radius, .. } => 4.0 * PI * radius * radius,
            Shape::Rectangle { half_u, half_v, .. } => 4.0 * half_u.cross(half_v).length(),
        }
    }

    pub(super) fn bounds(&self) -> Aabb {
        let (center, half) = match *self {
            Shape::Sphere { center, radius, .. } => (center, DVec3::splat(radius)),
            Shape::Rectangle { center, half_u, half_v } => (center, half_u.abs() + half_v.abs()),
        };
        Aabb { min: (center - half).as_vec3(), max: (center + half).as_vec3() }
    }

    /// Distance from `point` to the farthest point of the surface.
    pub(super) fn reach(&self, point: DVec3) -> f64 {
        match *self {
            Shape::Sphere { center, radius, .. } => (center - point).length() + radius,
            Shape::Rectangle { center, half_u, half_v } => [half_u + half_v, half_u - half_v]
                .into_iter()
                .flat_map(|corner| [center + corner, center - corner])
                .map(|corner| (corner - point).length())
                .fold(0.0, f64::max),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::VACUUM;

    fn ray(origin: DVec3, direction: DVec3) -> Ray {
        Ray { origin, direction, medium: VACUUM }
    }

    #[test]
    fn sphere_is_met_from_outside_from_inside_and_not_again_from_its_surface() {
        let sphere = Shape::Sphere { center: DVec3::Z, radius: 0.5, inward: false };
        let toward = |z: f64| sphere.intersect(&ray(DVec3::new(0.0, 0.0, z), DVec3::Z));
        assert_eq!(toward(-1.0), Some(1.5));
        assert_eq!(toward(1.0), Some(0.5));
        assert_eq!(toward(0.5), Some(1.0));
        assert_eq!(toward(1.5), None);
        assert_eq!(sphere.intersect(&ray(DVec3::X, DVec3::Z)), None);
    }

    #[test]
    fn rectangle_has_edges_and_two_sides() {
        let half = DVec3::new(1.0, 0.0, 0.0);
        let sheet = Shape::Rectangle { center: DVec3::ZERO, half_u: half, half_v: 2.0 * DVec3::Y };
        let down = |x: f64, y: f64| sheet.intersect(&ray(DVec3::new(x, y, 1.0), -DVec3::Z));
        assert_eq!(down(0.9, 1.9), Some(1.0));
        assert_eq!(down(1.1, 0.0), None);
        assert_eq!(down(0.0, 2.1), None);
        assert_eq!(sheet.front_normal(DVec3::ZERO), DVec3::Z);
        assert_eq!(sheet.area(), 8.0);
    }
}
