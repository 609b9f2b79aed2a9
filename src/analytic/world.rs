use super::camera::Camera;
use super::emission::{BoundingSphere, Emitter, Lamp};
use super::film::{self, FILM_CHANNELS};
use super::fog::{Fog, Profile};
use super::lamp_light;
use super::phase;
use super::photon_walk::Photons;
use super::ray::{Hit, Ray};
use super::surface::{Material, Surface};
use super::view_walk::ViewRays;
use crate::math::{Aabb, Rgb};
use crate::scene::{
    Batching, Extinction, FilmSamples, LampLight, Medium, MediumPoints, PathRules, Phase,
    PhasePairs, PhotonWalk, Places, Planes, PointSegments, Scene, SceneDescription, SceneResult,
    SensorFacts, SurfacePairs, ViewRayRequest, ViewWalk, VACUUM,
};
use glam::DVec3;
use std::f64::consts::PI;
use std::ops::Add;
use std::sync::RwLock;

/// How much the world tells the engine in advance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Disclosure {
    /// Constant extinctions, phase functions and Lambertian reflectances are described.
    #[default]
    Full,
    /// Nothing is: the engine must ask for every value, as in scenes that it does not understand.
    OnRequest,
}

/// What a [`World`] is made of. The camera and the lamps say which fog they stand in.
#[derive(Debug, Clone)]
pub struct Contents {
    pub camera: Camera,
    pub surfaces: Vec<Surface>,
    pub fogs: Vec<Fog>,
    pub lamps: Vec<Lamp>,
    pub disclosure: Disclosure,
}

/// A visible point that [`Scene::eval_bsdf`] will be asked about.
#[derive(Debug, Clone, Copy)]
struct StoredPoint {
    normal: DVec3,
    reflectance: Rgb,
}

/// A closed-form scene.
#[derive(Debug)]
pub struct World {
    pub(super) contents: Contents,
    pub(super) emitters: Vec<Emitter>,
    pub(super) bounding_sphere: BoundingSphere,
    description: SceneDescription,
    points: RwLock<Vec<StoredPoint>>,
}

impl World {
    pub fn new(contents: Contents) -> Self {
        let lit = contents.surfaces.iter().filter(|surface| !surface.emission.is_zero());
        let lamps = contents.lamps.iter().copied().map(Emitter::Lamp);
        let emitters: Vec<_> = lamps.chain(lit.copied().map(Emitter::Surface)).collect();
        let description = describe(&contents, &emitters);
        let bounding_sphere = enclose(&contents.surfaces, &description.bounds);
        let points = RwLock::default();
        World { contents, emitters, bounding_sphere, description, points }
    }

    pub fn contents(&self) -> &Contents {
        &self.contents
    }

    /// The first surface on a ray.
    pub(super) fn intersect(&self, ray: &Ray) -> Option<Hit> {
        self.intersect_where(ray, |_| true)
    }

    /// The first surface on a ray that does not emit.
    pub(super) fn intersect_dark(&self, ray: &Ray) -> Option<Hit> {
        self.intersect_where(ray, |surface| surface.emission.is_zero())
    }

    fn intersect_where(&self, ray: &Ray, keep: impl Fn(&Surface) -> bool) -> Option<Hit> {
        let surfaces = self.contents.surfaces.iter().enumerate();
        let crossings =
            surfaces.filter(|(_, surface)| keep(surface)).filter_map(|(index, surface)| {
                surface.shape.intersect(ray).map(|distance| (index, distance))
            });
        let (surface, distance) = crossings.min_by(|a, b| a.1.total_cmp(&b.1))?;
        let front_normal = self.contents.surfaces[surface].shape.front_normal(ray.at(distance));
        Some(Hit { surface, distance, position: ray.at(distance), front_normal })
    }

    pub(super) fn surface(&self, hit: &Hit) -> &Surface {
        &self.contents.surfaces[hit.surface]
    }

    pub(super) fn fog(&self, medium: u32) -> Option<&Fog> {
        (medium != VACUUM).then(|| &self.contents.fogs[medium as usize])
    }

