//! The seam between the engine and a renderer that owns a scene.
//!
//! The engine never sees shapes, textures or lights. It asks a [`Scene`], in batches, to advance
//! view rays and photon walks by one segment and to evaluate scattering functions for pairs. Two
//! implementors exist: [`crate::host`] (Mitsuba, through the C ABI) and
//! [`crate::analytic`] (closed-form scenes in pure Rust, by which the physics is proved).
//!
//! # Conventions
//!
//! - Vectors are in world space; directions have unit length and point the way light or the ray
//!   *travels*: a photon's `direction` leads away from the lamp, a view ray's away from the eye.
//! - Every array is a structure of arrays. A vector array of `n` lanes holds `n` x's, then `n`
//!   y's, then `n` z's ([`Planes`]).
//! - A photon's `flux` is in watts per emitted walk: emission over the density of its sampling,
//!   times every scattering weight so far. Dividing a sum of fluxes by the number of *emitted* walks
//!   estimates power.
//! - The three channels of a value are red, green and blue, or three wavelengths ([`Scene::tuned`]); then quantities of light
//!   are per nanometre.
//! - Depth counts scattering events other than null (index-matched) crossings, as Mitsuba's
//!   `volpath` does: a path with `k` of them is kept while `k < max_depth`.

mod batching;
mod facts;
mod film_filter;
mod limits;
mod photon_vertices;
mod planes;
mod view_vertices;
pub mod work;

pub use batching::{Batch, Batching};
pub use facts::{
    lobes, EmitterFacts, Extinction, Medium, Phase, Place, SceneDescription, SensorFacts,
    SurfaceFacts, RGB_ALPHA_WEIGHT, RGB_WEIGHT,
};
pub use film_filter::FilmFilter;
pub use limits::{PathLimits, PathRules};
pub use photon_vertices::{photon_event, PhotonSegments, PhotonVertices};
pub use planes::{PlaneRows, Planes};
pub use view_vertices::{view_flags, ViewVertices};

use crate::crew::{self, Crew};

/// "No medium" in every array of medium indices.
pub const VACUUM: u32 = u32::MAX;
/// `max_depth` of a path that may scatter without bound.
pub const UNBOUNDED_DEPTH: u32 = u32::MAX;

/// Uniform numbers in [0,1) consumed by [`Scene::emit`], per walk: emitter choice, two for the
/// position, two for the direction, shutter time, hero colour channel, [`EMIT_SEED`].
pub const EMIT_DIMENSIONS: usize = 8;
/// The number of [`Scene::emit`] that numbers a stream of hashes, by which free flights in varying
/// media shift their step's own numbers. With it fixed, a walk changes continuously with its other
/// numbers: small mutations leave it alone.
pub const EMIT_SEED: usize = 7;
/// Uniform numbers consumed by [`PhotonWalk::step`], per walk: free flight, lobe choice, two for
/// the direction, Russian roulette.
pub const PHOTON_STEP_DIMENSIONS: usize = 5;
/// Uniform numbers consumed by [`Scene::view_rays`], per ray: two for the aperture, shutter time,
/// wavelength. The film position is given apart.
pub const VIEW_RAY_DIMENSIONS: usize = 4;
/// Uniform numbers consumed by [`ViewWalk::step`], per ray: lobe choice and two for the direction.
pub const VIEW_STEP_DIMENSIONS: usize = 3;

/// Uniform numbers consumed by [`Scene::lamp_light`], per place: two for the lamp and the point on it, and one that
/// numbers a stream of hashes for what varying media take away.
pub const LAMP_DIMENSIONS: usize = 3;
/// Uniform numbers consumed by [`Scene::aim`], per lane: for the lamp, and two for the place on it.
pub const AIM_DIMENSIONS: usize = 3;

/// What went wrong on the renderer's side.
#[derive(Debug, Clone, thiserror::Error)]
#[error("{0}")]
pub struct SceneError(pub String);

