//! Random scenes that both sides can render and that cost little to judge.
//!
//! What is left out, and why:
//!
//! - A lamp that no ray meets by chance (point, spot, directional) never shares a scene with a sharp mirror
//!   or sharp glass: `volpath` finds such a lamp by shadow rays alone, which end there, and leaves its
//!   caustics black. Photons find them, so the reference would be wrong.
//! - Area lamps are large, so that a path tracer meets them by chance through glass often enough.
//! - Roughness is at least 0.3 and |g| at most 0.9: narrower lobes take long on both sides.
//! - Optical depths are moderate: `volpath` drops paths whose majorant's transmittance underflows, and its
//!   shadow rays end a little before the lamp.
//! - No `bumpmap`, `normalmap`, `sggx` or smooth normals: see what was found of them in `docs/ARCHITECTURE.md`.
//! - Lamps are hidden in scenes without media alone: within one, `volpath` shows the body of a hidden lamp.
//! - Paths are bounded where extinction is coloured: `volpathmis`, which judges there, is dark where its
//!   roulette begins. They are in a medium without end too, which no walk leaves.
//! - An infinite lamp in a medium without end lights nothing.

use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::scene::*;

pub fn generate(seed: u64) -> Scene {
    Generator { random: Pcg64Mcg::seed_from_u64(seed), sharp: false }.scene()
}

struct Generator {
    random: Pcg64Mcg,
    /// Sharp mirrors and glass, or else lamps that no ray meets.
    sharp: bool,
}

/// Where objects stand, well apart.
const SLOTS: [Point; 7] = [
    [-0.6, -0.6, -0.6],
    [0.6, -0.6, -0.6],
    [-0.6, 0.3, -0.6],
    [0.6, 0.3, -0.6],
    [-0.6, -0.6, 0.2],
    [0.6, -0.6, 0.2],
    [0.0, -0.2, -0.2],
];
const SLOT_RADIUS: f32 = 0.4;
/// What light travels before it meets something else, for the choice of optical depths.
const OUTSIDE: f32 = 2.0;

impl Generator {
    fn scene(mut self) -> Scene {
        self.sharp = self.random.random_bool(0.5);
        let surroundings = self.surroundings();
        let air = self.random.random_bool(0.5).then(|| self.air(&surroundings));
        let camera = self.camera(&surroundings);
        let count = self.random.random_range(1..=5);
        let slots: Vec<Point> = SLOTS.choose_multiple(&mut self.random, count).copied().collect();
        let mut scene = Scene {
            objects: slots.into_iter().map(|slot| self.object(slot, SLOT_RADIUS, 2)).collect(),
            lamps: Vec::new(),
            max_depth: self.random.random_bool(0.8).then(|| self.random.random_range(2..=8)),
            rr_depth: self.random.random_range(2..=8),
            hide_emitters: self.random.random_bool(0.3),
            surroundings,
            air,
            camera,
        };
        self.light(&mut scene);
        scene.hide_emitters &= scene.media().is_empty();
        let coloured = scene.media().iter().any(|medium| !medium.extinction.is_grey());
        if scene.max_depth.is_none() && (coloured || is_endless(&scene)) {
            scene.max_depth = Some(8);
        }
        scene
    }

    fn surroundings(&mut self) -> Surroundings {
        match self.random.random_range(0..4) {
            0 | 1 => {
                let walls =
                    if self.random.random_bool(0.7) { self.diffuse() } else { self.reflector(1) };
                Surroundings::Room(Bsdf::TwoSided(walls.into()))
            }
            2 => {
                let glass = self.sharp && self.random.random_bool(0.2);
                let boundary = if glass { Bsdf::Dielectric { ior: 1.3 } } else { Bsdf::Null };
                Surroundings::Box { boundary, camera_inside: self.random.random_bool(0.5) }
            }
            _ => {
                let floor = self.random.random_bool(0.7).then(|| self.diffuse());
                Surroundings::Open { floor }
            }
        }
    }

    /// A medium without end cannot vary.
    fn air(&mut self, surroundings: &Surroundings) -> Medium {
        let depth = self.random.random_range(0.2..0.8);
        let may_vary = !matches!(surroundings, Surroundings::Open { .. });
        self.medium(depth / OUTSIDE, may_vary)
    }

