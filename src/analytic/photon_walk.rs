use super::dielectric;
use super::fog::Fog;
use super::phase;
use super::ray::{Hit, Ray};
use super::surface::Material;
use super::warp;
use super::world::World;
use super::{may_scatter, number};
use crate::math::Rgb;
use crate::scene::{
    photon_event, PathLimits, PhotonVertices, PhotonWalk, SceneResult, PHOTON_STEP_DIMENSIONS,
};
use glam::Vec3;

/// A photon walk in flight.
///
/// Distances are sampled for one channel, the hero; the other channels are weighted by the balance
/// heuristic over the whole walk, as if each had been the hero in its turn.
// [Wilkie 2014 (5)]
#[derive(Debug, Clone, Copy)]
struct Photon {
    ray: Ray,
    /// Index within the batch as it was emitted.
    walk: u32,
    /// Scattering events so far.
    depth: u32,
    hero: usize,
    /// Emitted flux [W].
    emitted: Rgb,
    /// Throughput over the density of the walk with this hero.
    throughput: Rgb,
    /// Density of the walk with each channel as hero over that with this hero.
    densities: Rgb,
}

impl Photon {
    /// Throughput over the density of the walk with any hero.
    fn weight(&self) -> Rgb {
        self.throughput / self.densities.mean()
    }

    /// Takes in the density, per channel, of what free flight has done: both its transport and its
    /// sampling.
    fn fly(&mut self, value: Rgb) {
        let ratio = value / channel(value, self.hero);
        self.throughput *= ratio;
        self.densities *= ratio;
    }
}

/// A batch of photon walks that are alive.
pub(super) struct Photons<'a> {
    world: &'a World,
    limits: PathLimits,
    photons: Vec<Photon>,
}

impl<'a> Photons<'a> {
    pub fn emit(world: &'a World, lanes: usize, numbers: &[f32], limits: PathLimits) -> Self {
        let lanes_alive = if may_scatter(&limits, 0) { lanes } else { 0 };
        let photons = (0..lanes_alive).map(|lane| {
            let u = |dimension| number(numbers, lanes, dimension, lane);
            let count = world.emitters.len();
            let emitter = &world.emitters[(u(0) * count as f64) as usize];
            let emission = emitter.sample(&world.bounding_sphere, [u(1), u(2)], [u(3), u(4)]);
            Photon {
                ray: emission.ray,
                walk: lane as u32,
                depth: 0,
                hero: (3.0 * u(6)) as usize,
                emitted: emission.flux * count as f32,
                throughput: Rgb::ONE,
                densities: Rgb::ONE,
            }
        });
        Photons { world, limits, photons: photons.collect() }
    }

    /// Writes the segment and the event at its end; returns the walk if it goes on.
    fn advance(
        &self,
        mut photon: Photon,
        u: [f64; PHOTON_STEP_DIMENSIONS],
        lane: usize,
        out: &mut PhotonVertices,
    ) -> Option<Photon> {
        let hit = self.world.intersect(&photon.ray);
        let limit = hit.map_or(f64::INFINITY, |hit| hit.distance);
        write_start(&photon, limit, lane, out);
        let fog = self.world.fog(photon.ray.medium);
        let collision = fog.and_then(|fog| free_flight(&mut photon, fog, limit, u[0]));
        match (collision, fog, hit) {
            (Some(distance), Some(fog), _) => self.collide(photon, fog, distance, u, lane, out),
            (_, _, Some(hit)) => self.meet_surface(photon, &hit, u, lane, out),
            (_, _, None) => {
                write_segment(&photon, 0.0, photon_event::NONE, lane, out);
                out.length[lane] = f32::INFINITY;
                None
            }
        }
    }

    /// A real collision: deposits, and scatters by the phase function.
    fn collide(
        &self,
        mut photon: Photon,
        fog: &Fog,
        distance: f64,
        u: [f64; PHOTON_STEP_DIMENSIONS],
        lane: usize,
        out: &mut PhotonVertices,
    ) -> Option<Photon> {
        photon.throughput *= fog.albedo;
        write_segment(&photon, distance, photon_event::MEDIUM, lane, out);
        photon.ray.origin = photon.ray.at(distance);
        photon.ray.direction = phase::sample(fog.phase, photon.ray.direction, [u[2], u[3]]);
        self.scatter(photon, u[4])
    }

