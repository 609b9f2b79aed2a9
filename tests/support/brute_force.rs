//! The estimator without trees: every photon against every view beam and every visible point.
//!
//! Written apart from the engine, from the paper and the design alone, and slow on purpose. It draws
//! the same numbers in the same order, so that both see the same photons and the same view rays: where
//! they disagree by more than rounding, one of them is wrong.

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use std::f64::consts::PI;
use vpt::analytic::FILM_CHANNELS;
use vpt::density::radius::{KernelDimensions, Radii, RadiusSequence};
use vpt::film::FilmSums;
use vpt::math::uniform::{self, Purpose};
use vpt::method::Parameters;
use vpt::scene::{
    photon_event, view_flags, Extinction, MediumPoints, Phase, PhasePairs, PhotonVertices, Planes,
    PointSegments, Scene, SurfacePairs, ViewRayRequest, ViewVertices, EMIT_DIMENSIONS,
    PHOTON_STEP_DIMENSIONS, VACUUM, VIEW_RAY_DIMENSIONS, VIEW_STEP_DIMENSIONS,
};

/// Segments after which a view ray between mirrors is given up.
const MAX_SEGMENTS: usize = 64;
/// Steps of the midpoint rule per length over which an extinction changes.
const STEPS_PER_FEATURE: f64 = 4.0;

/// A view segment that crosses fog.
struct Beam {
    pixel: usize,
    origin: DVec3,
    direction: DVec3,
    length: f64,
    medium: u32,
    /// Weight of radiance at its origin on the pixel.
    weight: [f64; 3],
    /// Scattering events between the eye and the beam.
    depth: u32,
}

struct Point {
    pixel: usize,
    position: DVec3,
    /// On the side from which the view ray comes.
    normal: DVec3,
    reflectance: Option<[f64; 3]>,
    /// Weight of radiance at the point on the pixel: specular lobes and all transmittances.
    weight: [f64; 3],
    depth: u32,
}

/// All receivers behind one jitter of the view rays.
struct View {
    film: Vec<f32>,
    /// Light that is seen directly, per ray.
    emission: Vec<[f64; 3]>,
    alpha: Vec<f32>,
    beams: Vec<Beam>,
    points: Vec<Point>,
}

/// Renders as `vpt::method::render` does, in a time that nobody would wait for on a real scene.
pub fn render(scene: &dyn Scene, parameters: &Parameters) -> FilmSums {
    let description = scene.description();
    let mut film = FilmSums::new(description);
    let initial = Radii { surface: parameters.surface_radius, medium: parameters.medium_radius };
    let mut radii = RadiusSequence::new(
        initial,
        parameters.alpha,
        parameters.radius_schedule,
        KernelDimensions::POINTS,
    );
    let passes: Vec<u32> = (0..parameters.passes).collect();
    for (jitter, block) in passes.chunks(parameters.jitter_every as usize).enumerate() {
        let view = View::trace(scene, parameters, jitter as u64);
        let mut radiance = vec![[0.0; 3]; view.emission.len()];
        for &pass in block {
            add_all(&mut radiance, &scatter(scene, parameters, &view, pass, radii.current()));
            radii.advance();
        }
        view.splat(scene, &radiance, block.len(), &mut film);
    }
    film
}

/// A view ray on its way.
#[derive(Clone, Copy)]
struct Path {
    /// Weight of radiance at its end on the pixel.
    weight: [f64; 3],
    /// Share of the pixel that nothing has covered.
    clear: f64,
    depth: u32,
}

