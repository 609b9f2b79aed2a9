//! A perceptual error: the difference that one sees when two pictures are flipped in place.
//!
//! LDR-FLIP of Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild, "FLIP: A Difference Evaluator for
//! Alternating Images", HPG 2020; section numbers below are the paper's. Pictures are exposed alike by the
//! reference's [`Exposure`] and clipped to \[0,1\]. 0 is no visible difference, 1 the largest.

use super::display::Exposure;
use super::picture::Picture;
use std::f64::consts::PI;

/// A screen 0.7 m wide with 3840 pixels, seen from 0.7 m.
const PIXELS_PER_DEGREE: f64 = 67.02;

/// Contrast sensitivities as sums of Gaussians (weight, width in degrees²), §4.1.1.
const ACHROMATIC: [(f64, f64); 2] = [(1.0, 0.0047), (0.0, 1e-5)];
const RED_GREEN: [(f64, f64); 2] = [(1.0, 0.0053), (0.0, 1e-5)];
const BLUE_YELLOW: [(f64, f64); 2] = [(34.1, 0.04), (13.5, 0.025)];

/// Exponents and knee of the colour error (§4.1.3), width and exponent of the feature error (§4.2).
const COLOUR_EXPONENT: f64 = 0.7;
const KNEE_IN: f64 = 0.4;
const KNEE_OUT: f64 = 0.95;
const FEATURE_WIDTH: f64 = 0.082;
const FEATURE_EXPONENT: f64 = 0.5;

/// White point of D65.
const WHITE: [f64; 3] = [0.950_428_545_377_182, 1.0, 1.088_900_370_798_128];

/// A reference that pictures are held against.
pub struct Flip {
    exposure: Exposure,
    largest: f64,
    seen: Seen,
}

/// What the eye makes of a picture.
struct Seen {
    /// Hunt-adjusted Lab after the contrast sensitivity filters.
    colour: Vec<[f64; 3]>,
    /// Magnitudes of edges and points.
    features: Vec<[f64; 2]>,
}

impl Flip {
    pub fn new(reference: &Picture) -> Self {
        let exposure = Exposure::of(reference);
        let largest = colour_distance(hunt_lab([0.0, 1.0, 0.0]), hunt_lab([0.0, 0.0, 1.0]))
            .powf(COLOUR_EXPONENT);
        Flip { exposure, largest, seen: Seen::new(reference, exposure) }
    }

    /// Error per pixel in \[0,1\]. The picture must have the reference's size.
    pub fn errors(&self, picture: &Picture) -> Vec<f64> {
        assert_eq!(picture.pixels.len(), self.seen.colour.len(), "pictures of one size");
        let seen = Seen::new(picture, self.exposure);
        let colours = self.seen.colour.iter().zip(&seen.colour);
        let features = self.seen.features.iter().zip(&seen.features);
        colours
            .zip(features)
            .map(|((&a, &b), (f, g))| self.colour_error(a, b).powf(1.0 - feature_error(*f, *g)))
            .collect()
    }

    /// Mean of the errors over all pixels.
    pub fn mean_error(&self, picture: &Picture) -> f64 {
        let errors = self.errors(picture);
        errors.iter().sum::<f64>() / errors.len().max(1) as f64
    }

    /// §4.1.3: compresses large differences.
    fn colour_error(&self, a: [f64; 3], b: [f64; 3]) -> f64 {
        let error = colour_distance(a, b).powf(COLOUR_EXPONENT);
        let knee = KNEE_IN * self.largest;
        let mapped = if error < knee {
            KNEE_OUT / knee * error
        } else {
            KNEE_OUT + (error - knee) / (self.largest - knee) * (1.0 - KNEE_OUT)
        };
        mapped.clamp(0.0, 1.0)
    }
}

