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

use crate::crew::{self, Crew};
use crate::effect::{Effect, Effects};
use crate::math::{Aabb, Rgb};
use rayon::prelude::*;
use std::ops::Range;

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

/// How a medium's extinction is found along a view beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Extinction {
    /// `sigma_t` [1/length] is the same everywhere and in every direction.
    Constant(Rgb),
    /// Ask [`Scene::extinction`]; the value is the shortest length \[length\] over which the
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
    /// Ask [`Scene::eval_phase`].
    Opaque,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Medium {
    pub name: String,
    pub extinction: Extinction,
    /// Whether the extinction is known to be the same in all channels, everywhere.
    pub grey: bool,
    /// `sigma_s` [1/length] where it is the same everywhere and in every direction; None to ask
    /// [`Scene::scattering`].
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
    /// Media on its two sides, or [`VACUUM`].
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
    /// Floats per pixel of the film's storage (red, green and blue first, the weight last), the number of
    /// its pixels and of those in a row, for [`Scene::splat`].
    pub film_channels: u32,
    pub film_pixels: u32,
    pub film_width: u32,
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
    /// Whether a ray that leaves the scene sees light.
    pub fn has_environment(&self) -> bool {
        self.emitters.iter().any(|emitter| emitter.is_environment)
    }
}

/// How a host likes its batches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Batching {
    /// Lanes per batch.
    pub lanes: usize,
    /// Whether several threads may drive batches of their own at the same time.
    pub concurrent: bool,
    /// Vertices that a call of [`PhotonWalk::step`] or [`ViewWalk::step`] should yield, where few walks by several steps each: what a call
    /// costs is the less felt. 1 where calls cost nothing.
    pub launch: usize,
}

/// Steps that such a call is asked for at most.
const MAX_STEPS: usize = 16;

/// A share of a job that is done in batches.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Batch {
    pub number: u64,
    /// The number of its first lane within the whole job.
    pub first: u64,
    pub lanes: usize,
}

impl Batching {
    /// How many steps to ask for in one call while so many walks are alive.
    pub fn steps(self, alive: usize) -> usize {
        (self.launch / alive.max(1)).clamp(1, MAX_STEPS)
    }

    /// How many batches a job of `lanes` takes.
    pub fn count(self, lanes: u64) -> u64 {
        lanes.div_ceil(self.lanes as u64)
    }

    /// Runs the batches `numbers` of a job of `lanes`, side by side where the host allows it. Results
    /// are in the order of the numbers.
    pub fn run<T: Send>(
        self,
        lanes: u64,
        numbers: Range<u64>,
        run: impl Fn(Batch) -> SceneResult<T> + Sync,
    ) -> SceneResult<Vec<T>> {
        let batch = |number: u64| {
            let first = number * self.lanes as u64;
            Batch { number, first, lanes: (lanes - first).min(self.lanes as u64) as usize }
        };
        if self.concurrent {
            // One by one: a thread that took several would leave the others idle at the end.
            let count = (numbers.end - numbers.start) as usize;
            let one_by_one = (0..count).into_par_iter().with_max_len(1);
            one_by_one.map(|index| run(batch(numbers.start + index as u64))).collect()
        } else {
            numbers.map(|number| run(batch(number))).collect()
        }
    }

    /// Runs all batches of a job of `lanes`.
    pub fn run_all<T: Send>(
        self,
        lanes: u64,
        run: impl Fn(Batch) -> SceneResult<T> + Sync,
    ) -> SceneResult<Vec<T>> {
        self.run(lanes, 0..self.count(lanes), run)
    }
}

/// Termination rules, with `volpath`'s meaning.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct PathLimits {
    /// [`UNBOUNDED_DEPTH`] or the number of path segments between lamp and eye that may not be exceeded.
    #[serde(serialize_with = "serialize_max_depth")]
    pub max_depth: u32,
    /// Depth from which Russian roulette ends walks.
    pub rr_depth: u32,
    pub hide_emitters: bool,
}

impl PathLimits {
    /// Probability with which Russian roulette lets a path go on that carries `weight` of what it started with. \[Roulette\]
    pub fn survival(weight: f32, depth: u32) -> f32 {
        weight.min(1.0 - 2.0 / (depth as f32 + 40.0))
    }
}

/// As the XML has it: -1 is unbounded.
fn serialize_max_depth<S: serde::Serializer>(
    depth: &u32,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.serialize_i64(if *depth == UNBOUNDED_DEPTH { -1 } else { i64::from(*depth) })
}

/// How far paths go, and what is simulated along them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PathRules {
    pub limits: PathLimits,
    /// What is not in here may be left out: the scene does not call for it.
    pub effects: Effects,
    /// Whether view rays go on in directions that a surface without delta lobes samples with a density above 1 per solid
    /// angle; its visible points leave those out, but for the light of lamps that is denser still. [Glossy chain]
    pub glossy_chains: bool,
}

impl PathRules {
    pub fn simulates(&self, effect: Effect) -> bool {
        self.effects.has(effect)
    }
}

