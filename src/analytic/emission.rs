use super::ray::Ray;
use super::surface::Surface;
use super::warp;
use crate::math::Rgb;
use crate::scene::{EmitterFacts, Place, VACUUM};
use glam::DVec3;
use std::f64::consts::PI;

/// A lamp that is not a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Lamp {
    /// The same intensity [W/sr] in all directions, from a point within a fog or [`VACUUM`].
    Point { position: DVec3, intensity: Rgb, medium: u32 },
    /// The same radiance [W/(m² sr)] from everywhere outside, which is vacuum.
    Sky { radiance: Rgb },
    /// Parallel light from outside, which travels along a unit vector; irradiance [W/m²] normal to it.
    Sun { direction: DVec3, irradiance: Rgb },
}

impl Lamp {
    /// Radiance seen where a ray leaves the scene.
    pub(super) fn sky_radiance(&self) -> Rgb {
        match *self {
            Lamp::Sky { radiance } => radiance,
            Lamp::Point { .. } | Lamp::Sun { .. } => Rgb::ZERO,
        }
    }
}

/// Everything that emits, lamps and surfaces, chosen with equal probability.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Emitter {
    Lamp(Lamp),
    Surface(Surface),
}

/// A sphere around all surfaces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BoundingSphere {
    pub center: DVec3,
    pub radius: f64,
}

impl BoundingSphere {
    /// A point on the disk before the sphere, through which light of this direction comes in; `u` is a
    /// pair of uniform numbers.
    fn outside(&self, direction: DVec3, u: [f64; 2]) -> DVec3 {
        self.center + self.radius * (warp::disk(direction, u) - 1.001 * direction)
    }
}

/// Where an emitted walk starts, and its flux [W] over the density of its sampling.
#[derive(Debug, Clone, Copy)]
pub(super) struct Emission {
    pub ray: Ray,
    pub flux: Rgb,
}

/// Light that comes straight to a place, if nothing is in the way.
#[derive(Debug, Clone, Copy)]
pub(super) struct Arrival {
    /// In which it travels; a unit vector.
    pub direction: DVec3,
    /// To where it starts [length]; infinite for what comes from outside.
    pub distance: f64,
    /// Radiance over the density of directions [W/m²].
    pub irradiance: Rgb,
}

impl Emitter {
    /// Samples light toward a place; `u` is a pair of uniform numbers.
    // [Connection]
    pub fn sample_toward(&self, place: DVec3, u: [f64; 2]) -> Arrival {
        match *self {
            Emitter::Lamp(Lamp::Point { position, intensity, .. }) => {
                let way = place - position;
                let irradiance = intensity * (1.0 / way.length_squared()) as f32;
                Arrival { direction: way.normalize(), distance: way.length(), irradiance }
            }
            Emitter::Lamp(Lamp::Sky { radiance }) => {
                let irradiance = radiance * warp::FULL_SPHERE as f32;
                Arrival { direction: warp::sphere(u), distance: f64::INFINITY, irradiance }
            }
            Emitter::Lamp(Lamp::Sun { direction, irradiance }) => {
                Arrival { direction, distance: f64::INFINITY, irradiance }
            }
            Emitter::Surface(surface) => {
                let start = surface.shape.sample(u);
                let way = place - start;
                let (direction, distance) = (way.normalize(), way.length());
                let cosine = surface.shape.front_normal(start).dot(direction).max(0.0);
                let solid_angle = surface.shape.area() * cosine / (distance * distance);
                Arrival { direction, distance, irradiance: surface.emission * solid_angle as f32 }
            }
        }
    }

    /// What the engine is told in advance.
    pub fn facts(&self, index: usize) -> EmitterFacts {
        let is_environment = matches!(self, Emitter::Lamp(Lamp::Sky { .. }));
        let is_visible = is_environment || matches!(self, Emitter::Surface(_));
        let place = match *self {
            Emitter::Lamp(Lamp::Point { position, .. }) => {
                Some(Place { centre: position.as_vec3(), radius: 0.0 })
            }
            Emitter::Lamp(Lamp::Sky { .. } | Lamp::Sun { .. }) => None,
            Emitter::Surface(surface) => Some(surface.shape.place()),
        };
        EmitterFacts { name: format!("emitter {index}"), is_visible, is_environment, place }
    }

    /// `position` and `direction` are pairs of uniform numbers.
    pub fn sample(
        &self,
        bounds: &BoundingSphere,
        position: [f64; 2],
        direction: [f64; 2],
    ) -> Emission {
        match *self {
            Emitter::Lamp(Lamp::Point { position: origin, intensity, medium }) => {
                let ray = Ray { origin, direction: warp::sphere(direction), medium };
                // Intensity over the density 1/(4 pi).
                Emission { ray, flux: intensity * warp::FULL_SPHERE as f32 }
            }
            Emitter::Lamp(Lamp::Sky { radiance }) => {
                let direction = warp::sphere(direction);
                let origin = bounds.outside(direction, position);
                // Radiance over the densities 1/(4 pi) of directions and 1/(pi r²) of the disk.
                let measure = warp::FULL_SPHERE * PI * bounds.radius * bounds.radius;
                let ray = Ray { origin, direction, medium: VACUUM };
                Emission { ray, flux: radiance * measure as f32 }
            }
            Emitter::Lamp(Lamp::Sun { direction, irradiance }) => {
                let origin = bounds.outside(direction, position);
                let area = PI * bounds.radius * bounds.radius;
                let ray = Ray { origin, direction, medium: VACUUM };
                Emission { ray, flux: irradiance * area as f32 }
            }
            Emitter::Surface(surface) => {
                let origin = surface.shape.sample(position);
                let normal = surface.shape.front_normal(origin);
                let direction = warp::cosine_hemisphere(normal, direction);
                // Radiance times cosine over the densities cosine/pi and 1/area.
                let measure = PI * surface.shape.area();
                let ray = Ray { origin, direction, medium: surface.front };
                Emission { ray, flux: surface.emission * measure as f32 }
            }
        }
    }
}
