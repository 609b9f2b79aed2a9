use glam::DVec3;

/// Distance below which a ray does not see the surface that it starts on, over the size of the coordinates
/// that its intersection is computed from: some thousand roundings of an `f64`.
pub const CLEARANCE: f64 = 1e-12;

/// A half-line in a medium.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ray {
    pub origin: DVec3,
    /// Unit vector, the way that light or the view ray travels.
    pub direction: DVec3,
    /// Index of the fog that it crosses, or [`crate::scene::VACUUM`].
    pub medium: u32,
}

impl Ray {
    pub fn at(&self, distance: f64) -> DVec3 {
        self.origin + distance * self.direction
    }
}

/// Where a ray meets a surface first.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hit {
    pub surface: usize,
    /// Along the ray [length].
    pub distance: f64,
    pub position: DVec3,
    /// The shape's own normal, whichever side the ray comes from.
    pub front_normal: DVec3,
}

impl Hit {
    /// Whether a ray of this direction arrives on the side that the normal points to.
    pub fn is_front(&self, direction: DVec3) -> bool {
        direction.dot(self.front_normal) < 0.0
    }

    /// The normal on the side from which a ray of this direction arrives.
    pub fn normal_against(&self, direction: DVec3) -> DVec3 {
        if self.is_front(direction) {
            self.front_normal
        } else {
            -self.front_normal
        }
    }
}