    fn meet_surface(
        &self,
        mut photon: Photon,
        hit: &Hit,
        u: [f64; PHOTON_STEP_DIMENSIONS],
        lane: usize,
        out: &mut PhotonVertices,
    ) -> Option<Photon> {
        let surface = self.world.surface(hit);
        let from_front = hit.is_front(photon.ray.direction);
        let normal = hit.normal_against(photon.ray.direction);
        let event = match surface.material {
            Material::Lambertian { .. } => photon_event::SURFACE,
            Material::Null | Material::Dielectric { .. } => photon_event::NONE,
        };
        write_segment(&photon, hit.distance, event, lane, out);
        out.geometric_normal.set(lane, hit.front_normal.as_vec3());
        photon.ray.origin = hit.position;
        match surface.material {
            Material::Null => {
                photon.ray.medium = surface.beyond(from_front);
                Some(photon)
            }
            Material::Lambertian { reflectance } => {
                photon.throughput *= reflectance;
                photon.ray.direction = warp::cosine_hemisphere(normal, [u[2], u[3]]);
                self.scatter(photon, u[4])
            }
            Material::Dielectric { index } => {
                let index = if from_front { index } else { 1.0 / index };
                let lobe = dielectric::sample(photon.ray.direction, normal, index, u[1]);
                if lobe.transmitted {
                    photon.ray.medium = surface.beyond(from_front);
                }
                photon.ray.direction = lobe.direction;
                self.scatter(photon, u[4])
            }
        }
    }

    /// Counts a scattering event; ends the walk by depth, for want of flux or by Russian roulette.
    fn scatter(&self, mut photon: Photon, u: f64) -> Option<Photon> {
        photon.depth += 1;
        if !may_scatter(&self.limits, photon.depth) || photon.throughput.is_zero() {
            return None;
        }
        if photon.depth >= self.limits.rr_depth {
            let survival = PathLimits::survival(photon.weight().max_component(), photon.depth);
            if u >= f64::from(survival) {
                return None;
            }
            photon.throughput = photon.throughput / survival;
        }
        Some(photon)
    }
}

fn channel(color: Rgb, index: usize) -> f32 {
    Vec3::from(color)[index]
}

/// Distance to a collision before `limit`, if there is one; weights the photon by what happened.
fn free_flight(photon: &mut Photon, fog: &Fog, limit: f64, u: f64) -> Option<f64> {
    let hero = f64::from(channel(fog.sigma_t, photon.hero));
    // The optical depth of the flight is exponentially distributed.
    let distance = fog.distance(&photon.ray, -(-u).ln_1p() / hero);
    let collides = distance < limit;
    let column = fog.column(&photon.ray, distance.min(limit));
    // A flight without end is not worth its weight: nothing comes after it.
    if column.is_finite() {
        let transmittance = fog.sigma_t.map(|sigma| (-f64::from(sigma) * column).exp() as f32);
        photon.fly(if collides { transmittance * fog.sigma_t } else { transmittance });
    }
    collides.then_some(distance)
}

/// Fills a lane with what is known of a segment before the free flight, if that is wanted.
fn write_start(photon: &Photon, reach: f64, lane: usize, out: &mut PhotonVertices) {
    if let Some(segments) = &mut out.segments {
        segments.origin.set(lane, photon.ray.origin.as_vec3());
        segments.flux.set_rgb(lane, photon.emitted * photon.weight());
        segments.density.set_rgb(lane, photon.densities / photon.densities.mean());
        segments.reach[lane] = reach as f32;
    }
}

/// Fills a lane with a segment, its end and the photon's flux there.
fn write_segment(photon: &Photon, length: f64, event: u32, lane: usize, out: &mut PhotonVertices) {
    let straight = if photon.depth == 0 { photon_event::STRAIGHT } else { 0 };
    out.walk[lane] = photon.walk;
    out.event[lane] = event | straight;
    out.medium[lane] = photon.ray.medium;
    out.depth[lane] = photon.depth;
    out.position.set(lane, photon.ray.at(length).as_vec3());
    out.direction.set(lane, photon.ray.direction.as_vec3());
    out.length[lane] = length as f32;
    out.geometric_normal.set(lane, Vec3::ZERO);
    out.flux.set_rgb(lane, photon.emitted * photon.weight());
}

impl PhotonWalk for Photons<'_> {
    fn lanes(&self) -> usize {
        self.photons.len()
    }

    fn alive(&self, out: &mut Vec<u32>) -> SceneResult<()> {
        out.clear();
        out.extend(self.photons.iter().map(|photon| photon.walk));
        Ok(())
    }

    fn step(&mut self, steps: usize, numbers: &[f32], out: &mut PhotonVertices) -> SceneResult<()> {
        let lanes = self.photons.len();
        out.resize(steps * lanes);
        out.event.fill(photon_event::ABSENT);
        let mut alive = Vec::with_capacity(lanes);
        for (lane, &photon) in self.photons.iter().enumerate() {
            let mut photon = Some(photon);
            for step in 0..steps {
                let Some(before) = photon else { break };
                let planes = &numbers[step * PHOTON_STEP_DIMENSIONS * lanes..];
                let u = std::array::from_fn(|dimension| number(planes, lanes, dimension, lane));
                photon = self.advance(before, u, step * lanes + lane, out);
            }
            alive.extend(photon);
        }
        self.photons = alive;
        Ok(())
    }
}
