use glam::Vec3;

use super::Segment;

/// Sine below which two directions count as parallel.
///
/// Each component of the cross product of unit vectors is a difference of two products, off by up
/// to 1.5 ε; the vector is off by up to 2.6 ε. At a sine of 8 ε a third of it may be rounding, and
/// below that it tells no direction.
pub(super) const MIN_SINE: f32 = 8.0 * f32::EPSILON;

/// Where the lines of two segments come closest to one another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Approach {
    /// Parameter of the closest point on the first line, in scene units.
    pub t: f32,
    /// Parameter of the closest point on the other line, in scene units.
    pub t_other: f32,
    /// Square of the distance between both points.
    pub distance_squared: f32,
    /// Sine of the angle between the lines; positive.
    pub sine: f32,
}

impl Segment {
    /// The closest approach of this segment's *line* and that of `other`; none if they are parallel
    /// (sine below 8 ε) or a direction is NaN.
    ///
    /// With `w` from this origin to the other and `n = d × e`, the shortest connection `w + t_other·e
    /// − t·d` is parallel to `n`. Its cross product with `e`, dotted with `n`, gives `t`; that with
    /// `d` gives `t_other`. The distance is the length of that connection as computed, not the
    /// shorter `|w·n|/|n|`: so it is that of the two points at `t` and `t_other` up to a rounding of
    /// their coordinates, however oblique the lines, and a query may rely on it.
    #[inline]
    pub fn approach(&self, other: &Segment) -> Option<Approach> {
        let (d, e) = (self.direction, other.direction);
        let w = other.origin - self.origin;
        let n = d.cross(e);
        let sine_squared = n.length_squared();
        if sine_squared.is_nan() || sine_squared < MIN_SINE * MIN_SINE {
            return None;
        }
        let t = w.cross(e).dot(n) / sine_squared;
        let t_other = w.cross(d).dot(n) / sine_squared;
        let connection: Vec3 = w + t_other * e - t * d;
        Some(Approach {
            t,
            t_other,
            distance_squared: connection.length_squared(),
            sine: sine_squared.sqrt(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use rand::rngs::StdRng;
    use rand::{Rng, SeedableRng};

    fn line(origin: Vec3, direction: Vec3) -> Segment {
        Segment { origin, direction, length: 1.0 }
    }

    /// `t`, `t_other` and the distance by the normal equations, in double precision.
    fn approach_in_double(a: &Segment, b: &Segment) -> [f64; 3] {
        let (d, e) = (a.direction.as_dvec3(), b.direction.as_dvec3());
        let w: DVec3 = b.origin.as_dvec3() - a.origin.as_dvec3();
        let (dd, ee, de) = (d.dot(d), e.dot(e), d.dot(e));
        let determinant = dd * ee - de * de;
        let t = (w.dot(d) * ee - w.dot(e) * de) / determinant;
        let t_other = (w.dot(d) * de - w.dot(e) * dd) / determinant;
        [t, t_other, (w + t_other * e - t * d).length()]
    }

    fn random_vector(rng: &mut StdRng) -> Vec3 {
        2.0 * Vec3::from_array(rng.random()) - 1.0
    }

    /// The largest error of `t`, `t_other` and the distance over many pairs around `place` whose
    /// directions differ by about `spread`.
    fn largest_error(place: Vec3, spread: f32) -> f64 {
        let mut rng = StdRng::seed_from_u64(1);
        let mut largest: f64 = 0.0;
        for _ in 0..2000 {
            let direction = (random_vector(&mut rng) + Vec3::splat(1.5)).normalize();
            let deviation = direction.cross(random_vector(&mut rng)).normalize();
            let a = line(place + random_vector(&mut rng), direction);
            let b =
                line(place + random_vector(&mut rng), (direction + spread * deviation).normalize());
            let found = a.approach(&b).expect("not parallel");
            let expected = approach_in_double(&a, &b);
            let computed = [found.t, found.t_other, found.distance_squared.sqrt()];
            for (value, truth) in computed.into_iter().zip(expected) {
                largest = largest.max((f64::from(value) - truth).abs());
            }
        }
        largest
    }

    #[test]
    fn agrees_with_double_precision() {
        assert!(largest_error(Vec3::ZERO, 1.0) < 2e-5);
    }

    #[test]
    fn neighbours_far_from_the_world_s_origin_lose_nothing() {
        // Origins are rounded before both computations see them, so only the pair's own size counts.
        assert!(largest_error(Vec3::new(1e5, -2e5, 3e5), 1.0) < 2e-5);
    }

    #[test]
    fn nearly_parallel_lines_lose_digits_in_proportion() {
        // Parameters grow as 1/sine and their errors as 1/sine².
        assert!(largest_error(Vec3::ZERO, 1e-2) < 1e-1);
    }

    #[test]
    fn perpendicular_lines_are_exact() {
        let a = line(Vec3::new(1.0, 2.0, 3.0), Vec3::X);
        let b = line(Vec3::new(6.0, -5.0, 3.5), Vec3::Y);
        let expected = Approach { t: 5.0, t_other: 7.0, distance_squared: 0.25, sine: 1.0 };
        assert_eq!(a.approach(&b), Some(expected));
        let mirrored = Approach { t: 7.0, t_other: 5.0, ..expected };
        assert_eq!(b.approach(&a), Some(mirrored));
    }

    #[test]
    fn lines_that_meet_have_no_distance() {
        let a = line(Vec3::ZERO, Vec3::X);
        let b = line(Vec3::ZERO, Vec3::new(0.6, 0.8, 0.0));
        let found = a.approach(&b).expect("not parallel");
        assert_eq!((found.t, found.t_other, found.distance_squared), (0.0, 0.0, 0.0));
        assert!((found.sine - 0.8).abs() < 1e-6);
    }

    #[test]
    fn parallel_lines_and_points_have_no_approach() {
        let a = line(Vec3::ZERO, Vec3::new(0.6, 0.8, 0.0));
        let point = Segment::between(Vec3::ONE, Vec3::ONE);
        let turned = (a.direction + 4.0 * f32::EPSILON * Vec3::Z).normalize();
        for other in [
            line(Vec3::ONE, a.direction),
            line(Vec3::ONE, -a.direction),
            line(Vec3::ONE, turned),
            line(Vec3::ONE, Vec3::NAN),
            point,
        ] {
            assert_eq!(a.approach(&other), None, "{other:?}");
        }
    }
}
