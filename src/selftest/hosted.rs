//! Scenes in Mitsuba: nested media, glass, meshes, grids, skies, films.

use super::case::Case;
use super::closed_forms::half_space;
use super::trial::{Expected, Trial};
use super::worlds::{one_pass, POINTS};
use super::SelftestError;
use crate::method::{Method, Parameters};
use std::f64::consts::PI;
use std::fmt::Write;

pub const CASES: &[Case] = &[
    Case {
        name: "nested_media",
        claim: "white fog in white fog under a sky of radiance 1 is 1, from outside, inside, on and at every boundary",
        run: nested_media,
    },
    Case {
        name: "overlapping_media",
        claim: "white fogs that overlap, with boundaries that contradict each other, show no more than their sky",
        run: overlapping_media,
    },
    Case {
        name: "moved_media",
        claim: "white fog in white fog is 1 at 10 and 100 from the origin of Mitsuba's f32 coordinates",
        run: moved_media,
    },
    Case {
        name: "inside_glass",
        claim: "within glass that lies in white fog under a sky of radiance 1 it is n² = 2.25, with fog in the glass or not",
        run: inside_glass,
    },
    Case {
        name: "double_glazing",
        claim: "panes 1e-4 apart with N boundaries of reflectance r pass (1-r)/(1+(N-1)r), to the eye and to photons",
        run: double_glazing,
    },
    Case {
        name: "needles",
        claim: "a floor of needles of 1e-6 and triangles of no area shows its reflectance under a sky of radiance 1",
        run: needles,
    },
    Case {
        name: "small_lamp",
        claim: "a lamp of radius 1e-5 lights a floor as a point does: pi r² radiance reflectance/pi",
        run: small_lamp,
    },
    Case {
        name: "bright_pixel",
        claim: "under a sky with one pixel 1e8 brighter a floor is what Mitsuba's path tracer says",
        run: bright_pixel,
    },
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
        claim: "one voxel of optical depth 25 in an empty grid reflects as a half-space does",
        run: huge_voxel,
    },
    Case {
        name: "dense_grid",
        claim: "voxels of optical depth 10 reflect as a half-space does, seen at an angle",
        run: dense_grid,
    },
    Case {
        name: "one_pixel",
        claim: "films of 1 x 1 show what others show",
        run: one_pixel,
    },
    Case {
        name: "empty_scene",
        claim: "a sky alone is 1; fog without bounds hides it",
        run: empty_scene,
    },
];

const FURNACE: &str = include_str!("scenes/furnace_boxes.xml");
const GLASS: &str = include_str!("scenes/inside_glass.xml");
const GLAZING: &str = include_str!("scenes/double_glazing.xml");
const FLOOR: &str = include_str!("scenes/needle_floor.xml");
const LAMP: &str = include_str!("scenes/small_lamp.xml");
const SKY: &str = include_str!("scenes/bright_pixel.xml");
const GRID: &str = include_str!("scenes/grid.xml");
const EMPTY: &str = include_str!("scenes/empty.xml");

/// Parallel rays that stand on the boundaries: what the kernel covers beside a ray begins and ends where the ray
/// does, so that it blurs nothing.
fn nested_media(trial: &mut Trial) -> Result<(), SelftestError> {
    for (what, z, medium) in [
        ("outside", "3", "vacuum"),
        ("on the boundary", "1", "vacuum"),
        ("on its inside", "1", "outer"),
        ("inside", "0.75", "outer"),
        ("in the inner", "0", "inner"),
    ] {
        let defines = [("z", z.to_owned()), ("camera_medium", medium.to_owned())];
        let scene = trial.bench.load(FURNACE, &defines)?;
        let lent = scene.lend(0)?;
        let methods: &[Method] = if z == "3" { &Method::ALL } else { &[Method::Ppt, Method::Ppbt] };
        let parameters = one_pass(3000, 0.25);
        trial.film_by(methods, what, lent.scene(), &parameters, Expected::grey(1.0))?;
    }
    Ok(())
}

