//! A scene as Mitsuba's XML, with the files that it names.

use std::fmt::Write;
use std::path::Path;
use std::{fs, io};

use super::image::Image;
use super::scene::*;

pub const FILM: usize = 12;

/// Writes `scene.xml` and its files into `folder`.
pub fn write(scene: &Scene, folder: &Path) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    let mut writer = Writer { folder, text: String::new(), media: 0, files: 0 };
    writer.scene(scene)?;
    fs::write(folder.join("scene.xml"), writer.text)
}

struct Writer<'a> {
    folder: &'a Path,
    text: String,
    media: u32,
    files: u32,
}

impl Writer<'_> {
    fn line(&mut self, line: impl AsRef<str>) {
        self.text.push_str(line.as_ref());
        self.text.push('\n');
    }

    fn scene(&mut self, scene: &Scene) -> io::Result<()> {
        self.line("<scene version=\"3.0.0\">");
        self.line("<default name=\"integrator\" value=\"volpath\"/>");
        self.line("<integrator type=\"$integrator\">");
        let depth = scene.max_depth.map_or(-1, i64::from);
        self.line(format!("<integer name=\"max_depth\" value=\"{depth}\"/>"));
        self.line(format!(
            "<boolean name=\"hide_emitters\" value=\"{}\"/>\n</integrator>",
            scene.hide_emitters
        ));
        let air = match &scene.air {
            Some(air) => Some(self.medium(air, [0.0; 3], HALF_ROOM)?),
            None => None,
        };
        self.camera(scene, air.as_deref());
        self.surroundings(&scene.surroundings, air.as_deref());
        for object in &scene.objects {
            self.object(object, air.as_deref())?;
        }
        for lamp in &scene.lamps {
            self.lamp(lamp)?;
        }
        self.line("</scene>");
        Ok(())
    }

    fn camera(&mut self, scene: &Scene, air: Option<&str>) {
        let Camera { origin, target, fov } = &scene.camera;
        self.line(format!("<sensor type=\"perspective\">\n{}", number("fov", *fov)));
        self.line(format!(
            "<transform name=\"to_world\">\n<lookat origin=\"{}\" target=\"{}\" up=\"0, 1, 0\"/>\n</transform>",
            list(origin),
            list(target)
        ));
        let outside = matches!(scene.surroundings, Surroundings::Box { camera_inside: false, .. });
        if let (Some(air), false) = (air, outside) {
            self.line(format!("<ref name=\"medium\" id=\"{air}\"/>"));
        }
        self.line("<sampler type=\"independent\"/>\n<film type=\"hdrfilm\">");
        for side in ["width", "height"] {
            self.line(format!("<integer name=\"{side}\" value=\"{FILM}\"/>"));
        }
        self.line("<string name=\"pixel_format\" value=\"rgb\"/>");
        self.line("<string name=\"component_format\" value=\"float32\"/>");
        self.line("<rfilter type=\"box\"/>\n</film>\n</sensor>");
    }

    fn surroundings(&mut self, surroundings: &Surroundings, air: Option<&str>) {
        let (shape, transform, bsdf, interior) = match surroundings {
            Surroundings::Room(bsdf) | Surroundings::Box { boundary: bsdf, .. } => {
                ("cube", format!("<scale value=\"{HALF_ROOM}\"/>"), bsdf, air)
            }
            Surroundings::Open { floor: Some(bsdf) } => {
                let turn = "<scale value=\"2.5\"/>\n<rotate x=\"1\" angle=\"-90\"/>";
                ("rectangle", format!("{turn}\n<translate y=\"-1.05\"/>"), bsdf, None)
            }
            Surroundings::Open { floor: None } => return,
        };
        self.line(format!(
            "<shape type=\"{shape}\">\n<transform name=\"to_world\">\n{transform}\n</transform>"
        ));
        self.bsdf(bsdf, "");
        self.medium_refs(interior, None);
        self.line("</shape>");
    }

    fn object(&mut self, object: &Object, around: Option<&str>) -> io::Result<()> {
        let bounds = object.inside.is_some() || object.content.is_some();
        let inside = match &object.inside {
            Some(medium) => Some(self.medium(medium, object.centre, object.radius)?),
            None => None,
        };
        self.shape(object)?;
        self.bsdf(&object.bsdf, "");
        if bounds {
            self.medium_refs(inside.as_deref(), around);
        } else if object.names_medium {
            self.medium_refs(around, around);
        }
        if let Some(radiance) = object.radiance {
            self.line(format!(
                "<emitter type=\"area\">\n{}\n</emitter>",
                rgb("radiance", radiance)
            ));
        }
        self.line("</shape>");
        match &object.content {
            Some(content) => self.object(content, inside.as_deref()),
            None => Ok(()),
        }
    }

    /// Opens the shape's element.
    fn shape(&mut self, object: &Object) -> io::Result<()> {
        let own_radius = match object.shape {
            Shape::Sphere | Shape::Disk | Shape::Octahedron => 1.0,
            Shape::Cube => 3f32.sqrt(),
            Shape::Rectangle | Shape::Cylinder => 2f32.sqrt(),
        };
        let name = match object.shape {
            Shape::Sphere => "sphere",
            Shape::Cube => "cube",
            Shape::Octahedron => "obj",
            Shape::Rectangle => "rectangle",
            Shape::Disk => "disk",
            Shape::Cylinder => "cylinder",
        };
        self.line(format!("<shape type=\"{name}\">"));
        if object.shape == Shape::Octahedron {
            fs::write(self.folder.join("octahedron.obj"), octahedron())?;
            self.line("<string name=\"filename\" value=\"octahedron.obj\"/>");
            self.line("<boolean name=\"face_normals\" value=\"true\"/>");
        }
        if object.shape == Shape::Cylinder {
            self.line(
                "<point name=\"p0\" value=\"0, 0, -1\"/>\n<point name=\"p1\" value=\"0, 0, 1\"/>",
            );
        }
        let scale = object.stretch.map(|stretch| stretch * object.radius / own_radius);
        let scale = if is_grey(&scale) { scale[0].to_string() } else { list(&scale) };
        self.line(format!("<transform name=\"to_world\">\n<scale value=\"{scale}\"/>"));
        // Mitsuba takes an axis as it is: one of another length shears, and shapes like cylinders have wrong bounds then.
        let [x, y, z] = glam::Vec3::from(object.axis).normalize().to_array();
        let degrees = object.degrees;
        self.line(format!("<rotate x=\"{x}\" y=\"{y}\" z=\"{z}\" angle=\"{degrees}\"/>"));
        self.line(format!("<translate value=\"{}\"/>\n</transform>", list(&object.centre)));
        Ok(())
    }

    fn medium_refs(&mut self, interior: Option<&str>, exterior: Option<&str>) {
        for (side, medium) in [("interior", interior), ("exterior", exterior)] {
            if let Some(medium) = medium {
                self.line(format!("<ref name=\"{side}\" id=\"{medium}\"/>"));
            }
        }
    }

    fn bsdf(&mut self, bsdf: &Bsdf, attributes: &str) {
        let kind = match bsdf {
            Bsdf::Diffuse(_) | Bsdf::Checkerboard(..) => "diffuse",
            Bsdf::TwoSided(_) => "twosided",
            Bsdf::Conductor(_) => "conductor",
            Bsdf::RoughConductor { .. } => "roughconductor",
            Bsdf::Plastic(_) => "plastic",
            Bsdf::RoughPlastic { .. } => "roughplastic",
            Bsdf::Dielectric { .. } => "dielectric",
            Bsdf::ThinDielectric { .. } => "thindielectric",
            Bsdf::RoughDielectric { .. } => "roughdielectric",
            Bsdf::Null => "null",
            Bsdf::Mask { .. } => "mask",
            Bsdf::Blend { .. } => "blendbsdf",
            Bsdf::Principled { .. } => "principled",
        };
        self.line(format!("<bsdf type=\"{kind}\"{attributes}>"));
        for line in numbers_of(bsdf) {
            self.line(line);
        }
        for part in bsdf.parts() {
            self.bsdf(part, "");
        }
        self.line("</bsdf>");
    }

    /// Writes the medium, which lies within a ball or cube of this half width, and returns its name.
    fn medium(&mut self, medium: &Medium, centre: Point, half: f32) -> io::Result<String> {
        self.media += 1;
        let name = format!("medium{}", self.media);
        let kind = match medium.extinction {
            Extinction::Constant(_) => "homogeneous",
            Extinction::Grid(_) => "heterogeneous",
        };
        self.line(format!("<medium type=\"{kind}\" id=\"{name}\">"));
        match &medium.extinction {
            Extinction::Constant(colour) => {
                // Mitsuba takes colours up to 1.
                let scale = colour.iter().copied().fold(1.0, f32::max);
                self.line(rgb_or_number("sigma_t", colour.map(|channel| channel / scale)));
                self.line(number("scale", scale));
            }
            Extinction::Grid(values) => self.grid(values, centre, half)?,
        }
        self.line(rgb_or_number("albedo", medium.albedo));
        self.phase(&medium.phase);
        self.line("</medium>");
        Ok(name)
    }

    fn grid(&mut self, values: &[Colour], centre: Point, half: f32) -> io::Result<()> {
        self.files += 1;
        let file = format!("grid{}.vol", self.files);
        let channels = if values.iter().all(is_grey) { 1 } else { 3 };
        fs::write(self.folder.join(&file), volume(values, channels))?;
        self.line(format!(
            "<volume name=\"sigma_t\" type=\"gridvolume\">\n<string name=\"filename\" value=\"{file}\"/>"
        ));
        self.line("<boolean name=\"raw\" value=\"true\"/>\n<transform name=\"to_world\">");
        self.line(format!(
            "<translate value=\"-0.5, -0.5, -0.5\"/>\n<scale value=\"{}\"/>",
            2.02 * half
        ));
        self.line(format!("<translate value=\"{}\"/>\n</transform>\n</volume>", list(&centre)));
        Ok(())
    }

    fn phase(&mut self, phase: &Phase) {
        let (kind, line) = match phase {
            Phase::Isotropic => ("isotropic", None),
            Phase::HenyeyGreenstein(g) => ("hg", Some(number("g", *g))),
            Phase::Rayleigh => ("rayleigh", None),
            Phase::Tabulated(values) => {
                let values = list(values);
                ("tabphase", Some(format!("<string name=\"values\" value=\"{values}\"/>")))
            }
            Phase::Blend { weight, .. } => ("blendphase", Some(number("weight", *weight))),
        };
        self.line(format!("<phase type=\"{kind}\">"));
        line.into_iter().for_each(|line| self.line(line));
        if let Phase::Blend { parts, .. } = phase {
            parts.iter().for_each(|part| self.phase(part));
        }
        self.line("</phase>");
    }

    fn lamp(&mut self, lamp: &Lamp) -> io::Result<()> {
        let (kind, lines) = match lamp {
            Lamp::Point { position, intensity } => {
                let position = format!("<point name=\"position\" value=\"{}\"/>", list(position));
                ("point", format!("{position}\n{}", rgb("intensity", *intensity)))
            }
            Lamp::Spot { position, target, intensity, cutoff } => {
                let lookat = format!(
                    "<transform name=\"to_world\">\n<lookat origin=\"{}\" target=\"{}\" up=\"0, 0, 1\"/>\n</transform>",
                    list(position),
                    list(target)
                );
                let cutoff = number("cutoff_angle", *cutoff);
                ("spot", format!("{lookat}\n{}\n{cutoff}", rgb("intensity", *intensity)))
            }
            Lamp::Directional { direction, irradiance } => {
                let direction =
                    format!("<vector name=\"direction\" value=\"{}\"/>", list(direction));
                ("directional", format!("{direction}\n{}", rgb("irradiance", *irradiance)))
            }
            Lamp::Constant(radiance) => ("constant", rgb("radiance", *radiance)),
            Lamp::Envmap(pixels) => {
                let sky = Image::from_fn(SKY[0], SKY[1], |x, y| pixels[y * SKY[0] + x]);
                sky.write_exr(&self.folder.join("sky.exr")).map_err(io::Error::other)?;
                ("envmap", "<string name=\"filename\" value=\"sky.exr\"/>".to_owned())
            }
        };
        self.line(format!("<emitter type=\"{kind}\">\n{lines}\n</emitter>"));
        Ok(())
    }
}

