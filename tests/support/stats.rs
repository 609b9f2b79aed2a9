//! Tests of hypotheses about means that are known with an error, on both sides.
//!
//! A renderer under test gives K images from K independent seeds; the reference is a mean image and
//! the variance of that mean. What is compared is the mean of the whole image and the mean of each
//! block of pixels, per colour channel. The hypothesis is not "no bias", which no photon map with a
//! finite radius satisfies, but "the bias is at most `bound`", and it is rejected where the
//! deviation is *significantly* larger. So noise neither hides behind the bound nor fails a test,
//! and `Comparison::detectable` says how small a bias the noise still lets one see.

use statrs::function::beta::beta_reg;

use super::image::Image;

/// Blocks of this many pixels squared.
pub const BLOCK: usize = 8;

/// Deviations are relative to the reference's block mean, or to this share of the image's mean
/// where a block is darker.
pub const DARK: f64 = 0.1;

/// A mean, the variance of that mean, and the degrees of freedom that the variance was estimated
/// with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    pub mean: f64,
    pub variance: f64,
    pub freedom: f64,
}

impl Estimate {
    /// From independent values of the same distribution: s^2 / K with the unbiased sample variance
    /// s^2.
    pub fn from_samples(samples: &[f64]) -> Self {
        let count = samples.len() as f64;
        let mean = samples.iter().sum::<f64>() / count;
        let squares: f64 = samples.iter().map(|x| (x - mean).powi(2)).sum();
        Estimate { mean, variance: squares / (count - 1.0) / count, freedom: count - 1.0 }
    }
}

/// A reference image with the variance of each of its pixels, which are independent of each other.
pub struct Reference {
    pub mean: Image,
    pub variance: Image,
    /// Degrees of freedom of one pixel's variance: the reference's seeds minus one.
    pub freedom: f64,
}

/// An actual mean against an expected one, both divided by the same scale: a relative deviation.
#[derive(Clone, Copy, Debug)]
pub struct Comparison {
    pub ratio: f64,
    pub deviation: f64,
    pub error: f64,
    pub freedom: f64,
    pub bound: f64,
}

impl Comparison {
    pub fn new(actual: Estimate, expected: Estimate, scale: f64, bound: f64) -> Self {
        Comparison {
            ratio: actual.mean / expected.mean,
            deviation: (actual.mean - expected.mean) / scale,
            error: (actual.variance + expected.variance).sqrt() / scale,
            freedom: welch_freedom(actual, expected),
            bound,
        }
    }

    /// The deviation in standard errors.
    pub fn z(&self) -> f64 {
        if self.deviation == 0.0 {
            0.0
        } else {
            self.deviation / self.error
        }
    }

    /// The largest probability of a deviation at least this large while |bias| <= bound. The
    /// largest is reached at the bound itself, say at +bound. There T = (D - bound) / error follows
    /// Student's t, and |D| >= |d| is T >= (|d| - bound) / error or T <= -(|d| + bound) / error.
    /// With bound = 0 this is the two-sided t-test. A deviation that is no number has a probability
    /// of 0.
    pub fn p_value(&self) -> f64 {
        if !(self.deviation.is_finite() && self.error.is_finite()) {
            return 0.0;
        }
        let size = self.deviation.abs();
        if self.error == 0.0 {
            return if size <= self.bound { 1.0 } else { 0.0 };
        }
        student_tail((size - self.bound) / self.error, self.freedom)
            + student_tail((size + self.bound) / self.error, self.freedom)
    }

    pub fn rejected(&self, level: f64) -> bool {
        self.p_value() < level
    }

    /// The bias that would be rejected nine times in ten: the deviation must exceed bound + t_level
    /// error, and it falls short of the bias by more than t_0.1 error once in ten times.
    pub fn detectable(&self, level: f64) -> f64 {
        self.bound
            + (student_quantile(level, self.freedom) + student_quantile(0.1, self.freedom))
                * self.error
    }
}

