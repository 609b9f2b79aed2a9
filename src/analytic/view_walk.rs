use super::dielectric;
use super::ray::{Hit, Ray};
use super::surface::Material;
use super::world::{Disclosure, World};
use super::{may_scatter, number};
use crate::math::Rgb;
use crate::scene::{
    view_flags, PathLimits, SceneResult, ViewRayRequest, ViewVertices, ViewWalk,
    VIEW_STEP_DIMENSIONS,
};
use glam::DVec3;

/// A view ray in flight.
#[derive(Debug, Clone, Copy)]
struct ViewRay {
    ray: Ray,
    /// Scattering events so far.
    depth: u32,
    /// Within the batch.
    index: u32,
}

/// A batch of view rays; `None` where a ray has ended within the present call.
pub(super) struct ViewRays<'a> {
    world: &'a World,
    limits: PathLimits,
    rays: Vec<Option<ViewRay>>,
}

impl<'a> ViewRays<'a> {
    pub fn start(world: &'a World, request: &ViewRayRequest) -> Self {
        let rays = (0..request.lanes).map(|lane| {
            let x = number(request.film, request.lanes, 0, lane);
            let y = number(request.film, request.lanes, 1, lane);
            let ray = world.contents.camera.ray(x, y);
            Some(ViewRay { ray, depth: 0, index: lane as u32 })
        });
        let goes_on = request.rules.limits.max_depth > 0;
        let rays = if goes_on { rays.collect() } else { Vec::new() };
        ViewRays { world, limits: request.rules.limits, rays }
    }

    /// Writes the vertex at the end of a segment and returns what goes on from there.
    fn advance(
        &self,
        view: ViewRay,
        u: f64,
        lane: usize,
        out: &mut ViewVertices,
    ) -> Option<ViewRay> {
        let hides = self.limits.hide_emitters && view.depth == 0;
        let hit = match hides {
            true => self.world.intersect_dark(&view.ray),
            false => self.world.intersect(&view.ray),
        };
        write_segment(&view.ray, hit.as_ref(), lane, out);
        let emission = self.world.emission(&view.ray, hit.as_ref());
        if !emission.is_zero() && !hides {
            out.flags[lane] |= view_flags::EMISSION;
            out.emission.set_rgb(lane, emission);
        }
        let hit = hit?;
        match self.world.surface(&hit).material {
            Material::Null => self.pass(view, &hit, lane, out),
            Material::Lambertian { reflectance } => {
                self.stop(view, reflectance, lane, out);
                None
            }
            Material::Dielectric { index } => self.bend(view, &hit, index, u, lane, out),
        }
    }

    /// Goes on behind an index-matched boundary.
    fn pass(
        &self,
        view: ViewRay,
        hit: &Hit,
        lane: usize,
        out: &mut ViewVertices,
    ) -> Option<ViewRay> {
        out.flags[lane] |= view_flags::CONTINUES;
        let direction = view.ray.direction;
        let medium = self.world.surface(hit).beyond(hit.is_front(direction));
        Some(ViewRay { ray: Ray { origin: hit.position, direction, medium }, ..view })
    }

    /// Makes a visible point on a matt surface.
    fn stop(&self, view: ViewRay, reflectance: Rgb, lane: usize, out: &mut ViewVertices) {
        if may_scatter(&self.limits, view.depth) {
            out.flags[lane] |= view_flags::VISIBLE_POINT;
            if self.world.contents.disclosure == Disclosure::Full {
                out.flags[lane] |= view_flags::LAMBERTIAN;
                out.reflectance.set_rgb(lane, reflectance);
            }
        }
    }

    /// Goes on along one of the two lobes of glass.
    fn bend(
        &self,
        view: ViewRay,
        hit: &Hit,
        index: f64,
        u: f64,
        lane: usize,
        out: &mut ViewVertices,
    ) -> Option<ViewRay> {
        if !may_scatter(&self.limits, view.depth) {
            return None;
        }
        let direction = view.ray.direction;
        let from_front = hit.is_front(direction);
        let index = if from_front { index } else { 1.0 / index };
        let lobe = dielectric::sample(direction, hit.normal_against(direction), index, u);
        if lobe.transmitted {
            // Radiance over the square of the refractive index is conserved.
            out.weight.set_rgb(lane, Rgb::splat((1.0 / (index * index)) as f32));
        }
        out.flags[lane] |= view_flags::CONTINUES | view_flags::SCATTERED;
        let medium = match lobe.transmitted {
            true => self.world.surface(hit).beyond(from_front),
            false => view.ray.medium,
        };
        let ray = Ray { origin: hit.position, direction: lobe.direction, medium };
        Some(ViewRay { ray, depth: view.depth + 1, ..view })
    }
}

/// Fills a lane with a segment on whose end nothing happens yet.
fn write_segment(ray: &Ray, hit: Option<&Hit>, lane: usize, out: &mut ViewVertices) {
    out.flags[lane] = if hit.is_some() { view_flags::HIT } else { 0 };
    out.medium[lane] = ray.medium;
    out.length[lane] = hit.map_or(f32::INFINITY, |hit| hit.distance as f32);
    out.origin.set(lane, ray.origin.as_vec3());
    out.direction.set(lane, ray.direction.as_vec3());
    let end = hit.map_or(ray.origin, |hit| hit.position);
    out.position.set(lane, end.as_vec3());
    let normal = hit.map_or(DVec3::ZERO, |hit| hit.normal_against(ray.direction));
    out.normal.set(lane, normal.as_vec3());
    let geometric_normal = hit.map_or(DVec3::ZERO, |hit| hit.front_normal);
    out.geometric_normal.set(lane, geometric_normal.as_vec3());
    out.reflectance.set_rgb(lane, Rgb::ZERO);
    out.emission.set_rgb(lane, Rgb::ZERO);
    out.weight.set_rgb(lane, Rgb::ONE);
}

impl ViewWalk for ViewRays<'_> {
    fn lanes(&self) -> usize {
        self.rays.len()
    }

    fn step(&mut self, steps: usize, numbers: &[f32], out: &mut ViewVertices) -> SceneResult<()> {
        let lanes = self.rays.len();
        out.resize(steps * lanes);
        out.flags.fill(view_flags::ABSENT);
        for step in 0..steps {
            let numbers = &numbers[step * VIEW_STEP_DIMENSIONS * lanes..];
            for lane in 0..lanes {
                let Some(view) = self.rays[lane] else { continue };
                let slot = step * lanes + lane;
                out.ray[slot] = view.index;
                let u = number(numbers, lanes, 0, lane);
                self.rays[lane] = self.advance(view, u, slot, out);
            }
        }
        self.rays.retain(Option::is_some);
        Ok(())
    }
}
