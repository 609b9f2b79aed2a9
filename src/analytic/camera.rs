use super::ray::Ray;
use crate::scene::VACUUM;
use glam::DVec3;

/// How the film is projected into the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Projection {
    /// A pinhole; the film's width spans twice this tangent.
    Perspective { half_width_tangent: f64 },
    /// Parallel rays; the film's width spans `width` \[length\].
    Orthographic { width: f64 },
}

/// Without aperture or shutter. Film coordinates are pixels, x to the right and y down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    pub origin: DVec3,
    /// Unit vector in which the camera looks.
    pub forward: DVec3,
    /// Unit vector perpendicular to `forward`, up on the film.
    pub up: DVec3,
    pub projection: Projection,
    pub film_size: [u32; 2],
    /// The fog that it stands in, or [`VACUUM`].
    pub medium: u32,
}

impl Camera {
    /// In vacuum, with the film's up direction along an axis of the world.
    pub fn new(origin: DVec3, forward: DVec3, film_size: [u32; 2], projection: Projection) -> Self {
        let axis = if forward.y.abs() < 0.9 { DVec3::Y } else { DVec3::X };
        let up = axis.reject_from(forward).normalize();
        Camera { origin, forward, up, projection, film_size, medium: VACUUM }
    }

    pub fn inside(self, medium: u32) -> Self {
        Camera { medium, ..self }
    }

    /// The ray through a point of the film.
    pub(super) fn ray(&self, x: f64, y: f64) -> Ray {
        let [width, height] = self.film_size.map(f64::from);
        let right = self.forward.cross(self.up);
        // From -1 to 1 over the film's width, with square pixels.
        let (sx, sy) = ((2.0 * x - width) / width, (height - 2.0 * y) / width);
        let offset = sx * right + sy * self.up;
        let (origin, direction) = match self.projection {
            Projection::Perspective { half_width_tangent } => {
                (self.origin, (self.forward + half_width_tangent * offset).normalize())
            }
            Projection::Orthographic { width } => {
                (self.origin + 0.5 * width * offset, self.forward)
            }
        };
        Ray { origin, direction, medium: self.medium }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn film_corners_span_the_view() {
        let tangent = Projection::Perspective { half_width_tangent: 0.5 };
        let camera = Camera::new(DVec3::ZERO, -DVec3::Z, [4, 2], tangent);
        assert_eq!(camera.ray(2.0, 1.0).direction, -DVec3::Z);
        let corner = camera.ray(4.0, 0.0).direction;
        assert!((corner / -corner.z - DVec3::new(0.5, 0.25, -1.0)).length() < 1e-12);

        let parallel = Projection::Orthographic { width: 4.0 };
        let camera = Camera::new(DVec3::ZERO, -DVec3::Z, [4, 2], parallel);
        assert_eq!(camera.ray(4.0, 0.0).origin, DVec3::new(2.0, 1.0, 0.0));
    }
}
