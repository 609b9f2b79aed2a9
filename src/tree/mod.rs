//! The two kd-trees over what the camera sees [Collin 2013 §5.1].
//!
//! Photons are shot and discarded; the trees stay. A photon that interacts in a medium asks
//! [`ViewBeamTree`] for the view beams around it, one that lands on a surface asks
//! [`ViewPointTree`] for the visible points. Neither tree knows a radius: it shrinks from pass to
//! pass and is an argument of each query.

pub mod view_beam;
pub mod view_point;

pub use view_beam::ViewBeamTree;
pub use view_point::ViewPointTree;

/// Most levels of planes in a tree; sizes the stack of a query.
pub const MAX_DEPTH: usize = 64;
