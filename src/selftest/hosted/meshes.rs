//! Triangles that are hardly any.

use crate::method::Method;
use crate::selftest::case::Case;
use crate::selftest::trial::{Expected, Trial};
use crate::selftest::worlds::{one_pass, POINTS};
use crate::selftest::SelftestError;
use std::f64::consts::PI;
use std::fmt::Write;

pub const CASES: &[Case] = &[
    Case {
        name: "needles",
        claim: "a floor of needles of 1e-6 and triangles of no area shows its reflectance under a sky of radiance 1",
        run: needles,
    },
    Case {
        name: "needle_lamp",
        claim: "a lamp of one needle 1e-5 wide and triangles of no area lights a floor as a line does",
        run: needle_lamp,
    },
    Case {
        name: "wound_against_normals",
        claim: "a box of reflectance 1/2 whose triangles turn their backs on their own vertex normals, and on its walls' \
                radiance of 1, shows a radiance of 2",
        run: wound_against_normals,
    },
];

const FLOOR: &str = include_str!("../scenes/needle_floor.xml");
const LAMP: &str = include_str!("../scenes/needle_lamp.xml");
const BOX: &str = include_str!("../scenes/box_of_light.xml");

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

/// A strip from y = -1 to 1 that faces down, and triangles on one point and on one edge of it.
fn strip_mesh(width: f64) -> String {
    let mut obj = String::new();
    let half = 0.5 * width;
    for (x, y) in [(-half, -1), (-half, 1), (half, 1), (half, -1)] {
        writeln!(obj, "v {x:.9} {y} 1").expect("a string takes all");
    }
    obj + "f 1 2 3\nf 1 3 4\nf 2 2 2\nf 1 2 2\n"
}

/// Below the middle of a line of length 2 at a height of 1 irradiance is `radiance width int_-1^1 (1+y²)^-2 dy`, which
/// is `1/2 + pi/4`. Within the kernel's disk it falls by less than R² of it.
fn needle_lamp(trial: &mut Trial) -> Result<(), SelftestError> {
    let width: f64 = 1e-5;
    trial.bench.write("strip.obj", strip_mesh(width))?;
    let scene = trial.bench.load(LAMP, &[("radiance", (1.0 / width).to_string())])?;
    let lent = scene.lend(0)?;
    let radius = 0.1;
    let irradiance = 0.5 + 0.25 * PI;
    let expected = Expected::grey(irradiance * 0.5 / PI).with_bias(radius * radius);
    trial.film_by(&POINTS, "", lent.scene(), &one_pass(40_000, radius), expected)
}

/// The box of edge 2 around the origin, wound to face outward, with vertex normals that point inward.
fn inside_out_box() -> String {
    let (mut obj, mut faces) = (String::new(), 0);
    for axis in 0..3 {
        for side in [-1.0, 1.0] {
            let corner = |u: f64, v: f64| {
                let mut p = [0.0; 3];
                p[axis] = side;
                p[(axis + 1) % 3] = u;
                p[(axis + 2) % 3] = v * side;
                p
            };
            for [x, y, z] in
                [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]
            {
                writeln!(obj, "v {x} {y} {z}").expect("a string takes all");
            }
            let mut normal = [0.0; 3];
            normal[axis] = -side;
            let [x, y, z] = normal;
            faces += 1;
            let [a, b, c, d] = [3, 2, 1, 0].map(|before| 4 * faces - before);
            writeln!(
                obj,
                "vn {x} {y} {z}\nf {a}//{faces} {b}//{faces} {c}//{faces}\nf {a}//{faces} {c}//{faces} {d}//{faces}"
            )
            .expect("a string takes all");
        }
    }
    obj
}

/// `L = 1 + L / 2`.
fn wound_against_normals(trial: &mut Trial) -> Result<(), SelftestError> {
    trial.bench.write("box.obj", inside_out_box())?;
    let scene = trial.bench.load(BOX, &[])?;
    let lent = scene.lend(0)?;
    let expected = Expected::grey(2.0);
    trial.film_by(&Method::ALL, "", lent.scene(), &one_pass(20_000, 0.25), expected)
}
