//! Finite line segments and the projection of a point on them.

use glam::Vec3;

/// The points `origin + t·direction` with `t` in `[0, length)`.
///
/// Half-open, so that segments which continue one another share no point and an empty segment
/// (`length <= 0`) has none. Lengths are in scene units. `direction` has unit length; nothing
/// checks it.
#[derive(Clone, Copy, Debug, PartialEq)]
// In this order, so that direction and length are read as one row of four.
#[repr(C)]
pub struct Segment {
    pub origin: Vec3,
    pub direction: Vec3,
    pub length: f32,
}

impl Segment {
    /// The segment from `start` to `end`; if both are the same point, an empty segment.
    pub fn between(start: Vec3, end: Vec3) -> Self {
        let span = end - start;
        let length = span.length();
        Self { origin: start, direction: (span / length).normalize_or_zero(), length }
    }

    /// The point at parameter `t`.
    ///
    /// Every coordinate is `fl(o + fl(t·d))`. Both roundings are monotone, so each coordinate is a
    /// monotone function of `t` *as computed*; the beam tree's ownership rests on that.
    #[inline]
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + t * self.direction
    }

    /// Parameter `t` of the orthogonal projection of `p` on the segment's *line*, and the squared
    /// distance from `p` to that line.
    ///
    /// The distance comes from the residual `(p − o) − t·d`: its error is a rounding of `|p − o|`,
    /// where the shorter `|p − o|² − t²` would lose every digit of a distance below `|p − o|·√ε`.
    /// `p − o` is taken first because it is exact for neighbours however far both are from the
    /// world's origin.
    #[inline]
    pub fn project(&self, p: Vec3) -> (f32, f32) {
        let from_origin = p - self.origin;
        let t = from_origin.dot(self.direction);
        let residual = from_origin - t * self.direction;
        (t, residual.length_squared())
    }

    /// Whether all numbers are finite, the end point included.
    pub fn is_finite(&self) -> bool {
        self.origin.is_finite()
            && self.direction.is_finite()
            && self.length.is_finite()
            && self.at(self.length).is_finite()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn projects_on_the_line_beyond_both_ends() {
        let segment = Segment::between(Vec3::new(1.0, 0.0, 0.0), Vec3::new(3.0, 0.0, 0.0));
        assert_eq!(segment.length, 2.0);
        assert_eq!(segment.project(Vec3::new(2.0, 3.0, 4.0)), (1.0, 25.0));
        assert_eq!(segment.project(Vec3::new(-1.0, 1.0, 0.0)), (-2.0, 1.0));
        assert_eq!(segment.project(Vec3::new(7.0, 0.0, 2.0)), (6.0, 4.0));
    }

    #[test]
    fn keeps_a_small_distance_far_along_the_beam() {
        let segment = Segment { origin: Vec3::ZERO, direction: Vec3::X, length: 1e7 };
        let (t, distance_squared) = segment.project(Vec3::new(1e6, 1e-3, 0.0));
        assert_eq!(t, 1e6);
        assert!((distance_squared - 1e-6).abs() < 1e-12);
    }

    #[test]
    fn equal_end_points_make_an_empty_segment() {
        let segment = Segment::between(Vec3::ONE, Vec3::ONE);
        assert_eq!((segment.length, segment.direction), (0.0, Vec3::ZERO));
    }
}
