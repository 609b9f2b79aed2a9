//! The meshes of `breakfast_hall`: a hall with five tall windows, eight tables laid for breakfast.
//!
//! Metres. The inside is x in [-8, 8], y in [0, 4.8], z in [-3.5, 3.5]; the windows are in the wall z = 3.5.

use super::crockery::Fineness;
use super::furniture::{chair, placed, table, TABLE_HEIGHT};
use super::mesh::Mesh;
use super::solids::{block, cuboid, lathe};
use super::Asset;

const HALF_LENGTH: f32 = 8.0;
const HALF_WIDTH: f32 = 3.5;
const HEIGHT: f32 = 4.8;
/// Thickness of walls.
const WALL: f32 = 0.4;
const WINDOWS: [f32; 5] = [-6.0, -3.0, 0.0, 3.0, 6.0];
const WINDOW_WIDTH: f32 = 1.7;
const SILL: f32 = 0.9;
const LINTEL: f32 = 3.9;

const FINE: Fineness = Fineness { rounds: 3, sides: 72 };
const COARSE: Fineness = Fineness { rounds: 2, sides: 20 };

pub fn assets() -> Vec<(&'static str, Asset)> {
    let (crockery, wood) = laid_tables();
    vec![
        ("walls.ply", Asset::Mesh(walls())),
        ("frames.ply", Asset::Mesh(frames())),
        ("wood.ply", Asset::Mesh(wood)),
        ("crockery.ply", Asset::Mesh(crockery)),
        ("brass.ply", Asset::Mesh(lamps())),
        ("trunks.ply", Asset::Mesh(trees(&COARSE.leg(2.4, 0.22), 0.0))),
        ("leaves.ply", Asset::Mesh(trees(&crown(), 1.9))),
    ]
}

/// Ceiling and walls. Pieces overlap and are never flush with each other.
fn walls() -> Mesh {
    let (x, z) = (HALF_LENGTH, HALF_WIDTH);
    let (low, high) = (-0.3, HEIGHT + 0.05);
    let mut mesh = cuboid([-x - WALL, HEIGHT, -z - WALL], [x + WALL, HEIGHT + 0.3, z + WALL]);
    let mut wall = |low: [f32; 3], high: [f32; 3]| mesh.add_at(&cuboid(low, high), [0.0; 3]);
    wall([-x - WALL, low, -z - WALL], [x + WALL, high, -z]);
    wall([-x - WALL, low, -z - 0.1], [-x, high - 0.01, z + 0.1]);
    wall([x, low, -z - 0.1], [x + WALL, high - 0.01, z + 0.1]);
    let mut from = -x - 0.3;
    for centre in WINDOWS {
        wall([from, low, z], [centre - 0.5 * WINDOW_WIDTH, high, z + WALL]);
        from = centre + 0.5 * WINDOW_WIDTH;
        let (left, right) = (centre - 0.5 * WINDOW_WIDTH - 0.05, from + 0.05);
        wall([left, low, z + 0.01], [right, SILL, z + WALL - 0.01]);
        wall([left, LINTEL, z + 0.01], [right, high, z + WALL - 0.01]);
    }
    wall([from, low, z], [x + 0.3, high, z + WALL]);
    mesh
}

/// Window bars, beyond the fog's end.
fn frames() -> Mesh {
    let mut mesh = Mesh::default();
    let z = HALF_WIDTH + 0.28;
    for centre in WINDOWS {
        for step in -2..=2 {
            let x = centre + step as f32 * 0.25 * (WINDOW_WIDTH - 0.04);
            mesh.add_at(&block([x, 2.4, z], [0.05, LINTEL - SILL + 0.04, 0.06]), [0.0; 3]);
        }
        for step in 0..=4 {
            let y = SILL + step as f32 * 0.25 * (LINTEL - SILL);
            mesh.add_at(&block([centre, y, z], [WINDOW_WIDTH + 0.04, 0.05, 0.05]), [0.0; 3]);
        }
    }
    mesh
}

/// Crockery, and everything of wood: tables, chairs, beams, the sideboard.
fn laid_tables() -> (Mesh, Mesh) {
    let (mut crockery, mut wood) = (Mesh::default(), Mesh::default());
    let (table, chair, service) = (table(1.7, 0.95, COARSE), chair(COARSE), service());
    for (row, z) in [-1.5f32, 1.4].into_iter().enumerate() {
        for (place, x) in [-4.9f32, -1.7, 1.5, 4.7].into_iter().enumerate() {
            wood.add(&table, placed(0.0, x, z));
            crockery.add(&service, placed(180.0 * ((row + place) % 2) as f32, x, z));
            for (side, seat) in [(0.0, -0.62), (180.0, 0.62)] {
                for (end, along) in [-0.42, 0.42].into_iter().enumerate() {
                    // Nobody puts chairs back in line.
                    let askew = 7.0 * ((3 * row + 5 * place + 2 * end) % 5) as f32 - 14.0;
                    wood.add(&chair, placed(side + askew, x + along, z + seat));
                }
            }
        }
    }
    for x in [-7.4, -4.5, -1.5, 1.5, 4.5, 7.4] {
        let beam = block([x, HEIGHT - 0.08, 0.0], [0.24, 0.34, 2.0 * HALF_WIDTH + 0.1]);
        wood.add_at(&beam, [0.0; 3]);
    }
    wood.add_at(&sideboard(), [HALF_LENGTH - 0.28, 0.0, -0.6]);
    (crockery, wood)
}

