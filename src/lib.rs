//! Visibility-driven progressive volume photon tracing (Collin et al. 2013): the engine, and a native
//! integrator plugin for Mitsuba 3 around it.
//!
//! ```text
//! scene::Scene              a renderer's scene, asked in batches (host: Mitsuba; analytic: closed forms)
//! plan                      what of all this the scene calls for
//! transport::view           ray paths from the eye: view beams, visible points
//! tree                      kd-trees over both
//! transport::photons        walks from the lamps, splat and discard
//! density                   kernels and radii by pass number
//! film                      running mean over passes and jitters
//! method                    one loop per method, parameters, statistics
//! ```
//!
//! `report` (errors, curves, plots) and `picture` (layers, files) stand alone. Dependencies run one way, down this list read from its middle: `math ← medium ← scene ← {plan, tree} ←
//! transport ← film ← method ← host ← selftest`. Symbols and equations: `docs/EQUATIONS.md`.

pub mod analytic;
pub mod crew;
pub mod density;
pub mod effect;
pub mod film;
pub mod guide;
pub mod host;
pub mod markov;
pub mod math;
pub mod medium;
pub mod method;
pub mod part;
pub mod picture;
pub mod plan;
pub mod report;
pub mod scene;
pub mod selftest;
pub mod transport;
pub mod tree;
