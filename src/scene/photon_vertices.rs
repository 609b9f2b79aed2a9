//! What photon walks meet.

use super::work;
use super::{Planes, Scene};

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

/// One segment per photon walk, and the event at its end. Filled by [`super::PhotonWalk::step`].
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
        work::for_each_if(walks.len() >= SHARED_LANES, scene, planes, |plane: &mut [f32]| {
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
            work::for_each_if(is_worth_it, scene, self.parts(), |part| part.keep(&present));
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
