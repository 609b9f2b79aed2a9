//! What a photon adds to a receiver: the three kinds of pairs. Whoever finds a pair, a photon that asks
//! a tree of receivers or a receiver that asks a map of photons, it is worth the same.

use super::asked::{keep, Asked, MediumPair, Pending, SurfacePair};
use super::cone::nearly_parallel;
use super::counters::Counters;
use super::deposits::Sink;
use super::photon::{Family, MediumPhoton, SurfacePhoton};
use super::photon_beam::PhotonBeam;
use super::view::{Lobe, PointRecord, ViewBeam, ViewPaths};
use crate::density::kernel;
use crate::density::radius::Radii;
use crate::math::{Approach, Rgb};
use crate::medium::{phase, TransmittanceTables};
use crate::plan::Plan;
use crate::scene::*;
use glam::Vec3;

/// Cosine between the geometric normals of photon and point above which they lie on one surface.
const SAME_SURFACE: f32 = 0.5;
/// Height of a photon over the point's plane, in radii, up to which they lie on one surface.
const SAME_HEIGHT: f32 = 0.5;

/// What pairs depend on besides photon and receiver.
#[derive(Clone, Copy)]
pub struct Pairs<'a> {
    pub paths: &'a ViewPaths,
    pub media: &'a [Medium],
    pub radii: Radii,
    pub limits: PathLimits,
}

/// Contributions of pairs: finished ones in `sink`, the others in `asked`.
pub struct Gathered<S> {
    pub sink: S,
    pub asked: Asked,
    pub counters: Counters,
}

impl<S: Sink> Gathered<S> {
    pub fn new(sink: S) -> Self {
        Gathered { sink, asked: Asked::default(), counters: Counters::default() }
    }

    pub fn append(&mut self, other: Self) {
        self.sink.append(other.sink);
        self.asked.append(other.asked);
        self.counters.add(&other.counters);
    }

    /// Asks the scene what is still owed.
    pub fn resolve(&mut self, scene: &dyn Scene) -> SceneResult<()> {
        let asked = std::mem::take(&mut self.asked);
        asked.resolve(scene, &mut self.sink, &mut self.counters)
    }

    fn keep(&mut self, family: Family, pending: Pending) {
        keep(&mut self.sink, &mut self.counters, family, pending);
    }

    fn keep_or_ask(&mut self, pair: MediumPair, pending: Pending) {
        if pair.owes_phase || pair.owes_scattering {
            self.asked.medium(pair, pending);
        } else {
            self.keep(Family::Medium, pending);
        }
    }
}

impl<'a> Pairs<'a> {
    pub fn new(plan: &'a Plan, paths: &'a ViewPaths, radii: Radii) -> Self {
        Pairs { paths, media: &plan.media, radii, limits: plan.limits() }
    }

    fn within_depth(&self, view: u32, photon: u32) -> bool {
        // Scattering here counts once, and a path keeps fewer than `max_depth` scattering events.
        view.saturating_add(photon).saturating_add(2) <= self.limits.max_depth
    }

    /// A photon within the radius of a view beam, at distance `t` along it and this squared distance from
    /// it.
    // [Collin 2013 (4)], with the albedo in place of sigma_s: photons are stored per collision.
    pub fn point_on_beam<S: Sink>(
        &self,
        photon: &MediumPhoton,
        beam: ViewBeam,
        t: f32,
        distance_squared: f32,
        out: &mut Gathered<S>,
    ) {
        if beam.record.medium != photon.medium
            || !self.within_depth(beam.record.depth, photon.depth)
        {
            return;
        }
        let tr = self.paths.beam_transmittance(beam.record, self.media, t);
        let weighted = beam.record.throughput * tr * photon.flux * kernel::disk(self.radii.medium);
        let bias_share = kernel::disk_bias_share(distance_squared, self.radii.medium);
        let pending = Pending { walk: photon.walk, pixel: beam.record.pixel, weighted, bias_share };
        self.scatter(photon.position, photon.direction, beam, Some(Rgb::ONE), pending, out);
    }

    /// The collision of a photon beam that is nearly parallel to a view beam, within its radius.
    // [Parallel pair]
    pub fn parallel_on_beam<S: Sink>(
        &self,
        photon: &MediumPhoton,
        beam: ViewBeam,
        t: f32,
        distance_squared: f32,
        out: &mut Gathered<S>,
    ) {
        if nearly_parallel(beam.segment.direction, photon.direction) {
            self.point_on_beam(photon, beam, t, distance_squared, out);
        }
    }

    /// A photon beam that comes within the radius of a view beam, at an angle to it; `tables` are those of photon beams.
    // [Beam pair]
    pub fn beam_on_beam<S: Sink>(
        &self,
        photon: &PhotonBeam,
        tables: &TransmittanceTables,
        beam: ViewBeam,
        approach: &Approach,
        out: &mut Gathered<S>,
    ) {
        if beam.record.medium != photon.medium
            || !self.within_depth(beam.record.depth, photon.depth)
            || nearly_parallel(beam.segment.direction, photon.segment.direction)
        {
            return;
        }
        let flux = photon.flux_at(approach.t_other, self.media, tables);
        let tr = self.paths.beam_transmittance(beam.record, self.media, approach.t);
        let weight = kernel::interval(self.radii.medium) / approach.sine;
        let pending = Pending {
            walk: photon.walk,
            pixel: beam.record.pixel,
            weighted: beam.record.throughput * tr * flux * weight,
            bias_share: kernel::interval_bias_share(approach.distance_squared, self.radii.medium),
        };
        let position = photon.segment.at(approach.t_other);
        let sigma_s = self.media[photon.medium as usize].scattering;
        self.scatter(position, photon.segment.direction, beam, sigma_s, pending, out);
    }

