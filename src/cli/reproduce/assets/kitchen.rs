//! The meshes and the fog of `kitchen`: cupboards, a cooker, a sink under the window, a table.
//!
//! Metres. The inside is x in [-2.3, 2.3], y in [0, 2.6], z in [-2, 2.2]; the window is in the wall z = -2.

use super::crockery::Fineness;
use super::furniture::{chair, placed, table, TABLE_HEIGHT};
use super::grid::Grid;
use super::mesh::Mesh;
use super::noise::{carried, fractal, smoothstep};
use super::solids::{block, cuboid, lathe};
use super::Asset;

const FINE: Fineness = Fineness { rounds: 3, sides: 72 };
const COARSE: Fineness = Fineness { rounds: 2, sides: 24 };
/// Height of the worktop's upper side.
const WORKTOP: f32 = 0.9;
const SEED: u32 = 11;

pub fn assets() -> Vec<(&'static str, Asset)> {
    vec![
        ("walls.ply", Asset::Mesh(walls())),
        ("frames.ply", Asset::Mesh(frames())),
        ("cupboards.ply", Asset::Mesh(cupboards())),
        ("stone.ply", Asset::Mesh(worktop())),
        ("steel.ply", Asset::Mesh(steel())),
        ("wood.ply", Asset::Mesh(wood())),
        ("crockery.ply", Asset::Mesh(crockery())),
        ("fruit.ply", Asset::Mesh(fruit())),
        ("fog.vol", Asset::Grid(fog())),
    ]
}

/// Ceiling and walls, the window's opening x in [-0.7, 0.9], y in [1.1, 2.2]. Pieces overlap and are never flush.
fn walls() -> Mesh {
    let mut mesh = cuboid([-2.5, 2.6, -2.25], [2.5, 2.8, 2.4]);
    for (low, high) in [
        ([-2.5, -0.15, -2.2], [-2.3, 2.7, 2.35]),
        ([2.3, -0.15, -2.2], [2.5, 2.7, 2.35]),
        ([-2.45, -0.15, 2.2], [2.45, 2.7, 2.4]),
        ([-2.4, -0.15, -2.3], [-0.7, 2.7, -2.0]),
        ([0.9, -0.15, -2.3], [2.4, 2.7, -2.0]),
        ([-0.75, -0.15, -2.29], [0.95, 1.1, -2.01]),
        ([-0.75, 2.2, -2.29], [0.95, 2.7, -2.01]),
    ] {
        mesh.add_at(&cuboid(low, high), [0.0; 3]);
    }
    mesh
}

/// Window bars and the board below them, between the fog's end and the panes.
fn frames() -> Mesh {
    let mut mesh = Mesh::default();
    for x in [-0.68, -0.16, 0.36, 0.88] {
        mesh.add_at(&block([x, 1.65, -2.09], [0.05, 1.14, 0.024]), [0.0; 3]);
    }
    for y in [1.115, 1.74, 2.185] {
        mesh.add_at(&block([0.1, y, -2.09], [1.64, 0.045, 0.02]), [0.0; 3]);
    }
    mesh
}

/// Base cupboards along the back and the left wall, wall cupboards beside the window, with doors.
fn cupboards() -> Mesh {
    let mut mesh = Mesh::default();
    let mut add = |centre: [f32; 3], size: [f32; 3]| mesh.add_at(&block(centre, size), [0.0; 3]);
    add([0.0, 0.05, -1.74], [4.6, 0.1, 0.5]);
    add([0.0, 0.48, -1.71], [4.6, 0.76, 0.56]);
    for door in 0..9 {
        let x = -2.02 + 0.505 * door as f32;
        add([x, 0.40, -1.425], [0.47, 0.56, 0.03]);
        add([x, 0.775, -1.425], [0.47, 0.13, 0.03]);
    }
    add([-2.02, 0.48, -0.35], [0.56, 0.76, 0.74]);
    add([-1.735, 0.48, -0.35], [0.03, 0.70, 0.68]);
    for (from, doors) in [(-2.28, 3), (1.12, 2)] {
        let width = 0.5 * doors as f32;
        add([from + 0.5 * width, 1.82, -1.83], [width, 0.70, 0.33]);
        for door in 0..doors {
            add([from + 0.25 + 0.5 * door as f32, 1.82, -1.655], [0.47, 0.66, 0.025]);
        }
    }
    mesh
}

fn worktop() -> Mesh {
    let mut mesh = cuboid([-2.3, WORKTOP - 0.04, -2.0], [2.3, WORKTOP, -1.39]);
    mesh.add_at(&cuboid([-2.3, WORKTOP - 0.041, -1.38], [-1.70, WORKTOP - 0.001, 0.05]), [0.0; 3]);
    mesh
}

