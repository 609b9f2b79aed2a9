//! Samples on their way to the pixels around them, through the film's reconstruction filter.
//!
//! Every band of rows takes the samples that reach it, in their order, so bands are filled in side by side, without atomics,
//! and each pixel comes out the same bits however many bands there are.

use super::FilmSums;
use crate::math::Rgb;
use crate::scene::{work, FilmFilter, Scene, SceneDescription, RGB_ALPHA_WEIGHT};
use glam::{Vec2, Vec4};
use std::ops::{AddAssign, Mul};

/// Pixels of a band at least, and rows of it, beside which those are few that two bands share.
const PIXELS_PER_BAND: usize = 8192;
const ROWS_PER_BAND: usize = 16;
/// Samples that are looked at together to see whether they reach a band. Where they come row by row, few of them do.
const GROUP: usize = 1024;

/// What a ray brings to the film.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FilmSample {
    pub radiance: Rgb,
    pub alpha: f32,
    /// Of the radiance; it goes beside the film.
    pub bias: f32,
    /// What all of them count for.
    pub weight: f32,
}

/// Adds samples at these positions in film coordinates, and their bias to one value for each pixel of the film; `sample` may be
/// asked about one of them several times.
pub fn splat(
    scene: &dyn Scene,
    positions: &[[f32; 2]],
    sample: impl Fn(usize) -> FilmSample + Sync,
    film: &mut FilmSums,
    bias: Option<&mut [f64]>,
) {
    let description = scene.description();
    let rows = ROWS_PER_BAND.max(PIXELS_PER_BAND.div_ceil(description.film_width.max(1) as usize));
    let groups = groups(positions);
    let bands = bands(description, &mut film.values, bias, rows);
    work::for_each(scene, bands, |mut band| {
        for (group, positions) in groups.iter().zip(positions.chunks(GROUP)) {
            band.add_all(group, positions, &sample);
        }
        band.pour();
    });
}

/// Cuts the values of a film into bands of so many rows.
fn bands<'a>(
    description: &'a SceneDescription,
    values: &'a mut [f64],
    bias: Option<&'a mut [f64]>,
    rows: usize,
) -> Vec<Band<'a>> {
    let pixels = (rows * description.film_width as usize).max(1);
    let mut biases = bias.map(|bias| bias.chunks_mut(pixels));
    let values = values.chunks_mut(pixels * description.film_channels as usize);
    let band = |(first_row, values)| {
        let bias = biases.as_mut().and_then(Iterator::next).unwrap_or_default();
        Band::new(description, first_row, values, bias)
    };
    (0..).step_by(rows).zip(values).map(band).collect()
}

/// Samples that come one after another.
struct Group {
    first: usize,
    /// Least and largest of their second coordinates.
    rows: [f32; 2],
}

fn groups(positions: &[[f32; 2]]) -> Vec<Group> {
    let group = |(first, positions): (usize, &[[f32; 2]])| {
        let nothing = [f32::INFINITY, f32::NEG_INFINITY];
        let rows = positions
            .iter()
            .fold(nothing, |[low, high], position| [low.min(position[1]), high.max(position[1])]);
        Group { first, rows }
    };
    (0..).step_by(GROUP).zip(positions.chunks(GROUP)).map(group).collect()
}

/// Rows of the film that one task fills in, in single precision: so the sums of jitters stay exact, see [`super::ExactSums`].
struct Band<'a> {
    filter: &'a FilmFilter,
    /// Film coordinates of the middle of the first pixel.
    origin: Vec2,
    width: usize,
    rows: usize,
    channels: usize,
    /// What there is for them already; no bias where it is not asked for.
    values: &'a mut [f64],
    bias: &'a mut [f64],
    /// Red, green, blue and the weight.
    sums: Vec<Vec4>,
    /// Alpha and bias.
    further: Vec<Vec2>,
    /// Of the columns that a sample counts for.
    weights: Vec<f32>,
}