/// Everything is simulated.
impl From<PathLimits> for PathRules {
    fn from(limits: PathLimits) -> Self {
        PathRules { limits, effects: Effects::ALL, glossy_chains: false }
    }
}

/// Three planes of `f32`, one value per lane and component.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Planes {
    lanes: usize,
    values: Vec<f32>,
}

impl Planes {
    /// Sets the number of lanes; contents are unspecified afterwards.
    pub fn resize(&mut self, lanes: usize) {
        self.lanes = lanes;
        self.values.resize(3 * lanes, 0.0);
    }

    pub fn lanes(&self) -> usize {
        self.lanes
    }

    pub fn get(&self, lane: usize) -> glam::Vec3 {
        let n = self.lanes;
        glam::Vec3::new(self.values[lane], self.values[n + lane], self.values[2 * n + lane])
    }

    pub fn set(&mut self, lane: usize, value: glam::Vec3) {
        let n = self.lanes;
        self.values[lane] = value.x;
        self.values[n + lane] = value.y;
        self.values[2 * n + lane] = value.z;
    }

    pub fn rgb(&self, lane: usize) -> Rgb {
        Rgb::from(self.get(lane))
    }

    pub fn set_rgb(&mut self, lane: usize, value: Rgb) {
        self.set(lane, value.into());
    }

    /// The three planes, one after another.
    fn planes_mut(&mut self) -> impl Iterator<Item = &mut [f32]> {
        self.values.chunks_exact_mut(self.lanes.max(1))
    }

    pub fn push_all(values: impl ExactSizeIterator<Item = glam::Vec3>) -> Self {
        let mut planes = Planes::default();
        planes.resize(values.len());
        for (lane, value) in values.enumerate() {
            planes.set(lane, value);
        }
        planes
    }

    /// Keeps the lanes named, which ascend.
    pub fn keep(&mut self, lanes: &[u32]) {
        let (before, after) = (self.lanes, lanes.len());
        for component in 0..3 {
            for (to, &from) in lanes.iter().enumerate() {
                self.values[component * after + to] =
                    self.values[component * before + from as usize];
            }
        }
        self.lanes = after;
        self.values.truncate(3 * after);
    }

    pub fn as_slice(&self) -> &[f32] {
        &self.values
    }

    pub fn as_mut_slice(&mut self) -> &mut [f32] {
        &mut self.values
    }
}

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

/// One segment per view ray, and the vertex at its end. Filled by [`ViewWalk::step`].
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

/// What happened at the end of a photon's segment ([`PhotonVertices::event`]).
pub mod photon_event {
    /// Nothing that is seen: the walk escaped, was absorbed, or met a delta or null lobe alone.
    pub const NONE: u32 = 0;
    /// A real collision in a medium.
    pub const MEDIUM: u32 = 1;
    /// A surface with a smooth lobe.
    pub const SURFACE: u32 = 2;
    /// Added to an event after which the walk ended because its flux was no longer finite.
    pub const INVALID: u32 = 4;
    /// Added where the segment comes straight from a lamp that [`super::Scene::lamp_light`] finds too: nothing
    /// scattered the photon before, null boundaries apart.
    pub const STRAIGHT: u32 = 8;
    /// No segment: the walk had ended within an earlier step of the same call.
    pub const ABSENT: u32 = 16;

    /// The event without what was added to it.
    pub fn kind(event: u32) -> u32 {
        event & !(INVALID | STRAIGHT)
    }
}

/// One segment per photon walk, and the event at its end. Filled by [`PhotonWalk::step`].
///
/// `flux` is ready to be deposited: at a collision it includes the single-scattering albedo (and,
/// for direction-dependent media, everything but the phase function); on a surface it is the flux
/// *before* the BSDF, corrected from the geometric to the shading normal's cosine.
#[derive(Debug, Clone, Default)]
pub struct PhotonVertices {
    /// Index of the walk within the batch as it was emitted.
    pub walk: Vec<u32>,
    pub event: Vec<u32>,
    pub medium: Vec<u32>,
    /// Scattering events before this one.
    pub depth: Vec<u32>,
    pub position: Planes,
    pub direction: Planes,
    pub length: Vec<f32>,
    /// Geometric normal as the shape is oriented, not turned toward the photon (surfaces only).
    pub geometric_normal: Planes,
    pub flux: Planes,
    /// How densely the light of the lamp lies in directions [1/sr], if nothing but delta and null lobes has scattered it
    /// yet, infinite for lamps without extent; else 0. Filled where the caller has put `Some`. \[Glossy chain\]
    pub lamp_density: Option<Vec<f32>>,
    /// Filled where the caller has put `Some`.
    pub segments: Option<PhotonSegments>,
}

impl PhotonVertices {
    pub fn resize(&mut self, lanes: usize) {
        for lane in [&mut self.walk, &mut self.event, &mut self.medium, &mut self.depth] {
            lane.resize(lanes, 0);
        }
        self.length.resize(lanes, 0.0);
        for planes in
            [&mut self.position, &mut self.direction, &mut self.geometric_normal, &mut self.flux]
        {
            planes.resize(lanes);
        }
        if let Some(density) = &mut self.lamp_density {
            density.resize(lanes, 0.0);
        }
        if let Some(segments) = &mut self.segments {
            segments.resize(lanes);
        }
    }