    fn camera(&mut self, surroundings: &Surroundings) -> Camera {
        let inside = match surroundings {
            Surroundings::Room(_) => true,
            Surroundings::Box { camera_inside, .. } => *camera_inside,
            Surroundings::Open { .. } => false,
        };
        let mut about = |range: f32| self.random.random_range(-range..range);
        let target = [about(0.2), -0.2 + about(0.2), -0.3];
        if inside {
            return Camera { origin: [about(0.6), about(0.6), 1.1], target, fov: 75.0 };
        }
        let (turn, height): (f32, f32) = (about(0.6), 1.6 + about(1.2));
        Camera { origin: [3.5 * turn.sin(), height, 3.5 * turn.cos()], target, fov: 38.0 }
    }

    fn object(&mut self, centre: Point, radius: f32, nesting: u32) -> Object {
        let hollow = nesting > 0 && self.random.random_bool(0.45);
        let shapes: &[Shape] = if hollow {
            &[Shape::Sphere, Shape::Cube, Shape::Octahedron]
        } else {
            &[
                Shape::Sphere,
                Shape::Cube,
                Shape::Octahedron,
                Shape::Rectangle,
                Shape::Disk,
                Shape::Cylinder,
            ]
        };
        let shape = *shapes.choose(&mut self.random).expect("not empty");
        let stretches = !hollow && shape.can_stretch();
        let mut object = Object {
            shape,
            centre,
            radius: radius * self.random.random_range(0.7..1.0),
            stretch: [(); 3]
                .map(|()| if stretches { self.random.random_range(0.4..1.0) } else { 1.0 }),
            axis: [(); 3].map(|()| self.random.random_range(-1.0..1.0)),
            degrees: self.random.random_range(0.0..180.0),
            bsdf: Bsdf::Null,
            radiance: None,
            inside: None,
            content: None,
            names_medium: self.random.random_bool(0.5),
        };
        if hollow {
            self.fill(&mut object, nesting);
        } else {
            object.bsdf = self.opaque(shape);
        }
        object
    }

    /// Glass, fog in nothing, and what is inside.
    fn fill(&mut self, object: &mut Object, nesting: u32) {
        object.bsdf = self.boundary();
        let inner = object.shape.inner_radius().expect("closed") * object.radius;
        if self.random.random_bool(0.75) {
            let depth = self.random.random_range(0.5..2.0);
            object.inside = Some(self.medium(depth / (2.0 * inner), true));
        }
        if self.random.random_bool(0.4) {
            let shift = [(); 3].map(|()| self.random.random_range(-0.15..0.15) * inner);
            let centre = [0, 1, 2].map(|i| object.centre[i] + shift[i]);
            let mut content = self.object(centre, 0.65 * inner, nesting - 1);
            if self.random.random_bool(0.2) && content.content.is_none() {
                self.ignite(&mut content);
            }
            object.content = Some(Box::new(content));
        }
    }

    /// What a closed boundary may be made of.
    fn boundary(&mut self) -> Bsdf {
        match self.random.random_range(0..if self.sharp { 8 } else { 6 }) {
            0..=3 => Bsdf::Null,
            4 => Bsdf::RoughDielectric { ior: self.ior(), alpha: self.roughness() },
            5 => Bsdf::Mask {
                opacity: self.random.random_range(0.1..0.9),
                nested: Box::new(Bsdf::TwoSided(Box::new(self.reflector(0)))),
            },
            6 => Bsdf::ThinDielectric { ior: self.ior() },
            _ => Bsdf::Dielectric { ior: self.ior() },
        }
    }

    /// What anything else may be made of: reflectors, and sheets that let light through without a
    /// change of medium.
    fn opaque(&mut self, shape: Shape) -> Bsdf {
        match self.random.random_range(0..10) {
            0 => Bsdf::Mask {
                opacity: self.random.random_range(0.1..0.9),
                nested: Box::new(self.reflector(1)),
            },
            1 => {
                let parts = [self.reflector(1), self.reflector(1)].map(Box::new);
                Bsdf::Blend { weight: self.random.random_range(0.1..0.9), parts }
            }
            2 if self.sharp => Bsdf::ThinDielectric { ior: self.ior() },
            3 if shape.inner_radius().is_none() => Bsdf::TwoSided(Box::new(self.reflector(1))),
            _ => self.reflector(1),
        }
    }