/// All of a BSDF but its parts.
fn numbers_of(bsdf: &Bsdf) -> Vec<String> {
    match bsdf {
        Bsdf::Diffuse(colour) => vec![rgb("reflectance", *colour)],
        Bsdf::Checkerboard(first, second) => vec![
            "<texture name=\"reflectance\" type=\"checkerboard\">".to_owned(),
            rgb("color0", *first),
            rgb("color1", *second),
            "<transform name=\"to_uv\">\n<scale x=\"3\" y=\"3\"/>\n</transform>\n</texture>"
                .to_owned(),
        ],
        Bsdf::Conductor(material) => vec![metal(material)],
        Bsdf::RoughConductor { material, alpha } => vec![metal(material), number("alpha", *alpha)],
        Bsdf::Plastic(colour) => vec![rgb("diffuse_reflectance", *colour)],
        Bsdf::RoughPlastic { diffuse, alpha } => {
            vec![rgb("diffuse_reflectance", *diffuse), number("alpha", *alpha)]
        }
        Bsdf::Dielectric { ior } | Bsdf::ThinDielectric { ior } => vec![number("int_ior", *ior)],
        Bsdf::RoughDielectric { ior, alpha } => {
            vec![number("int_ior", *ior), number("alpha", *alpha)]
        }
        Bsdf::Mask { opacity, .. } => vec![number("opacity", *opacity)],
        Bsdf::Blend { weight, .. } => vec![number("weight", *weight)],
        Bsdf::Principled { colour, numbers } => {
            let numbers = numbers.iter().map(|(name, value)| number(name, *value));
            std::iter::once(rgb("base_color", *colour)).chain(numbers).collect()
        }
        Bsdf::TwoSided(_) | Bsdf::Null => Vec::new(),
    }
}

