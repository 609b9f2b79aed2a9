//! Triangle meshes, and how Mitsuba reads them.

use glam::{Affine3A, Vec3};
use std::io::{self, Write};

/// Triangles with a normal at each vertex; lengths in metres.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    /// Indices of three vertices, counter-clockwise seen from outside.
    pub faces: Vec<[u32; 3]>,
}

impl Mesh {
    /// Adds a copy of another mesh, moved without shear.
    pub fn add(&mut self, other: &Mesh, motion: Affine3A) {
        let offset = self.positions.len() as u32;
        self.positions.extend(other.positions.iter().map(|&p| motion.transform_point3(p)));
        let turned = |&n: &Vec3| motion.transform_vector3(n).normalize_or_zero();
        self.normals.extend(other.normals.iter().map(turned));
        self.faces.extend(other.faces.iter().map(|face| face.map(|index| index + offset)));
    }

    /// Adds a copy of another mesh at a place.
    pub fn add_at(&mut self, other: &Mesh, place: [f32; 3]) {
        self.add(other, Affine3A::from_translation(place.into()));
    }

    /// Binary PLY, little-endian.
    pub fn write_ply(&self, to: &mut impl Write) -> io::Result<()> {
        write!(
            to,
            "ply\nformat binary_little_endian 1.0\nelement vertex {}\n\
             property float x\nproperty float y\nproperty float z\n\
             property float nx\nproperty float ny\nproperty float nz\n\
             element face {}\nproperty list uchar int vertex_indices\nend_header\n",
            self.positions.len(),
            self.faces.len()
        )?;
        for (position, normal) in self.positions.iter().zip(&self.normals) {
            for value in position.to_array().into_iter().chain(normal.to_array()) {
                to.write_all(&value.to_le_bytes())?;
            }
        }
        for face in &self.faces {
            to.write_all(&[3])?;
            for index in face {
                to.write_all(&index.to_le_bytes())?;
            }
        }
        Ok(())
    }

    /// Sets every normal to the mean of its faces' normals, weighted by their areas.
    pub fn smooth(&mut self) {
        self.normals = vec![Vec3::ZERO; self.positions.len()];
        for face in &self.faces {
            let [a, b, c] = face.map(|index| self.positions[index as usize]);
            let normal = (b - a).cross(c - a);
            for &index in face {
                self.normals[index as usize] += normal;
            }
        }
        for normal in &mut self.normals {
            *normal = normal.normalize_or(Vec3::Y);
        }
    }

    /// Smallest and largest coordinates; None without vertices.
    pub fn bounds(&self) -> Option<[Vec3; 2]> {
        let first = *self.positions.first()?;
        let widen = |[low, high]: [Vec3; 2], &p: &Vec3| [low.min(p), high.max(p)];
        Some(self.positions.iter().fold([first; 2], widen))
    }
}

#[cfg(test)]
mod tests {
    use super::super::solids::cuboid;
    use super::*;

    #[test]
    fn ply_holds_what_its_header_says() {
        let mesh = cuboid([0.0; 3], [1.0; 3]);
        let mut bytes = Vec::new();
        mesh.write_ply(&mut bytes).unwrap();
        let end = b"end_header\n";
        let header = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
        assert!(bytes.starts_with(b"ply\nformat binary_little_endian 1.0\nelement vertex 24\n"));
        assert_eq!(bytes.len() - header, 24 * 24 + 12 * 13);
    }

    #[test]
    fn copies_are_moved_and_keep_their_faces() {
        let mut mesh = cuboid([0.0; 3], [1.0; 3]);
        mesh.add_at(&cuboid([0.0; 3], [1.0; 3]), [2.0, 0.0, 0.0]);
        assert_eq!(mesh.faces.len(), 24);
        assert_eq!(mesh.bounds(), Some([Vec3::ZERO, Vec3::new(3.0, 1.0, 1.0)]));
    }

    #[test]
    fn smooth_normals_of_a_convex_solid_point_outwards() {
        let mut mesh = cuboid([-1.0; 3], [1.0; 3]);
        mesh.smooth();
        assert!(mesh.positions.iter().zip(&mesh.normals).all(|(p, n)| p.dot(*n) > 0.5));
    }
}
