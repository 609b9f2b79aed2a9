//! Vectors, colours, boxes, segments and random numbers. Depends on nothing else in the crate.

mod aabb;
mod rgb;
mod segment;
pub mod uniform;

pub use aabb::Aabb;
pub use rgb::Rgb;
pub use segment::Segment;
