//! The solids that furniture is made of. Normals point outwards.

use super::mesh::Mesh;
use glam::Vec3;

/// A box between two corners.
pub fn cuboid(low: [f32; 3], high: [f32; 3]) -> Mesh {
    let corners = [Vec3::from(low), Vec3::from(high)];
    let mut mesh = Mesh::default();
    for axis in 0..3 {
        for (side, sign) in [(0, -1.0), (1, 1.0)] {
            let [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
            let corner = |i: usize, j: usize| {
                let mut p = Vec3::ZERO;
                (p[axis], p[u], p[v]) = (corners[side][axis], corners[i][u], corners[j][v]);
                p
            };
            let first = mesh.positions.len() as u32;
            mesh.positions.extend([corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)]);
            mesh.normals.extend([Vec3::AXES[axis] * sign; 4]);
            let outwards = |face: [u32; 3]| match side {
                1 => face,
                _ => [face[0], face[2], face[1]],
            };
            mesh.faces.push(outwards([0, 1, 2].map(|k| first + k)));
            mesh.faces.push(outwards([0, 2, 3].map(|k| first + k)));
        }
    }
    mesh
}

/// A box by its centre and the lengths of its sides.
pub fn block(centre: [f32; 3], size: [f32; 3]) -> Mesh {
    let (centre, half) = (Vec3::from(centre), 0.5 * Vec3::from(size));
    cuboid((centre - half).into(), (centre + half).into())
}

/// What a lathe makes: the profile, pairs of a radius and a height, turned about the y axis. The profile runs so
/// that the outside is on its right; `sides` flat strips go round. Normals are smooth along the profile where it
/// bends by less than 40 degrees, so that rims stay sharp.
pub fn lathe(profile: &[[f32; 2]], sides: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for (point, normal) in rings(profile) {
        for side in 0..sides {
            let (sin, cos) = (std::f32::consts::TAU * side as f32 / sides as f32).sin_cos();
            mesh.positions.push(Vec3::new(point[0] * cos, point[1], point[0] * sin));
            mesh.normals.push(Vec3::new(normal[0] * cos, normal[1], normal[0] * sin));
        }
    }
    for strip in 0..profile.len() as u32 - 1 {
        let (lower, upper) = (2 * strip * sides, (2 * strip + 1) * sides);
        let radius = |end: usize| profile[strip as usize + end][0];
        for side in 0..sides {
            let next = (side + 1) % sides;
            if radius(0) > 0.0 {
                mesh.faces.push([lower + side, upper + next, lower + next]);
            }
            if radius(1) > 0.0 {
                mesh.faces.push([lower + side, upper + side, upper + next]);
            }
        }
    }
    mesh
}

/// Two rings for each piece of the profile, with the normals at its ends.
fn rings(profile: &[[f32; 2]]) -> Vec<([f32; 2], [f32; 2])> {
    let pieces: Vec<[f32; 2]> = profile.windows(2).map(|p| right_of(p[0], p[1])).collect();
    let blend = |piece: usize, other: Option<&[f32; 2]>| {
        let own = pieces[piece];
        match other {
            Some(other) if own[0] * other[0] + own[1] * other[1] > 0.77 => {
                unit([own[0] + other[0], own[1] + other[1]])
            }
            _ => own,
        }
    };
    let ends = |piece: usize| {
        let before = piece.checked_sub(1).and_then(|before| pieces.get(before));
        [
            (profile[piece], blend(piece, before)),
            (profile[piece + 1], blend(piece, pieces.get(piece + 1))),
        ]
    };
    (0..pieces.len()).flat_map(ends).collect()
}

fn right_of(from: [f32; 2], to: [f32; 2]) -> [f32; 2] {
    unit([to[1] - from[1], from[0] - to[0]])
}

fn unit([x, y]: [f32; 2]) -> [f32; 2] {
    let length = x.hypot(y).max(f32::MIN_POSITIVE);
    [x / length, y / length]
}

/// A profile near the given points, from the first to the last. Every round cuts each corner off and doubles the pieces
/// [Chaikin 1974].
pub fn rounded(profile: &[[f32; 2]], rounds: u32) -> Vec<[f32; 2]> {
    let mut points = profile.to_vec();
    for _ in 0..rounds {
        let cut = points.windows(2).flat_map(|p| [mix(p[0], p[1], 0.25), mix(p[0], p[1], 0.75)]);
        let ends = [points[0], points[points.len() - 1]];
        points = std::iter::once(ends[0]).chain(cut).chain([ends[1]]).collect();
    }
    points
}

fn mix(a: [f32; 2], b: [f32; 2], share: f32) -> [f32; 2] {
    [0, 1].map(|k| a[k] + share * (b[k] - a[k]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Six times the volume that the faces enclose; negative if they are turned inwards.
    fn volume(mesh: &Mesh) -> f32 {
        let at = |index: u32| mesh.positions[index as usize];
        mesh.faces.iter().map(|&[a, b, c]| at(a).dot(at(b).cross(at(c)))).sum::<f32>() / 6.0
    }

    fn faces_agree_with_normals(mesh: &Mesh) -> bool {
        mesh.faces.iter().all(|face| {
            let [a, b, c] = face.map(|index| mesh.positions[index as usize]);
            let normal = (b - a).cross(c - a);
            face.iter().all(|&index| normal.dot(mesh.normals[index as usize]) > 0.0)
        })
    }

    #[test]
    fn cuboid_encloses_its_volume() {
        let mesh = cuboid([1.0, 2.0, 3.0], [2.0, 4.0, 6.0]);
        assert!((volume(&mesh) - 6.0).abs() < 1e-5 && faces_agree_with_normals(&mesh));
        assert_eq!(mesh, block([1.5, 3.0, 4.5], [1.0, 2.0, 3.0]));
    }

    #[test]
    fn lathe_turns_cylinders_and_cones() {
        let cylinder = lathe(&[[0.0, 0.0], [2.0, 0.0], [2.0, 3.0], [0.0, 3.0]], 400);
        assert!((volume(&cylinder) / (12.0 * std::f32::consts::PI) - 1.0).abs() < 1e-3);
        let cone = lathe(&[[0.0, 0.0], [1.0, 0.0], [0.0, 3.0]], 400);
        assert!((volume(&cone) / std::f32::consts::PI - 1.0).abs() < 1e-3);
        assert!(faces_agree_with_normals(&cylinder) && faces_agree_with_normals(&cone));
    }

    #[test]
    fn rounding_keeps_the_ends() {
        let profile = rounded(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], 3);
        assert_eq!((profile[0], profile[profile.len() - 1]), ([0.0, 0.0], [1.0, 1.0]));
        assert!(profile.len() > 16);
    }
}
