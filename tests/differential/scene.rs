//! A random scene as plain data: what the generator draws, `xml` writes and `shrink` takes apart.

pub type Colour = [f32; 3];
pub type Point = [f32; 3];

#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    pub surroundings: Surroundings,
    /// What fills the surroundings.
    pub air: Option<Medium>,
    pub objects: Vec<Object>,
    pub lamps: Vec<Lamp>,
    pub camera: Camera,
    /// None is unbounded.
    pub max_depth: Option<u32>,
    pub rr_depth: u32,
    pub hide_emitters: bool,
}

#[derive(Clone, Debug, PartialEq)]
pub enum Surroundings {
    /// A closed cube, seen from inside.
    Room(Bsdf),
    /// A cube that light passes.
    Box { boundary: Bsdf, camera_inside: bool },
    /// Nothing, or a medium without end, over a floor or none.
    Open { floor: Option<Bsdf> },
}

/// Half an edge of the cubes of [`Surroundings`].
pub const HALF_ROOM: f32 = 1.2;

#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    pub origin: Point,
    pub target: Point,
    pub fov: f32,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Object {
    pub shape: Shape,
    pub centre: Point,
    /// Radius of the sphere around it.
    pub radius: f32,
    /// Along the shape's own axes, at most 1; for those that Mitsuba can stretch.
    pub stretch: [f32; 3],
    pub axis: Point,
    pub degrees: f32,
    pub bsdf: Bsdf,
    pub radiance: Option<Colour>,
    pub inside: Option<Medium>,
    /// Lies within the shape.
    pub content: Option<Box<Object>>,
    /// Whether the file says which medium is on both sides of a shape that bounds none. It need not.
    pub names_medium: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    Sphere,
    Cube,
    /// As an OBJ file.
    Octahedron,
    Rectangle,
    Disk,
    Cylinder,
}

impl Shape {
    /// Radius of the largest ball inside, for a sphere of radius 1 around it; none where it is open.
    pub fn inner_radius(self) -> Option<f32> {
        match self {
            Shape::Sphere => Some(1.0),
            Shape::Cube | Shape::Octahedron => Some(1.0 / 3f32.sqrt()),
            Shape::Rectangle | Shape::Disk | Shape::Cylinder => None,
        }
    }

    pub fn can_stretch(self) -> bool {
        matches!(self, Shape::Cube | Shape::Octahedron | Shape::Rectangle)
    }
}

#[derive(Clone, Debug, PartialEq)]
pub enum Bsdf {
    Diffuse(Colour),
    Checkerboard(Colour, Colour),
    TwoSided(Box<Bsdf>),
    Conductor(&'static str),
    RoughConductor { material: &'static str, alpha: f32 },
    Plastic(Colour),
    RoughPlastic { diffuse: Colour, alpha: f32 },
    Dielectric { ior: f32 },
    ThinDielectric { ior: f32 },
    RoughDielectric { ior: f32, alpha: f32 },
    Null,
    Mask { opacity: f32, nested: Box<Bsdf> },
    Blend { weight: f32, parts: [Box<Bsdf>; 2] },
    Principled { colour: Colour, numbers: Vec<(&'static str, f32)> },
}

impl Bsdf {
    /// Whether it mirrors or refracts sharply.
    pub fn has_delta(&self) -> bool {
        match self {
            Bsdf::Conductor(_)
            | Bsdf::Plastic(_)
            | Bsdf::Dielectric { .. }
            | Bsdf::ThinDielectric { .. } => true,
            Bsdf::TwoSided(nested) | Bsdf::Mask { nested, .. } => nested.has_delta(),
            Bsdf::Blend { parts, .. } => parts.iter().any(|part| part.has_delta()),
            Bsdf::Diffuse(_)
            | Bsdf::Checkerboard(..)
            | Bsdf::RoughConductor { .. }
            | Bsdf::RoughPlastic { .. }
            | Bsdf::RoughDielectric { .. }
            | Bsdf::Null
            | Bsdf::Principled { .. } => false,
        }
    }

    /// The BSDFs that it is made of.
    pub fn parts(&self) -> Vec<&Bsdf> {
        match self {
            Bsdf::TwoSided(nested) | Bsdf::Mask { nested, .. } => vec![nested],
            Bsdf::Blend { parts, .. } => parts.iter().map(|part| &**part).collect(),
            _ => Vec::new(),
        }
    }
}

#[derive(Clone, Debug, PartialEq)]
pub struct Medium {
    pub extinction: Extinction,
    pub albedo: Colour,
    pub phase: Phase,
}

#[derive(Clone, Debug, PartialEq)]
pub enum Extinction {
    Constant(Colour),
    /// [`GRID`] values along each axis of the box around the medium.
    Grid(Vec<Colour>),
}

pub const GRID: usize = 4;

impl Extinction {
    pub fn is_grey(&self) -> bool {
        match self {
            Extinction::Constant(colour) => is_grey(colour),
            Extinction::Grid(values) => values.iter().all(is_grey),
        }
    }
}

pub fn is_grey(colour: &Colour) -> bool {
    colour.iter().all(|&channel| channel == colour[0])
}

#[derive(Clone, Debug, PartialEq)]
pub enum Phase {
    Isotropic,
    HenyeyGreenstein(f32),
    Rayleigh,
    /// Values over equal steps of the cosine.
    Tabulated(Vec<f32>),
    Blend {
        weight: f32,
        parts: [Box<Phase>; 2],
    },
}

#[derive(Clone, Debug, PartialEq)]
pub enum Lamp {
    Point {
        position: Point,
        intensity: Colour,
    },
    Spot {
        position: Point,
        target: Point,
        intensity: Colour,
        cutoff: f32,
    },
    Directional {
        direction: Point,
        irradiance: Colour,
    },
    Constant(Colour),
    /// [`SKY`] pixels, row by row.
    Envmap(Vec<Colour>),
}

pub const SKY: [usize; 2] = [8, 4];

impl Lamp {
    /// Whether no ray meets it by chance.
    pub fn is_delta(&self) -> bool {
        matches!(self, Lamp::Point { .. } | Lamp::Spot { .. } | Lamp::Directional { .. })
    }
}

impl Scene {
    /// All media of the scene.
    pub fn media(&self) -> Vec<&Medium> {
        let mut media: Vec<&Medium> = self.air.iter().collect();
        let mut objects: Vec<&Object> = self.objects.iter().collect();
        while let Some(object) = objects.pop() {
            media.extend(&object.inside);
            objects.extend(object.content.as_deref());
        }
        media
    }

    pub fn has_light(&self) -> bool {
        let shines = |object: &Object| {
            let mut object = Some(object);
            while let Some(inner) = object {
                if inner.radiance.is_some() {
                    return true;
                }
                object = inner.content.as_deref();
            }
            false
        };
        !self.lamps.is_empty() || self.objects.iter().any(shines)
    }
}
