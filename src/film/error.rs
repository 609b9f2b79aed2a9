//! How far a picture may be off, told without a reference: noise from the spread of the jitters, bias
//! from what a narrower kernel saw of the same photons. [Hachisuka 2010] is where the idea comes from.

use super::FilmSums;
use crate::crew::Task;
use crate::math::brightness;
use crate::scene::{work, Scene, SceneDescription};
use serde::{Deserialize, Serialize};

/// Jitters from which an estimate is made; fewer say too little of their own spread.
const FEWEST_JITTERS: u32 = 2;
/// The first number of jitters whose noise is kept to measure its decay by.
const FIRST_MILESTONE: u32 = 8;
/// Jitters from which an estimate may end a render.
const JITTERS_TO_STOP: u32 = 4;
/// Pixels whose moments a task adds.
const PER_TASK: usize = 1 << 14;
/// The bias of a pixel is averaged over a window that reaches so many pixels to each side: the difference
/// of two kernels is as noisy as the picture, but it changes slowly.
const BIAS_REACH: usize = 3;

/// How far the whole picture is off: roots of means over pixels and channels, relative to each pixel as
/// `report::metrics` has it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct ErrorEstimate {
    /// Noise and bias together.
    pub relative: f64,
    pub noise: f64,
    pub bias: f64,
    /// How the squares of noise and bias fall with the number of passes `n`: as `n^-decay`.
    pub noise_decay: f64,
    pub bias_decay: f64,
    /// Correlation of a jitter with the one before, which chains that live on bring about.
    pub correlation: f64,
    pub jitters: u32,
}

impl ErrorEstimate {
    /// Whether the error is known well enough to be below `target`.
    pub fn reaches(&self, target: f64) -> bool {
        self.jitters >= JITTERS_TO_STOP && self.relative <= target
    }

    /// The factor on the passes so far after which the error has fallen to `target`; none where it never
    /// will within the reach of the model.
    // [Error decay]
    pub fn passes_factor(&self, target: f64) -> Option<f64> {
        const REACH: f64 = 1e9;
        let error_after = |factor: f64| {
            (self.noise.powi(2) * factor.powf(-self.noise_decay)
                + self.bias.powi(2) * factor.powf(-self.bias_decay))
            .sqrt()
        };
        if error_after(1.0) <= target {
            return Some(1.0);
        }
        if error_after(REACH) > target {
            return None;
        }
        let (mut low, mut high) = (0.0, REACH.ln());
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if error_after(f64::exp(middle)) > target {
                low = middle;
            } else {
                high = middle;
            }
        }
        Some(high.exp())
    }
}

/// Of 32 bits, in what one film pixel has shown: eight f64 and nine f32.
pub const WORDS: usize = 2 * 8 + 9;

/// What one film pixel has shown so far.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Moments {
    sum: [f64; 3],
    square: [f64; 3],
    first: [f32; 3],
    last: [f32; 3],
    /// Squared steps from a jitter to the next.
    steps: [f32; 3],
    bias: f64,
    bias_square: f64,
}

/// Sums over pixels, each relative to the square of the pixel.
#[derive(Debug, Clone, Copy, Default)]
struct SquaredErrors {
    /// Of all channels: squared steps, and the variance of the mean over jitters.
    steps: f64,
    spread: f64,
    /// Of the mean of the channels: the square of the bias, and the variance of its mean.
    squared_bias: f64,
    bias_spread: f64,
}

/// What [`ErrorSums`] know besides the moments of pixels.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Trend {
    jitters: u32,
    noise_decay: f64,
    bias_decay: f64,
    /// Between these bounds the decay of noise is measured; none where it is known.
    measured_decay: Option<[f64; 2]>,
    /// Squared noise after numbers of jitters that are powers of two.
    noises: Vec<(u32, f64)>,
}

/// Spread and trend of all jitters so far. Each counts alike, so they must have had equally many passes.
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorSums {
    pixels: Vec<Moments>,
    width: usize,
    channels: usize,
    trend: Trend,
}

