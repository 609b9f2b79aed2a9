use super::number;
use super::ray::Ray;
use super::surface::Material;
use super::world::World;
use crate::math::Rgb;
use crate::scene::{LampLight, Places};
use glam::DVec3;

/// Share of its coordinates by which a ray starts off the surface that it lies on: they are of single precision.
const OFF_SURFACE: f64 = 1e-6;
/// Share of the way to a lamp on which nothing may stand: the lamp itself ends it.
const BEFORE_LAMP: f64 = 1.0 - 1e-9;

/// See [`crate::scene::Scene::lamp_light`].
pub(super) fn lamp_light(world: &World, places: &Places, numbers: &[f32], out: &mut LampLight) {
    let lanes = places.medium.len();
    out.resize(lanes);
    for lane in 0..lanes {
        let (direction, irradiance) = if world.emitters.is_empty() {
            (DVec3::ZERO, Rgb::ZERO)
        } else {
            sample(world, places, lane, [0, 1].map(|d| number(numbers, lanes, d, lane)))
        };
        out.direction.set(lane, direction.as_vec3());
        out.irradiance.set_rgb(lane, irradiance);
    }
}

fn sample(world: &World, places: &Places, lane: usize, u: [f64; 2]) -> (DVec3, Rgb) {
    let choice = u[0] * world.emitters.len() as f64;
    let emitter = &world.emitters[choice as usize];
    let position = places.position.get(lane).as_dvec3();
    let arrival = emitter.sample_toward(position, [choice.fract(), u[1]]);
    let normal = places.normal.get(lane).as_dvec3();
    let side = -arrival.direction.dot(normal).signum();
    let lift = OFF_SURFACE * (position.abs().max_element() + world.bounding_sphere.radius);
    let ray = Ray {
        origin: position + side * lift * normal,
        direction: -arrival.direction,
        medium: places.medium[lane],
    };
    let passed = transmittance(world, ray, BEFORE_LAMP * arrival.distance - 2.0 * lift);
    (arrival.direction, arrival.irradiance * passed * world.emitters.len() as f32)
}

/// What passes through fogs and null boundaries over a distance.
fn transmittance(world: &World, mut ray: Ray, mut distance: f64) -> Rgb {
    let mut passed = Rgb::ONE;
    loop {
        let hit = world.intersect(&ray).filter(|hit| hit.distance < distance);
        let length = hit.map_or(distance, |hit| hit.distance);
        if let Some(fog) = world.fog(ray.medium) {
            let column = fog.column(&ray, length);
            passed *= fog.sigma_t.map(|sigma| match sigma {
                0.0 => 1.0,
                sigma => (-f64::from(sigma) * column).exp() as f32,
            });
        }
        let Some(hit) = hit else { return passed };
        let surface = world.surface(&hit);
        if surface.material != Material::Null {
            return Rgb::ZERO;
        }
        distance -= hit.distance;
        ray.medium = surface.beyond(hit.is_front(ray.direction));
        ray.origin = hit.position;
    }
}
