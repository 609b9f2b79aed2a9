//! How much a sample counts for the pixels around it.

use super::{SceneError, SceneResult};
use glam::{Vec2, Vec4, Vec4Swizzles};

/// A film's reconstruction filter, the same along both axes.
#[derive(Debug, Clone, PartialEq)]
pub struct FilmFilter {
    radius: f32,
    steps_per_pixel: f32,
    values: Vec<f32>,
}

impl FilmFilter {
    /// A filter that reaches `radius` pixels to either side. All values but the last are those of equal steps of the distance, from
    /// 0 on; the last is that at the radius. Fails where that makes no filter.
    pub fn new(radius: f32, values: Vec<f32>) -> SceneResult<Self> {
        let reaches = radius > 0.0 && radius.is_finite();
        if !reaches || values.len() < 2 || values.iter().any(|value| !value.is_finite()) {
            return Err(SceneError(format!(
                "the film's filter has a radius of {radius} pixels and {} values; it needs a positive radius and at least two \
                 finite values",
                values.len()
            )));
        }
        let steps_per_pixel = (values.len() - 1) as f32 / radius;
        Ok(FilmFilter { radius, steps_per_pixel, values })
    }

    /// Each sample belongs to the pixel that it falls into.
    pub fn of_a_pixel() -> Self {
        FilmFilter { radius: 0.5, steps_per_pixel: 2.0, values: vec![1.0; 2] }
    }

    /// In pixels.
    pub fn radius(&self) -> f32 {
        self.radius
    }

    /// See [`FilmFilter::new`].
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// The weight of a sample at this distance from a pixel's centre along an axis, within the radius.
    #[inline]
    pub fn weight(&self, distance: f32) -> f32 {
        // As u32, which costs a third of what usize does.
        let step = (distance.abs() * self.steps_per_pixel) as u32;
        self.values[(step as usize).min(self.values.len() - 1)]
    }

    /// First and last pixel along both axes that a sample counts for, where the middle of the first pixel is at 0. A sample between
    /// two pixels belongs to the second, if a radius of half a pixel has to decide.
    #[inline]
    pub fn pixels(&self, position: Vec2) -> [Vec2; 2] {
        // One instruction for all four.
        let (low, high) = (position - self.radius, position + self.radius);
        let ends = Vec4::new(low.x, low.y, high.x, high.y).floor();
        [ends.xy() + 1.0, ends.zw()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Positions are multiples of 1/1024, so that all sums are exact.
        #[test]
        fn a_filter_of_a_pixel_is_the_pixel(position in 0..4096 * 1024u32) {
            let position = position as f32 / 1024.0;
            let pixels = FilmFilter::of_a_pixel().pixels(Vec2::splat(position - 0.5));
            prop_assert_eq!(pixels, [Vec2::splat(position.floor()); 2]);
        }
    }

    #[test]
    fn weights_are_those_of_their_steps() {
        let filter = FilmFilter::new(1.5, vec![4.0, 3.0, 2.0, 0.0]).unwrap();
        let weights = [0.0, 0.4, -0.6, 1.4, -1.5].map(|distance| filter.weight(distance));
        assert_eq!(weights, [4.0, 4.0, 3.0, 2.0, 0.0]);
        assert_eq!(
            filter.pixels(Vec2::new(0.25, 9.75)),
            [Vec2::new(-1.0, 9.0), Vec2::new(1.0, 11.0)]
        );
    }

    #[test]
    fn what_is_no_filter_is_refused() {
        for (radius, values) in [
            (0.0, vec![1.0; 2]),
            (f32::NAN, vec![1.0; 2]),
            (1.0, vec![1.0]),
            (1.0, vec![f32::NAN; 2]),
        ] {
            let error = FilmFilter::new(radius, values).unwrap_err();
            assert!(error.0.contains("filter"), "{error}");
        }
    }
}