/// The boxes overlap by half; each says that vacuum is outside of it. Light is then not reciprocal: photons and view rays
/// that come from different sides disagree on the medium between them, and what one of them calls vacuum is dark.
fn overlapping_media(trial: &mut Trial) -> Result<(), SelftestError> {
    let defines = [("inner_x", "0.6".to_owned()), ("outside", "vacuum".to_owned())];
    let scene = trial.bench.load(FURNACE, &defines)?;
    let lent = scene.lend(0)?;
    for method in Method::ALL {
        let parameters = Parameters { method, ..one_pass(3000, 0.25) };
        trial.at_most(method.name(), lent.scene(), &parameters, 1.0)?;
    }
    Ok(())
}

/// Mitsuba moves rays off a boundary by 9e-5 of the coordinate, so that light goes in past a layer of optical depth
/// 4 times that, which scatters what comes out: at most this share more.
fn moved_media(trial: &mut Trial) -> Result<(), SelftestError> {
    for x in [10.0, 100.0] {
        let scene = trial.bench.load(FURNACE, &[("x", x.to_string())])?;
        let lent = scene.lend(0)?;
        let expected = Expected::grey(1.0).with_bias(4.0 * 9e-5 * x);
        let what = format!("by {x:.0e}");
        trial.film_by(&Method::ALL, &what, lent.scene(), &one_pass(3000, 0.25), expected)?;
    }
    Ok(())
}

/// From the middle all rays meet the glass at right angles. Where the glass holds fog, the kernel reaches past the end of
/// a ray by R²/2 at most.
fn inside_glass(trial: &mut Trial) -> Result<(), SelftestError> {
    for sigma_t in ["1", "0"] {
        let scene = trial.bench.load(GLASS, &[("sigma_t", sigma_t.to_owned())])?;
        let lent = scene.lend(0)?;
        let expected = Expected::grey(2.25).with_bias(0.02).noticing(0.6);
        let what = format!("sigma_t {sigma_t}");
        trial.film_by(
            &[Method::Ppt, Method::PptMetro, Method::Ppbt],
            &what,
            lent.scene(),
            &one_pass(4000, 0.2),
            expected,
        )?;
    }
    Ok(())
}

/// Light that is reflected between any number of boundaries. At n = 30 each reflects 0.876: half of the light takes more than
/// some 20 reflections, and 1e-3 of it more than 200.
fn double_glazing(trial: &mut Trial) -> Result<(), SelftestError> {
    for index in [1.5f64, 30.0] {
        let reflected = ((index - 1.0) / (index + 1.0)).powi(2);
        let passed = (1.0 - reflected) / (1.0 + 3.0 * reflected);
        let defines = [("ior", index.to_string())];
        let scene = trial.bench.load(GLAZING, &defines)?;
        let lent = scene.lend(0)?;
        let limits = crate::scene::PathLimits { rr_depth: 200, ..one_pass(1, 0.1).limits };
        let parameters = Parameters { limits, passes: 50, ..one_pass(1, 0.1) };
        let expected = Expected::grey(passed);
        trial.film(&format!("seen, n {index}"), lent.scene(), &parameters, expected)?;
    }
    let defines = [
        ("ior", "1.5".to_owned()),
        ("lamp", "directionalarea".to_owned()),
        ("floor", "0.5".to_owned()),
        ("origin", "0, -1, -1".to_owned()),
        ("target", "0, 0, -2".to_owned()),
    ];
    let scene = trial.bench.load(GLAZING, &defines)?;
    let lent = scene.lend(0)?;
    let expected = Expected::grey(0.5 / PI * 0.96 / 1.12);
    trial.film_by(&POINTS, "lit", lent.scene(), &one_pass(20_000, 0.3), expected)
}

/// Strips of 1e-3, of 1e-6 between them, and a triangle on one point and one on one edge for each.
fn needle_mesh() -> String {
    let mut obj = String::new();
    let quad = |x0: f64, x1: f64, obj: &mut String, first: usize| {
        for (x, y) in [(x0, -1), (x1, -1), (x1, 1), (x0, 1)] {
            writeln!(obj, "v {x:.7} {y} 0").expect("a string takes all");
        }
        let [a, b, c, d] = [first, first + 1, first + 2, first + 3];
        writeln!(obj, "f {a} {b} {c}\nf {a} {c} {d}\nf {a} {b} {b}\nf {c} {c} {c}")
            .expect("a string takes all");
    };
    for strip in 0..1000 {
        let x = -1.0 + 0.002 * f64::from(strip);
        let first = 8 * strip as usize + 1;
        quad(x, x + 1e-6, &mut obj, first);
        quad(x + 1e-6, x + 0.002, &mut obj, first + 4);
    }
    obj
}

