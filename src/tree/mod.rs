//! Search structures that pair photons with what the camera sees.
//!
//! Two are built once per jitter of the view rays, over what the camera sees [Collin 2013 §5.1];
//! photons are shot, ask them, and are discarded. A photon that interacts in a medium, or the beam
//! that led it there, asks [`ViewBeamTree`] for the view beams around it; one that lands on a surface
//! asks [`ViewPointTree`] for the visible points.
//!
//! Beams that leave a pinhole are found in [`ApexGrid`] instead, which has the same pairs sooner; the tree then holds the
//! others.
//!
//! Two are built once per pass, over its photons, and asked by the view beams: [`PhotonDisks`]
//! [Jarosz 2008] has the pairs of [`ViewBeamTree::query`], [`PhotonBeams`] [Jarosz 2011] those of
//! [`ViewBeamTree::query_segment`], bit by bit. Both stand on the hierarchy [`Bvh`].
//!
//! None knows a radius: it shrinks from pass to pass and is an argument of each query.

pub mod apex_grid;
mod beam;
pub mod bvh;
mod interval;
pub mod photon_beams;
pub mod photon_disks;
pub mod view_beam;
pub mod view_point;

pub use apex_grid::ApexGrid;
pub use bvh::Bvh;
pub use photon_beams::PhotonBeams;
pub use photon_disks::PhotonDisks;
pub use view_beam::ViewBeamTree;
pub use view_point::ViewPointTree;

/// Bytes that a vector takes on the heap, its room to grow included.
pub(crate) fn heap_bytes<T>(values: &Vec<T>) -> usize {
    values.capacity() * size_of::<T>()
}

/// Most levels of planes in a tree; sizes the stack of a query.
pub const MAX_DEPTH: usize = 64;
