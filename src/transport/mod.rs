//! Light's two ways: ray paths from the eye, walks from the lamps.

pub mod asked;
mod beam_sample;
pub mod cone;
pub mod connect;
pub mod counters;
pub mod deposits;
pub mod emission_rays;
pub mod extent;
pub mod footprint;
pub mod gather;
mod guided;
mod lessons;
pub mod memory;
pub mod numbers;
mod overlap;
pub mod pairs;
pub mod photon;
pub mod photon_beam;
pub mod photon_map;
pub mod photons;
pub mod receivers;
pub mod splat;
pub mod store;
pub mod tabulate;
pub mod view;
pub mod walks;
pub mod wavelengths;
