use glam::Vec3;
#[derive(Debug, Clone, Copy)]
pub struct Segment { pub origin: Vec3, pub direction: Vec3, pub length: f32 }