impl ErrorSums {
    /// For passes of which a share `alpha` of the photons is kept from one to the next, and whose noise may come from
    /// connections, too.
    // [Error decay]
    pub fn new(description: &SceneDescription, alpha: f32, connections: bool) -> Self {
        let alpha = f64::from(alpha);
        let noise_decay = if connections { 0.5 * (alpha + 1.0) } else { alpha };
        ErrorSums {
            pixels: vec![Moments::default(); description.film_pixels as usize],
            width: description.film_width as usize,
            channels: description.film_channels as usize,
            trend: Trend {
                jitters: 0,
                noise_decay,
                bias_decay: 1.0 - alpha,
                measured_decay: connections.then_some([alpha, 1.0]),
                noises: Vec::new(),
            },
        }
    }

    /// Puts together what [`Self::trend`] and [`Self::words`] gave of a film with rows of `width` pixels.
    pub fn from_words(
        trend: Trend,
        words: impl Iterator<Item = [u32; WORDS]>,
        width: usize,
        channels: usize,
    ) -> Self {
        ErrorSums { pixels: words.map(Moments::from_words).collect(), width, channels, trend }
    }

    pub fn trend(&self) -> &Trend {
        &self.trend
    }

    /// The moments of every pixel, bit by bit.
    pub fn words(&self) -> impl Iterator<Item = [u32; WORDS]> + '_ {
        self.pixels.iter().map(Moments::words)
    }

    /// Adds the film of one jitter and the bias of its pixels, weighted as their values are.
    pub fn add(&mut self, scene: &dyn Scene, picture: &FilmSums, bias: &[f64]) {
        let (channels, first) = (self.channels, self.trend.jitters == 0);
        let films = picture.values.chunks(channels * PER_TASK).zip(bias.chunks(PER_TASK));
        let tasks = self.pixels.chunks_mut(PER_TASK).zip(films).collect();
        work::for_each(scene, tasks, |(pixels, (picture, bias))| {
            let films = picture.chunks(channels).zip(bias);
            for (moments, (picture, bias)) in pixels.iter_mut().zip(films) {
                let weight = picture[channels - 1];
                if weight > 0.0 {
                    let value = [0, 1, 2].map(|channel| picture[channel] / weight);
                    moments.add(value, bias / weight, first);
                }
            }
        });
        self.trend.jitters += 1;
        let is_milestone =
            self.trend.jitters >= FIRST_MILESTONE && self.trend.jitters.is_power_of_two();
        if is_milestone {
            let noise = self.estimate().map(|estimate| estimate.noise.powi(2));
            self.trend.noises.extend(noise.map(|noise| (self.trend.jitters, noise)));
        }
    }

    /// Adds what later jitters have shown. Sums of f64 that are grouped otherwise differ by rounding; the decay of noise is that
    /// which was measured first, as the later jitters measured theirs without those before.
    pub fn merge(&mut self, later: &ErrorSums) {
        assert_eq!(self.pixels.len(), later.pixels.len());
        if self.trend.jitters == 0 {
            *self = later.clone();
        } else if later.trend.jitters > 0 {
            let pixels = self.pixels.iter_mut().zip(&later.pixels);
            pixels.for_each(|(pixel, later)| pixel.merge(later));
            self.trend.jitters += later.trend.jitters;
        }
    }

    /// The decay of noise, by the last milestone that lies far enough behind.
    // [Error decay]
    fn decay_of_noise(&self, noise: f64) -> f64 {
        let behind =
            self.trend.noises.iter().rev().find(|(jitters, _)| 2 * jitters <= self.trend.jitters);
        match (self.trend.measured_decay, behind) {
            (Some([least, most]), Some(&(jitters, before))) if noise > 0.0 => {
                let decay = (before / noise).ln() / (self.count() / f64::from(jitters)).ln();
                decay.clamp(least, most)
            }
            _ => self.trend.noise_decay,
        }
    }

    /// None before there are enough jitters.
    pub fn estimate(&self) -> Option<ErrorEstimate> {
        self.estimate_from(|parts| parts.into_iter().for_each(|sum| sum()))
    }

    /// The same, by the threads that a scene lends.
    pub fn estimate_by(&self, scene: &dyn Scene) -> Option<ErrorEstimate> {
        self.estimate_from(|parts| work::for_each(scene, parts, |sum| sum()))
    }

    fn estimate_from(&self, run: impl FnOnce(Vec<Task>)) -> Option<ErrorEstimate> {
        if self.trend.jitters < FEWEST_JITTERS {
            return None;
        }
        let floor = self.floor();
        let mut parts = vec![SquaredErrors::default(); self.pixels.len().div_ceil(PER_TASK)];
        let tasks = parts.iter_mut().zip(self.pixels.chunks(PER_TASK)).map(|(part, pixels)| {
            Box::new(move || *part = self.squared_errors(pixels, floor)) as Task
        });
        run(tasks.collect());
        let sum = |of: fn(&SquaredErrors) -> f64| parts.iter().map(of).sum::<f64>();
        let (steps, spread) = (sum(|part| part.steps), sum(|part| part.spread));
        let (squared_bias, bias_spread) =
            (sum(|part| part.squared_bias), sum(|part| part.bias_spread));
        let count = (3 * self.pixels.len()) as f64;
        let correlation = self.correlation(steps, spread);
        let inflation = inflation(correlation);
        let noise = spread * inflation / count;
        let bias = ((squared_bias - bias_spread * inflation) / count).max(0.0);
        Some(ErrorEstimate {
            relative: (noise + bias).sqrt(),
            noise: noise.sqrt(),
            bias: bias.sqrt(),
            noise_decay: self.decay_of_noise(noise),
            bias_decay: self.trend.bias_decay,
            correlation,
            jitters: self.trend.jitters,
        })
    }

    /// Square of a tenth of the picture's brightness, below which errors are not relative to their pixel.
    fn floor(&self) -> f64 {
        let sum = |index: usize| self.pixels[index / 3].sum[index % 3];
        let level = brightness((0..3 * self.pixels.len()).map(sum)) / self.count();
        (0.1 * level).powi(2).max(f64::MIN_POSITIVE)
    }

    fn squared_errors(&self, pixels: &[Moments], floor: f64) -> SquaredErrors {
        let mut sums = SquaredErrors::default();
        for pixel in pixels {
            let scales = [0, 1, 2].map(|channel| self.scale(pixel, channel, floor));
            for (channel, scale) in scales.into_iter().enumerate() {
                sums.steps += f64::from(pixel.steps[channel]) / scale;
                sums.spread += self.variance(pixel, channel) / scale;
            }
            let scale = scales.iter().sum::<f64>() / 9.0;
            sums.squared_bias += self.bias(pixel).powi(2) / scale;
            sums.bias_spread += self.variance_of_bias(pixel) / scale;
        }
        sums
    }

    /// The standard error of red, green and blue of each pixel, in the picture's unit, bias included;
    /// zero before there are enough jitters.
    pub fn image(&self) -> Vec<[f32; 3]> {
        let Some(whole) = self.estimate() else { return vec![[0.0; 3]; self.pixels.len()] };
        let inflation = inflation(whole.correlation);
        // Unbiased for independent jitters, so it may be negative.
        let squared_bias =
            |pixel| self.bias(pixel).powi(2) - self.variance_of_bias(pixel) * inflation;
        let biases: Vec<f64> = self.pixels.iter().map(squared_bias).collect();
        let biases = window_means(&biases, self.width);
        let error = |(pixel, bias): (&Moments, f64)| {
            [0, 1, 2].map(|channel| {
                (self.variance(pixel, channel) * inflation + bias.max(0.0)).sqrt() as f32
            })
        };
        self.pixels.iter().zip(biases).map(error).collect()
    }

    fn count(&self) -> f64 {
        f64::from(self.trend.jitters)
    }

    /// Of the mean over jitters, if they are independent.
    fn variance(&self, pixel: &Moments, channel: usize) -> f64 {
        self.variance_of_mean(pixel.sum[channel], pixel.square[channel])
    }

    fn variance_of_mean(&self, sum: f64, square: f64) -> f64 {
        let count = self.count();
        ((square - sum * sum / count) / (count * (count - 1.0))).max(0.0)
    }

    fn bias(&self, pixel: &Moments) -> f64 {
        pixel.bias / self.count()
    }

    fn variance_of_bias(&self, pixel: &Moments) -> f64 {
        self.variance_of_mean(pixel.bias, pixel.bias_square)
    }

    /// What a squared difference is divided by; the square of a noisy mean is too large by its variance.
    fn scale(&self, pixel: &Moments, channel: usize, floor: f64) -> f64 {
        let mean = pixel.sum[channel] / self.count();
        (mean * mean - self.variance(pixel, channel)).max(0.0) + floor
    }

    /// From sums over the picture: the mean squared step is twice the variance, less the correlation.
    /// [von Neumann 1941]
    fn correlation(&self, steps: f64, spread: f64) -> f64 {
        let variance = spread * self.count();
        if variance > 0.0 {
            (1.0 - 0.5 * steps / (self.count() - 1.0) / variance).clamp(0.0, 0.9)
        } else {
            0.0
        }
    }
}