/// What one scene's images say: one comparison per colour for the whole image, and one per block
/// and colour.
pub struct Verdict {
    pub image: Vec<Comparison>,
    pub blocks: Vec<Comparison>,
}

impl Verdict {
    pub fn new(runs: &[Image], reference: &Reference, image_bound: f64, block_bound: f64) -> Self {
        let run_means: Vec<_> = runs.iter().map(Image::mean).collect();
        let run_blocks: Vec<_> = runs.iter().map(|run| run.block_means(BLOCK)).collect();
        let (level, blocks) = (reference.mean.mean(), reference.mean.block_means(BLOCK));
        let (variance, block_variances) =
            (reference.variance.mean(), reference.variance.block_means(BLOCK));

        // The variance of a mean of n independent pixels is the mean of their variances over n, and
        // its degrees of freedom are those of n pixels together.
        let expected = |mean: f64, mean_variance: f64, pixels: usize| Estimate {
            mean,
            variance: mean_variance / pixels as f64,
            freedom: reference.freedom * pixels as f64,
        };
        let colours = || 0..3;
        let image = colours().map(|c| {
            let samples: Vec<f64> = run_means.iter().map(|mean| mean[c]).collect();
            let expected = expected(level[c], variance[c], reference.mean.pixels.len());
            Comparison::new(Estimate::from_samples(&samples), expected, level[c], image_bound)
        });
        let block = |b: usize, c: usize| {
            let samples: Vec<f64> = run_blocks.iter().map(|run| run[b][c]).collect();
            let expected = expected(blocks[b][c], block_variances[b][c], BLOCK * BLOCK);
            let scale = blocks[b][c].max(DARK * level[c]);
            Comparison::new(Estimate::from_samples(&samples), expected, scale, block_bound)
        };
        let block = &block;
        Verdict {
            image: image.collect(),
            blocks: (0..blocks.len()).flat_map(|b| colours().map(move |c| block(b, c))).collect(),
        }
    }

    /// The comparison of `comparisons` that is hardest to believe.
    pub fn worst(comparisons: &[Comparison]) -> &Comparison {
        comparisons
            .iter()
            .min_by(|a, b| a.p_value().total_cmp(&b.p_value()))
            .expect("an image has blocks")
    }

    /// What all colours of the image could detect.
    pub fn detectable_in_image(&self, level: f64) -> f64 {
        sorted_detectable(&self.image, level)[self.image.len() - 1]
    }

    /// What half of the blocks could detect.
    pub fn detectable_in_median_block(&self, level: f64) -> f64 {
        sorted_detectable(&self.blocks, level)[self.blocks.len() / 2]
    }
}

fn sorted_detectable(comparisons: &[Comparison], level: f64) -> Vec<f64> {
    let mut biases: Vec<f64> = comparisons.iter().map(|c| c.detectable(level)).collect();
    biases.sort_by(f64::total_cmp);
    biases
}

/// Degrees of freedom of the difference of two means (Welch and Satterthwaite), at most 10^4,
/// beyond which Student's t is the normal distribution for every level used here.
fn welch_freedom(a: Estimate, b: Estimate) -> f64 {
    let sum = a.variance + b.variance;
    let parts = a.variance.powi(2) / a.freedom + b.variance.powi(2) / b.freedom;
    if parts == 0.0 {
        1e4
    } else {
        (sum * sum / parts).min(1e4)
    }
}

/// P(T >= t) for Student's t: half of I_x(freedom / 2, 1 / 2) with x = freedom / (freedom + t^2),
/// for t >= 0.
fn student_tail(t: f64, freedom: f64) -> f64 {
    let tail = 0.5 * beta_reg(0.5 * freedom, 0.5, freedom / (freedom + t * t));
    if t >= 0.0 {
        tail
    } else {
        1.0 - tail
    }
}

