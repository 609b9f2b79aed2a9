//! Small steps in primary sample space, and the size that finds itself.

use crate::math::uniform::BELOW_ONE;

/// Size of the first mutations. [Collin 2013 §6.1]
const INITIAL_SIZE: f64 = 0.1;
/// Share of the mutations that ought to be accepted. [Hachisuka 2011]
const TARGET_ACCEPTANCE: f64 = 0.234;
/// Below, a step is less than single precision resolves; above, the torus has no longer one.
const SIZES: std::ops::RangeInclusive<f64> = 1e-3..=1.0;

/// Polynomials through Chebyshev nodes: `log2(1 + x) / x` for `x` in [0, 1] and `2^x` in [-1/2, 1/2].
const LOG2: [f32; 5] = [1.442_615_7, -0.717_063_9, 0.442_274_2, -0.227_712_64, 0.059_945_6];
const EXP2: [f32; 5] = [1.000_000_1, 0.693_121, 0.240_221_07, 0.055_922_04, 0.009_676_04];
/// 1.5 times 2 to the power of the bits behind the point.
const ROUNDER: f32 = 12_582_912.0;

/// Small steps of one size.
#[derive(Debug, Clone, Copy)]
pub struct Mutation {
    exponent: f32,
}

impl Mutation {
    pub fn of_size(size: f32) -> Self {
        Mutation { exponent: 1.0 / size + 1.0 }
    }

    /// Moves a number in [0, 1) by `± xi^(1/size + 1)` and wraps it; sign and `xi` are those of a uniform `number`.
    // [Mutation]
    #[inline]
    pub fn of(self, u: f32, number: f32) -> f32 {
        let both = 2.0 * number;
        let (sign, passed) = if both < 1.0 { (1.0, 0.0) } else { (-1.0, 1.0) };
        let moved = u + sign * power(both - passed, self.exponent);
        // Between -1 and 2.
        let wrapped = if moved < 0.0 { moved + 1.0 } else { moved };
        // A tiny negative number has come to 1 in single precision.
        let wrapped = if wrapped < 1.0 { wrapped } else { wrapped - 1.0 };
        wrapped.clamp(0.0, BELOW_ONE)
    }
}

/// `xi^exponent` for `xi` in [0, 1) and exponents above 1, within 1e-4 times the exponent. A chain asks of its steps that those up are
/// as likely as those down, whatever their lengths, and this is computed for several at once.
#[inline]
fn power(xi: f32, exponent: f32) -> f32 {
    let bits = xi.to_bits();
    let octave = (bits >> 23) as i32 - 127;
    let above = f32::from_bits(bits & 0x007f_ffff | 0x3f80_0000) - 1.0;
    let slope = polynomial(above, LOG2);
    let log = (octave as f32 + above * slope) * exponent;
    // Below, all is less than single precision resolves.
    let log = log.clamp(-126.0, 0.0);
    // Numbers so large are whole: the sum is rounded to one, and its bits count up from ROUNDER's.
    let rounded = log + ROUNDER;
    let part = polynomial(log - (rounded - ROUNDER), EXP2);
    let whole = rounded.to_bits().wrapping_sub(ROUNDER.to_bits());
    part * f32::from_bits(whole.wrapping_add(127) << 23)
}

#[inline]
fn polynomial<const N: usize>(x: f32, coefficients: [f32; N]) -> f32 {
    coefficients.into_iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// The mutation size of a family, which drifts to where `TARGET_ACCEPTANCE` of the mutations are
/// accepted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MutationSize {
    size: f64,
    updates: u64,
}

impl Default for MutationSize {
    fn default() -> Self {
        MutationSize { size: INITIAL_SIZE, updates: 0 }
    }
}

impl MutationSize {
    pub fn get(&self) -> f32 {
        self.size as f32
    }

    /// Learns from one round of mutations of all chains; ever less, so that it settles.
    // [Mutation size]
    pub fn adapt(&mut self, accepted: u64, mutated: u64) {
        if mutated == 0 {
            return;
        }
        self.updates += 1;
        let acceptance = accepted as f64 / mutated as f64;
        let step = (acceptance - TARGET_ACCEPTANCE) / self.updates as f64;
        self.size = (self.size + step).clamp(*SIZES.start(), *SIZES.end());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_are_nearly_exact() {
        for exponent in [2.0f32, 11.0, 101.0] {
            for number in 1..2000 {
                let xi = number as f32 / 2000.0;
                let exact = f64::from(xi).powf(f64::from(exponent));
                let off = (f64::from(power(xi, exponent)) - exact).abs();
                assert!(
                    off <= 1e-4 * f64::from(exponent) * exact + 1e-37,
                    "{xi}^{exponent}: {off}"
                );
            }
            assert!(power(0.0, exponent) <= 1e-30);
        }
    }

    /// Steps up and down are of equal lengths, so that a chain is as likely to come back as it was to go.
    #[test]
    fn mutations_are_symmetric_and_stay_within_the_cube() {
        let mutation = Mutation::of_size(0.3);
        for number in 0..1 << 12 {
            let number = number as f32 / 8192.0;
            let [up, down] = [number, number + 0.5].map(|number| mutation.of(0.5, number));
            assert!(((up - 0.5) - (0.5 - down)).abs() < 1e-7, "{up} and {down}");
            for known in [0.0, 1e-30, 0.5, 1.0 - f32::EPSILON / 2.0] {
                let moved = mutation.of(known, number);
                assert!((0.0..1.0).contains(&moved), "{known} moved to {moved}");
            }
        }
    }
}