impl View {
    fn trace(scene: &dyn Scene, parameters: &Parameters, jitter: u64) -> View {
        let [width, height] = scene.description().film_size.map(|n| n as usize);
        let lanes = width * height;
        assert!(lanes <= scene.batching().lanes, "the engine draws numbers batch by batch");
        let mut rng = uniform::stream(parameters.seed, Purpose::ViewRays, jitter, 0);
        let mut numbers = Vec::new();
        uniform::fill(&mut rng, &mut numbers, 2 * lanes);
        let film = film_positions(scene, &numbers);
        uniform::fill(&mut rng, &mut numbers, VIEW_RAY_DIMENSIONS * lanes);
        let limits = parameters.limits;
        let request =
            ViewRayRequest { lanes, film: &film, numbers: &numbers, rules: limits.into() };
        let mut importance = Planes::default();
        let mut walk = scene.view_rays(&request, &mut importance).expect("view rays start");
        let start = |lane| Path { weight: array(importance.get(lane)), clear: 1.0, depth: 0 };
        let mut paths: Vec<Path> = (0..lanes).map(start).collect();

        let (mut emission, mut segments) = (vec![[0.0; 3]; lanes], Segments::default());
        let (mut beams, mut points) = (Vec::new(), Vec::new());
        let mut vertices = ViewVertices::default();
        for _ in 0..MAX_SEGMENTS {
            uniform::fill(&mut rng, &mut numbers, VIEW_STEP_DIMENSIONS * walk.lanes());
            walk.step(1, &numbers, &mut vertices).expect("view rays advance");
            for (lane, &ray) in vertices.ray.iter().enumerate() {
                let path = &mut paths[ray as usize];
                let hides = limits.hide_emitters && path.depth == 0;
                segments.add_point(&vertices, lane, hides);
                beams.extend(path.cross(scene, &vertices, lane));
                path.cover(scene, vertices.flags[lane], limits.hide_emitters);
                add(&mut emission[ray as usize], path.emission(&vertices, lane));
                points.extend(path.point(&vertices, lane));
                path.leave(&vertices, lane);
            }
            if walk.lanes() == 0 {
                break;
            }
        }
        scene.store_points(&segments.into_points()).expect("points are stored");
        let alpha = paths.iter().map(|path| (1.0 - path.clear) as f32).collect();
        View { film, emission, alpha, beams, points }
    }

    /// Hands the mean radiance of a block of passes to the film, weighted by their number.
    fn splat(&self, scene: &dyn Scene, radiance: &[[f64; 3]], passes: usize, film: &mut FilmSums) {
        let [width, height] = scene.description().film_size.map(|n| n as usize);
        let lanes = radiance.len();
        for (lane, radiance) in radiance.iter().enumerate() {
            let value = |c| self.emission[lane][c] + radiance[c] / passes as f64;
            let value = DVec3::new(value(0), value(1), value(2)).as_vec3().to_array();
            let [x, y] = [self.film[lane], self.film[lanes + lane]].map(|p| p.floor() as usize);
            // Rounding may put a sample on the far edge.
            if x >= width || y >= height {
                continue;
            }
            let pixel = y * width + x;
            let sums = &mut film.values[FILM_CHANNELS * pixel..][..FILM_CHANNELS];
            for (sum, value) in
                sums.iter_mut().zip(value.into_iter().chain([self.alpha[lane], 1.0]))
            {
                *sum += passes as f64 * f64::from(value);
            }
        }
    }
}

/// One position in every pixel, x's then y's, from pairs of numbers.
fn film_positions(scene: &dyn Scene, numbers: &[f32]) -> Vec<f32> {
    let [width, height] = scene.description().film_size.map(|n| n as usize);
    let [left, top] = scene.description().film_offset.map(|n| n as f32);
    let pixels = 0..width * height;
    let xs = pixels.clone().map(|i| left + (i % width) as f32 + numbers[2 * i]);
    let ys = pixels.map(|i| top + (i / width) as f32 + numbers[2 * i + 1]);
    xs.chain(ys).collect()
}

