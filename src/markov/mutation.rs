//! Small steps in primary sample space, and the size that finds itself.

use rand::Rng;

/// Size of the first mutations. [Collin 2013 §6.1]
const INITIAL_SIZE: f64 = 0.1;
/// Share of the mutations that ought to be accepted. [Hachisuka 2011]
const TARGET_ACCEPTANCE: f64 = 0.234;
/// Below, a step is less than single precision resolves; above, the torus has no longer one.
const SIZES: std::ops::RangeInclusive<f64> = 1e-3..=1.0;

/// Moves a number in [0, 1) by `± xi^(1/size + 1)`, with `xi` uniform, and wraps it.
// [Mutation]
pub fn mutate(u: f32, size: f32, rng: &mut impl Rng) -> f32 {
    let both: f32 = 2.0 * rng.random::<f32>();
    let (sign, xi) = if both < 1.0 { (1.0, both) } else { (-1.0, both - 1.0) };
    let moved = u + sign * xi.powf(1.0 / size + 1.0);
    // Between -1 and 2.
    let wrapped = if moved < 0.0 { moved + 1.0 } else { moved };
    // A tiny negative number has come to 1 in single precision.
    if wrapped < 1.0 {
        wrapped
    } else {
        wrapped - 1.0
    }
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