fn needles(trial: &mut Trial) -> Result<(), SelftestError> {
    trial.bench.write("needles.obj", needle_mesh())?;
    let scene = trial.bench.load(FLOOR, &[])?;
    let lent = scene.lend(0)?;
    let expected = Expected::grey(0.5);
    trial.film_by(&Method::ALL, "", lent.scene(), &one_pass(3000, 0.25), expected)
}

/// Irradiance 1 below the lamp. Within the kernel's disk it falls as (1 + r²)^-2, to 1 - R² on average.
fn small_lamp(trial: &mut Trial) -> Result<(), SelftestError> {
    let radius: f64 = 1e-5;
    let defines =
        [("radius", radius.to_string()), ("radiance", (1.0 / (PI * radius * radius)).to_string())];
    let scene = trial.bench.load(LAMP, &defines)?;
    let lent = scene.lend(0)?;
    let expected = Expected::grey(0.5 / PI).with_bias(0.01);
    trial.film_by(&POINTS, "", lent.scene(), &one_pass(60_000, 0.1), expected)
}

/// 64 x 32 pixels of 1, and one of 1e8 at 45° above the horizon.
fn write_sky(trial: &Trial) -> Result<(), SelftestError> {
    let bright = |x, y| if (x, y) == (20, 8) { 1e8f32 } else { 1.0 };
    let pixel = |x, y| (bright(x, y), bright(x, y), bright(x, y));
    exr::prelude::write_rgb_file(trial.bench.path("sky.exr"), 64, 32, pixel)
        .map_err(|error| SelftestError::Files(std::io::Error::other(error)))
}

/// `path` chooses directions by the sky's brightness, so that it holds hardly any noise.
fn bright_pixel(trial: &mut Trial) -> Result<(), SelftestError> {
    write_sky(trial)?;
    let scene = trial.bench.load(SKY, &[])?;
    let seen = trial.seen_by_mitsuba(&scene, "path", 4096)?;
    let lent = scene.lend(0)?;
    let expected = Expected::rgb(seen).with_bias(0.01);
    trial.film_by(&POINTS, "", lent.scene(), &one_pass(3000, 0.25), expected)
}

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
    let scene = trial.bench.load(GRID, &[("scale", "100".to_owned())])?;
    let lent = scene.lend(0)?;
    let expected = Expected::grey(half_space(0.8, 1.0)).with_bias(0.02);
    let methods = [Method::Ppt, Method::Ppbt];
    trial.film_by(&methods, "", lent.scene(), &one_pass(16_000, 0.05), expected)
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

fn one_pixel(trial: &mut Trial) -> Result<(), SelftestError> {
    let (radius, radiance) = (0.1f64, 100.0 / PI);
    let defines = [
        ("film", "1".to_owned()),
        ("radius", radius.to_string()),
        ("radiance", radiance.to_string()),
    ];
    let scene = trial.bench.load(LAMP, &defines)?;
    let lent = scene.lend(0)?;
    let expected = Expected::grey(0.5 / PI).with_bias(0.01);
    trial.film_by(&POINTS, "floor", lent.scene(), &one_pass(60_000, 0.1), expected)?;
    drop(lent);
    drop(scene);
    // Radii are chosen by the spacing of pixels, of which there is one.
    let scene = trial.bench.load(EMPTY, &[])?;
    let lent = scene.lend(0)?;
    let automatic = one_pass(1000, 0.0);
    trial.film_by(&Method::ALL, "sky", lent.scene(), &automatic, Expected::grey(1.0))
}

fn empty_scene(trial: &mut Trial) -> Result<(), SelftestError> {
    for (sigma_t, seen) in [("0", 1.0), ("1", 0.0)] {
        let defines = [("film", "4".to_owned()), ("sigma_t", sigma_t.to_owned())];
        let scene = trial.bench.load(EMPTY, &defines)?;
        let lent = scene.lend(0)?;
        let what = format!("sigma_t {sigma_t}");
        let automatic = one_pass(1000, 0.0);
        trial.film_by(&Method::ALL, &what, lent.scene(), &automatic, Expected::grey(seen))?;
    }
    Ok(())
}
