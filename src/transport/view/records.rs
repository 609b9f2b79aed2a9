//! What is kept of ray paths: view beams and visible points.

use crate::math::{Octahedral, Rgb, Segment};
use glam::Vec3;

/// One view beam: a segment of a ray path inside a medium. The segment is in [`super::ViewPaths::beam_segments`], or in the structure
/// that takes it over.
#[derive(Debug, Clone, Copy)]
pub struct BeamRecord {
    /// Weight from the start of the segment to the film (dimensionless).
    pub throughput: Rgb,
    /// Of [`super::ViewPaths::places`], the one that belongs to its pixel.
    pub pixel: u32,
    pub medium: u32,
    /// Transmittance table, or [`crate::medium::NO_TABLE`] where the extinction is constant.
    pub table: u32,
    /// Scattering events between the film and the segment.
    pub depth: u32,
}

/// A view beam with its segment.
#[derive(Debug, Clone, Copy)]
pub struct ViewBeam<'a> {
    pub record: &'a BeamRecord,
    pub segment: &'a Segment,
}

/// One visible point: where a ray path meets a smooth lobe. Its place is in [`super::ViewPaths::point_positions`], or in the tree that
/// takes them over.
#[derive(Debug, Clone, Copy)]
pub struct PointRecord {
    /// As the shape is oriented.
    pub geometric_normal: Octahedral,
    /// Shading normal on the viewer's side.
    pub normal: Octahedral,
    /// Weight from the point to the film, transmittances and a Lambertian lobe included [1, or 1/sr with the lobe].
    pub weight: Rgb,
    pub pixel: u32,
    pub(super) lobe: PackedLobe,
}

/// How a visible point reflects.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Lobe {
    /// Lambertian; the weight holds it.
    Lambertian,
    /// Ask [`crate::scene::Scene::eval_bsdf`] for the point with this index.
    Stored(u32),
}

/// The number of a stored point or, with the highest bit set, the depth of a Lambertian one.
#[derive(Debug, Clone, Copy)]
pub(super) struct PackedLobe(pub(super) u32);

impl PackedLobe {
    pub(super) const LAMBERTIAN: u32 = 1 << 31;

    pub(super) fn lambertian(depth: u32) -> Self {
        PackedLobe(Self::LAMBERTIAN | depth)
    }
}

impl PointRecord {
    #[inline]
    pub fn lobe(&self) -> Lobe {
        match self.lobe.0 {
            lambertian if lambertian & PackedLobe::LAMBERTIAN != 0 => Lobe::Lambertian,
            stored => Lobe::Stored(stored),
        }
    }
}

/// Where a ray path meets a lobe that the scene is to keep.
#[derive(Debug, Clone, Copy)]
pub(super) struct StoredPoint {
    pub origin: Vec3,
    pub direction: Vec3,
    pub skips_emitters: bool,
}
