//! What view rays meet.

use super::{Planes, VACUUM};

/// Bits of [`ViewVertices::flags`].
pub mod view_flags {
    /// The ray goes on: a delta or null lobe was sampled.
    pub const CONTINUES: u32 = 1;
    /// A smooth lobe is here: the vertex is a visible point.
    pub const VISIBLE_POINT: u32 = 2;
    /// `reflectance` describes the whole of the smooth lobe (a Lambertian reflector).
    pub const LAMBERTIAN: u32 = 4;
    /// `emission` is light that is seen directly.
    pub const EMISSION: u32 = 8;
    /// The segment ends on a surface; without it, the ray left the scene or had already ended.
    pub const HIT: u32 = 16;
    /// The lobe that was sampled counts as a scattering event.
    pub const SCATTERED: u32 = 32;
    /// No segment: the ray had ended within an earlier step of the same call.
    pub const ABSENT: u32 = 64;
}

/// One segment per view ray, and the vertex at its end. Filled by [`super::ViewWalk::step`].
#[derive(Debug, Clone, Default)]
pub struct ViewVertices {
    /// Number of the ray within its batch.
    pub ray: Vec<u32>,
    pub flags: Vec<u32>,
    /// The medium that the segment crosses.
    pub medium: Vec<u32>,
    pub origin: Planes,
    pub direction: Planes,
    /// Infinite where nothing was hit.
    pub length: Vec<f32>,
    pub position: Planes,
    /// Shading normal on the side from which the ray came.
    pub normal: Planes,
    /// Geometric normal as the shape is oriented (not turned toward the ray).
    pub geometric_normal: Planes,
    /// Directional albedo of a Lambertian reflector (dimensionless).
    pub reflectance: Planes,
    /// Radiance emitted toward the eye [W/(m² sr)].
    pub emission: Planes,
    /// Weight of the sampled delta lobe (dimensionless).
    pub weight: Planes,
}

impl ViewVertices {
    pub fn resize(&mut self, lanes: usize) {
        self.ray.resize(lanes, 0);
        self.flags.resize(lanes, 0);
        self.medium.resize(lanes, VACUUM);
        self.length.resize(lanes, 0.0);
        for planes in [
            &mut self.origin,
            &mut self.direction,
            &mut self.position,
            &mut self.normal,
            &mut self.geometric_normal,
            &mut self.reflectance,
            &mut self.emission,
            &mut self.weight,
        ] {
            planes.resize(lanes);
        }
    }
}