    /// Radiance [W/(m² sr)] that arrives against a ray from where it ends.
    pub(super) fn emission(&self, ray: &Ray, hit: Option<&Hit>) -> Rgb {
        match hit {
            None => self.contents.lamps.iter().map(Lamp::sky_radiance).fold(Rgb::ZERO, Add::add),
            Some(hit) if hit.is_front(ray.direction) => self.surface(hit).emission,
            Some(_) => Rgb::ZERO,
        }
    }

    /// Coefficients [1/length] at points, by their value where the density is 1.
    fn coefficients(
        &self,
        points: &MediumPoints,
        coefficient: impl Fn(&Fog) -> Rgb,
        out: &mut Planes,
    ) {
        out.resize(points.medium.len());
        for (lane, &medium) in points.medium.iter().enumerate() {
            let position = points.position.get(lane).as_dvec3();
            let value = self.fog(medium).map(|fog| coefficient(fog) * fog.density(position) as f32);
            out.set_rgb(lane, value.unwrap_or(Rgb::ZERO));
        }
    }

    /// The visible point at the end of a view segment: the first matt surface, for the segment may start on another one, to
    /// single precision.
    fn point_at(&self, ray: &Ray, skips_emitters: bool) -> StoredPoint {
        let hit = self.intersect_where(ray, |surface| {
            let is_seen = !skips_emitters || surface.emission.is_zero();
            is_seen && matches!(surface.material, Material::Lambertian { .. })
        });
        let nothing = StoredPoint { normal: DVec3::ZERO, reflectance: Rgb::ZERO };
        hit.map_or(nothing, |hit| {
            let reflectance = match self.surface(&hit).material {
                Material::Lambertian { reflectance } => reflectance,
                Material::Null | Material::Dielectric { .. } => Rgb::ZERO,
            };
            StoredPoint { normal: hit.normal_against(ray.direction), reflectance }
        })
    }
}

fn describe(contents: &Contents, emitters: &[Emitter]) -> SceneDescription {
    let mut bounds = Aabb::EMPTY;
    for surface in &contents.surfaces {
        let part = surface.shape.bounds();
        bounds.grow(part.min);
        bounds.grow(part.max);
    }
    let film_size = contents.camera.film_size;
    let media = contents.fogs.iter().enumerate();
    SceneDescription {
        film_size,
        film_offset: [0, 0],
        film_channels: FILM_CHANNELS as u32,
        film_pixels: film_size[0] * film_size[1],
        film_width: film_size[0],
        media: media.map(|(index, fog)| disclose(index, fog, contents.disclosure)).collect(),
        bounds,
        surfaces: contents.surfaces.iter().enumerate().map(|(i, s)| s.facts(i)).collect(),
        emitters: emitters.iter().enumerate().map(|(i, e)| e.facts(i)).collect(),
        sensor: SensorFacts { name: "camera".to_owned(), has_aperture: false },
        warnings: Vec::new(),
    }
}

fn disclose(index: usize, fog: &Fog, disclosure: Disclosure) -> Medium {
    let extinction = match (fog.profile, disclosure) {
        (Profile::Uniform, Disclosure::Full) => Extinction::Constant(fog.sigma_t),
        (Profile::Uniform, Disclosure::OnRequest) => Extinction::Varying { feature_size: 1.0 },
        // Over a sixteenth of its height an exponential is a straight line within 0.05 %.
        (Profile::Exponential { scale_height }, _) => {
            Extinction::Varying { feature_size: scale_height as f32 / 16.0 }
        }
    };
    let phase = match disclosure {
        Disclosure::Full => fog.phase,
        Disclosure::OnRequest => Phase::Opaque,
    };
    let discloses = disclosure == Disclosure::Full;
    let uniform = fog.profile == Profile::Uniform;
    Medium {
        name: format!("fog {index}"),
        extinction,
        grey: discloses && fog.sigma_t == Rgb::splat(fog.sigma_t.r),
        scattering: (discloses && uniform).then_some(fog.sigma_t * fog.albedo),
        phase,
        bounds: fog.bounds,
    }
}