    /// A BSDF that may lie in `twosided`; `blends` times within blends.
    fn reflector(&mut self, blends: u32) -> Bsdf {
        match self.random.random_range(0..9) {
            0 | 1 => self.diffuse(),
            2 => Bsdf::Checkerboard(self.reflectance(), self.reflectance()),
            3 if self.sharp => Bsdf::Conductor(self.metal()),
            3 | 4 => Bsdf::RoughConductor { material: self.metal(), alpha: self.roughness() },
            5 if self.sharp => Bsdf::Plastic(self.reflectance()),
            5 | 6 => Bsdf::RoughPlastic { diffuse: self.reflectance(), alpha: self.roughness() },
            7 if blends > 0 => {
                let parts = [self.reflector(blends - 1), self.diffuse()].map(Box::new);
                Bsdf::Blend { weight: self.random.random_range(0.1..0.9), parts }
            }
            _ => self.principled(),
        }
    }

    fn principled(&mut self) -> Bsdf {
        let names = ["metallic", "specular", "spec_tint", "sheen", "sheen_tint", "flatness"];
        let mut numbers = vec![("roughness", self.random.random_range(0.55..1.0))];
        for name in names {
            if self.random.random_bool(0.4) {
                numbers.push((name, self.random.random_range(0.1..0.9)));
            }
        }
        Bsdf::Principled { colour: self.reflectance(), numbers }
    }

    fn diffuse(&mut self) -> Bsdf {
        Bsdf::Diffuse(self.reflectance())
    }

    fn reflectance(&mut self) -> Colour {
        self.colour(0.1, 0.65)
    }

    fn metal(&mut self) -> &'static str {
        ["Au", "Cu", "Al"].choose(&mut self.random).expect("not empty")
    }

    fn roughness(&mut self) -> f32 {
        self.random.random_range(0.3..0.6)
    }

    fn ior(&mut self) -> f32 {
        self.random.random_range(1.1..1.6)
    }

    /// Grey one time in three.
    fn colour(&mut self, low: f32, high: f32) -> Colour {
        let grey = self.random.random_range(low..high);
        if self.random.random_bool(0.33) {
            return [grey; 3];
        }
        [(); 3].map(|()| self.random.random_range(low..high))
    }

    fn medium(&mut self, extinction: f32, may_vary: bool) -> Medium {
        let tint = if self.random.random_bool(0.6) { [1.0; 3] } else { self.colour(0.4, 1.0) };
        let tinted = tint.map(|tint| tint * extinction);
        let extinction = if may_vary && self.random.random_bool(0.4) {
            let mut voxel = || self.random.random_range(0.0..2.0f32);
            let densities: Vec<f32> = (0..GRID.pow(3)).map(|_| voxel()).collect();
            Extinction::Grid(densities.iter().map(|d| tinted.map(|t| t * d)).collect())
        } else {
            Extinction::Constant(tinted)
        };
        Medium { extinction, albedo: self.colour(0.3, 0.98), phase: self.phase(1) }
    }

    fn phase(&mut self, blends: u32) -> Phase {
        match self.random.random_range(0..6) {
            0 | 1 => Phase::Isotropic,
            2 => Phase::HenyeyGreenstein(self.random.random_range(-0.9..0.9)),
            3 => Phase::Rayleigh,
            4 if blends > 0 => {
                let parts = [self.phase(0), self.phase(0)].map(Box::new);
                Phase::Blend { weight: self.random.random_range(0.1..0.9), parts }
            }
            _ => {
                let steps = self.random.random_range(2..=5);
                Phase::Tabulated(
                    (0..steps).map(|_| self.random.random_range(0.1..2.0f32)).collect(),
                )
            }
        }
    }

    /// One to three lamps.
    fn light(&mut self, scene: &mut Scene) {
        let endless =
            matches!(scene.surroundings, Surroundings::Open { .. }) && scene.air.is_some();
        let sky = !endless && !matches!(scene.surroundings, Surroundings::Room(_));
        let inside = !matches!(scene.surroundings, Surroundings::Open { .. });
        if sky && self.random.random_bool(0.6) {
            let lamp = self.environment();
            scene.lamps.push(lamp);
        }
        if !self.sharp && self.random.random_bool(0.7) {
            let lamp = self.delta_lamp(sky, inside);
            scene.lamps.push(lamp);
        }
        if !scene.has_light() || self.random.random_bool(0.3) {
            let lamp = self.area_lamp();
            scene.objects.push(lamp);
        }
    }

    fn environment(&mut self) -> Lamp {
        if self.random.random_bool(0.6) {
            return Lamp::Constant(self.colour(0.2, 1.0));
        }
        Lamp::Envmap((0..SKY[0] * SKY[1]).map(|_| self.colour(0.1, 1.5)).collect())
    }

    fn delta_lamp(&mut self, sky: bool, inside: bool) -> Lamp {
        let height = if inside { 1.0 } else { 1.5 };
        let mut about = |range: f32| self.random.random_range(-range..range);
        let position = [about(0.5), height, about(0.5)];
        let direction = [about(0.6), -1.0, about(0.6)];
        let target = [about(0.5), -0.5, about(0.5)];
        match self.random.random_range(0..if sky { 3 } else { 2 }) {
            0 => Lamp::Point { position, intensity: self.colour(0.5, 3.0) },
            1 => Lamp::Spot {
                position,
                target,
                intensity: self.colour(3.0, 10.0),
                cutoff: self.random.random_range(25.0..50.0),
            },
            _ => Lamp::Directional { direction, irradiance: self.colour(0.5, 2.0) },
        }
    }

    /// Under the ceiling, facing down: a shape's own front is where its z axis points.
    fn area_lamp(&mut self) -> Object {
        let shape = *[Shape::Rectangle, Shape::Disk].choose(&mut self.random).expect("not empty");
        Object {
            shape,
            centre: [0.0, 1.1, 0.0],
            radius: self.random.random_range(0.5..0.9),
            stretch: [1.0; 3],
            axis: [1.0, 0.0, 0.0],
            degrees: 90.0,
            bsdf: Bsdf::Diffuse([0.2; 3]),
            radiance: Some(self.colour(2.0, 6.0)),
            inside: None,
            content: None,
            names_medium: self.random.random_bool(0.5),
        }
    }

    fn ignite(&mut self, object: &mut Object) {
        object.bsdf = Bsdf::Diffuse([0.2; 3]);
        object.radiance = Some(self.colour(2.0, 6.0));
    }
}