impl Path {
    /// Crosses a segment, which is a beam where there is fog.
    fn cross(&mut self, scene: &dyn Scene, vertices: &ViewVertices, lane: usize) -> Option<Beam> {
        let beam = Beam {
            pixel: vertices.ray[lane] as usize,
            origin: vertices.origin.get(lane).as_dvec3(),
            direction: vertices.direction.get(lane).as_dvec3(),
            length: f64::from(vertices.length[lane]),
            medium: vertices.medium[lane],
            weight: self.weight,
            depth: self.depth,
        };
        let transmittance = beam.transmittance(scene, beam.length);
        self.weight = product(self.weight, transmittance);
        self.clear *= transmittance.iter().sum::<f64>() / 3.0;
        (beam.medium != VACUUM && beam.length > 0.0).then_some(beam)
    }

    /// A surface covers the pixel unless it is but crossed; so does a sky that is not hidden.
    fn cover(&mut self, scene: &dyn Scene, flags: u32, hide_emitters: bool) {
        let crossed = flags & view_flags::CONTINUES != 0 && flags & view_flags::SCATTERED == 0;
        let covered = match flags & view_flags::HIT != 0 {
            true => !crossed,
            false => scene.description().has_environment() && !hide_emitters,
        };
        if covered {
            self.clear = 0.0;
        }
    }

    fn emission(&self, vertices: &ViewVertices, lane: usize) -> [f64; 3] {
        match vertices.flags[lane] & view_flags::EMISSION != 0 {
            true => product(self.weight, array(vertices.emission.get(lane))),
            false => [0.0; 3],
        }
    }

    fn point(&self, vertices: &ViewVertices, lane: usize) -> Option<Point> {
        let has = |flag| vertices.flags[lane] & flag != 0;
        let reflectance = array(vertices.reflectance.get(lane));
        has(view_flags::VISIBLE_POINT).then(|| Point {
            pixel: vertices.ray[lane] as usize,
            position: vertices.position.get(lane).as_dvec3(),
            normal: vertices.normal.get(lane).as_dvec3(),
            reflectance: has(view_flags::LAMBERTIAN).then_some(reflectance),
            weight: self.weight,
            depth: self.depth,
        })
    }

    /// Goes on along a delta lobe, if there is one.
    fn leave(&mut self, vertices: &ViewVertices, lane: usize) {
        self.weight = product(self.weight, array(vertices.weight.get(lane)));
        self.depth += u32::from(vertices.flags[lane] & view_flags::SCATTERED != 0);
    }
}

impl Beam {
    /// Transmittance of its first part.
    fn transmittance(&self, scene: &dyn Scene, distance: f64) -> [f64; 3] {
        if self.medium == VACUUM || distance == 0.0 {
            return [1.0; 3];
        }
        let depth = match scene.description().media[self.medium as usize].extinction {
            Extinction::Constant(sigma_t) => array(sigma_t.into()).map(|s| s * distance),
            Extinction::Varying { feature_size } => {
                self.optical_depth(scene, distance, f64::from(feature_size))
            }
        };
        // A channel without extinction stays clear over any distance.
        depth.map(|tau| if tau.is_nan() { 1.0 } else { (-tau).exp() })
    }

    fn optical_depth(&self, scene: &dyn Scene, distance: f64, feature: f64) -> [f64; 3] {
        let steps = (STEPS_PER_FEATURE * distance / feature).ceil() as usize;
        let width = distance / steps as f64;
        let midpoints = (0..steps).map(|i| self.origin + (i as f64 + 0.5) * width * self.direction);
        let points = MediumPoints {
            medium: vec![self.medium; steps],
            position: Planes::push_all(midpoints.map(|p| p.as_vec3())),
            direction: Planes::push_all((0..steps).map(|_| self.direction.as_vec3())),
        };
        let mut sigma_t = Planes::default();
        scene.extinction(&points, &mut sigma_t).expect("extinction is known");
        let mut sum = [0.0; 3];
        for step in 0..steps {
            add(&mut sum, array(sigma_t.get(step)).map(|s| s * width));
        }
        sum
    }
}

