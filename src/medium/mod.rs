//! Phase functions and transmittance, as far as the engine evaluates them by itself.

pub mod phase;
mod transmittance;

pub use transmittance::{transmittance, TransmittanceTables, NO_TABLE};
