//! What two independent renders of one picture tell about each other without any reference: the noise of their mean,
//! and how far the expectations of two such pairs lie apart.

use super::metrics::{relative_mse, rmse};
use super::picture::Picture;
use super::results::Noise;

/// Side [pixels] of the tiles over which an estimate's spread is taken: neighbouring pixels share their noise.
const TILE: usize = 8;

/// Two independent renders of one picture.
#[derive(Debug, Clone)]
pub struct Halves {
    pub pictures: [Picture; 2],
    /// Samples or passes of each; above 0.
    pub works: [f64; 2],
}

/// An estimated mean square, and the standard error of the estimate. The estimate may be below 0, as it is unbiased.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Square {
    pub mean: f64,
    pub error: f64,
}

impl Square {
    /// Root of the estimate.
    pub fn root(self) -> f64 {
        self.mean.max(0.0).sqrt()
    }

    /// Root of what the square hardly exceeds: two standard errors more.
    pub fn bound(self) -> f64 {
        (self.mean.max(0.0) + 2.0 * self.error).sqrt()
    }

    /// Whether it cannot be chance.
    pub fn is_significant(self) -> bool {
        self.mean > 4.0 * self.error
    }
}

impl Halves {
    /// Of both, weighted by their work.
    pub fn mean(&self) -> Picture {
        let [share, rest] = self.shares();
        self.combine(|a, b| (share * f64::from(a) + rest * f64::from(b)) as f32)
    }

    /// The noise of the mean. Where variances are as the inverse works `1/u` and `1/v`, the difference of the halves
    /// times `sqrt(u v) / (u + v)` has the variance of the mean.
    pub fn noise(&self) -> Noise {
        let mean = self.mean();
        let noisy = self.with_its_noise(&mean);
        Noise { rmse: rmse(&noisy, &mean), relative_mse: relative_mse(&noisy, &mean) }
    }

    /// The noise of the mean, root mean square, relative to another picture.
    pub fn noise_relative_to(&self, scale: &Picture) -> f64 {
        relative_mse(&self.with_its_noise(scale), scale).sqrt()
    }

    /// A picture with the error that the mean typically has.
    fn with_its_noise(&self, picture: &Picture) -> Picture {
        let [share, rest] = self.shares();
        let factor = (share * rest).sqrt();
        let difference = self.combine(|a, b| (factor * (f64::from(a) - f64::from(b))) as f32);
        let pixels = picture.pixels.iter().zip(&difference.pixels);
        let pixels = pixels.map(|(p, d)| [0, 1, 2].map(|c| p[c] + d[c])).collect();
        Picture { pixels, ..difference }
    }

    fn shares(&self) -> [f64; 2] {
        self.works.map(|work| work / (self.works[0] + self.works[1]))
    }

    fn combine(&self, of: impl Fn(f32, f32) -> f32) -> Picture {
        let [a, b] = &self.pictures;
        let pixels = a.pixels.iter().zip(&b.pixels);
        let pixels = pixels.map(|(a, b)| [0, 1, 2].map(|c| of(a[c], b[c]))).collect();
        Picture { width: a.width, height: a.height, pixels }
    }
}

/// The squared difference of what two pairs expect, relative to `scale` as in the relative MSE. The product of the
/// differences of the first and of the second halves has no noise in the mean, as the halves are independent.
pub fn squared_difference(x: &Halves, y: &Halves, scale: &Picture) -> Square {
    let floor = scale.dark_floor();
    let product = |index: usize| -> f64 {
        let channel = |c: usize| {
            let difference = |half: usize| {
                let (x, y) = (&x.pictures[half].pixels[index], &y.pictures[half].pixels[index]);
                f64::from(x[c]) - f64::from(y[c])
            };
            let r = f64::from(scale.pixels[index][c]);
            difference(0) * difference(1) / (r * r + floor)
        };
        (channel(0) + channel(1) + channel(2)) / 3.0
    };
    mean_over_tiles(scale.width, scale.height, product)
}

/// The mean over pixels, and its standard error from the spread of the tiles.
fn mean_over_tiles(width: usize, height: usize, value: impl Fn(usize) -> f64) -> Square {
    let mut tiles = vec![0.0; width.div_ceil(TILE) * height.div_ceil(TILE)];
    for y in 0..height {
        for x in 0..width {
            tiles[y / TILE * width.div_ceil(TILE) + x / TILE] += value(y * width + x);
        }
    }
    let (count, pixels) = (tiles.len() as f64, (width * height) as f64);
    let sum: f64 = tiles.iter().sum();
    let squares: f64 = tiles.iter().map(|tile| (tile - sum / count).powi(2)).sum();
    let error = (squares * count / (count - 1.0).max(1.0)).sqrt() / pixels;
    Square { mean: sum / pixels, error }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};

    fn grey(value: f32) -> Picture {
        Picture::from_fn(3, 2, |_, _| [value; 3])
    }

    /// Grey with noise of the given standard deviation.
    fn noisy(seed: u64, value: f32, deviation: f32) -> Picture {
        let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(seed);
        let mut picture = Picture::from_fn(64, 64, |_, _| [value; 3]);
        for value in picture.pixels.iter_mut().flatten() {
            *value += deviation * 3f32.sqrt() * (2.0 * random.random::<f32>() - 1.0);
        }
        picture
    }

    fn halves(seed: u64, value: f32, deviation: f32) -> Halves {
        let pictures = [2 * seed, 2 * seed + 1].map(|seed| noisy(seed, value, deviation));
        Halves { pictures, works: [1.0; 2] }
    }

    #[test]
    fn noise_of_the_mean_is_half_the_difference_of_equal_halves() {
        let halves = Halves { pictures: [grey(1.2), grey(0.8)], works: [5.0; 2] };
        assert_eq!(halves.mean().pixels[0], [1.0; 3]);
        let noise = halves.noise();
        assert!((noise.rmse - 0.2).abs() < 1e-6);
        assert!((noise.relative_mse - 0.04 / 1.01).abs() < 1e-6);
    }

    #[test]
    fn noise_of_unequal_halves_is_that_of_all_samples() {
        // One sample has the deviation 0.4: halves of 16 and 4 samples, a mean of 20.
        let pictures = [noisy(1, 1.0, 0.1), noisy(2, 1.0, 0.2)];
        let halves = Halves { pictures, works: [16.0, 4.0] };
        let expected = 0.4 / 20f64.sqrt();
        assert!((halves.noise().rmse / expected - 1.0).abs() < 0.03, "{:?}", halves.noise());
        let error = rmse(&halves.mean(), &Picture::from_fn(64, 64, |_, _| [1.0; 3]));
        assert!((error / expected - 1.0).abs() < 0.03, "{error}");
    }

    #[test]
    fn difference_of_expectations_is_found_beneath_noise() {
        let scale = Picture::from_fn(64, 64, |_, _| [1.0; 3]);
        let apart =
            |value| squared_difference(&halves(1, 1.0, 0.3), &halves(2, value, 0.3), &scale);
        let same = apart(1.0);
        assert!(!same.is_significant() && same.bound() < 0.08, "{same:?}");
        let other = apart(1.1);
        assert!(other.is_significant(), "{other:?}");
        assert!((other.root() - 0.1).abs() < 0.02, "{other:?}");
    }
}