/// §4.2: the larger of the differences of edges and of points.
fn feature_error(a: [f64; 2], b: [f64; 2]) -> f64 {
    let difference = (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
    (difference / 2f64.sqrt()).powf(FEATURE_EXPONENT).clamp(0.0, 1.0)
}

impl Seen {
    fn new(picture: &Picture, exposure: Exposure) -> Self {
        let size = picture.size();
        let opponent: Vec<[f64; 3]> = picture
            .pixels
            .iter()
            .map(|&pixel| to_opponent(rgb_to_xyz(exposure.expose(pixel))))
            .collect();
        let channel = |c: usize| opponent.iter().map(|value| value[c]).collect::<Vec<f64>>();
        let filtered = [
            sensitivity(&channel(0), size, ACHROMATIC),
            sensitivity(&channel(1), size, RED_GREEN),
            sensitivity(&channel(2), size, BLUE_YELLOW),
        ];
        let colour = (0..opponent.len())
            .map(|i| {
                let xyz = from_opponent([filtered[0][i], filtered[1][i], filtered[2][i]]);
                hunt_lab(xyz_to_rgb(xyz).map(|value| value.clamp(0.0, 1.0)))
            })
            .collect();
        let grey: Vec<f64> = opponent.iter().map(|value| (value[0] + 16.0) / 116.0).collect();
        Seen { colour, features: features(&grey, size) }
    }
}

/// §4.1.1: one channel as the eye resolves it.
fn sensitivity(channel: &[f64], size: [usize; 2], gaussians: [(f64, f64); 2]) -> Vec<f64> {
    let widest = BLUE_YELLOW[0].1;
    let radius = (3.0 * (widest / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as i64;
    let mut sum = vec![0.0; channel.len()];
    let mut total = 0.0;
    for (weight, width) in gaussians {
        if weight == 0.0 {
            continue;
        }
        let taps = taps(radius, |x| (-(PI * x / PIXELS_PER_DEGREE).powi(2) / width).exp());
        let (mass, amplitude) = (taps.iter().sum::<f64>(), weight * (PI / width).sqrt());
        total += amplitude * mass * mass;
        for (out, value) in sum.iter_mut().zip(convolve(channel, size, &taps, &taps)) {
            *out += amplitude * value;
        }
    }
    sum.iter().map(|value| value / total).collect()
}

/// §4.2: magnitudes of edges (first derivative of a Gaussian) and points (second derivative).
fn features(grey: &[f64], size: [usize; 2]) -> Vec<[f64; 2]> {
    let deviation = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
    let radius = (3.0 * deviation).ceil() as i64;
    let gauss = |x: f64| (-x * x / (2.0 * deviation * deviation)).exp();
    let blur = taps(radius, gauss);
    let edge = taps(radius, |x| -x * gauss(x));
    let point = taps(radius, |x| (x * x / (deviation * deviation) - 1.0) * gauss(x));
    let magnitude = |derivative: &[f64]| -> Vec<f64> {
        let (above, below) = lobes(derivative, &blur);
        // Positive and negative weights of the kernel sum to 1 each.
        let scaled = |value: &f64| if *value > 0.0 { value / above } else { value / below };
        let taps: Vec<f64> = derivative.iter().map(scaled).collect();
        let along_x = convolve(grey, size, &taps, &blur);
        let along_y = convolve(grey, size, &blur, &taps);
        along_x.iter().zip(along_y).map(|(x, y)| x.hypot(y)).collect()
    };
    magnitude(&edge).into_iter().zip(magnitude(&point)).map(|(e, p)| [e, p]).collect()
}

/// Sums of a two-dimensional kernel's positive weights and of its negative ones, without their sign.
fn lobes(derivative: &[f64], blur: &[f64]) -> (f64, f64) {
    let across: f64 = blur.iter().sum();
    let above: f64 = derivative.iter().filter(|&&value| value > 0.0).sum();
    let below: f64 = derivative.iter().filter(|&&value| value < 0.0).sum();
    (above * across, -below * across)
}

fn taps(radius: i64, weight: impl Fn(f64) -> f64) -> Vec<f64> {
    (-radius..=radius).map(|x| weight(x as f64)).collect()
}

/// Convolves with `across` in x and `down` in y; the border's pixels go on outside.
fn convolve(channel: &[f64], size: [usize; 2], across: &[f64], down: &[f64]) -> Vec<f64> {
    let [width, height] = size;
    let rows = pass(channel, across, [width, height], |x, y| y * width + x);
    pass(&rows, down, [height, width], |y, x| y * width + x)
}

/// One dimension of a convolution: along the first coordinate, for all values of the second.
fn pass(
    channel: &[f64],
    taps: &[f64],
    [along, others]: [usize; 2],
    index: impl Fn(usize, usize) -> usize,
) -> Vec<f64> {
    let radius = (taps.len() / 2) as i64;
    let mut out = vec![0.0; channel.len()];
    for other in 0..others {
        for i in 0..along {
            let at =
                |tap: usize| (i as i64 + tap as i64 - radius).clamp(0, along as i64 - 1) as usize;
            let terms = taps.iter().enumerate();
            out[index(i, other)] =
                terms.map(|(tap, weight)| weight * channel[index(at(tap), other)]).sum();
        }
    }
    out
}

/// HyAB distance in Lab.
fn colour_distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (a[0] - b[0]).abs() + (a[1] - b[1]).hypot(a[2] - b[2])
}

/// Lab of linear RGB, chroma scaled by lightness: colours look paler in the dark. §4.1.2
fn hunt_lab(rgb: [f64; 3]) -> [f64; 3] {
    let xyz = rgb_to_xyz(rgb);
    let f = |value: f64| {
        let delta: f64 = 6.0 / 29.0;
        if value > delta.powi(3) {
            value.cbrt()
        } else {
            value / (3.0 * delta * delta) + 4.0 / 29.0
        }
    };
    let [x, y, z] = [0, 1, 2].map(|axis| f(xyz[axis] / WHITE[axis]));
    let lightness = 116.0 * y - 16.0;
    [lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)]
}

/// YCxCz, a linear relative of Lab.
fn to_opponent(xyz: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = [0, 1, 2].map(|axis| xyz[axis] / WHITE[axis]);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn from_opponent([y, cx, cz]: [f64; 3]) -> [f64; 3] {
    let y = (y + 16.0) / 116.0;
    [(y + cx / 500.0) * WHITE[0], y * WHITE[1], (y - cz / 200.0) * WHITE[2]]
}

fn rgb_to_xyz([r, g, b]: [f64; 3]) -> [f64; 3] {
    [
        0.412_390_799_265_959 * r + 0.357_584_339_383_878 * g + 0.180_480_788_401_834 * b,
        0.212_639_005_871_510 * r + 0.715_168_678_767_756 * g + 0.072_192_315_360_734 * b,
        0.019_330_818_715_592 * r + 0.119_194_779_794_626 * g + 0.950_532_152_249_661 * b,
    ]
}

fn xyz_to_rgb([x, y, z]: [f64; 3]) -> [f64; 3] {
    [
        3.240_969_941_904_523 * x - 1.537_383_177_570_094 * y - 0.498_610_760_293_003 * z,
        -0.969_243_636_280_880 * x + 1.875_967_501_507_721 * y + 0.041_555_057_407_176 * z,
        0.055_630_079_696_994 * x - 0.203_976_958_888_977 * y + 1.056_971_514_242_879 * z,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers in [0,1] that look random.
    fn noise(seed: usize) -> Picture {
        Picture::from_fn(24, 17, |x, y| {
            [1, 2, 3].map(|c| ((seed + 37 * x + 101 * y) * (17 * c + 5) % 101) as f32 / 100.0)
        })
    }

    #[test]
    fn equal_pictures_differ_by_nothing() {
        assert!(Flip::new(&noise(1)).errors(&noise(1)).iter().all(|&error| error < 1e-6));
    }

    #[test]
    fn errors_are_within_bounds_and_symmetric_under_one_exposure() {
        let (a, b) = (noise(1), noise(60));
        let mut other = Flip::new(&b);
        let flip = Flip::new(&a);
        other.exposure = flip.exposure;
        other.seen = Seen::new(&b, flip.exposure);
        for (there, back) in flip.errors(&b).into_iter().zip(other.errors(&a)) {
            assert!((0.0..=1.0).contains(&there));
            assert!((there - back).abs() < 1e-12);
        }
        assert!(flip.mean_error(&b) > 0.1);
    }

    #[test]
    fn black_against_white_is_a_large_error_and_a_little_grey_a_small_one() {
        let grey = |value: f32| Picture::from_fn(16, 16, |_, _| [value; 3]);
        let flip = Flip::new(&grey(1.0));
        assert!(flip.mean_error(&grey(0.0)) > 0.9);
        let (small, smaller) = (flip.mean_error(&grey(0.95)), flip.mean_error(&grey(0.99)));
        assert!(smaller < small && small < 0.2, "{smaller} {small}");
    }

    #[test]
    fn opponent_space_and_back_is_the_identity() {
        let rgb = [0.2, 0.7, 0.4];
        let back = xyz_to_rgb(from_opponent(to_opponent(rgb_to_xyz(rgb))));
        assert!(rgb.iter().zip(back).all(|(a, b)| (a - b).abs() < 1e-9));
    }

    #[test]
    fn flat_pictures_have_no_features() {
        let seen = features(&vec![0.5; 20 * 20], [20, 20]);
        assert!(seen.iter().flatten().all(|value| value.abs() < 1e-12));
    }

    #[test]
    fn an_edge_of_full_contrast_has_magnitude_one_at_most() {
        let step: Vec<f64> = (0..40 * 20).map(|i| f64::from(u8::from(i % 40 >= 20))).collect();
        let largest = features(&step, [40, 20]).iter().map(|f| f[0]).fold(0.0, f64::max);
        assert!((0.9..=1.0 + 1e-9).contains(&largest), "{largest}");
    }
}