/// Whether a medium goes on for ever.
fn is_endless(scene: &Scene) -> bool {
    matches!(scene.surroundings, Surroundings::Open { .. }) && scene.air.is_some()
}

/// All BSDFs of the scene.
fn all_bsdfs(scene: &Scene) -> Vec<&Bsdf> {
    let mut open: Vec<&Bsdf> = match &scene.surroundings {
        Surroundings::Room(bsdf) | Surroundings::Box { boundary: bsdf, .. } => vec![bsdf],
        Surroundings::Open { floor } => floor.iter().collect(),
    };
    for object in &scene.objects {
        let mut object = Some(object);
        while let Some(inner) = object {
            open.push(&inner.bsdf);
            object = inner.content.as_deref();
        }
    }
    let mut found = Vec::new();
    while let Some(bsdf) = open.pop() {
        found.push(bsdf);
        open.extend(bsdf.parts());
    }
    found
}

/// The rules of what is left out, and that neither side of the first is empty: of 500 scenes about half are
/// sharp, and some hundred have a lamp that no ray meets.
#[test]
fn scenes_keep_the_rules() {
    let (mut sharp, mut delta) = (0, 0);
    for scene in (0..500).map(generate) {
        let is_sharp = all_bsdfs(&scene).into_iter().any(Bsdf::has_delta);
        let is_delta = scene.lamps.iter().any(Lamp::is_delta);
        assert!(!(is_sharp && is_delta), "{scene:#?}");
        assert!(scene.has_light(), "{scene:#?}");
        let grey = scene.media().iter().all(|medium| medium.extinction.is_grey());
        assert!(grey || scene.max_depth.is_some(), "{scene:#?}");
        sharp += usize::from(is_sharp);
        delta += usize::from(is_delta);
    }
    assert!(sharp > 100 && delta > 100, "{sharp} sharp, {delta} delta");
}

/// Whoever repeats a seed gets the scene again.
#[test]
fn a_scene_is_a_function_of_its_seed() {
    assert_eq!(generate(7), generate(7));
    assert_ne!(generate(7), generate(8));
}
