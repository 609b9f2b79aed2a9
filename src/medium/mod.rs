//! Phase functions and transmittance, as far as the engine evaluates them by itself.

pub mod phase;
mod transmittance;

pub use transmittance::{transmittance, TableStep, TransmittanceTables, NO_TABLE};