impl Moments {
    fn add(&mut self, value: [f64; 3], bias: f64, first: bool) {
        for channel in 0..3 {
            let value = value[channel];
            self.sum[channel] += value;
            self.square[channel] += value * value;
            if first {
                self.first[channel] = value as f32;
            } else {
                self.steps[channel] += (value - f64::from(self.last[channel])).powi(2) as f32;
            }
            self.last[channel] = value as f32;
        }
        self.bias += bias;
        self.bias_square += bias * bias;
    }
}

impl Moments {
    fn words(&self) -> [u32; WORDS] {
        let of_double = |value: &f64| [(value.to_bits() >> 32) as u32, value.to_bits() as u32];
        let doubles = self.sum.iter().chain(&self.square).chain([&self.bias, &self.bias_square]);
        let floats = self.first.iter().chain(&self.last).chain(&self.steps);
        let mut all = doubles.flat_map(of_double).chain(floats.map(|value| value.to_bits()));
        std::array::from_fn(|_| all.next().expect("there are so many"))
    }

    fn from_words(words: [u32; WORDS]) -> Self {
        let double = |at: usize| {
            f64::from_bits(u64::from(words[2 * at]) << 32 | u64::from(words[2 * at + 1]))
        };
        let float = |at: usize| f32::from_bits(words[16 + at]);
        Moments {
            sum: [0, 1, 2].map(double),
            square: [3, 4, 5].map(double),
            bias: double(6),
            bias_square: double(7),
            first: [0, 1, 2].map(float),
            last: [3, 4, 5].map(float),
            steps: [6, 7, 8].map(float),
        }
    }