impl<'a> Band<'a> {
    fn new(
        description: &'a SceneDescription,
        first_row: usize,
        values: &'a mut [f64],
        bias: &'a mut [f64],
    ) -> Self {
        let [left, top] = description.film_origin();
        let channels = description.film_channels as usize;
        let (pixels, width) = (values.len() / channels, description.film_width as usize);
        Band {
            filter: &description.film_filter,
            origin: Vec2::new(left as f32, (top + first_row as i32) as f32) + 0.5,
            width,
            rows: pixels / width,
            channels,
            values,
            bias,
            sums: Vec::new(),
            further: Vec::new(),
            weights: Vec::new(),
        }
    }

    /// Adds the samples of a group, if any reaches the band.
    fn add_all(
        &mut self,
        group: &Group,
        positions: &[[f32; 2]],
        sample: &impl Fn(usize) -> FilmSample,
    ) {
        if !self.reaches(group.rows) {
            return;
        }
        let pixels = self.rows * self.width;
        self.sums.resize(pixels, Vec4::ZERO);
        self.further.resize(pixels, Vec2::ZERO);
        for (number, &position) in (group.first..).zip(positions) {
            self.add(position, || sample(number));
        }
    }

    /// Whether samples between these second coordinates may count for a pixel of the band.
    fn reaches(&self, [low, high]: [f32; 2]) -> bool {
        let [first, last] =
            [low, high].map(|row| self.filter.pixels(Vec2::splat(row) - self.origin));
        last[1].y >= 0.0 && first[0].y < self.rows as f32
    }

    /// Adds a sample to the pixels that it counts for.
    #[inline]
    fn add(&mut self, position: [f32; 2], sample: impl FnOnce() -> FilmSample) {
        let place = Vec2::from(position) - self.origin;
        let [first, last] = self.filter.pixels(place);
        let [columns, rows] = [(0, self.width), (1, self.rows)].map(|(axis, count)| {
            // What is not a number counts for no pixel.
            let end = (last[axis] + 1.0) as u32 as usize;
            first[axis] as u32 as usize..end.min(count)
        });
        if columns.is_empty() || rows.is_empty() {
            return;
        }
        let FilmSample { radiance, alpha, bias, weight } = sample();
        let value = glam::Vec3::from(radiance).extend(1.0) * weight;
        let further = Vec2::new(alpha, bias) * weight;
        self.weights.clear();
        self.weights
            .extend(columns.clone().map(|column| self.filter.weight(column as f32 - place.x)));
        for row in rows {
            let of_row = self.filter.weight(row as f32 - place.y);
            let first = row * self.width + columns.start;
            add_row(&mut self.sums[first..], value * of_row, &self.weights);
            if further != Vec2::ZERO {
                add_row(&mut self.further[first..], further * of_row, &self.weights);
            }
        }
    }

    /// Adds the sums to what there is.
    fn pour(self) {
        let has_alpha = self.channels == RGB_ALPHA_WEIGHT as usize;
        let pixels = self.values.chunks_exact_mut(self.channels).zip(&self.sums);
        for ((values, sums), further) in pixels.zip(&self.further) {
            let [r, g, b, weight] = sums.to_array();
            let alpha = has_alpha.then_some(further.x);
            let sums = [r, g, b].into_iter().chain(alpha).chain([weight]);
            values.iter_mut().zip(sums).for_each(|(value, sum)| *value += f64::from(sum));
        }
        let biases = self.bias.iter_mut().zip(&self.further);
        biases.for_each(|(bias, further)| *bias += f64::from(further.y));
    }
}

