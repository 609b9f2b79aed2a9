//! Photons that fly along view beams: where two beams are nearly parallel, the estimate by their closest approach
//! divides by a sine near 0, and by 0 in a laser that is looked into.

use glam::Vec3;

/// Sine of the angle below which two directions, or one and the opposite of the other, are nearly parallel.
const NEARLY_PARALLEL: f32 = 1e-3;

/// Whether a pair of beams is estimated by the photon's collision instead of the beams' approach. [Parallel pair]
#[inline]
pub fn nearly_parallel(a: Vec3, b: Vec3) -> bool {
    a.cross(b).length_squared() < NEARLY_PARALLEL * NEARLY_PARALLEL
}

/// A cone that holds the directions of all view beams.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DirectionCone {
    axis: Vec3,
    /// Of the half-angle; above 1 where there is no direction.
    cosine: f32,
}

impl Default for DirectionCone {
    fn default() -> Self {
        DirectionCone { axis: Vec3::Z, cosine: f32::INFINITY }
    }
}

impl DirectionCone {
    /// Around the mean of the directions.
    pub fn around(directions: impl Iterator<Item = Vec3> + Clone) -> Self {
        let sum: Vec3 = directions.clone().filter(|d| d.is_finite()).sum();
        let axis = sum.try_normalize().unwrap_or(Vec3::Z);
        let cosine = directions.map(|d| d.dot(axis)).fold(f32::INFINITY, f32::min);
        DirectionCone { axis, cosine }
    }

    /// Whether a direction may be nearly parallel to one of those within. It is not more than the limit's angle δ
    /// outside, so `cos(a + δ) > cos(a) - δ - δ²/2`; the rest is for rounding.
    #[inline]
    pub fn may_be_parallel(&self, direction: Vec3) -> bool {
        self.axis.dot(direction).abs() >= self.cosine - 2.0 * NEARLY_PARALLEL
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn unit() -> impl Strategy<Value = Vec3> {
        [-1.0f32..1.0, -1.0..1.0, -1.0..1.0]
            .prop_map(|v| Vec3::from_array(v).try_normalize().unwrap_or(Vec3::Y))
    }

    proptest! {
        /// Whatever is nearly parallel to a direction within, or opposite to it, is not lost.
        #[test]
        fn no_parallel_direction_is_missed(
            axis in unit(), spread in 0.0f32..1.0, others in prop::collection::vec(unit(), 1..9), turn in unit(),
        ) {
            let within: Vec<Vec3> = others.iter().map(|o| (axis + spread * *o).try_normalize().unwrap_or(axis)).collect();
            let cone = DirectionCone::around(within.iter().copied());
            for direction in within {
                let near = (direction + 0.99e-3 * turn.reject_from_normalized(direction)).normalize();
                for candidate in [direction, near, -near] {
                    prop_assert!(!nearly_parallel(candidate, direction) || cone.may_be_parallel(candidate));
                }
            }
        }
    }

    #[test]
    fn no_beam_is_parallel_to_nothing() {
        assert!(!DirectionCone::default().may_be_parallel(Vec3::Z));
        assert!(!DirectionCone::around([].into_iter()).may_be_parallel(Vec3::Z));
        let narrow = DirectionCone::around([Vec3::Z].into_iter());
        assert!(narrow.may_be_parallel(-Vec3::Z) && !narrow.may_be_parallel(Vec3::X));
    }
}
