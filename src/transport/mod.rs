//! Light's two ways: ray paths from the eye, walks from the lamps.

pub mod footprint;
pub mod photons;
pub mod receivers;
pub mod view;
