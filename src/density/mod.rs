//! Kernels and their radii: how a photon's flux becomes radiance.

pub mod kernel;
pub mod radius;
