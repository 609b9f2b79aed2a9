//! The wavelengths that all view rays and photons of one jitter share. [Shared wavelengths]

use crate::math::uniform::{self, Purpose};
use crate::scene::{Scene, SceneResult};

/// The scene as the view rays and photons of a jitter see it; None where its channels are colours.
pub fn tuned(
    scene: &dyn Scene,
    seed: u64,
    jitter: u64,
) -> SceneResult<Option<Box<dyn Scene + '_>>> {
    scene.tuned(number(seed, jitter))
}

/// The number in [0,1) that chooses the wavelengths of a jitter, known from its index alone. It is uniform over the seeds. Its
/// shifts by thirds choose two more wavelengths, so that the numbers of `2^k` jitters and their shifts are equidistant.
fn number(seed: u64, jitter: u64) -> f32 {
    let first: f32 = uniform::next(&mut uniform::stream(seed, Purpose::Wavelengths, 0, 0));
    let shift = (jitter as u32).reverse_bits() as f64 / (3.0 * 2.0_f64.powi(32));
    ((f64::from(first) + shift).fract() as f32).min(uniform::BELOW_ONE)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With their shifts by thirds, the numbers of 2^k jitters lie at equal distances of 1 / (3 * 2^k).
    #[test]
    fn jitters_cover_the_spectrum_evenly() {
        for jitters in [1, 2, 8, 64] {
            let thirds = |jitter| [0.0, 1.0, 2.0].map(|i| (number(7, jitter) + i / 3.0).fract());
            let mut numbers: Vec<f32> = (0..jitters).flat_map(thirds).collect();
            numbers.sort_by(f32::total_cmp);
            let distance = 1.0 / (3.0 * jitters as f32);
            for pair in numbers.windows(2) {
                assert!((pair[1] - pair[0] - distance).abs() < 1e-6, "{jitters} jitters: {pair:?}");
            }
        }
    }

    /// A jitter's number is uniform over the seeds: Kolmogorov's statistic of 2000 seeds stays below its quantile at 1e-3,
    /// 1.95.
    #[test]
    fn seeds_choose_any_wavelengths() {
        const SEEDS: usize = 2000;
        for jitter in [0, 5] {
            let mut numbers: Vec<f32> =
                (0..SEEDS as u64).map(|seed| number(seed, jitter)).collect();
            numbers.sort_by(f32::total_cmp);
            let gap = |(index, &number): (usize, &f32)| {
                (number - (index as f32 + 0.5) / SEEDS as f32).abs()
            };
            let worst = numbers.iter().enumerate().map(gap).fold(0.0, f32::max);
            assert!(worst * (SEEDS as f32).sqrt() < 1.95, "jitter {jitter}: {worst}");
        }
    }
}
