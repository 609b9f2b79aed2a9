//! What [`Segment`] computes, for four of them in one instruction.

use super::approach::MIN_SINE;
use super::{Approach, Segment, Vec3x4};
use glam::{BVec4A, Mat4, Vec3, Vec4};

/// Four segments, coordinate by coordinate.
#[derive(Clone, Copy, Debug)]
pub struct FourSegments {
    origin: Vec3x4,
    direction: Vec3x4,
    pub length: Vec4,
}

/// Four results of [`Segment::approach`].
#[derive(Clone, Copy, Debug)]
pub struct FourApproaches {
    pub t: Vec4,
    pub t_other: Vec4,
    pub distance_squared: Vec4,
    /// Square of the sine of the angle between the lines.
    pub sine_squared: Vec4,
    /// False where the lines are parallel: there is no approach.
    pub exist: BVec4A,
}

impl FourApproaches {
    /// One of them, if it exists.
    #[inline]
    pub fn lane(&self, lane: usize) -> Approach {
        Approach {
            t: self.t[lane],
            t_other: self.t_other[lane],
            distance_squared: self.distance_squared[lane],
            sine: self.sine_squared[lane].sqrt(),
        }
    }
}

impl FourSegments {
    /// Segments without a point.
    pub const EMPTY: Self = {
        let zeros = Vec3x4 { x: Vec4::ZERO, y: Vec4::ZERO, z: Vec4::ZERO };
        FourSegments { origin: zeros, direction: zeros, length: Vec4::ZERO }
    };

    #[inline]
    pub fn new(segments: [&Segment; 4]) -> Self {
        let rows = |row: fn(&Segment) -> Vec4| {
            let [a, b, c, d] = segments.map(row);
            Mat4::from_cols(a, b, c, d).transpose()
        };
        let first = rows(|s| s.origin.extend(s.direction.x));
        let last = rows(|s| s.direction.extend(s.length));
        FourSegments {
            origin: Vec3x4 { x: first.x_axis, y: first.y_axis, z: first.z_axis },
            direction: Vec3x4 { x: last.x_axis, y: last.y_axis, z: last.z_axis },
            length: last.w_axis,
        }
    }

    /// As [`Segment::project`], bit by bit.
    #[inline]
    pub fn project(&self, p: Vec3) -> (Vec4, Vec4) {
        let from_origin = Vec3x4::splat(p) - self.origin;
        let t = from_origin.dot(self.direction);
        let residual = from_origin - t * self.direction;
        (t, residual.length_squared())
    }

    /// As [`Segment::approach`], bit by bit.
    #[inline]
    pub fn approach(&self, other: &Segment) -> FourApproaches {
        let (d, e) = (self.direction, Vec3x4::splat(other.direction));
        let w = Vec3x4::splat(other.origin) - self.origin;
        let n = d.cross(e);
        let sine_squared = n.length_squared();
        let t = w.cross(e).dot(n) / sine_squared;
        let t_other = w.cross(d).dot(n) / sine_squared;
        let connection = w + t_other * e - t * d;
        let exist = sine_squared.cmpge(Vec4::splat(MIN_SINE * MIN_SINE));
        let distance_squared = connection.length_squared();
        FourApproaches { t, t_other, distance_squared, sine_squared, exist }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn number() -> impl Strategy<Value = f32> {
        prop_oneof![
            1 => Just(f32::NAN),
            1 => Just(f32::INFINITY),
            1 => Just(1e-30),
            1 => Just(0.0),
            1 => Just(1.0),
            20 => -2.0f32..2.0,
        ]
    }

    fn vector() -> impl Strategy<Value = Vec3> {
        prop::array::uniform3(number()).prop_map(Vec3::from)
    }

    fn segment() -> impl Strategy<Value = Segment> {
        (vector(), vector(), number()).prop_map(|(origin, direction, length)| Segment {
            origin,
            direction,
            length,
        })
    }

    /// Bits, where all that is not a number is the same.
    fn bits(numbers: impl IntoIterator<Item = f32>) -> Vec<u32> {
        numbers.into_iter().map(|x| if x.is_nan() { f32::NAN } else { x }.to_bits()).collect()
    }

    proptest! {
        #[test]
        fn four_project_as_one(four in prop::array::uniform4(segment()), p in vector()) {
            let segments = FourSegments::new(four.each_ref());
            let (t, distance_squared) = segments.project(p);
            for (lane, segment) in four.iter().enumerate() {
                let one = segment.project(p);
                prop_assert_eq!(bits([t[lane], distance_squared[lane]]), bits([one.0, one.1]));
                prop_assert_eq!(bits([segments.length[lane]]), bits([segment.length]));
            }
        }

        #[test]
        fn four_approach_as_one(four in prop::array::uniform4(segment()), other in segment()) {
            let all = FourSegments::new(four.each_ref()).approach(&other);
            for (lane, segment) in four.iter().enumerate() {
                let one = segment.approach(&other);
                prop_assert_eq!(all.exist.test(lane), one.is_some());
                let Some(one) = one else { continue };
                let numbers = |a: Approach| bits([a.t, a.t_other, a.distance_squared, a.sine]);
                prop_assert_eq!(numbers(all.lane(lane)), numbers(one));
            }
        }
    }
}
