//! A mesh of any size and place, PLY or OBJ, made to fit the scene.

use super::mesh::Mesh;
use super::package;
use flate2::read::GzDecoder;
use glam::Vec3;
use ply_rs_bw::parser::Parser;
use ply_rs_bw::ply::{Property, PropertyAccess};
use std::fs::File;
use std::io::{self, BufRead, BufReader};
use std::path::{Path, PathBuf};

/// Why there is no dragon.
#[derive(Debug, thiserror::Error)]
pub enum DragonError {
    #[error("cannot read the dragon \"{}\"; give a triangle mesh as PLY or OBJ with --dragon", .path.display())]
    Unreadable { path: PathBuf, source: io::Error },
    #[error("the dragon \"{}\" is no OBJ file that can be used; give another with --dragon", .path.display())]
    Obj { path: PathBuf, source: tobj::LoadError },
    #[error("the dragon \"{}\" has no extension that names a format; give a .ply or .obj file", .0.display())]
    Extension(PathBuf),
    #[error("the dragon \"{}\" holds no triangles; give another mesh with --dragon", .0.display())]
    Empty(PathBuf),
    #[error("the dragon \"{}\" has a face whose vertex {index} does not exist; give another mesh with --dragon",
            .path.display())]
    Index { path: PathBuf, index: i64 },
    #[error(transparent)]
    Package(#[from] package::PackageError),
}

/// Extensions of meshes that can be read.
const EXTENSIONS: [&str; 3] = ["ply", "gz", "obj"];

/// Checks a mesh of the user's own as far as that goes without reading it through.
pub fn check(path: &Path) -> Result<(), DragonError> {
    File::open(path).map_err(|source| DragonError::Unreadable { path: path.into(), source })?;
    match EXTENSIONS.contains(&extension(path).as_str()) {
        true => Ok(()),
        false => Err(DragonError::Extension(path.to_owned())),
    }
}

/// The user's mesh or the Stanford dragon, one metre long at most, its feet around the origin on the plane y = 0.
pub fn dragon(own: Option<&Path>, say: impl Fn(&str)) -> Result<Mesh, DragonError> {
    let path = match own {
        Some(path) => path.to_owned(),
        None => package::dragon(say)?,
    };
    let mut mesh = if extension(&path) == "obj" { read_obj(&path)? } else { read_ply(&path)? };
    if mesh.faces.is_empty() {
        return Err(DragonError::Empty(path));
    }
    fit(&mut mesh);
    mesh.smooth();
    Ok(mesh)
}

fn extension(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_lowercase()
}

/// Scales and moves a mesh to its place.
fn fit(mesh: &mut Mesh) {
    let Some([low, high]) = mesh.bounds() else { return };
    let scale = 1.0 / (high - low).max_element().max(f32::MIN_POSITIVE);
    let foot = Vec3::new(0.5 * (low.x + high.x), low.y, 0.5 * (low.z + high.z));
    for position in &mut mesh.positions {
        *position = (*position - foot) * scale;
    }
}

fn read_obj(path: &Path) -> Result<Mesh, DragonError> {
    let options = tobj::LoadOptions { triangulate: true, ..Default::default() };
    let (models, _) = tobj::load_obj(path, &options)
        .map_err(|source| DragonError::Obj { path: path.to_owned(), source })?;
    let mut mesh = Mesh::default();
    for tobj::Model { mesh: model, .. } in models {
        let offset = mesh.positions.len() as u32;
        mesh.positions.extend(model.positions.chunks_exact(3).map(Vec3::from_slice));
        let triangles = model.indices.chunks_exact(3);
        mesh.faces.extend(triangles.map(|t| [t[0] + offset, t[1] + offset, t[2] + offset]));
    }
    Ok(mesh)
}

#[derive(Default)]
struct Vertex(Vec3);

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Vertex::default()
    }

    fn set_property(&mut self, key: &str, property: Property) {
        let value = match property {
            Property::Float(value) => value,
            Property::Double(value) => value as f32,
            _ => return,
        };
        match key {
            "x" => self.0.x = value,
            "y" => self.0.y = value,
            "z" => self.0.z = value,
            _ => (),
        }
    }
}

#[derive(Default)]
struct Face(Vec<i64>);

impl PropertyAccess for Face {
    fn new() -> Self {
        Face::default()
    }

