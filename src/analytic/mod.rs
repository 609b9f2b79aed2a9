//! Closed-form scenes in pure Rust, by which the physics of the engine is proved without Mitsuba.
//!
//! A [`World`] is a handful of spheres and rectangles, fogs whose optical depth has a formula, and
//! lamps; its answers are short enough to be checked by eye. Where a render of it differs from a
//! radiance that was worked out on paper, the engine is wrong, and where the engine agrees here but
//! not in Mitsuba, the host is. `tests/analytic.rs` is that comparison.
//!
//! Inside, everything is `f64`; only the seam is `f32`. Lengths may have any scale: how close a ray sees
//! its own surface goes by the size of its coordinates ([`CLEARANCE`]).

mod camera;
mod dielectric;
mod emission;
mod fog;
mod hosting;
mod lamp_light;
mod phase;
mod photon_walk;
mod ray;
mod shape;
mod surface;
mod view_walk;
mod warp;
mod world;

pub use camera::{Camera, Projection};
pub use emission::Lamp;
pub use fog::{Fog, Profile};
pub use ray::CLEARANCE;
pub use shape::Shape;
pub use surface::{Material, Surface};
pub use world::{Contents, Disclosure, Spectrum, World, FILM_CHANNELS};

use crate::scene::PathLimits;

/// One lane's uniform number out of planes of them.
fn number(numbers: &[f32], lanes: usize, dimension: usize, lane: usize) -> f64 {
    f64::from(numbers[dimension * lanes + lane])
}

/// Whether a path with this many scattering events may have one more: with `k` of them it is kept
/// while `k < max_depth`.
fn may_scatter(limits: &PathLimits, depth: u32) -> bool {
    depth + 1 < limits.max_depth
}
