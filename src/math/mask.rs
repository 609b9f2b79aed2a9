//! Comparisons of several numbers at once, a bit for each.

use glam::{BVec4A, Vec4};

/// Bits of a comparison that is made for four numbers in one instruction.
#[inline]
fn mask<const N: usize>(a: &[f32; N], b: &[f32; N], compare: impl Fn(Vec4, Vec4) -> BVec4A) -> u32 {
    const { assert!(N % 4 == 0 && N <= 32) };
    let quads = a.chunks_exact(4).zip(b.chunks_exact(4)).enumerate();
    quads.fold(0, |bits, (quad, (a, b))| {
        bits | compare(Vec4::from_slice(a), Vec4::from_slice(b)).bitmask() << (4 * quad)
    })
}

/// A bit for each number that is below its partner, from the lowest bit on.
#[inline]
pub fn below<const N: usize>(a: &[f32; N], b: &[f32; N]) -> u32 {
    mask(a, b, Vec4::cmplt)
}

/// A bit for each number that is at most its partner, from the lowest bit on.
#[inline]
pub fn at_most<const N: usize>(a: &[f32; N], b: &[f32; N]) -> u32 {
    mask(a, b, Vec4::cmple)
}

/// Calls `visit` for the places of the bits that are set, from the lowest on; all must be below `LANES`.
#[inline]
pub fn for_each_lane<const LANES: usize>(mut set: u32, mut visit: impl FnMut(usize)) {
    const { assert!(LANES.is_power_of_two() && LANES <= 32) };
    while set != 0 {
        // The remainder spares a caller's index its check.
        visit(set.trailing_zeros() as usize % LANES);
        set &= set - 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn number() -> impl Strategy<Value = f32> {
        prop_oneof![
            Just(f32::NAN),
            Just(0.0),
            Just(-0.0),
            Just(1.0),
            Just(f32::INFINITY),
            -2.0f32..2.0
        ]
    }

    proptest! {
        /// As Rust's own comparisons, one by one.
        #[test]
        fn bits_are_those_of_single_comparisons(
            a in prop::array::uniform8(number()),
            b in prop::array::uniform8(number()),
        ) {
            for lane in 0..8 {
                prop_assert_eq!(below(&a, &b) >> lane & 1 == 1, a[lane] < b[lane]);
                prop_assert_eq!(at_most(&a, &b) >> lane & 1 == 1, a[lane] <= b[lane]);
            }
            prop_assert_eq!((below(&a, &b) | at_most(&a, &b)) >> 8, 0);
        }

        /// The lanes are those whose bits a shift finds.
        #[test]
        fn lanes_are_visited_in_order(set in 0u32..=255) {
            let mut visited = Vec::new();
            for_each_lane::<8>(set, |lane| visited.push(lane));
            let expected: Vec<usize> = (0..8).filter(|lane| set >> lane & 1 == 1).collect();
            prop_assert_eq!(visited, expected);
        }
    }
}
