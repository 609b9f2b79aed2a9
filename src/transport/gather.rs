//! The receivers of a photon, and what it adds to their pixels.

use crate::density::kernel;
use crate::density::radius::Radii;
use crate::math::Rgb;
use crate::medium::phase;
use crate::scene::*;
use crate::transport::counters::Counters;
use crate::transport::deposits::Deposits;
use crate::transport::receivers::Receivers;
use crate::transport::view::Lobe;
use glam::Vec3;

/// Cosine between the geometric normals of photon and point above which they lie on one surface.
const SAME_SURFACE: f32 = 0.5;
/// Height of a photon over the point's plane, in radii, up to which they lie on one surface.
const SAME_HEIGHT: f32 = 0.5;

/// What a range of photon vertices gave.
pub struct Gathered {
    pub deposits: Deposits,
    pub asked: Asked,
    pub counters: Counters,
}

/// Finds the receivers of photons and evaluates what the engine can by itself.
pub struct Gather<'a> {
    pub receivers: &'a Receivers,
    pub media: &'a [Medium],
    pub radii: Radii,
    pub limits: PathLimits,
}

impl Gather<'_> {
    pub fn run(&self, v: &PhotonVertices, range: std::ops::Range<usize>) -> Gathered {
        let mut out = Gathered {
            deposits: Deposits::new(self.receivers.pixels()),
            asked: Asked::default(),
            counters: Counters::default(),
        };
        for lane in range {
            if v.event[lane] & photon_event::INVALID != 0 {
                out.counters.dropped_photons += 1;
            }
            let event = v.event[lane] & !photon_event::INVALID;
            if event == photon_event::NONE {
                continue;
            }
            if !v.flux.rgb(lane).is_finite() || !v.position.get(lane).is_finite() {
                out.counters.dropped_photons += 1;
            } else if event == photon_event::MEDIUM {
                self.medium(v, lane, &mut out);
            } else {
                self.surface(v, lane, &mut out);
            }
        }
        out
    }

    fn within_depth(&self, view: u32, photon: u32) -> bool {
        // Scattering here counts once, and a path keeps fewer than `max_depth` scattering events.
        view.saturating_add(photon).saturating_add(2) <= self.limits.max_depth
    }

    // [Collin 2013 (4)], with the albedo in place of sigma_s: photons are stored per collision.
    fn medium(&self, v: &PhotonVertices, lane: usize, out: &mut Gathered) {
        out.counters.medium_photons += 1;
        let (position, direction) = (v.position.get(lane), v.direction.get(lane));
        let (medium, depth) = (v.medium[lane], v.depth[lane]);
        let flux = v.flux.rgb(lane) * kernel::disk(self.radii.medium);
        let phase = self.media[medium as usize].phase;
        let paths = &self.receivers.paths;
        self.receivers.beam_tree.query(position, self.radii.medium, |index, t, _| {
            let beam = &paths.beams[index as usize];
            if beam.medium != medium || !self.within_depth(beam.depth, depth) {
                return;
            }
            let tr = paths.beam_transmittance(beam, self.media, t);
            let weighted = beam.throughput * tr * flux;
            let cosine = -direction.dot(beam.segment.direction);
            match phase {
                Phase::Isotropic => out.keep(beam.pixel, weighted * phase::ISOTROPIC, true),
                Phase::HenyeyGreenstein { g } => {
                    out.keep(beam.pixel, weighted * phase::henyey_greenstein(g, cosine), true);
                }
                Phase::Opaque => {
                    let view = beam.segment.direction;
                    out.asked.phase(medium, position, direction, view, beam.pixel, weighted);
                }
            }
        });
    }

    // [Collin 2013 (5)], without the cosine: the density of photons on a surface holds it.
    fn surface(&self, v: &PhotonVertices, lane: usize, out: &mut Gathered) {
        out.counters.surface_photons += 1;
        let (position, direction) = (v.position.get(lane), v.direction.get(lane));
        let (normal, depth) = (v.geometric_normal.get(lane), v.depth[lane]);
        let flux = v.flux.rgb(lane) * kernel::disk(self.radii.surface);
        let points = &self.receivers.paths.points;
        self.receivers.point_tree.query(position, self.radii.surface, |index, _| {
            let point = &points[index as usize];
            let height = (position - point.position).dot(point.geometric_normal).abs();
            if normal.dot(point.geometric_normal) < SAME_SURFACE
                || height > SAME_HEIGHT * self.radii.surface
                || !self.within_depth(point.depth, depth)
            {
                return;
            }
            let weighted = point.throughput * flux;
            match point.lobe {
                Lobe::Lambertian(_) if direction.dot(point.normal) >= 0.0 => {}
                Lobe::Lambertian(reflectance) => {
                    out.keep(
                        point.pixel,
                        weighted * reflectance * std::f32::consts::FRAC_1_PI,
                        false,
                    );
                }
                Lobe::Stored(stored) => out.asked.bsdf(stored, direction, point.pixel, weighted),
            }
        });
    }
}

