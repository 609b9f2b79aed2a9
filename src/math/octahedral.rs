use glam::Vec3;

/// A direction in eight bytes: its place on an octahedron that is unfolded to the square `[-1, 1]²` [Meyer 2010].
///
/// Both coordinates are `f32`, so that what comes out differs from what went in by roundings; axes come out as they were.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Octahedral([f32; 2]);

impl From<Vec3> for Octahedral {
    /// Of a vector of any length; that of 0 becomes the z axis.
    fn from(v: Vec3) -> Self {
        let on_faces = v / v.abs().element_sum().max(f32::MIN_POSITIVE);
        let upper = [on_faces.x, on_faces.y];
        Octahedral(if on_faces.z < 0.0 { fold(upper) } else { upper })
    }
}

impl Octahedral {
    /// The place on the octahedron, 1/√3 to 1 from its middle: enough where the side of a plane is asked.
    #[inline]
    pub fn on_faces(self) -> Vec3 {
        let Octahedral([u, v]) = self;
        let z = 1.0 - u.abs() - v.abs();
        let [x, y] = if z < 0.0 { fold([u, v]) } else { [u, v] };
        Vec3::new(x, y, z)
    }
}

impl From<Octahedral> for Vec3 {
    /// Of unit length.
    #[inline]
    fn from(direction: Octahedral) -> Self {
        direction.on_faces().normalize()
    }
}

/// Between the lower half of the octahedron and the corners of the square, either way.
#[inline]
fn fold([x, y]: [f32; 2]) -> [f32; 2] {
    [(1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3Swizzles;
    use proptest::prelude::*;

    proptest! {
        /// With u = 2^-24: on the octahedron each of three coordinates of at most 1 is off by no more than 4u (a sum of three,
        /// a quotient, a difference or two), which is an angle of at most √3·4u·√3 where its faces are nearest, 1/√3, to the
        /// middle. The last normalisation adds 3u.
        #[test]
        fn directions_come_out_within_roundings(
            v in [-1.0f32..1.0, -1.0..1.0, -1.0..1.0], flat in prop::sample::select(vec![1.0f32, 1e-3, 1e-7, 0.0]),
        ) {
            let v = Vec3::new(v[0], v[1], v[2] * flat);
            prop_assume!(v.length() > 1e-3);
            for v in [v, v.yzx(), v.zxy()].map(Vec3::normalize) {
                let out = Vec3::from(Octahedral::from(v));
                let angle = out.as_dvec3().cross(v.as_dvec3()).length();
                prop_assert!(angle < 15.0 * 2f64.powi(-24) && out.dot(v) > 0.0, "{v} became {out}");
            }
        }
    }

    #[test]
    fn axes_come_out_as_they_were() {
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            assert_eq!([axis, -axis].map(|v| Vec3::from(Octahedral::from(v))), [axis, -axis]);
        }
    }
}
