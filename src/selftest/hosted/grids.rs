//! Smoke in grids of extreme values.

use crate::method::Method;
use crate::selftest::case::Case;
use crate::selftest::closed_forms::half_space;
use crate::selftest::trial::{Expected, Trial};
use crate::selftest::worlds::one_pass;
use crate::selftest::SelftestError;

pub const CASES: &[Case] = &[
    Case {
        name: "zero_grid",
        claim: "a grid of zeros shows the sky behind it",
        run: zero_grid,
    },
    Case {
        name: "negative_voxel",
        claim: "white smoke with a negative voxel, which counts as none, is 1 under a sky of radiance 1",
        run: negative_voxel,
    },
    Case {
        name: "huge_voxel",
        claim: "one voxel of optical depth 25, or 500, in an empty grid reflects as a half-space does",
        run: huge_voxel,
    },
    Case {
        name: "dense_grid",
        claim: "voxels of optical depth 10 reflect as a half-space does, seen at an angle",
        run: dense_grid,
    },
];

const GRID: &str = include_str!("../scenes/grid.xml");

/// Mitsuba's grid format: "VOL", version 3, type 1 (f32), size, channels, bounds, values.
fn grid(values: &[f32; 64]) -> Vec<u8> {
    let mut bytes = b"VOL\x03".to_vec();
    for integer in [1i32, 4, 4, 4, 1] {
        bytes.extend(integer.to_le_bytes());
    }
    for number in [0.0f32, 0.0, 0.0, 1.0, 1.0, 1.0].into_iter().chain(*values) {
        bytes.extend(number.to_le_bytes());
    }
    bytes
}

fn zero_grid(trial: &mut Trial) -> Result<(), SelftestError> {
    trial.bench.write("grid.vol", grid(&[0.0; 64]))?;
    let scene = trial.bench.load(GRID, &[])?;
    let lent = scene.lend(0)?;
    trial.film_by(&Method::ALL, "", lent.scene(), &one_pass(1000, 0.02), Expected::grey(1.0))
}

fn negative_voxel(trial: &mut Trial) -> Result<(), SelftestError> {
    let mut values = [1.0f32; 64];
    values[(2 * 4 + 2) * 4 + 2] = -1.0;
    trial.bench.write("grid.vol", grid(&values))?;
    let scene = trial.bench.load(GRID, &[("albedo", "1".to_owned())])?;
    let lent = scene.lend(0)?;
    let methods = [Method::Ppt, Method::Ppbt];
    let expected = Expected::grey(1.0).noticing(0.15);
    trial.film_by(&methods, "", lent.scene(), &one_pass(16_000, 0.05), expected)
}

/// The voxel at x, y, z in [0, 1/4] x [0, 1/4] x [1/4, 1/2]: its upper face is the box's. The window and the kernel keep to the
/// middle of the face, some free paths from its edges.
fn huge_voxel(trial: &mut Trial) -> Result<(), SelftestError> {
    let mut values = [0.0f32; 64];
    values[(3 * 4 + 2) * 4 + 2] = 1.0;
    trial.bench.write("grid.vol", grid(&values))?;
    let expected = Expected::grey(half_space(0.8, 1.0)).with_bias(0.02);
    for (scale, photons, methods, noticed) in [
        (100, 20_000, &[Method::Ppt, Method::Ppbt][..], 0.3),
        // Every photon that crosses the grid takes 2000 steps of delta tracking.
        (2000, 1500, &[Method::Ppt], 1.1),
    ] {
        let scene = trial.bench.load(GRID, &[("scale", scale.to_string())])?;
        let lent = scene.lend(0)?;
        let what = format!("sigma_t {scale}");
        let expected = expected.noticing(noticed);
        trial.film_by(methods, &what, lent.scene(), &one_pass(photons, 0.05), expected)?;
    }
    Ok(())
}

/// All voxels below the middle are dense, and the rays, whose cosine is 0.8, meet them within a step of the tables of
/// transmittance. The kernel is a fifth of a free path: beside the ray light comes from R tan(angle)/cos(angle) deeper or less
/// deep, a mean of squares of (0.75 R sigma_t)²/8.
fn dense_grid(trial: &mut Trial) -> Result<(), SelftestError> {
    let mut values = [0.0f32; 64];
    values[..32].fill(1.0);
    trial.bench.write("grid.vol", grid(&values))?;
    let defines = [
        ("scale", "40".to_owned()),
        ("origin", "0.6, 0, 0.8".to_owned()),
        ("target", "0, 0, 0".to_owned()),
    ];
    let scene = trial.bench.load(GRID, &defines)?;
    let lent = scene.lend(0)?;
    let expected = Expected::grey(half_space(0.8, 0.8)).with_bias(0.03);
    let methods = [Method::Ppt, Method::Ppbt];
    trial.film_by(&methods, "", lent.scene(), &one_pass(40_000, 0.01), expected)
}