/// Handles, tap, sink, cooker, hood and pans.
fn steel() -> Mesh {
    let mut mesh = Mesh::default();
    for door in 0..9 {
        let x = -2.02 + 0.505 * door as f32;
        mesh.add_at(&block([x, 0.64, -1.395], [0.16, 0.014, 0.02]), [0.0; 3]);
        mesh.add_at(&block([x, 0.80, -1.395], [0.16, 0.014, 0.02]), [0.0; 3]);
    }
    mesh.add_at(&block([0.1, WORKTOP + 0.002, -1.68], [0.62, 0.012, 0.42]), [0.0; 3]);
    let pipe = |radius: f32, height: f32| {
        lathe(&[[0.0, 0.0], [radius, 0.0], [radius, height], [0.0, height]], 32)
    };
    mesh.add_at(&pipe(0.016, 0.26), [0.1, WORKTOP, -1.92]);
    mesh.add_at(&block([0.1, WORKTOP + 0.255, -1.845], [0.022, 0.022, 0.17]), [0.0; 3]);
    mesh.add_at(&pipe(0.028, 0.05), [0.1, WORKTOP, -1.92]);
    mesh.add_at(&block([-2.0, 0.45, -1.0], [0.61, 0.90, 0.58]), [0.0; 3]);
    mesh.add_at(&block([-2.05, 1.68, -1.0], [0.46, 0.10, 0.6]), [0.0; 3]);
    mesh.add_at(&block([-2.15, 2.15, -1.0], [0.26, 0.86, 0.28]), [0.0; 3]);
    for (x, z, size) in [(-2.12, -1.14, 1.0), (-1.88, -0.86, 0.85)] {
        let place = glam::Vec3::new(x, 0.9, z);
        let scale = glam::Vec3::splat(size);
        let motion =
            glam::Affine3A::from_scale_rotation_translation(scale, glam::Quat::IDENTITY, place);
        mesh.add(&FINE.pan(), motion);
        mesh.add_at(&block([x + 0.17, 0.985, z], [0.18, 0.016, 0.024]), [0.0; 3]);
    }
    mesh
}

/// The table and three chairs, and the shelf.
fn wood() -> Mesh {
    let mut mesh = Mesh::default();
    mesh.add(&table(1.3, 0.85, COARSE), placed(0.0, 0.75, 0.05));
    for (degrees, x, z) in [(8.0, 0.45, -0.58), (-10.0, 1.1, -0.55), (186.0, 1.0, 0.72)] {
        mesh.add(&chair(COARSE), placed(degrees, x, z));
    }
    mesh.add_at(&block([-2.2, 1.45, 0.6], [0.2, 0.03, 1.3]), [0.0; 3]);
    mesh.add_at(&block([-1.2, WORKTOP + 0.17, -1.96], [0.26, 0.36, 0.02]), [0.0; 3]);
    mesh
}

fn crockery() -> Mesh {
    let mut mesh = Mesh::default();
    let (plate, cup) = (FINE.plate(), FINE.cup());
    for (x, z) in [(0.40, -0.18), (1.05, -0.2), (1.0, 0.25)] {
        mesh.add_at(&plate, [x, TABLE_HEIGHT, z]);
        mesh.add_at(&cup, [x + 0.19, TABLE_HEIGHT, z + 0.02]);
    }
    mesh.add_at(&FINE.bowl(), [0.68, TABLE_HEIGHT, 0.05]);
    mesh.add_at(&FINE.jug(), [0.36, TABLE_HEIGHT, 0.22]);
    for layer in 0..6 {
        mesh.add_at(&plate, [1.35, WORKTOP + 0.011 * layer as f32, -1.7]);
    }
    for (k, z) in [0.1, 0.25, 0.4, 0.7, 0.85].into_iter().enumerate() {
        mesh.add_at(&cup, [-2.19 + 0.01 * (k % 2) as f32, 1.466, z]);
    }
    mesh.add_at(&FINE.bottle(0.30), [1.7, WORKTOP, -1.75]);
    mesh.add_at(&FINE.bottle(0.24), [1.82, WORKTOP, -1.68]);
    mesh.add_at(&FINE.bottle(0.28), [-0.95, WORKTOP, -1.78]);
    mesh
}

fn fruit() -> Mesh {
    let ball = Fineness { rounds: 3, sides: 48 };
    let mut mesh = Mesh::default();
    for (x, y, z, radius) in [
        (0.64, 0.02, 0.05, 0.038),
        (0.71, 0.02, 0.02, 0.036),
        (0.70, 0.02, 0.10, 0.037),
        (0.68, 0.072, 0.05, 0.036),
    ] {
        mesh.add_at(&ball.ball(radius), [x, TABLE_HEIGHT + y, z]);
    }
    mesh
}

/// Steam in swaths, thicker above the cooker, which stands at the left of the window, and thin everywhere.
fn fog() -> Grid {
    Grid::from_fn([48, 28, 44], |p| {
        let [x, y, z] = [4.6 * p[0], 2.6 * p[1], 4.2 * p[2]];
        let q = carried([1.3 * x, 1.1 * y, 1.3 * z], 0.5, SEED);
        let swaths = smoothstep(-0.25, 0.7, fractal(q, 4, SEED));
        let aside = (x - 0.4).powi(2) + (z - 1.0).powi(2);
        let plume = smoothstep(0.7, 1.5, y) / (1.0 + 2.5 * aside);
        0.25 + 0.5 * swaths + 0.25 * plume
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fog_varies_and_is_everywhere() {
        let fog = fog();
        let low = fog.values.iter().copied().fold(f32::INFINITY, f32::min);
        let high = fog.values.iter().copied().fold(0.0, f32::max);
        assert!(low >= 0.2 && high <= 1.0 && high > 2.5 * low, "{low} {high}");
    }
}