/// Segments that end in visible points, in the order of the points.
#[derive(Default)]
struct Segments {
    origins: Vec<Vec3>,
    directions: Vec<Vec3>,
    skips_emitters: Vec<u32>,
}

impl Segments {
    fn add_point(&mut self, vertices: &ViewVertices, lane: usize, skips_emitters: bool) {
        if vertices.flags[lane] & view_flags::VISIBLE_POINT != 0 {
            self.origins.push(vertices.origin.get(lane));
            self.directions.push(vertices.direction.get(lane));
            self.skips_emitters.push(skips_emitters.into());
        }
    }

    fn into_points(self) -> PointSegments {
        PointSegments {
            glossy_chains: false,
            origin: Planes::push_all(self.origins.into_iter()),
            direction: Planes::push_all(self.directions.into_iter()),
            skips_emitters: self.skips_emitters,
        }
    }
}

/// Radiance per view ray that one pass of photons scatters toward the eye.
fn scatter(
    scene: &dyn Scene,
    parameters: &Parameters,
    view: &View,
    pass: u32,
    radii: Radii,
) -> Vec<[f64; 3]> {
    let batch_lanes = scene.batching().lanes as u64;
    let batches = parameters.photons.div_ceil(batch_lanes);
    let rays = view.emission.len();
    let sums = (0..batches).into_par_iter().map(|batch| {
        let lanes = (parameters.photons - batch * batch_lanes).min(batch_lanes) as usize;
        let mut rng = uniform::stream(parameters.seed, Purpose::Photons, pass.into(), batch);
        let mut numbers = Vec::new();
        uniform::fill(&mut rng, &mut numbers, EMIT_DIMENSIONS * lanes);
        let mut walk = scene.emit(lanes, &numbers, parameters.limits.into()).expect("walks start");
        let mut vertices = PhotonVertices::default();
        let mut radiance = vec![[0.0; 3]; rays];
        while walk.lanes() > 0 {
            uniform::fill(&mut rng, &mut numbers, PHOTON_STEP_DIMENSIONS * walk.lanes());
            walk.step(1, &numbers, &mut vertices).expect("walks advance");
            for lane in 0..vertices.event.len() {
                let photon = Photon::from_lane(&vertices, lane);
                let max_depth = parameters.limits.max_depth;
                match photon_event::kind(vertices.event[lane]) {
                    photon_event::MEDIUM => photon.light_beams(
                        scene,
                        view,
                        f64::from(radii.medium),
                        max_depth,
                        &mut radiance,
                    ),
                    photon_event::SURFACE => photon.light_points(
                        scene,
                        view,
                        f64::from(radii.surface),
                        max_depth,
                        &mut radiance,
                    ),
                    _ => {}
                }
            }
        }
        radiance
    });
    let mut total = vec![[0.0; 3]; rays];
    for radiance in sums.collect::<Vec<_>>() {
        add_all(&mut total, &radiance);
    }
    // [Collin 2013 (2) (3)]: 1/N, with N the walks emitted.
    let emitted = parameters.photons as f64;
    total.into_iter().map(|sum| sum.map(|x| x / emitted)).collect()
}

/// A photon where it is seen.
struct Photon {
    position: DVec3,
    direction: DVec3,
    /// Normal on the side from which it came, where it met a surface.
    normal: DVec3,
    medium: u32,
    depth: u32,
    flux: [f64; 3],
}

impl Photon {
    fn from_lane(vertices: &PhotonVertices, lane: usize) -> Self {
        let direction = vertices.direction.get(lane).as_dvec3();
        let normal = vertices.geometric_normal.get(lane).as_dvec3();
        Photon {
            position: vertices.position.get(lane).as_dvec3(),
            direction,
            normal: if normal.dot(direction) < 0.0 { normal } else { -normal },
            medium: vertices.medium[lane],
            depth: vertices.depth[lane],
            flux: array(vertices.flux.get(lane)),
        }
    }