/// Adds a value to neighbours in a row, by their weights.
#[inline]
fn add_row<V: Copy + AddAssign + Mul<f32, Output = V>>(sums: &mut [V], value: V, weights: &[f32]) {
    sums.iter_mut().zip(weights).for_each(|(sum, &weight)| *sum += value * weight);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::RGB_WEIGHT;
    use proptest::prelude::*;

    const SIZE: [u32; 2] = [6, 11];

    /// A film of 6 x 11 pixels within a border of two.
    fn description(channels: u32) -> SceneDescription {
        SceneDescription {
            film_size: SIZE.map(|pixels| pixels + 4),
            film_offset: [-2, 7],
            film_filter: FilmFilter::new(1.7, vec![0.9, 0.4, -0.1, 0.0]).unwrap(),
            ..SceneDescription::of_film(SIZE, channels)
        }
    }

    fn splat_in_bands(
        description: &SceneDescription,
        samples: &[([f32; 2], FilmSample)],
        rows: usize,
    ) -> [Vec<f64>; 2] {
        let positions: Vec<_> = samples.iter().map(|(position, _)| *position).collect();
        let mut values = vec![0.0; (SIZE[0] * SIZE[1] * description.film_channels) as usize];
        let mut biases = vec![0.0; (SIZE[0] * SIZE[1]) as usize];
        for mut band in bands(description, &mut values, Some(&mut biases), rows) {
            for (group, positions) in groups(&positions).iter().zip(positions.chunks(GROUP)) {
                band.add_all(group, positions, &|number| samples[number].1);
            }
            band.pour();
        }
        [values, biases]
    }

    /// Sums over all samples, pixel by pixel: the weight is the product of the filter along both axes.
    fn expected(
        description: &SceneDescription,
        samples: &[([f32; 2], FilmSample)],
    ) -> [Vec<f64>; 2] {
        let filter = &description.film_filter;
        let (mut values, mut biases) = (Vec::new(), Vec::new());
        for (row, column) in (0..SIZE[1]).flat_map(|row| (0..SIZE[0]).map(move |c| (row, c))) {
            let middle = [column as f32 + 0.5, row as f32 + 0.5 + 9.0];
            let mut sums = vec![0.0; description.film_channels as usize];
            let mut bias = 0.0;
            for (position, sample) in samples {
                let [x, y] = [0, 1].map(|axis| position[axis] - middle[axis]);
                if x.abs().max(y.abs()) > filter.radius() {
                    continue;
                }
                let weight = f64::from(sample.weight * filter.weight(x) * filter.weight(y));
                let Rgb { r, g, b } = sample.radiance;
                let all = [r, g, b, sample.alpha, 1.0].map(|value| weight * f64::from(value));
                let last = sums.len() - 1;
                sums[..last].iter_mut().zip(all).for_each(|(sum, value)| *sum += value);
                sums[last] += all[4];
                bias += weight * f64::from(sample.bias);
            }
            values.extend(sums);
            biases.push(bias);
        }
        [values, biases]
    }

    /// Positions are multiples of 1/64, some of them beyond the film, so that distances are exact.
    fn samples() -> impl Strategy<Value = Vec<([f32; 2], FilmSample)>> {
        let position = (-4 * 64..12 * 64i32, 5 * 64..24 * 64i32);
        let sample = (position, prop::array::uniform6(0.0f32..2.0)).prop_map(|((x, y), values)| {
            let [r, g, b, alpha, bias, weight] = values;
            let sample = FilmSample { radiance: Rgb::new(r, g, b), alpha, bias, weight };
            ([x as f32 / 64.0, y as f32 / 64.0], sample)
        });
        prop::collection::vec(sample, 0..80)
    }

    proptest! {
        #[test]
        fn samples_count_by_the_filter(samples in samples(), has_alpha: bool) {
            let description = description(if has_alpha { RGB_ALPHA_WEIGHT } else { RGB_WEIGHT });
            let expected = expected(&description, &samples);
            let all = splat_in_bands(&description, &samples, SIZE[1] as usize);
            for (value, expected) in all.iter().flatten().zip(expected.iter().flatten()) {
                // 80 sums of products of at most 4, each rounded by 2^-24.
                prop_assert!((value - expected).abs() < 80.0 * 80.0 * 4.0 * 2f64.powi(-24));
            }
            prop_assert_eq!(splat_in_bands(&description, &samples, 3), all);
        }
    }

    #[test]
    fn what_is_not_a_number_counts_for_no_pixel() {
        let description = description(RGB_WEIGHT);
        let sample = FilmSample { radiance: Rgb::ONE, alpha: 1.0, bias: 1.0, weight: 1.0 };
        let samples = [([f32::NAN, 10.0], sample), ([1.0, f32::NAN], sample)];
        let values = splat_in_bands(&description, &samples, 4);
        assert!(values.iter().flatten().all(|&value| value == 0.0));
    }
}
