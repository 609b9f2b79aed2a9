//! Analytic scenes that several cases share.

use crate::analytic::{
    Camera, Contents, Disclosure, Fog, Lamp, Material, Projection, Shape, Surface,
};
use crate::math::Rgb;
use crate::method::{Method, Parameters, Preset};
use crate::scene::{PathLimits, Phase, VACUUM};
use glam::DVec3;

/// Index of the only fog.
pub const FOG: u32 = 0;
/// The methods that differ in what they do in media: photon points there, photon beams.
pub const POINTS: [Method; 3] = [Method::Ppt, Method::PptMetro, Method::Apa];
pub const BEAMS: [Method; 3] = [Method::Ppbt, Method::PpbtMetro, Method::Ppb];
const FILM: [u32; 2] = [4, 4];

/// One pass of photons with the same radius for surfaces and media.
pub fn one_pass(photons: u64, radius: f64) -> Parameters {
    Parameters {
        passes: 1,
        jitter_every: 1,
        photons,
        surface_radius: radius as f32,
        medium_radius: radius as f32,
        ..Preset::Paper.parameters()
    }
}

pub fn up_to_depth(parameters: Parameters, max_depth: u32) -> Parameters {
    let limits = PathLimits { max_depth, ..parameters.limits };
    Parameters { limits, ..parameters }
}

/// Nothing but a camera.
pub fn empty(camera: Camera) -> Contents {
    Contents {
        camera,
        surfaces: Vec::new(),
        fogs: Vec::new(),
        lamps: Vec::new(),
        disclosure: Disclosure::Full,
    }
}

/// A half-space of fog under a sky of radiance 1, seen straight from above through a square window of
/// parallel rays around `place`. Light enters through a square of half-width `reach` alone, which must be
/// many free paths; the window is a quarter of it unless given.
#[derive(Debug, Clone, Copy)]
pub struct HalfSpace {
    pub place: DVec3,
    pub sigma_t: Rgb,
    pub albedo: Rgb,
    pub reach: f64,
    pub window: f64,
}

impl HalfSpace {
    pub fn new(sigma_t: Rgb, albedo: f32, reach: f64) -> Self {
        let (place, window) = (DVec3::ZERO, 0.25 * reach);
        HalfSpace { place, sigma_t, albedo: Rgb::splat(albedo), reach, window }
    }

    /// A radius over which the field is flat.
    pub fn radius(&self) -> f64 {
        0.5 * self.window
    }

    pub fn contents(&self) -> Contents {
        let (half_u, half_v) = (self.reach * DVec3::X, self.reach * DVec3::Y);
        let top = Shape::Rectangle { center: self.place, half_u, half_v };
        let eye = self.place + self.reach * DVec3::Z;
        let projection = Projection::Orthographic { width: self.window };
        Contents {
            surfaces: vec![Surface::new(top, Material::Null).between(VACUUM, FOG)],
            fogs: vec![Fog::uniform(self.sigma_t, self.albedo, Phase::Isotropic)],
            lamps: vec![Lamp::Sky { radiance: Rgb::ONE }],
            ..empty(Camera::new(eye, -DVec3::Z, FILM, projection))
        }
    }
}
