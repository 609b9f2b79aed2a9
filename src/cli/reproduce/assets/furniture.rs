//! Tables and chairs, feet on the plane y = 0; lengths in metres.

use super::crockery::Fineness;
use super::mesh::Mesh;
use super::solids::block;
use glam::{Affine3A, Quat, Vec3};

/// Height of a table's upper side.
pub const TABLE_HEIGHT: f32 = 0.75;

/// A table with turned legs, `length` along x and `width` along z.
pub fn table(length: f32, width: f32, fineness: Fineness) -> Mesh {
    let mut mesh = block([0.0, TABLE_HEIGHT - 0.018, 0.0], [length, 0.036, width]);
    let (x, z) = (0.5 * length - 0.1, 0.5 * width - 0.1);
    let leg = fineness.leg(TABLE_HEIGHT - 0.03, 0.042);
    for (sx, sz) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, -1.0), (1.0, 1.0)] {
        mesh.add_at(&leg, [sx * x, 0.0, sz * z]);
    }
    for side in [-1.0, 1.0] {
        let apron = TABLE_HEIGHT - 0.08;
        mesh.add_at(&block([0.0; 3], [length - 0.22, 0.09, 0.02]), [0.0, apron, side * z]);
        mesh.add_at(&block([0.0; 3], [0.02, 0.09, width - 0.22]), [side * x, apron, 0.0]);
    }
    mesh
}

/// A chair that looks along +z, with a seat, turned front legs and a back of slats.
pub fn chair(fineness: Fineness) -> Mesh {
    let mut mesh = block([0.0, 0.45, 0.0], [0.42, 0.035, 0.42]);
    let leg = fineness.leg(0.44, 0.024);
    let post = block([0.0, 0.47, 0.0], [0.034, 0.94, 0.034]);
    let stretcher = block([0.0; 3], [0.018, 0.022, 0.34]);
    for side in [-0.18, 0.18] {
        mesh.add_at(&leg, [side, 0.0, 0.18]);
        mesh.add_at(&post, [side, 0.0, -0.19]);
        mesh.add_at(&stretcher, [side, 0.20, 0.0]);
    }
    for (height, size) in [(0.91, 0.085), (0.55, 0.04)] {
        mesh.add_at(&block([0.0; 3], [0.34, size, 0.02]), [0.0, height, -0.19]);
    }
    for slat in -2..=2 {
        let x = 0.062 * slat as f32;
        mesh.add_at(&block([0.0; 3], [0.022, 0.36, 0.012]), [x, 0.72, -0.19]);
    }
    mesh
}

/// A motion that turns about y by so many degrees and then moves on the floor.
pub fn placed(degrees: f32, x: f32, z: f32) -> Affine3A {
    let turn = Quat::from_rotation_y(degrees.to_radians());
    Affine3A::from_rotation_translation(turn, Vec3::new(x, 0.0, z))
}