impl Gathered {
    fn keep(&mut self, pixel: u32, radiance: Rgb, in_medium: bool) {
        keep(&mut self.deposits, &mut self.counters, pixel, radiance, in_medium);
    }
}

fn keep(
    deposits: &mut Deposits,
    counters: &mut Counters,
    pixel: u32,
    radiance: Rgb,
    in_medium: bool,
) {
    if !radiance.is_finite() {
        counters.dropped_deposits += 1;
        return;
    }
    if in_medium {
        counters.medium_deposits += 1;
    } else {
        counters.surface_deposits += 1;
    }
    deposits.push(pixel, radiance);
}

/// Pairs whose scattering function only the scene can evaluate.
#[derive(Default)]
pub struct Asked {
    phases: Vec<AskedPhase>,
    bsdfs: Vec<AskedBsdf>,
}

struct AskedPhase {
    medium: u32,
    position: Vec3,
    photon: Vec3,
    view: Vec3,
    pixel: u32,
    weighted: Rgb,
}

struct AskedBsdf {
    point: u32,
    photon: Vec3,
    pixel: u32,
    weighted: Rgb,
}

impl Asked {
    fn phase(
        &mut self,
        medium: u32,
        position: Vec3,
        photon: Vec3,
        view: Vec3,
        pixel: u32,
        weighted: Rgb,
    ) {
        self.phases.push(AskedPhase { medium, position, photon, view, pixel, weighted });
    }

    fn bsdf(&mut self, point: u32, photon: Vec3, pixel: u32, weighted: Rgb) {
        self.bsdfs.push(AskedBsdf { point, photon, pixel, weighted });
    }

    pub fn append(&mut self, mut other: Asked) {
        self.phases.append(&mut other.phases);
        self.bsdfs.append(&mut other.bsdfs);
    }

    /// Asks the scene and turns the answers into deposits.
    pub fn resolve(
        self,
        scene: &dyn Scene,
        deposits: &mut Deposits,
        counters: &mut Counters,
    ) -> SceneResult<()> {
        let mut values = Planes::default();
        if !self.phases.is_empty() {
            let pairs = PhasePairs {
                medium: self.phases.iter().map(|p| p.medium).collect(),
                position: Planes::push_all(self.phases.iter().map(|p| p.position)),
                photon_direction: Planes::push_all(self.phases.iter().map(|p| p.photon)),
                view_direction: Planes::push_all(self.phases.iter().map(|p| p.view)),
            };
            scene.eval_phase(&pairs, &mut values)?;
            for (lane, pair) in self.phases.iter().enumerate() {
                keep(deposits, counters, pair.pixel, pair.weighted * values.rgb(lane), true);
            }
        }
        if !self.bsdfs.is_empty() {
            let pairs = SurfacePairs {
                point: self.bsdfs.iter().map(|p| p.point).collect(),
                photon_direction: Planes::push_all(self.bsdfs.iter().map(|p| p.photon)),
            };
            scene.eval_bsdf(&pairs, &mut values)?;
            for (lane, pair) in self.bsdfs.iter().enumerate() {
                keep(deposits, counters, pair.pixel, pair.weighted * values.rgb(lane), false);
            }
        }
        Ok(())
    }
}