    /// Applies the phase function and what the photon does not hold of `sigma_s`; asks for what only the
    /// scene knows (None).
    fn scatter<S: Sink>(
        &self,
        position: Vec3,
        photon: Vec3,
        beam: ViewBeam,
        sigma_s: Option<Rgb>,
        mut pending: Pending,
        out: &mut Gathered<S>,
    ) {
        let view = beam.segment.direction;
        let phase = self.phase(beam.record.medium, photon, -view);
        let directional = self.media[beam.record.medium as usize].phase != Phase::Isotropic;
        out.counters.directional_pairs += u64::from(directional);
        pending.weighted = pending.weighted * sigma_s.unwrap_or(Rgb::ONE) * phase.unwrap_or(1.0);
        let (owes_phase, owes_scattering) = (phase.is_none(), sigma_s.is_none());
        let medium = beam.record.medium;
        let pair = MediumPair { medium, position, photon, view, owes_phase, owes_scattering };
        out.keep_or_ask(pair, pending);
    }

    /// Between directions of travel; None where the scene has to be asked.
    fn phase(&self, medium: u32, before: Vec3, after: Vec3) -> Option<f32> {
        match self.media[medium as usize].phase {
            Phase::Isotropic => Some(phase::ISOTROPIC),
            Phase::HenyeyGreenstein { g } => Some(phase::henyey_greenstein(g, before, after)),
            Phase::Opaque => None,
        }
    }

    /// A photon within the radius of a visible point at `position`, at this squared distance from it.
    // [Collin 2013 (5)], without the cosine: the density of photons on a surface holds it.
    pub fn photon_on_point<S: Sink>(
        &self,
        photon: &SurfacePhoton,
        point: &PointRecord,
        position: Vec3,
        distance_squared: f32,
        out: &mut Gathered<S>,
    ) {
        let (geometric_normal, normal) = (point.geometric_normal.into(), point.normal.on_faces());
        let height = (photon.position - position).dot(geometric_normal).abs();
        if photon.geometric_normal.dot(geometric_normal) < SAME_SURFACE
            || height > SAME_HEIGHT * self.radii.surface
            || !self.within_depth(self.paths.depth(point), photon.depth)
            || photon.is_found && photon.direction.dot(normal) < 0.0
        {
            return;
        }
        let weighted = point.weight * photon.flux * kernel::disk(self.radii.surface);
        let bias_share = kernel::disk_bias_share(distance_squared, self.radii.surface);
        let pending = Pending { walk: photon.walk, pixel: point.pixel, weighted, bias_share };
        let light = Light { direction: photon.direction, lamp_density: photon.lamp_density };
        reflect(light, normal, point.lobe(), pending, out);
    }

    /// One sample of a lamp's light at distance `t` along a view beam, which was drawn with this density [1/length].
    // [Connection]
    pub fn lamp_on_beam<S: Sink>(
        &self,
        lamp: LampSample,
        beam: ViewBeam,
        t: f32,
        density: f32,
        out: &mut Gathered<S>,
    ) {
        if lamp.irradiance.is_zero() || !self.within_depth(beam.record.depth, 0) {
            return;
        }
        let tr = self.paths.beam_transmittance(beam.record, self.media, t);
        let weighted = beam.record.throughput * tr * lamp.irradiance / density;
        let sigma_s = self.media[beam.record.medium as usize].scattering;
        let pending = Pending { walk: 0, pixel: beam.record.pixel, weighted, bias_share: 0.0 };
        self.scatter(beam.segment.at(t), lamp.direction, beam, sigma_s, pending, out);
    }

    /// One sample of a lamp's light at a visible point, from the viewer's side.
    // [Connection]
    pub fn lamp_on_point<S: Sink>(
        &self,
        lamp: LampSample,
        point: &PointRecord,
        out: &mut Gathered<S>,
    ) {
        let normal = point.normal.into();
        let cosine = -lamp.direction.dot(normal);
        let depth = self.paths.depth(point);
        if lamp.irradiance.is_zero() || cosine <= 0.0 || !self.within_depth(depth, 0) {
            return;
        }
        let weighted = point.weight * lamp.irradiance * cosine;
        let pending = Pending { walk: 0, pixel: point.pixel, weighted, bias_share: 0.0 };
        let light = Light { direction: lamp.direction, lamp_density: lamp.density };
        reflect(light, normal, point.lobe(), pending, out);
    }
}

/// Light of one direction from a lamp, at a receiver.
#[derive(Debug, Clone, Copy)]
pub struct LampSample {
    pub direction: Vec3,
    /// Normal to the direction, over the density of the sample [W/m²].
    pub irradiance: Rgb,
    /// How densely the lamp's light lies in directions, as in [`LampLight`] \[1/sr\].
    pub density: f32,
}

/// Light that falls on a visible point.
struct Light {
    direction: Vec3,
    lamp_density: f32,
}

/// Adds what a visible point reflects, or asks for its BSDF.
fn reflect<S: Sink>(
    Light { direction, lamp_density }: Light,
    normal: Vec3,
    lobe: Lobe,
    pending: Pending,
    out: &mut Gathered<S>,
) {
    match lobe {
        Lobe::Lambertian if direction.dot(normal) >= 0.0 => {}
        Lobe::Lambertian => out.keep(Family::Surface, pending),
        Lobe::Stored(stored) => {
            let pair = SurfacePair { point: stored, photon: direction, lamp_density };
            out.asked.surface(pair, pending);
        }
    }
}