    // [Collin 2013 (4)], with the albedo, which the flux holds, in the place of sigma_s.
    fn light_beams(
        &self,
        scene: &dyn Scene,
        view: &View,
        radius: f64,
        max_depth: u32,
        radiance: &mut [[f64; 3]],
    ) {
        for beam in &view.beams {
            let offset = self.position - beam.origin;
            let along = offset.dot(beam.direction);
            let miss = offset - along * beam.direction;
            let passes = beam.medium == self.medium
                && (0.0..beam.length).contains(&along)
                && miss.length_squared() < radius * radius
                && self.depth + beam.depth + 1 < max_depth;
            if passes {
                let kernel = 1.0 / (PI * radius * radius);
                let phase = self.phase(scene, beam.direction);
                let arriving = product(beam.transmittance(scene, along), self.flux);
                let scattered = product(arriving, phase).map(|x| kernel * x);
                add(&mut radiance[beam.pixel], product(beam.weight, scattered));
            }
        }
    }

    fn phase(&self, scene: &dyn Scene, view_direction: DVec3) -> [f64; 3] {
        let g = match scene.description().media[self.medium as usize].phase {
            Phase::Isotropic => 0.0,
            Phase::HenyeyGreenstein { g } => f64::from(g),
            Phase::Opaque => return self.asked_phase(scene, view_direction),
        };
        // Light leaves against the view ray.
        let cosine = -self.direction.dot(view_direction);
        [(1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cosine).powf(1.5)); 3]
    }

    fn asked_phase(&self, scene: &dyn Scene, view_direction: DVec3) -> [f64; 3] {
        let pairs = PhasePairs {
            medium: vec![self.medium],
            position: one(self.position),
            photon_direction: one(self.direction),
            view_direction: one(view_direction),
        };
        let mut value = Planes::default();
        scene.eval_phase(&pairs, &mut value).expect("the phase function is known");
        array(value.get(0))
    }

    // [Collin 2013 (5)], without the cosine, which the density of photons already holds.
    fn light_points(
        &self,
        scene: &dyn Scene,
        view: &View,
        radius: f64,
        max_depth: u32,
        radiance: &mut [[f64; 3]],
    ) {
        for (index, point) in view.points.iter().enumerate() {
            let reaches = (self.position - point.position).length_squared() < radius * radius
                && self.normal.dot(point.normal) > 0.0
                // A BSDF is zero below the horizon of its own point.
                && self.direction.dot(point.normal) < 0.0
                && self.depth + point.depth + 1 < max_depth;
            if reaches {
                let reflectance = point.reflectance.map(|rho| rho.map(|x| x / PI));
                let bsdf = reflectance.unwrap_or_else(|| self.asked_bsdf(scene, index));
                let area = PI * radius * radius;
                let reflected = product(bsdf, self.flux).map(|x| x / area);
                add(&mut radiance[point.pixel], product(point.weight, reflected));
            }
        }
    }

    fn asked_bsdf(&self, scene: &dyn Scene, point: usize) -> [f64; 3] {
        let pairs = SurfacePairs {
            point: vec![point as u32],
            photon_direction: one(self.direction),
            lamp_density: vec![0.0],
        };
        let mut value = Planes::default();
        scene.eval_bsdf(&pairs, &mut value).expect("the BSDF is known");
        array(value.get(0))
    }
}

fn one(v: DVec3) -> Planes {
    Planes::push_all(std::iter::once(v.as_vec3()))
}

fn array(v: Vec3) -> [f64; 3] {
    v.as_dvec3().to_array()
}

fn product(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|c| a[c] * b[c])
}

fn add(sum: &mut [f64; 3], term: [f64; 3]) {
    for c in 0..3 {
        sum[c] += term[c];
    }
}

fn add_all(sums: &mut [[f64; 3]], terms: &[[f64; 3]]) {
    for (sum, term) in sums.iter_mut().zip(terms) {
        add(sum, *term);
    }
}
