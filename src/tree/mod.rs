use crate::math::Segment;
use glam::Vec3;
pub struct ViewBeamTree(Vec<Segment>);
impl ViewBeamTree {
    pub fn build(s: &[Segment]) -> Self { Self(s.to_vec()) }
    pub fn query(&self, p: Vec3, radius: f32, mut visit: impl FnMut(u32, f32, f32)) {
        for (i, s) in self.0.iter().enumerate() {
            let t = (p - s.origin).dot(s.direction);
            if t < 0.0 || t >= s.length { continue; }
            let d2 = (p - s.origin - s.direction * t).length_squared();
            if d2 < radius * radius { visit(i as u32, t, d2) }
        }
    }
}
pub struct ViewPointTree(Vec<Vec3>);
impl ViewPointTree {
    pub fn build(s: &[Vec3]) -> Self { Self(s.to_vec()) }
    pub fn query(&self, p: Vec3, radius: f32, mut visit: impl FnMut(u32, f32)) {
        for (i, s) in self.0.iter().enumerate() {
            let d2 = (p - *s).length_squared();
            if d2 < radius * radius { visit(i as u32, d2) }
        }
    }
}