    fn set_property(&mut self, key: &str, property: Property) {
        if !["vertex_indices", "vertex_index"].contains(&key) {
            return;
        }
        match property {
            Property::ListInt(list) => self.0 = list.into_iter().map(i64::from).collect(),
            Property::ListUInt(list) => self.0 = list.into_iter().map(i64::from).collect(),
            Property::ListUShort(list) => self.0 = list.into_iter().map(i64::from).collect(),
            Property::ListShort(list) => self.0 = list.into_iter().map(i64::from).collect(),
            _ => (),
        }
    }
}

fn read_ply(path: &Path) -> Result<Mesh, DragonError> {
    let (vertices, faces) = parse_ply(path)
        .map_err(|source| DragonError::Unreadable { path: path.to_owned(), source })?;
    let positions: Vec<Vec3> = vertices.into_iter().map(|vertex| vertex.0).collect();
    let count = positions.len() as i64;
    if let Some(&index) = faces.iter().flat_map(|f| &f.0).find(|i| !(0..count).contains(i)) {
        return Err(DragonError::Index { path: path.to_owned(), index });
    }
    let fan = |Face(face): &Face| -> Vec<[u32; 3]> {
        let first = face.first().copied().unwrap_or_default();
        let rest = face.get(1..).unwrap_or_default().windows(2);
        rest.map(|pair| [first, pair[0], pair[1]].map(|index| index as u32)).collect()
    };
    Ok(Mesh { positions, faces: faces.iter().flat_map(fan).collect(), ..Mesh::default() })
}

/// All vertices and faces, of a file that may be packed by gzip.
fn parse_ply(path: &Path) -> io::Result<(Vec<Vertex>, Vec<Face>)> {
    let file = File::open(path)?;
    let mut from: Box<dyn BufRead> = match extension(path).as_str() {
        "gz" => Box::new(BufReader::new(GzDecoder::new(file))),
        _ => Box::new(BufReader::new(file)),
    };
    let (vertex_parser, face_parser) = (Parser::<Vertex>::new(), Parser::<Face>::new());
    let header = vertex_parser.read_header(&mut from)?;
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    for (name, element) in &header.elements {
        match name.as_str() {
            "vertex" => {
                vertices = vertex_parser.read_payload_for_element(&mut from, element, &header)?;
            }
            _ => {
                let read = face_parser.read_payload_for_element(&mut from, element, &header)?;
                if name == "face" {
                    faces = read;
                }
            }
        }
    }
    Ok((vertices, faces))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pyramid of a square and four triangles, far from the origin.
    const PLY: &str =
        "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\n\
        property float z\nelement face 5\nproperty list uchar int vertex_indices\nend_header\n\
        10 5 0\n14 5 0\n14 5 4\n10 5 4\n12 7 2\n4 0 1 2 3\n3 0 4 1\n3 1 4 2\n3 2 4 3\n3 3 4 0\n";
    const OBJ: &str =
        "v 10 5 0\nv 14 5 0\nv 14 5 4\nv 10 5 4\nv 12 7 2\nf 1 2 3 4\nf 1 5 2\nf 2 5 3\n\
        f 3 5 4\nf 4 5 1\n";

    fn read(name: &str, text: &str) -> Result<Mesh, DragonError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        check(&path)?;
        dragon(Some(&path), |_| ())
    }

    #[test]
    fn meshes_of_both_formats_are_fitted() {
        for (name, text) in [("a.ply", PLY), ("a.obj", OBJ)] {
            let mesh = read(name, text).unwrap();
            assert_eq!(mesh.faces.len(), 6, "{name}");
            let bounds = [Vec3::new(-0.5, 0.0, -0.5), Vec3::new(0.5, 0.5, 0.5)];
            assert_eq!(mesh.bounds(), Some(bounds), "{name}");
            assert_eq!(mesh.normals.len(), 5, "{name}");
        }
    }

    #[test]
    fn unusable_meshes_are_named_with_their_mend() {
        for (name, text, part) in [
            ("a.stl", PLY, "a .ply or .obj file"),
            ("a.ply", "ply\nnonsense", "as PLY or OBJ"),
            ("a.ply", &PLY.replace("3 3 4 0", "3 3 4 9"), "vertex 9 does not exist"),
            ("a.obj", "v 1 2 3\n", "no triangles"),
            ("a.obj", "v 1 2 3\nf 1 2 x\n", "no OBJ file"),
        ] {
            let message = read(name, text).unwrap_err().to_string();
            assert!(message.contains(part), "{name}: {message}");
        }
    }
}
