use super::WIDER;

/// Slopes of the two lines through the origin that touch a circle; none where it reaches the plane of the origin.
#[inline]
pub(super) fn tangents(x: f32, z: f32, radius: f32) -> Option<[f32; 2]> {
    if z <= radius * (1.0 + WIDER) {
        return None;
    }
    let touching = radius * (x * x + (z - radius) * (z + radius)).sqrt();
    let scale = 1.0 / ((z - radius) * (z + radius));
    Some([(x * z - touching) * scale, (x * z + touching) * scale])
}