    /// No lanes; what may be left out is wanted as here.
    pub fn like(&self) -> Self {
        let segments = self.segments.as_ref().map(|_| PhotonSegments::default());
        let lamp_density = self.lamp_density.as_ref().map(|_| Vec::new());
        PhotonVertices { segments, lamp_density, ..PhotonVertices::default() }
    }

    /// Multiplies the flux of all lanes by the weights of their walks. The scene lends the threads that do it.
    pub fn weigh(&mut self, scene: &dyn Scene, weights: &[f32]) {
        let walks = &self.walk;
        let segments = self.segments.as_mut().map(|segments| &mut segments.flux);
        let fluxes = [&mut self.flux].into_iter().chain(segments);
        let planes = fluxes.flat_map(Planes::planes_mut).collect();
        crew::for_each_if(walks.len() >= SHARED_LANES, scene, planes, |plane: &mut [f32]| {
            for (value, &walk) in plane.iter_mut().zip(walks) {
                *value *= weights[walk as usize];
            }
        });
    }

    /// Drops lanes that are [`photon_event::ABSENT`]. The scene lends the threads that do it.
    pub fn keep_present(&mut self, scene: &dyn Scene) {
        let present = |lane: &u32| self.event[*lane as usize] & photon_event::ABSENT == 0;
        let present: Vec<u32> = (0..self.event.len() as u32).filter(present).collect();
        let lanes = self.event.len();
        if present.len() < lanes {
            let is_worth_it = lanes >= SHARED_LANES;
            crew::for_each_if(is_worth_it, scene, self.parts(), |part| part.keep(&present));
        }
    }

    /// All that there is of each lane.
    fn parts(&mut self) -> Vec<Part<'_>> {
        let indices = [&mut self.walk, &mut self.event, &mut self.medium, &mut self.depth];
        let triples =
            [&mut self.position, &mut self.direction, &mut self.geometric_normal, &mut self.flux];
        let mut parts: Vec<Part> = triples.into_iter().map(Part::Triples).collect();
        if let Some(PhotonSegments { origin, flux, density, reach }) = &mut self.segments {
            parts.extend([origin, flux, density].into_iter().map(Part::Triples));
            parts.push(Part::Numbers(reach));
        }
        parts.extend(indices.into_iter().map(Part::Indices));
        parts.extend(self.lamp_density.as_mut().map(Part::Numbers));
        parts.push(Part::Numbers(&mut self.length));
        parts
    }
}

/// From so many lanes on each part is a task; fewer are sooner done than handed over.
const SHARED_LANES: usize = 8192;

/// A part of photon vertices.
enum Part<'a> {
    Indices(&'a mut Vec<u32>),
    Numbers(&'a mut Vec<f32>),
    Triples(&'a mut Planes),
}

impl Part<'_> {
    /// Keeps the lanes named, which ascend.
    fn keep(self, lanes: &[u32]) {
        match self {
            Part::Indices(values) => keep(values, lanes),
            Part::Numbers(values) => keep(values, lanes),
            Part::Triples(planes) => planes.keep(lanes),
        }
    }
}

/// Keeps the lanes named, which ascend.
fn keep<T: Copy>(values: &mut Vec<T>, lanes: &[u32]) {
    for (to, &from) in lanes.iter().enumerate() {
        values[to] = values[from as usize];
    }
    values.truncate(lanes.len());
}

/// Photons' segments as photon beams, before anything of their own free flight. They run along
/// [`PhotonVertices::direction`] and weigh `flux * Tr(t)` as long beams, which end at `reach`, and
/// `flux * Tr(t) / mean(density * Tr(t))` as short beams, which end at [`PhotonVertices::length`].
/// [Long beam] [Short beam]
#[derive(Debug, Clone, Default)]
pub struct PhotonSegments {
    pub origin: Planes,
    /// Flux at the origin [W per emitted walk].
    pub flux: Planes,
    /// Densities of the walk up to the origin with each channel as hero, relative to their mean,
    /// which is 1. [Miller 2019]
    pub density: Planes,
    /// Distance \[length\] to the surface that ends the segment if nothing collides before; infinite
    /// where there is none.
    pub reach: Vec<f32>,
}

impl PhotonSegments {
    fn resize(&mut self, lanes: usize) {
        self.reach.resize(lanes, 0.0);
        for planes in [&mut self.origin, &mut self.flux, &mut self.density] {
            planes.resize(lanes);
        }
    }
}

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

/// Samples for the film: positions in film coordinates, radiance, alpha and weight, one per lane.
#[derive(Debug, Clone, Default)]
pub struct FilmSamples {
    /// x's then y's.
    pub position: Vec<f32>,
    pub radiance: Planes,
    pub alpha: Vec<f32>,
    pub weight: Vec<f32>,
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

    /// Adds samples through the film's reconstruction filter to `storage`
    /// (`film_pixels * film_channels` values).
    fn splat(&self, samples: &FilmSamples, storage: &mut [f64]) -> SceneResult<()>;
}
