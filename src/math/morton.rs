//! A curve through space that keeps neighbours together [Morton 1966].

use super::Aabb;
use glam::Vec3;

/// Bits of a cell's coordinate: three bytes to sort by for three axes, and cells that are small beside what is looked for.
const BITS: u32 = 8;
/// Cells along an axis.
const CELLS: f32 = (1 << BITS) as f32;

/// How far along a curve through the cells of a box a place lies, of all that are a number; places outside count as those at
/// its sides.
#[derive(Clone, Copy, Debug)]
pub struct MortonCurve {
    min: Vec3,
    scale: Vec3,
}

impl MortonCurve {
    pub fn through(bounds: &Aabb) -> Self {
        MortonCurve { min: bounds.min, scale: CELLS / bounds.extent() }
    }

    /// Below 2²⁴.
    #[inline]
    pub fn place(&self, p: Vec3) -> u32 {
        // A flat box divides by zero; the cast sends NaN to 0 and what is too large to the last cell.
        let cell = (p - self.min) * self.scale;
        interleave(cell.x as u32) | interleave(cell.y as u32) << 1 | interleave(cell.z as u32) << 2
    }
}

/// Spreads the bits of `x`, at most [`BITS`] after clamping, to every third place.
fn interleave(x: u32) -> u32 {
    let x = x.min((1 << BITS) - 1);
    let x = (x | x << 8) & 0x0000_f00f;
    let x = (x | x << 4) & 0x000c_30c3;
    (x | x << 2) & 0x0024_9249
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coordinates_take_turns_from_the_highest_bit_on() {
        let curve = MortonCurve::through(&Aabb { min: Vec3::ZERO, max: Vec3::ONE });
        // Cell 128 has only the highest of eight bits; z comes before y before x.
        let halves = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| curve.place(0.5 * axis));
        assert_eq!(halves, [1 << 21, 1 << 22, 1 << 23]);
        assert_eq!(curve.place(Vec3::ONE), (1 << 24) - 1);
        assert_eq!(curve.place(Vec3::splat(-1.0)), 0);
    }

    #[test]
    fn a_flat_box_orders_by_its_other_axes() {
        let curve = MortonCurve::through(&Aabb { min: Vec3::ZERO, max: Vec3::new(1.0, 1.0, 0.0) });
        assert!(curve.place(Vec3::new(0.1, 0.1, 0.0)) < curve.place(Vec3::new(0.1, 0.6, 0.0)));
    }
}
