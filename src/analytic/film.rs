//! A film with a box filter: a sample belongs to the pixel that it falls into.

use crate::scene::FilmSamples;

/// Red, green, blue, alpha and weight: sums of weighted samples, and of the weights.
pub const FILM_CHANNELS: usize = 5;

/// Adds samples to sums of [`FILM_CHANNELS`] values per pixel, row by row.
pub(super) fn splat(samples: &FilmSamples, size: [u32; 2], storage: &mut [f64]) {
    let [width, height] = size.map(|n| n as usize);
    let lanes = samples.weight.len();
    for lane in 0..lanes {
        // A sample that rounding has put on the far edge belongs to the last pixel.
        let x = (samples.position[lane] as usize).min(width - 1);
        let y = (samples.position[lanes + lane] as usize).min(height - 1);
        let first = (y * width + x) * FILM_CHANNELS;
        let (color, weight) = (samples.radiance.rgb(lane), f64::from(samples.weight[lane]));
        let values = [color.r, color.g, color.b, samples.alpha[lane], 1.0];
        for (sum, value) in storage[first..first + FILM_CHANNELS].iter_mut().zip(values) {
            *sum += weight * f64::from(value);
        }
    }
}