/// Four places with plate, saucer and cup, and a jug and a bowl in the middle.
fn service() -> Mesh {
    let (plate, cup) = (FINE.plate(), FINE.cup());
    let mut mesh = Mesh::default();
    for (x, z) in [(-0.42f32, -0.28f32), (0.42, -0.28), (-0.42, 0.28), (0.42, 0.28)] {
        mesh.add_at(&plate, [x, TABLE_HEIGHT, z]);
        let (x, z) = (x + 0.24 * x.signum(), 0.55 * z);
        mesh.add(&plate, placed(0.0, x, z) * glam::Affine3A::from_scale(glam::Vec3::splat(0.6)));
        let last = mesh.positions.len() - plate.positions.len();
        mesh.positions[last..].iter_mut().for_each(|p| p.y += TABLE_HEIGHT);
        mesh.add_at(&cup, [x, TABLE_HEIGHT + 0.006, z]);
    }
    mesh.add_at(&FINE.jug(), [-0.1, TABLE_HEIGHT, 0.02]);
    mesh.add_at(&FINE.bowl(), [0.13, TABLE_HEIGHT, -0.03]);
    mesh
}

fn sideboard() -> Mesh {
    let mut mesh = block([0.0, 0.45, 0.0], [0.5, 0.9, 2.4]);
    mesh.add_at(&block([0.0, 0.92, 0.0], [0.56, 0.04, 2.5]), [0.0; 3]);
    for door in 0..4 {
        let z = -0.885 + 0.59 * door as f32;
        mesh.add_at(&block([-0.258, 0.45, z], [0.03, 0.74, 0.53]), [0.0; 3]);
    }
    mesh
}

/// Unlit pendant lamps: a rod and a shade each.
fn lamps() -> Mesh {
    let shade =
        [[0.03, 0.30], [0.06, 0.27], [0.24, 0.02], [0.25, 0.0], [0.235, 0.01], [0.03, 0.26]];
    let shade = lathe(&shade.map(|[r, y]| [r, 0.3 - y]), 48);
    let rod = lathe(&[[0.0, 0.0], [0.012, 0.0], [0.012, 2.3], [0.0, 2.3]], 12);
    let mut mesh = Mesh::default();
    for x in [-4.9, -1.7, 1.5, 4.7] {
        let upside_down = glam::Affine3A::from_rotation_translation(
            glam::Quat::from_rotation_x(std::f32::consts::PI),
            glam::Vec3::new(x, 2.6, -0.05),
        );
        mesh.add(&shade, upside_down);
        mesh.add_at(&rod, [x, 2.55, -0.05]);
    }
    mesh
}

/// A heap of tufts around the axis, 3 m high.
fn crown() -> Mesh {
    let tuft = Fineness { rounds: 2, sides: 24 }.ball(0.42);
    let mut mesh = Mesh::default();
    for k in 0..70 {
        // Turned by the golden angle from tuft to tuft, they cover the crown evenly.
        let (sin, cos) = (2.399_963 * k as f32).sin_cos();
        let height = k as f32 / 69.0;
        let reach = 1.25 * (1.0 - (2.0 * height - 0.9).powi(2)).max(0.0).sqrt();
        mesh.add_at(&tuft, [reach * cos, 2.6 * height - 0.3, reach * sin]);
    }
    mesh
}

/// One part of each tree in the garden, so high above the ground.
fn trees(part: &Mesh, height: f32) -> Mesh {
    let mut mesh = Mesh::default();
    for (x, z, size) in [
        (-9.0, 14.0, 1.1),
        (-2.0, 17.0, 1.4),
        (5.0, 13.0, 1.0),
        (12.0, 16.0, 1.3),
        (20.0, 12.0, 1.2),
    ] {
        let place = glam::Vec3::new(x, size * height - 0.3, z);
        let motion = glam::Affine3A::from_scale_rotation_translation(
            glam::Vec3::splat(size),
            glam::Quat::IDENTITY,
            place,
        );
        mesh.add(part, motion);
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hall_has_about_the_polygons_of_the_paper() {
        let faces: usize = assets()
            .iter()
            .map(|(_, asset)| match asset {
                Asset::Mesh(mesh) => mesh.faces.len(),
                Asset::Grid(_) => 0,
            })
            .sum();
        assert!((1_200_000..2_000_000).contains(&faces), "{faces}");
    }
}
