//! Vectors, directions, colours, boxes, segments and random numbers. Depends on nothing else in the crate.

mod aabb;
mod approach;
mod brightness;
mod four_segments;
pub mod mask;
mod morton;
mod octahedral;
mod rgb;
mod segment;
pub mod srgb;
pub mod uniform;
mod vec3x4;

pub use aabb::Aabb;
pub use approach::Approach;
pub use brightness::brightness;
pub use four_segments::FourSegments;
pub use morton::MortonCurve;
pub use octahedral::Octahedral;
pub use rgb::Rgb;
pub use segment::Segment;
pub use vec3x4::Vec3x4;