    /// Adds those of jitters that followed.
    fn merge(&mut self, later: &Moments) {
        for channel in 0..3 {
            self.sum[channel] += later.sum[channel];
            self.square[channel] += later.square[channel];
            let step = later.first[channel] - self.last[channel];
            self.steps[channel] += step * step + later.steps[channel];
            self.last[channel] = later.last[channel];
        }
        self.bias += later.bias;
        self.bias_square += later.bias_square;
    }
}

/// By which a correlation from each jitter to the next raises the variance of their mean.
fn inflation(correlation: f64) -> f64 {
    (1.0 + correlation) / (1.0 - correlation)
}

/// The means over square windows around each pixel of a picture, cut off at its edges.
fn window_means(values: &[f64], width: usize) -> Vec<f64> {
    let along_rows: Vec<f64> = values.chunks(width.max(1)).flat_map(means_of_line).collect();
    let height = values.len() / width.max(1);
    let mut means = vec![0.0; values.len()];
    for x in 0..width {
        let column: Vec<f64> = (0..height).map(|y| along_rows[y * width + x]).collect();
        for (y, mean) in means_of_line(&column).into_iter().enumerate() {
            means[y * width + x] = mean;
        }
    }
    means
}

fn means_of_line(line: &[f64]) -> Vec<f64> {
    let mean = |at: usize| {
        let window = &line[at.saturating_sub(BIAS_REACH)..line.len().min(at + BIAS_REACH + 1)];
        window.iter().sum::<f64>() / window.len() as f64
    };
    (0..line.len()).map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analytic::{World, FILM_CHANNELS};
    use rand::{Rng, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    const WIDTH: usize = 40;
    const HEIGHT: usize = 25;
    const WEIGHT: f64 = 4.0;

    fn scene() -> World {
        World::empty([WIDTH as u32, HEIGHT as u32])
    }

    fn sums() -> ErrorSums {
        ErrorSums::new(scene().description(), 0.7, false)
    }

    /// A film of which every pixel holds one value in all colours.
    fn film(mut value: impl FnMut(usize) -> f64) -> FilmSums {
        let pixel = |index| {
            let sum = WEIGHT * value(index);
            [sum, sum, sum, WEIGHT, WEIGHT]
        };
        FilmSums { values: (0..WIDTH * HEIGHT).flat_map(pixel).collect() }
    }

    fn bias(mut value: impl FnMut() -> f64) -> Vec<f64> {
        (0..WIDTH * HEIGHT).map(|_| WEIGHT * value()).collect()
    }

    fn normal(rng: &mut Pcg64Mcg) -> f64 {
        (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0
    }

    /// Jitters of 2 + 0.3 z, z normal: the mean of 16 has a standard error of 0.075, and with the floor of
    /// 0.2² under 2² the relative one is 0.075 / sqrt(4.04) = 0.0373. One value per pixel, 1000 pixels and
    /// 15 degrees of freedom: known to 1 %.
    #[test]
    fn noise_is_the_standard_error_of_the_mean() {
        let mut rng = Pcg64Mcg::seed_from_u64(1);
        let mut sums = sums();
        assert!(sums.estimate().is_none());
        for _ in 0..16 {
            sums.add(&scene(), &film(|_| 2.0 + 0.3 * normal(&mut rng)), &[0.0; WIDTH * HEIGHT]);
        }
        let estimate = sums.estimate().unwrap();
        assert!((estimate.noise / 0.0373 - 1.0).abs() < 0.04, "{estimate:?}");
        assert_eq!(estimate.bias, 0.0);
        assert!(estimate.correlation < 0.03, "{estimate:?}");
        let mean_error = sums.image().iter().map(|pixel| f64::from(pixel[0])).sum::<f64>() / 1000.0;
        // The mean of a standard deviation with 15 degrees of freedom is 0.983 of the true one.
        assert!((mean_error / 0.075 / 0.983 - 1.0).abs() < 0.02, "{mean_error}");
    }

    /// A bias of 0.1 whose estimate has noise of 0.4 per jitter, drowned in a pixel, not in the picture.
    #[test]
    fn bias_is_found_below_its_noise() {
        let mut rng = Pcg64Mcg::seed_from_u64(2);
        let mut sums = sums();
        for _ in 0..16 {
            sums.add(&scene(), &film(|_| 2.0), &bias(|| 0.1 + 0.4 * normal(&mut rng)));
        }
        let estimate = sums.estimate().unwrap();
        // 0.1 over sqrt(4.04). The squared bias of a pixel has a standard error of 0.025 and a mean of 0.01:
        // over 1000 pixels 0.01 +- 0.0008, so 4 % of the bias.
        assert!((estimate.bias / 0.04975 - 1.0).abs() < 0.16, "{estimate:?}");
        assert_eq!(estimate.noise, 0.0);
        let image = sums.image();
        let middle: Vec<f64> = (10..30).map(|x| f64::from(image[12 * WIDTH + x][1])).collect();
        let mean = middle.iter().sum::<f64>() / middle.len() as f64;
        assert!((mean / 0.1 - 1.0).abs() < 0.3, "{mean}");
    }

    /// Jitters that keep 0.6 of the one before: the variance of their mean is (1 + 0.6) / (1 - 0.6) = 4 times
    /// that of independent ones.
    #[test]
    fn correlated_jitters_count_for_less() {
        let mut rng = Pcg64Mcg::seed_from_u64(3);
        let mut values = vec![0.0; WIDTH * HEIGHT];
        values.iter_mut().for_each(|value| *value = normal(&mut rng));
        let mut sums = sums();
        for _ in 0..256 {
            for value in &mut values {
                *value = 0.6 * *value + 0.8 * normal(&mut rng);
            }
            sums.add(&scene(), &film(|pixel| 2.0 + 0.3 * values[pixel]), &[0.0; WIDTH * HEIGHT]);
        }
        let estimate = sums.estimate().unwrap();
        assert!((estimate.correlation - 0.6).abs() < 0.03, "{estimate:?}");
        assert!((estimate.noise / (2.0 * 0.3 / 16.0 / 2.01) - 1.0).abs() < 0.06, "{estimate:?}");
    }

    /// Thirty jitters in one go and in three parts, which go through words; only rounding may tell them apart.
    #[test]
    fn parts_add_up_to_the_whole() {
        let mut rng = Pcg64Mcg::seed_from_u64(4);
        let films: Vec<_> = (0..30).map(|_| film(|_| 2.0 + 0.3 * normal(&mut rng))).collect();
        let biases: Vec<_> = (0..30).map(|_| bias(|| 0.1 * normal(&mut rng))).collect();
        let of = |range: std::ops::Range<usize>| {
            let mut sums = sums();
            range.for_each(|jitter| sums.add(&scene(), &films[jitter], &biases[jitter]));
            let copy =
                ErrorSums::from_words(sums.trend().clone(), sums.words(), WIDTH, FILM_CHANNELS);
            assert_eq!(copy, sums);
            copy
        };
        let whole = of(0..30);
        let mut merged = sums();
        [0..11, 11..12, 12..30].into_iter().for_each(|range| merged.merge(&of(range)));
        let (merged, whole) = (merged.estimate().unwrap(), whole.estimate().unwrap());
        assert_eq!(merged.jitters, 30);
        let pairs = [
            (merged.noise, whole.noise),
            (merged.bias, whole.bias),
            (merged.correlation, whole.correlation),
        ];
        for (merged, whole) in pairs {
            // Steps are kept in f32, and the bias is a difference of nearly equal sums.
            assert!((merged - whole).abs() <= 1e-5 * whole.abs() + 1e-7, "{merged} {whole}");
        }
    }

    #[test]
    fn window_means_are_those_of_brute_force() {
        let values: Vec<f64> = (0..WIDTH * HEIGHT).map(|i| (i * i % 97) as f64).collect();
        let means = window_means(&values, WIDTH);
        for (x, y) in [(0, 0), (20, 12), (39, 24), (2, 23)] {
            let near = |at: usize, of: usize| at.saturating_sub(3)..of.min(at + 4);
            let rows = near(y, HEIGHT).map(|row| {
                near(x, WIDTH).map(|column| values[row * WIDTH + column]).sum::<f64>()
                    / near(x, WIDTH).len() as f64
            });
            let expected = rows.sum::<f64>() / near(y, HEIGHT).len() as f64;
            assert!((means[y * WIDTH + x] - expected).abs() < 1e-9);
        }
    }

    /// Noise alone, whose square falls as 1/n: half of it takes four times the passes. A bias that falls more
    /// slowly takes longer, and no number of passes in reach brings it to nothing.
    #[test]
    fn passes_to_a_target_follow_the_decays() {
        let noise = ErrorEstimate {
            relative: 0.1,
            noise: 0.1,
            noise_decay: 1.0,
            bias_decay: 0.6,
            ..ErrorEstimate::default()
        };
        assert!((noise.passes_factor(0.05).unwrap() - 4.0).abs() < 1e-6);
        assert_eq!(noise.passes_factor(0.1), Some(1.0));
        let bias = ErrorEstimate { noise: 0.0, bias: 0.1, ..noise };
        assert!((bias.passes_factor(0.05).unwrap() - 4f64.powf(1.0 / 0.6)).abs() < 1e-6);
        assert_eq!(bias.passes_factor(1e-9), None);
    }
}