pub type SceneResult<T> = Result<T, SceneError>;

/// Where view rays start. `film` holds x's then y's, in film coordinates; `numbers` holds
/// [`VIEW_RAY_DIMENSIONS`] planes.
#[derive(Debug, Clone, Copy)]
pub struct ViewRayRequest<'a> {
    pub lanes: usize,
    pub film: &'a [f32],
    pub numbers: &'a [f32],
    pub rules: PathRules,
}

/// View rays in flight, advanced together.
pub trait ViewWalk {
    /// Rays still alive: the number of lanes that the next step reports and takes numbers for.
    fn lanes(&self) -> usize;
    /// Advances every ray by up to `steps` segments and drops those that ended. For each step `numbers` holds
    /// [`VIEW_STEP_DIMENSIONS`] planes of [`ViewWalk::lanes`] each, and `out` is given as many lanes; those of rays that had
    /// ended before are [`view_flags::ABSENT`].
    fn step(&mut self, steps: usize, numbers: &[f32], out: &mut ViewVertices) -> SceneResult<()>;
}

/// Photon walks in flight, advanced together.
pub trait PhotonWalk {
    /// Walks still alive: the number of lanes that the next step reports and takes numbers for.
    fn lanes(&self) -> usize;
    /// Writes which walks are alive: their indices within the batch as it was emitted, ascending.
    fn alive(&self, out: &mut Vec<u32>) -> SceneResult<()>;
    /// Advances every walk by up to `steps` segments and drops those that ended. For each step `numbers` holds
    /// [`PHOTON_STEP_DIMENSIONS`] planes of [`PhotonWalk::lanes`] each, and `out` is given as many lanes; those of walks
    /// that had ended before are [`photon_event::ABSENT`].
    fn step(&mut self, steps: usize, numbers: &[f32], out: &mut PhotonVertices) -> SceneResult<()>;
}

/// Directions at which phase functions are wanted: light travels along `photon_direction`, is
/// scattered at `position`, and leaves against `view_direction`.
#[derive(Debug, Clone, Default)]
pub struct PhasePairs {
    pub medium: Vec<u32>,
    pub position: Planes,
    pub photon_direction: Planes,
    pub view_direction: Planes,
}

/// Where coefficients of media are wanted, and the direction in which light travels there. Points lie
/// within the bounds of their medium.
#[derive(Debug, Clone, Default)]
pub struct MediumPoints {
    pub medium: Vec<u32>,
    pub position: Planes,
    pub direction: Planes,
}

/// The view segments at whose ends visible points lie.
#[derive(Debug, Clone, Default)]
pub struct PointSegments {
    pub origin: Planes,
    pub direction: Planes,
    /// 1 where emitters are passed through, as `hide_emitters` asks on first segments; else 0.
    pub skips_emitters: Vec<u32>,
    /// As in [`PathRules`].
    pub glossy_chains: bool,
}

/// Visible points (indices as given to [`Scene::store_points`]) and the direction in which a photon
/// arrives there.
#[derive(Debug, Clone, Default)]
pub struct SurfacePairs {
    pub point: Vec<u32>,
    pub photon_direction: Planes,
    /// As in [`PhotonVertices`]; 0 where there are no glossy chains.
    pub lamp_density: Vec<f32>,
}

/// Places from which lamps are looked for.
#[derive(Debug, Clone, Default)]
pub struct Places {
    /// The medium that the place lies in, or that the light crosses last before the surface that it lies on.
    pub medium: Vec<u32>,
    pub position: Planes,
    /// Geometric normal of the surface that it lies on; 0 within a medium.
    pub normal: Planes,
}