fn enclose(surfaces: &[Surface], bounds: &Aabb) -> BoundingSphere {
    if bounds.is_empty() {
        return BoundingSphere { center: DVec3::ZERO, radius: 0.0 };
    }
    let center = 0.5 * (bounds.min + bounds.max).as_dvec3();
    let radius = surfaces.iter().map(|surface| surface.shape.reach(center)).fold(0.0, f64::max);
    BoundingSphere { center, radius }
}

impl Scene for World {
    fn description(&self) -> &SceneDescription {
        &self.description
    }

    fn batching(&self) -> Batching {
        Batching { lanes: 1024, concurrent: true }
    }

    fn view_rays<'a>(
        &'a self,
        request: &ViewRayRequest,
        importance: &mut Planes,
    ) -> SceneResult<Box<dyn ViewWalk + 'a>> {
        importance.resize(request.lanes);
        importance.as_mut_slice().fill(1.0);
        Ok(Box::new(ViewRays::start(self, request)))
    }

    fn emit<'a>(
        &'a self,
        lanes: usize,
        numbers: &[f32],
        rules: PathRules,
    ) -> SceneResult<Box<dyn PhotonWalk + 'a>> {
        Ok(Box::new(Photons::emit(self, lanes, numbers, rules.limits)))
    }

    fn extinction(&self, points: &MediumPoints, out: &mut Planes) -> SceneResult<()> {
        self.coefficients(points, |fog| fog.sigma_t, out);
        Ok(())
    }

    fn scattering(&self, points: &MediumPoints, out: &mut Planes) -> SceneResult<()> {
        self.coefficients(points, |fog| fog.sigma_t * fog.albedo, out);
        Ok(())
    }

    fn eval_phase(&self, pairs: &PhasePairs, out: &mut Planes) -> SceneResult<()> {
        out.resize(pairs.medium.len());
        for (lane, &medium) in pairs.medium.iter().enumerate() {
            // Of unit length in f64: narrow lobes see the rounding of an f32.
            let travel = pairs.photon_direction.get(lane).as_dvec3().normalize();
            let cosine = -travel.dot(pairs.view_direction.get(lane).as_dvec3().normalize());
            let value = self.fog(medium).map_or(0.0, |fog| phase::eval(fog.phase, cosine));
            out.set_rgb(lane, Rgb::splat(value as f32));
        }
        Ok(())
    }

    fn store_points(&self, points: &PointSegments) -> SceneResult<()> {
        let stored = (0..points.origin.lanes()).map(|lane| {
            let origin = points.origin.get(lane).as_dvec3();
            let direction = points.direction.get(lane).as_dvec3();
            self.point_at(
                &Ray { origin, direction, medium: VACUUM },
                points.skips_emitters[lane] != 0,
            )
        });
        *self.points.write().expect("no writer panics") = stored.collect();
        Ok(())
    }

    fn eval_bsdf(&self, pairs: &SurfacePairs, out: &mut Planes) -> SceneResult<()> {
        let points = self.points.read().expect("no writer panics");
        out.resize(pairs.point.len());
        for (lane, &index) in pairs.point.iter().enumerate() {
            let point = points[index as usize];
            let travel = pairs.photon_direction.get(lane).as_dvec3();
            let same_side = travel.dot(point.normal) < 0.0;
            let value = if same_side { point.reflectance * (1.0 / PI) as f32 } else { Rgb::ZERO };
            out.set_rgb(lane, value);
        }
        Ok(())
    }

    fn lamp_light(&self, places: &Places, numbers: &[f32], out: &mut LampLight) -> SceneResult<()> {
        lamp_light::lamp_light(self, places, numbers, out);
        Ok(())
    }

    fn splat(&self, samples: &FilmSamples, storage: &mut [f64]) -> SceneResult<()> {
        film::splat(samples, self.description.film_size, storage);
        Ok(())
    }
}
