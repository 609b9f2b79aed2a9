//! Light's two ways: ray paths from the eye, walks from the lamps.

pub mod counters;
pub mod deposits;
pub mod footprint;
pub mod gather;
pub mod photons;
pub mod receivers;
pub mod tabulate;
pub mod view;
