//! Uniform numbers for batches: one independent stream per (seed, purpose, pass, batch), so that a
//! result does not depend on which thread draws it.

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// The largest number that may be drawn.
pub const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// What a stream of numbers is for; streams of different purposes never overlap.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    ViewRays = 1,
    Photons = 2,
    PhotonTables = 3,
    SurfaceMutations = 4,
    MediumMutations = 5,
    SurfaceExchange = 6,
    MediumExchange = 7,
    ViewTables = 8,
    Aperture = 9,
    LampsOfPoints = 10,
    LampsOfBeams = 11,
    LampProbe = 12,
    EmissionRays = 13,
    EmissionAperture = 14,
    EmissionTables = 15,
    Lessons = 16,
    LessonTables = 17,
    Wavelengths = 18,
    AimedRays = 19,
}

/// The stream that belongs to one batch of one pass.
pub fn stream(seed: u64, purpose: Purpose, pass: u64, batch: u64) -> Pcg64Mcg {
    let mut state = splitmix(seed ^ 0x9e37_79b9_7f4a_7c15);
    for word in [purpose as u64, pass, batch] {
        state = splitmix(state ^ word.wrapping_mul(0xff51_afd7_ed55_8ccd));
    }
    Pcg64Mcg::seed_from_u64(state)
}

/// Fills a buffer with numbers in [0,1).
pub fn fill(rng: &mut Pcg64Mcg, numbers: &mut Vec<f32>, count: usize) {
    numbers.resize(count, 0.0);
    fill_slice(rng, numbers);
}

/// The same for a buffer of known length.
pub fn fill_slice(rng: &mut Pcg64Mcg, numbers: &mut [f32]) {
    rng.fill(numbers);
}

/// Takes the next `count` numbers out of a stream: what is returned draws them, and the stream goes on behind them.
pub fn split_off(rng: &mut Pcg64Mcg, count: usize) -> Pcg64Mcg {
    let own = rng.clone();
    rng.advance(count as u128);
    own
}

/// The next number in [0,1).
pub fn next(rng: &mut Pcg64Mcg) -> f32 {
    rng.random()
}

fn splitmix(mut z: u64) -> u64 {
    z = z.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Part by part, whoever draws them, numbers are those that the stream would have given one by one.
    #[test]
    fn parts_of_a_stream_are_the_stream() {
        let start = || stream(7, Purpose::Photons, 1, 2);
        let (mut whole, mut parts) = (start(), start());
        let one_by_one: Vec<f32> = (0..1000).map(|_| next(&mut whole)).collect();
        let mut numbers = Vec::new();
        for count in [0, 1, 99, 900] {
            let mut part = Vec::new();
            fill(&mut split_off(&mut parts, count), &mut part, count);
            numbers.extend(part);
        }
        assert_eq!(numbers, one_by_one);
        assert_eq!(next(&mut parts), next(&mut whole));
    }
}
