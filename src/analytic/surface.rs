use super::shape::Shape;
use crate::math::Rgb;
use crate::scene::{lobes, SurfaceFacts, VACUUM};

/// What a surface does to light.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Material {
    /// Nothing: the index-matched boundary of a fog.
    Null,
    /// Scatters the same way on both sides; `reflectance` is the albedo.
    Lambertian { reflectance: Rgb },
    /// Smooth glass; `index` is the refractive index behind the front over that before it.
    Dielectric { index: f64 },
}

/// A shape with its material, the light it emits and the fogs on its two sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surface {
    pub shape: Shape,
    pub material: Material,
    /// Radiance emitted from the front, the same in all directions [W/(m² sr)].
    pub emission: Rgb,
    /// Fog at the front, as an index into [`super::Contents::fogs`], or [`VACUUM`].
    pub front: u32,
    /// Fog at the back.
    pub back: u32,
}

impl Surface {
    /// A dark surface in vacuum.
    pub fn new(shape: Shape, material: Material) -> Self {
        Surface { shape, material, emission: Rgb::ZERO, front: VACUUM, back: VACUUM }
    }

    pub fn emitting(self, emission: Rgb) -> Self {
        Surface { emission, ..self }
    }

    /// Puts fogs on the two sides.
    pub fn between(self, front: u32, back: u32) -> Self {
        Surface { front, back, ..self }
    }

    /// What the engine is told in advance.
    pub(super) fn facts(&self, index: usize) -> SurfaceFacts {
        let lobes = match self.material {
            Material::Null => lobes::NULL,
            Material::Lambertian { .. } => lobes::SMOOTH,
            Material::Dielectric { .. } => lobes::DELTA_REFLECTION | lobes::DELTA_TRANSMISSION,
        };
        SurfaceFacts {
            name: format!("surface {index}"),
            lobes,
            interior: self.back,
            exterior: self.front,
        }
    }

    /// The medium into which a ray passes that arrives from the front, or from the back.
    pub(super) fn beyond(&self, from_front: bool) -> u32 {
        if from_front {
            self.back
        } else {
            self.front
        }
    }
}
