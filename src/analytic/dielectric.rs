//! A smooth boundary between two refractive indices.

use glam::DVec3;

/// What leaves the boundary: one of two delta lobes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct DeltaLobe {
    pub direction: DVec3,
    pub transmitted: bool,
}

/// Share of the light that is reflected; `cosine` is that of incidence, `index` the refractive
/// index beyond the boundary over that before it.
// [Fresnel]
pub(super) fn reflected_share(cosine: f64, index: f64) -> f64 {
    let squared = 1.0 - (1.0 - cosine * cosine) / (index * index);
    if squared <= 0.0 {
        return 1.0;
    }
    let beyond = squared.sqrt();
    let perpendicular = (cosine - index * beyond) / (cosine + index * beyond);
    let parallel = (beyond - index * cosine) / (beyond + index * cosine);
    0.5 * (perpendicular * perpendicular + parallel * parallel)
}

/// Chooses a lobe with the probability of its share of the light, so that its weight for flux is 1.
pub(super) fn sample(direction: DVec3, normal: DVec3, index: f64, u: f64) -> DeltaLobe {
    let cosine = -direction.dot(normal);
    if u < reflected_share(cosine, index) {
        DeltaLobe { direction: direction.reflect(normal).normalize(), transmitted: false }
    } else {
        let bent = direction.refract(normal, 1.0 / index).normalize();
        DeltaLobe { direction: bent, transmitted: true }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn share_at_normal_incidence_at_brewster_and_beyond_the_critical_angle() {
        let normal = ((1.5f64 - 1.0) / 2.5).powi(2);
        assert!((reflected_share(1.0, 1.5) - normal).abs() < 1e-12);
        // At Brewster's angle, tan = n, the parallel part vanishes.
        let cosine = 1.0 / (1.0f64 + 1.5 * 1.5).sqrt();
        let perpendicular = (1.0 - 1.5f64 * 1.5) / (1.0 + 1.5 * 1.5);
        let brewster = 0.5 * perpendicular * perpendicular;
        assert!((reflected_share(cosine, 1.5) - brewster).abs() < 1e-12);
        assert_eq!(reflected_share(0.5, 1.0 / 1.5), 1.0);
    }

    #[test]
    fn transmission_bends_by_snells_law() {
        let direction = DVec3::new(0.6, 0.0, -0.8);
        let lobe = sample(direction, DVec3::Z, 1.5, 0.999);
        assert!(lobe.transmitted);
        assert!((lobe.direction.x - 0.6 / 1.5).abs() < 1e-12);
        assert!(lobe.direction.z < 0.0);
    }
}
