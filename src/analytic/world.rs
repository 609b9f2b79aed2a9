use super::camera::Camera;
use super::emission::{BoundingSphere, Emitter, Lamp};
use super::fog::{Fog, Profile};
use super::ray::{Hit, Ray};
use super::surface::{Material, Surface};
use crate::math::{Aabb, Rgb};
use crate::scene::{
    Batching, Extinction, FilmFilter, Medium, MediumPoints, Phase, Planes, SceneDescription,
    SensorFacts, RGB_ALPHA_WEIGHT, VACUUM,
};
use glam::DVec3;
use std::ops::Add;
use std::sync::RwLock;

/// Values that a world's film has for each pixel.
pub const FILM_CHANNELS: usize = RGB_ALPHA_WEIGHT as usize;

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

/// What a world is made of at the three wavelengths that a number in [0,1) chooses, and the red, green and blue on the film of
/// a unit of each.
pub type Spectrum = fn(f32) -> (Contents, [Rgb; 3]);

/// A visible point that [`Scene::eval_bsdf`] will be asked about.
#[derive(Debug, Clone, Copy)]
pub(super) struct StoredPoint {
    pub normal: DVec3,
    pub reflectance: Rgb,
}

/// A closed-form scene.
#[derive(Debug)]
pub struct World {
    pub(super) contents: Contents,
    pub(super) emitters: Vec<Emitter>,
    pub(super) bounding_sphere: BoundingSphere,
    pub(super) description: SceneDescription,
    pub(super) points: RwLock<Vec<StoredPoint>>,
    pub(super) batching: Batching,
    spectrum: Option<Spectrum>,
}

impl World {
    pub fn new(contents: Contents) -> Self {
        let lit = contents.surfaces.iter().filter(|surface| !surface.emission.is_zero());
        let lamps = contents.lamps.iter().copied().map(Emitter::Lamp);
        let emitters: Vec<_> = lamps.chain(lit.copied().map(Emitter::Surface)).collect();
        let description = describe(&contents, &emitters);
        let bounding_sphere = enclose(&contents.surfaces, &description.bounds);
        let points = RwLock::default();
        let batching = Batching { lanes: 1024, concurrent: true, launch: 1 };
        let spectrum = None;
        World { contents, emitters, bounding_sphere, description, points, batching, spectrum }
    }

    /// A film of so many pixels, and nothing to see.
    #[cfg(test)]
    pub fn empty(film_size: [u32; 2]) -> Self {
        let projection = super::Projection::Orthographic { width: 1.0 };
        World::new(Contents {
            camera: Camera::new(DVec3::ZERO, DVec3::Z, film_size, projection),
            surfaces: Vec::new(),
            fogs: Vec::new(),
            lamps: Vec::new(),
            disclosure: Disclosure::Full,
        })
    }

    /// A scene whose channels are wavelengths. `contents` has the largest constants of all light.
    pub fn spectral(contents: Contents, spectrum: Spectrum) -> Self {
        let mut world = World { spectrum: Some(spectrum), ..World::new(contents) };
        world.description.channel_colours = Some([Rgb::ZERO; 3]);
        world
    }

    /// The scene at the wavelengths that a number chooses.
    pub(super) fn at(&self, number: f32) -> Option<World> {
        let (contents, colours) = self.spectrum?(number);
        let mut world = World::new(contents).in_batches(self.batching);
        world.description.channel_colours = Some(colours);
        Some(world)
    }

    /// The same, driven in other batches.
    pub fn in_batches(self, batching: Batching) -> Self {
        World { batching, ..self }
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
    pub(super) fn coefficients(
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
    pub(super) fn point_at(&self, ray: &Ray, skips_emitters: bool) -> StoredPoint {
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
        film_channels: RGB_ALPHA_WEIGHT,
        film_pixels: film_size[0] * film_size[1],
        film_width: film_size[0],
        film_filter: FilmFilter::of_a_pixel(),
        channel_colours: None,
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
