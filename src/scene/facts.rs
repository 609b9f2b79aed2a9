//! What is known of a scene before anything is traced.

use super::FilmFilter;
use crate::math::{Aabb, Rgb};

/// Channels of a film: red, green, blue and the weight.
pub const RGB_WEIGHT: u32 = 4;
/// Channels of a film: red, green, blue, alpha and the weight.
pub const RGB_ALPHA_WEIGHT: u32 = 5;

/// How a medium's extinction is found along a view beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Extinction {
    /// `sigma_t` [1/length] is the same everywhere and in every direction.
    Constant(Rgb),
    /// Ask [`super::Scene::extinction`]; the value is the shortest length \[length\] over which the
    /// extinction changes (a voxel's edge).
    Varying { feature_size: f32 },
}

/// A phase function that the engine evaluates by itself, or one that it must ask for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Phase {
    Isotropic,
    /// Henyey-Greenstein; `g` is the mean cosine between the directions of travel.
    HenyeyGreenstein {
        g: f32,
    },
    /// Ask [`super::Scene::eval_phase`].
    Opaque,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Medium {
    pub name: String,
    pub extinction: Extinction,
    /// Whether the extinction is known to be the same in all channels, everywhere.
    pub grey: bool,
    /// `sigma_s` [1/length] where it is the same everywhere and in every direction; None to ask
    /// [`super::Scene::scattering`].
    pub scattering: Option<Rgb>,
    pub phase: Phase,
    /// Where the medium's extinction can differ from zero; infinite where unbounded.
    pub bounds: Aabb,
}

impl Medium {
    /// Whether it takes anything from the light that crosses it, as far as is known.
    pub fn attenuates(&self) -> bool {
        match self.extinction {
            Extinction::Constant(sigma_t) => sigma_t.max_component() > 0.0,
            Extinction::Varying { .. } => true,
        }
    }

    /// Whether it sends light from one direction into others, as far as is known.
    pub fn scatters(&self) -> bool {
        self.attenuates() && self.scattering.is_none_or(|sigma_s| sigma_s.max_component() > 0.0)
    }
}

/// Bits of [`SurfaceFacts::lobes`].
pub mod lobes {
    /// A lobe that photons can be gathered for.
    pub const SMOOTH: u32 = 1;
    pub const DELTA_REFLECTION: u32 = 2;
    pub const DELTA_TRANSMISSION: u32 = 4;
    /// An index-matched crossing.
    pub const NULL: u32 = 8;
    /// A smooth lobe that may be sharp.
    pub const GLOSSY: u32 = 16;
    pub const GLOSSY_TRANSMISSION: u32 = 32;
}

/// What is known of a surface in advance.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceFacts {
    pub name: String,
    /// Bits of [`lobes`].
    pub lobes: u32,
    /// Media on its two sides, or [`VACUUM`](super::VACUUM).
    pub interior: u32,
    pub exterior: u32,
}

impl SurfaceFacts {
    pub fn has(&self, lobes: u32) -> bool {
        self.lobes & lobes != 0
    }
}

/// What is known of an emitter in advance.
#[derive(Debug, Clone, PartialEq)]
pub struct EmitterFacts {
    pub name: String,
    /// Whether a ray can meet it: it is a surface or a sky.
    pub is_visible: bool,
    /// Whether it is a sky.
    pub is_environment: bool,
    /// Where it is; none if it is infinitely far away.
    pub place: Option<Place>,
}

/// A ball around something.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    pub centre: glam::Vec3,
    pub radius: f32,
}

/// What is known of the sensor in advance.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SensorFacts {
    pub name: String,
    /// Whether its rays start from an aperture.
    pub has_aperture: bool,
}

/// Facts about a scene that do not change while it is rendered.
#[derive(Debug, Clone)]
pub struct SceneDescription {
    /// Size in pixels of the grid of view rays, border included.
    pub film_size: [u32; 2],
    /// Film coordinates of that grid's first pixel (negative where the filter needs a border).
    pub film_offset: [i32; 2],
    /// Values for each pixel that the film keeps sums of: [`RGB_WEIGHT`] or [`RGB_ALPHA_WEIGHT`].
    pub film_channels: u32,
    /// Pixels that the film keeps sums of, the middle of the grid, and those of them in a row.
    pub film_pixels: u32,
    pub film_width: u32,
    pub film_filter: FilmFilter,
    /// What a unit of each of the three channels is on the film in red, green and blue, where channels are wavelengths;
    /// None where they are the film's own.
    pub channel_colours: Option<[Rgb; 3]>,
    pub media: Vec<Medium>,
    /// Bounds of everything that a ray can hit.
    pub bounds: Aabb,
    pub surfaces: Vec<SurfaceFacts>,
    pub emitters: Vec<EmitterFacts>,
    pub sensor: SensorFacts,
    /// Remarks about the scene that its user should read (an emitter in unbounded fog, say).
    pub warnings: Vec<String>,
}

#[cfg(test)]
impl SceneDescription {
    /// A film without a border, and nothing else.
    pub fn of_film(size: [u32; 2], channels: u32) -> Self {
        SceneDescription {
            film_size: size,
            film_offset: [0, 0],
            film_channels: channels,
            film_pixels: size[0] * size[1],
            film_width: size[0],
            film_filter: FilmFilter::of_a_pixel(),
            channel_colours: None,
            media: Vec::new(),
            bounds: Aabb::EMPTY,
            surfaces: Vec::new(),
            emitters: Vec::new(),
            sensor: SensorFacts::default(),
            warnings: Vec::new(),
        }
    }
}

impl SceneDescription {
    /// Columns and rows of view rays to each side of the pixels that the film keeps sums of.
    pub fn film_border(&self) -> [u32; 2] {
        let size = [self.film_width, self.film_pixels / self.film_width.max(1)];
        [0, 1].map(|axis| self.film_size[axis].saturating_sub(size[axis]) / 2)
    }

    /// Film coordinates of the first pixel that the film keeps sums of.
    pub fn film_origin(&self) -> [i32; 2] {
        let border = self.film_border();
        [0, 1].map(|axis| self.film_offset[axis] + border[axis] as i32)
    }

    /// Whether a ray that leaves the scene sees light.
    pub fn has_environment(&self) -> bool {
        self.emitters.iter().any(|emitter| emitter.is_environment)
    }
}