fn list(values: &[f32]) -> String {
    values.iter().map(f32::to_string).collect::<Vec<_>>().join(", ")
}

fn number(name: &str, value: f32) -> String {
    format!("<float name=\"{name}\" value=\"{value}\"/>")
}

fn rgb(name: &str, colour: Colour) -> String {
    format!("<rgb name=\"{name}\" value=\"{}\"/>", list(&colour))
}

fn rgb_or_number(name: &str, colour: Colour) -> String {
    if is_grey(&colour) {
        number(name, colour[0])
    } else {
        rgb(name, colour)
    }
}

fn metal(name: &str) -> String {
    format!("<string name=\"material\" value=\"{name}\"/>")
}

/// Vertices on the axes, faces outward.
fn octahedron() -> String {
    let mut text = String::new();
    for vertex in ["1 0 0", "-1 0 0", "0 1 0", "0 -1 0", "0 0 1", "0 0 -1"] {
        writeln!(text, "v {vertex}").expect("write to a string");
    }
    for [x, y, z] in
        [[1, 3, 5], [2, 3, 5], [1, 4, 5], [2, 4, 5], [1, 3, 6], [2, 3, 6], [1, 4, 6], [2, 4, 6]]
    {
        // An odd number of axes turned around makes a mirror image.
        let mirrored = (x + y + z) % 2 == 0;
        let [y, z] = if mirrored { [z, y] } else { [y, z] };
        writeln!(text, "f {x} {y} {z}").expect("write to a string");
    }
    text
}

/// Mitsuba's binary grid, version 3: sizes, channels, the box, then x fastest.
fn volume(values: &[Colour], channels: usize) -> Vec<u8> {
    let mut bytes = b"VOL\x03".to_vec();
    for number in [1, GRID, GRID, GRID, channels] {
        bytes.extend((number as i32).to_le_bytes());
    }
    for corner in [0f32, 0.0, 0.0, 1.0, 1.0, 1.0] {
        bytes.extend(corner.to_le_bytes());
    }
    for value in values.iter().flat_map(|colour| &colour[..channels]) {
        bytes.extend(value.to_le_bytes());
    }
    bytes
}
