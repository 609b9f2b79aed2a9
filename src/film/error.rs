//! How far a picture may be off, told without a reference: noise from the spread of the jitters, bias
//! from what a narrower kernel saw of the same photons. [Hachisuka 2010] is where the idea comes from.

use super::FilmSums;
use crate::scene::SceneDescription;
use serde::Serialize;

/// Jitters from which an estimate is made; fewer say too little of their own spread.
const FEWEST_JITTERS: u32 = 2;
/// Jitters from which an estimate may end a render.
const JITTERS_TO_STOP: u32 = 4;
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

/// What one film pixel has shown so far.
#[derive(Debug, Clone, Copy, Default)]
struct Moments {
    sum: [f64; 3],
    square: [f64; 3],
    last: [f32; 3],
    /// Squared steps from a jitter to the next.
    steps: [f32; 3],
    bias: f64,
    bias_square: f64,
}

/// Spread and trend of all jitters so far. Each counts alike, so they must have had equally many passes.
#[derive(Debug, Clone)]
pub struct ErrorSums {
    pixels: Vec<Moments>,
    width: usize,
    channels: usize,
    jitters: u32,
    noise_decay: f64,
    bias_decay: f64,
}

impl ErrorSums {
    /// For passes of which a share `alpha` of the photons is kept from one to the next.
    // [Error decay]
    pub fn new(description: &SceneDescription, alpha: f32) -> Self {
        let alpha = f64::from(alpha);
        ErrorSums {
            pixels: vec![Moments::default(); description.film_pixels as usize],
            width: description.film_width as usize,
            channels: description.film_channels as usize,
            jitters: 0,
            noise_decay: alpha,
            bias_decay: 2.0 * (1.0 - alpha),
        }
    }

    /// Adds the film of one jitter and, in the place of its red, the film of the jitter's bias.
    pub fn add(&mut self, picture: &FilmSums, bias: &FilmSums) {
        let channels = self.channels;
        let films = picture.values.chunks(channels).zip(bias.values.chunks(channels));
        let first = self.jitters == 0;
        for (moments, (picture, bias)) in self.pixels.iter_mut().zip(films) {
            let weight = picture[channels - 1];
            if weight > 0.0 {
                let value = [0, 1, 2].map(|channel| picture[channel] / weight);
                moments.add(value, bias[0] / weight, first);
            }
        }
        self.jitters += 1;
    }

    /// None before there are enough jitters.
    pub fn estimate(&self) -> Option<ErrorEstimate> {
        if self.jitters < FEWEST_JITTERS {
            return None;
        }
        let count = (3 * self.pixels.len()) as f64;
        let sums = self.pixels.iter().flat_map(|pixel| pixel.sum).sum::<f64>();
        let floor = (0.1 * sums / self.count() / count).powi(2).max(f64::MIN_POSITIVE);
        let correlation = self.correlation(floor);
        let (mut noise, mut bias) = (0.0, 0.0);
        for pixel in &self.pixels {
            for channel in 0..3 {
                let variance = self.variance(pixel, channel);
                noise += variance / self.scale(pixel, channel, floor);
            }
            let scale = (0..3).map(|channel| self.scale(pixel, channel, floor)).sum::<f64>();
            bias += 9.0 * self.squared_bias(pixel, correlation) / scale;
        }
        noise = noise * inflation(correlation) / count;
        bias = (bias / count).max(0.0);
        Some(ErrorEstimate {
            relative: (noise + bias).sqrt(),
            noise: noise.sqrt(),
            bias: bias.sqrt(),
            noise_decay: self.noise_decay,
            bias_decay: self.bias_decay,
            correlation,
            jitters: self.jitters,
        })
    }

    /// The standard error of red, green and blue of each pixel, in the picture's unit, bias included;
    /// zero before there are enough jitters.
    pub fn image(&self) -> Vec<[f32; 3]> {
        let Some(whole) = self.estimate() else { return vec![[0.0; 3]; self.pixels.len()] };
        let biases: Vec<f64> =
            self.pixels.iter().map(|pixel| self.squared_bias(pixel, whole.correlation)).collect();
        let biases = window_means(&biases, self.width);
        let inflation = inflation(whole.correlation);
        let error = |(pixel, bias): (&Moments, f64)| {
            [0, 1, 2].map(|channel| {
                (self.variance(pixel, channel) * inflation + bias.max(0.0)).sqrt() as f32
            })
        };
        self.pixels.iter().zip(biases).map(error).collect()
    }

    fn count(&self) -> f64 {
        f64::from(self.jitters)
    }

    /// Of the mean over jitters, if they are independent.
    fn variance(&self, pixel: &Moments, channel: usize) -> f64 {
        self.variance_of_mean(pixel.sum[channel], pixel.square[channel])
    }

    fn variance_of_mean(&self, sum: f64, square: f64) -> f64 {
        let count = self.count();
        ((square - sum * sum / count) / (count * (count - 1.0))).max(0.0)
    }

    /// Unbiased for independent jitters, so it may be negative.
    fn squared_bias(&self, pixel: &Moments, correlation: f64) -> f64 {
        let mean = pixel.bias / self.count();
        let variance = self.variance_of_mean(pixel.bias, pixel.bias_square);
        mean * mean - variance * inflation(correlation)
    }

    /// What a squared difference is divided by; the square of a noisy mean is too large by its variance.
    fn scale(&self, pixel: &Moments, channel: usize, floor: f64) -> f64 {
        let mean = pixel.sum[channel] / self.count();
        (mean * mean - self.variance(pixel, channel)).max(0.0) + floor
    }

    /// The mean squared step is twice the variance, less the correlation. [von Neumann 1941]
    fn correlation(&self, floor: f64) -> f64 {
        let (mut steps, mut spread) = (0.0, 0.0);
        for pixel in &self.pixels {
            for channel in 0..3 {
                let scale = self.scale(pixel, channel, floor);
                steps += f64::from(pixel.steps[channel]) / scale;
                spread += self.variance(pixel, channel) / scale;
            }
        }
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
            if !first {
                self.steps[channel] += (value - f64::from(self.last[channel])).powi(2) as f32;
            }
            self.last[channel] = value as f32;
        }
        self.bias += bias;
        self.bias_square += bias * bias;
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
