use super::ray::Ray;
use crate::math::{Aabb, Rgb};
use crate::scene::Phase;
use glam::DVec3;

/// How the extinction of a fog changes in space.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Profile {
    Uniform,
    /// An atmosphere: extinction falls by `1/e` over every `scale_height` \[length\] along z.
    Exponential {
        scale_height: f64,
    },
}

/// A participating medium whose optical depth has a formula. All channels share the profile.
#[derive(Debug, Clone, PartialEq)]
pub struct Fog {
    /// Extinction [1/length] everywhere, or at z = 0 if it varies.
    pub sigma_t: Rgb,
    /// Single-scattering albedo `sigma_s / sigma_t`.
    pub albedo: Rgb,
    pub phase: Phase,
    pub profile: Profile,
    /// Where it is; its boundary is made of surfaces.
    pub bounds: Aabb,
}

impl Fog {
    /// Fog that fills all space, or what surfaces leave of it.
    pub fn uniform(sigma_t: Rgb, albedo: Rgb, phase: Phase) -> Self {
        Fog { sigma_t, albedo, phase, profile: Profile::Uniform, bounds: Aabb::UNBOUNDED }
    }

    /// Extinction at a point over `sigma_t` (dimensionless).
    pub(super) fn density(&self, position: DVec3) -> f64 {
        match self.profile {
            Profile::Uniform => 1.0,
            Profile::Exponential { scale_height } => (-position.z / scale_height).exp(),
        }
    }

    /// Integral of the density over the first part of a ray [length]; times `sigma_t` it is the
    /// optical depth.
    pub(super) fn column(&self, ray: &Ray, distance: f64) -> f64 {
        let start = self.density(ray.origin);
        match self.profile {
            Profile::Uniform => distance,
            Profile::Exponential { scale_height } => {
                let rate = ray.direction.z / scale_height;
                if rate.abs() < 1e-9 {
                    start * distance
                } else {
                    -start * (-rate * distance).exp_m1() / rate
                }
            }
        }
    }

    /// Inverse of [`Fog::column`]: the distance at which it is reached, infinite if it never is.
    pub(super) fn distance(&self, ray: &Ray, column: f64) -> f64 {
        let start = self.density(ray.origin);
        match self.profile {
            Profile::Uniform => column,
            Profile::Exponential { scale_height } => {
                let rate = ray.direction.z / scale_height;
                let used = column * rate / start;
                if used >= 1.0 {
                    f64::INFINITY
                } else if rate.abs() < 1e-9 {
                    column / start
                } else {
                    -(-used).ln_1p() / rate
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn column_of_an_atmosphere_is_the_integral_of_its_density_and_has_an_inverse() {
        let fog = Fog {
            profile: Profile::Exponential { scale_height: 0.5 },
            ..Fog::uniform(Rgb::ONE, Rgb::ONE, Phase::Isotropic)
        };
        for direction in [DVec3::Z, -DVec3::Z, DVec3::X, DVec3::new(0.6, 0.0, -0.8)] {
            let ray = Ray { origin: DVec3::new(0.1, 0.2, 0.3), direction, medium: 0 };
            let steps = 100_000;
            let width = 0.7 / f64::from(steps);
            let sum: f64 =
                (0..steps).map(|i| fog.density(ray.at((f64::from(i) + 0.5) * width)) * width).sum();
            assert!((fog.column(&ray, 0.7) / sum - 1.0).abs() < 1e-9);
            assert!((fog.distance(&ray, sum) - 0.7).abs() < 1e-9);
        }
        // Straight up, all of the atmosphere has a finite column.
        let up = Ray { origin: DVec3::ZERO, direction: DVec3::Z, medium: 0 };
        assert_eq!(fog.column(&up, f64::INFINITY), 0.5);
        assert_eq!(fog.distance(&up, 0.6), f64::INFINITY);
    }
}