/// The t >= 0 with P(T >= t) = `level` <= 1 / 2, by bisection.
fn student_quantile(level: f64, freedom: f64) -> f64 {
    let mut high = 1.0;
    while student_tail(high, freedom) > level {
        high *= 2.0;
    }
    let mut low = 0.0;
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if student_tail(middle, freedom) > level {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(actual: f64, expected: f64, tolerance: f64) {
        assert!(
            (actual - expected).abs() <= tolerance * expected.abs(),
            "{actual} is not {expected}"
        );
    }

    /// Uniform numbers in (0, 1) by SplitMix64, enough for synthetic noise.
    struct Random(u64);

    impl Random {
        fn uniform(&mut self) -> f64 {
            self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = self.0;
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64 + f64::EPSILON / 4.0
        }

        /// By Box and Muller.
        fn normal(&mut self) -> f64 {
            (-2.0 * self.uniform().ln()).sqrt() * (std::f64::consts::TAU * self.uniform()).cos()
        }
    }

    /// 1, 2, 3, 4: mean 2.5, squared deviations 2.25 + 0.25 + 0.25 + 2.25 = 5, s^2 = 5/3, variance
    /// of the mean 5/12.
    #[test]
    fn estimate_of_four_numbers() {
        let estimate = Estimate::from_samples(&[1.0, 2.0, 3.0, 4.0]);
        assert_eq!((estimate.mean, estimate.freedom), (2.5, 3.0));
        close(estimate.variance, 5.0 / 12.0, 1e-14);
    }

    /// One degree of freedom is Cauchy's distribution: P(T >= 1) = 1/2 - atan(1)/pi = 1/4, and far
    /// out 1/(pi t). Two have P(T >= t) = 1/2 - t / (2 sqrt(2 + t^2)): at sqrt(2) that is (2 -
    /// sqrt(2)) / 4. With 10^4 the normal quantile 1.959964 leaves 0.025 and 4.753424 leaves 1e-6;
    /// t's tails are heavier by phi(z) (z^3 + z) / (4 freedom).
    #[test]
    fn student_tails_in_closed_form() {
        close(student_tail(1.0, 1.0), 0.25, 1e-12);
        close(student_tail(-1.0, 1.0), 0.75, 1e-12);
        close(student_tail(1e6, 1.0), 1.0 / (std::f64::consts::PI * 1e6), 1e-9);
        close(student_tail(2f64.sqrt(), 2.0), (2.0 - 2f64.sqrt()) / 4.0, 1e-12);
        for (z, level) in [(1.959_964_f64, 0.025), (4.753_424, 1e-6)] {
            let density = (-0.5 * z * z).exp() / std::f64::consts::TAU.sqrt();
            close(student_tail(z, 1e4), level + density * (z.powi(3) + z) / 4e4, 1e-4);
        }
    }

    /// The quantile undoes the tail; for two degrees of freedom P(T >= t) = level solves to t = (1
    /// - 2 level) / sqrt(2 level (1 - level)).
    #[test]
    fn student_quantiles_in_closed_form() {
        for level in [0.3, 1e-3, 1e-7_f64] {
            close(
                student_quantile(level, 2.0),
                (1.0 - 2.0 * level) / (2.0 * level * (1.0 - level)).sqrt(),
                1e-7,
            );
        }
    }

    /// Equal variances with equal freedom n: (2 v)^2 / (2 v^2 / n) = 2 n. One variance alone: its
    /// own freedom.
    #[test]
    fn welch_freedom_of_equal_and_of_lone_variances() {
        let estimate = |variance, freedom| Estimate { mean: 0.0, variance, freedom };
        close(welch_freedom(estimate(3.0, 7.0), estimate(3.0, 7.0)), 14.0, 1e-14);
        close(welch_freedom(estimate(3.0, 7.0), estimate(0.0, 100.0)), 7.0, 1e-14);
    }

    /// With bound 0 and one degree of freedom, one standard error has the two-sided p-value 1/4 +
    /// 1/4. At |d| = bound the near tail is 1/2 and the far one begins 2 bound / error from the
    /// centre: at one standard error here, which leaves 1/4. Without any error the bound alone
    /// decides, and a deviation that is no number is rejected.
    #[test]
    fn p_values_in_closed_form() {
        let comparison = |deviation, error, bound| Comparison {
            ratio: 1.0,
            deviation,
            error,
            freedom: 1.0,
            bound,
        };
        close(comparison(-0.3, 0.3, 0.0).p_value(), 0.5, 1e-12);
        close(comparison(0.02, 0.04, 0.02).p_value(), 0.75, 1e-12);
        assert_eq!(comparison(0.02, 0.0, 0.02).p_value(), 1.0);
        assert_eq!(comparison(0.021, 0.0, 0.02).p_value(), 0.0);
        assert!(comparison(f64::NAN, 0.1, 0.02).rejected(1e-9));
    }

    /// A true null hypothesis is rejected as often as the level says: of 4000 t-tests with four
    /// samples each at level 0.05, 200 with a standard deviation of sqrt(4000 * 0.05 * 0.95) =
    /// 13.8. Four of these are allowed for.
    #[test]
    fn the_level_is_the_rate_of_false_alarms() {
        let mut random = Random(1);
        let expected = Estimate { mean: 5.0, variance: 0.0, freedom: 1e4 };
        let alarms = (0..4000)
            .filter(|_| {
                let samples: Vec<f64> = (0..4).map(|_| 5.0 + random.normal()).collect();
                Comparison::new(Estimate::from_samples(&samples), expected, 5.0, 0.0).rejected(0.05)
            })
            .count();
        assert!((145..=255).contains(&alarms), "{alarms} of 4000");
    }

    /// `detectable` keeps its promise: biased by just that much, with bound 0.01, freedom 7 and
    /// level 1e-3, nine tests in ten reject. The error of each test is estimated too, so the share
    /// is 0.9 only roughly; it stays in 0.8 to 0.98.
    #[test]
    fn nine_in_ten_detectable_biases_are_found() {
        let (mut random, error, level) = (Random(2), 0.004, 1e-3);
        let promise = Comparison { ratio: 1.0, deviation: 0.0, error, freedom: 7.0, bound: 0.01 }
            .detectable(level);
        let expected = Estimate { mean: 1.0, variance: 0.0, freedom: 1e4 };
        let found = (0..2000)
            .filter(|_| {
                let samples: Vec<f64> =
                    (0..8).map(|_| 1.0 + promise + error * 8f64.sqrt() * random.normal()).collect();
                Comparison::new(Estimate::from_samples(&samples), expected, 1.0, 0.01)
                    .rejected(level)
            })
            .count();
        assert!((1600..=1960).contains(&found), "{found} of 2000");
    }

    /// A smooth scene of 64 x 64 pixels, a reference of it with 0.1 % noise per pixel, and eight
    /// runs with 5 % noise per pixel, which is 0.05 / 64 / sqrt(8) = 0.03 % for the image and 0.05
    /// / 8 / sqrt(8) = 0.22 % for a block. `truth` bends the runs.
    fn synthetic(seed: u64, truth: impl Fn(usize, usize) -> f64) -> Verdict {
        let mut random = Random(seed);
        let scene = |x: usize, y: usize| {
            [1.0, 0.5, 0.2].map(|c: f64| c * (1.0 + x as f64 / 64.0 + y as f64 / 32.0))
        };
        let mut noisy = |share: f64, bend: &dyn Fn(usize, usize) -> f64| {
            Image::from_fn(64, 64, |x, y| {
                scene(x, y).map(|v| (v * bend(x, y) * (1.0 + share * random.normal())) as f32)
            })
        };
        let reference = Reference {
            mean: noisy(0.001, &|_, _| 1.0),
            variance: Image::from_fn(64, 64, |x, y| {
                scene(x, y).map(|v| (0.001 * v).powi(2) as f32)
            }),
            freedom: 23.0,
        };
        let runs: Vec<Image> = (0..8).map(|_| noisy(0.05, &truth)).collect();
        Verdict::new(&runs, &reference, 0.005, 0.02)
    }

    fn image_rejected(verdict: &Verdict) -> bool {
        verdict.image.iter().any(|c| c.rejected(1e-3 / 3.0))
    }

    fn block_rejected(verdict: &Verdict) -> bool {
        verdict.blocks.iter().any(|c| c.rejected(1e-3 / 192.0))
    }

    #[test]
    fn an_unbiased_image_passes() {
        for seed in 0..10 {
            let verdict = synthetic(seed, |_, _| 1.0);
            assert!(!image_rejected(&verdict) && !block_rejected(&verdict), "seed {seed}");
        }
    }

    /// 0.4 % is within the bound of 0.5 %.
    #[test]
    fn a_bias_within_the_bound_passes() {
        for seed in 0..10 {
            let verdict = synthetic(seed, |_, _| 1.004);
            assert!(!image_rejected(&verdict) && !block_rejected(&verdict), "seed {seed}");
        }
    }

    /// 1 % exceeds the bound of the image by 0.5 % = 18 standard errors; no block's bound is
    /// touched. What `detectable` says agrees: below 1 %.
    #[test]
    fn a_bias_of_one_percent_is_rejected() {
        for seed in 0..10 {
            let verdict = synthetic(seed, |_, _| 1.01);
            assert!(image_rejected(&verdict) && !block_rejected(&verdict), "seed {seed}");
            assert!(verdict.detectable_in_image(1e-3 / 3.0) < 0.01);
        }
    }

    /// One block of 64 is 8 % too bright and another 8 % too dark: the image's mean hardly moves,
    /// the blocks tell. The rejected ones are exactly these two: numbers 10 and 53 in row-major
    /// order, in all three colours.
    #[test]
    fn two_wrong_blocks_are_found_where_they_are() {
        let bend = |x: usize, y: usize| match (x / BLOCK, y / BLOCK) {
            (2, 1) => 1.08,
            (5, 6) => 0.92,
            _ => 1.0,
        };
        for seed in 0..5 {
            let verdict = synthetic(seed, bend);
            let level = 1e-3 / 192.0;
            let found: Vec<usize> =
                (0..192).filter(|&i| verdict.blocks[i].rejected(level)).map(|i| i / 3).collect();
            assert_eq!(found, [10, 10, 10, 53, 53, 53], "seed {seed}");
            assert!(!image_rejected(&verdict), "seed {seed}");
        }
    }

    /// A bright block of 1.99 and a dark one of 0.01 make an image of mean 1. Where the runs have
    /// 0.02 in the dark block, that is 0.01 too much of 0.1, the share `DARK` of the image's mean.
    #[test]
    fn a_dark_block_is_measured_against_the_image() {
        let halves = |dark: f32| Image::from_fn(16, 8, |x, _| [if x < 8 { 1.99 } else { dark }; 3]);
        let reference = Reference {
            mean: halves(0.01),
            variance: Image::from_fn(16, 8, |_, _| [0.0; 3]),
            freedom: 15.0,
        };
        let verdict = Verdict::new(&[halves(0.02), halves(0.02)], &reference, 0.005, 0.02);
        close(verdict.blocks[3].deviation, 0.1, 1e-6);
        assert_eq!(verdict.blocks[0].deviation, 0.0);
    }

    /// Runs that do not differ at all, equal to a reference without variance: deviation 0 with
    /// error 0.
    #[test]
    fn identical_images_pass_without_dividing_zero_by_zero() {
        let flat = Image::from_fn(64, 64, |x, _| [x as f32, 1.0, 0.5]);
        let zero = Image::from_fn(64, 64, |_, _| [0.0; 3]);
        let reference = Reference { mean: flat.clone(), variance: zero, freedom: 23.0 };
        let verdict = Verdict::new(&[flat.clone(), flat], &reference, 0.005, 0.02);
        assert!(verdict
            .image
            .iter()
            .chain(&verdict.blocks)
            .all(|c| c.p_value() == 1.0 && c.z() == 0.0));
    }
}