/// Light that arrives at places straight from lamps, through null boundaries and media: one sample for each place.
#[derive(Debug, Clone, Default)]
pub struct LampLight {
    /// In which the light travels; 0 where none arrives.
    pub direction: Planes,
    /// Radiance over the density of directions per solid angle [W/m²], what media take away taken off.
    pub irradiance: Planes,
    /// As in [`PhotonVertices`], filled where the caller has put `Some`.
    pub density: Option<Vec<f32>>,
}

impl LampLight {
    pub fn resize(&mut self, lanes: usize) {
        self.direction.resize(lanes);
        self.irradiance.resize(lanes);
        if let Some(density) = &mut self.density {
            density.resize(lanes, 0.0);
        }
    }
}

/// A scene as the engine sees it.
pub trait Scene: Sync {
    /// Before a scene whose channels are wavelengths is tuned, constants of its media are the largest of all light's.
    fn description(&self) -> &SceneDescription;

    fn batching(&self) -> Batching;

    /// Lends threads that do the engine's tasks while the caller goes on driving the scene, and returns when all are done.
    fn with_crew<'scope>(&self, body: &mut dyn FnMut(&dyn Crew<'scope>)) {
        crew::of_rayon(body);
    }

    /// The same scene at the three wavelengths that a number in [0,1) chooses, which all that meets must share; None where
    /// the channels are colours. [Shared wavelengths]
    fn tuned(&self, _number: f32) -> SceneResult<Option<Box<dyn Scene + '_>>> {
        Ok(None)
    }

    /// Starts one view ray per lane and writes the weight that its radiance has on the film.
    fn view_rays<'a>(
        &'a self,
        request: &ViewRayRequest,
        importance: &mut Planes,
    ) -> SceneResult<Box<dyn ViewWalk + 'a>>;

    /// Where on the film places on lamps would be seen if nothing were in the way: x's then y's in film coordinates, one place
    /// for each lane, not a number where it is not on the film or cannot be told. `numbers` holds [`AIM_DIMENSIONS`] planes.
    fn aim(&self, lanes: usize, _numbers: &[f32], film: &mut Vec<f32>) -> SceneResult<()> {
        film.clear();
        film.resize(2 * lanes, f32::NAN);
        Ok(())
    }

    /// Starts one photon walk per lane; `numbers` holds [`EMIT_DIMENSIONS`] planes.
    fn emit<'a>(
        &'a self,
        lanes: usize,
        numbers: &[f32],
        rules: PathRules,
    ) -> SceneResult<Box<dyn PhotonWalk + 'a>>;

    /// Extinction `sigma_t` [1/length] at each point for light travelling along its direction.
    fn extinction(&self, points: &MediumPoints, out: &mut Planes) -> SceneResult<()>;

    /// Scattering coefficient `sigma_s` [1/length] at each point for light travelling along its
    /// direction. Times [`Scene::eval_phase`] with that direction as the photon's, it scatters light
    /// from there to the eye, in direction-dependent media too. [Long beam]
    fn scattering(&self, points: &MediumPoints, out: &mut Planes) -> SceneResult<()>;

    /// Value of the phase function [1/sr] for each pair, written to `out`. For direction-dependent
    /// media the ratio of extinctions (view over photon direction) is included.
    fn eval_phase(&self, pairs: &PhasePairs, out: &mut Planes) -> SceneResult<()>;

    /// Tells the scene which visible points will be asked about, in place of those told before.
    fn store_points(&self, points: &PointSegments) -> SceneResult<()>;

    /// Value of the smooth BSDF lobes `f_r` [1/sr], without a cosine, for each pair.
    fn eval_bsdf(&self, pairs: &SurfacePairs, out: &mut Planes) -> SceneResult<()>;

    /// Samples a lamp for each place, and what of its light arrives there without being scattered. `numbers` holds
    /// [`LAMP_DIMENSIONS`] planes. Light that comes this way, and no other, reaches photons on
    /// [`photon_event::STRAIGHT`] segments.
    fn lamp_light(&self, places: &Places, numbers: &[f32], out: &mut LampLight) -> SceneResult<()>;
}
