//! Where further rays look for emission: lamps seen directly or by way of glass are far brighter than what they light, and one
//! ray per pixel and jitter would leave their edges noisy long after all else is smooth. [Emission rays]

use super::view::EmissionSamples;

/// Further rays of a jitter at most, per pixel of the film, where nothing else is wanted.
const BUDGET: f64 = 0.5;
/// Rays per pixel at most, of those that are shared out evenly and of those that go by what was seen.
const MOST_EVENLY: usize = 64;
const MOST_BY_CONTRAST: usize = 2048;
/// Range of what neighbouring rays saw, over the picture's mean, from which on it is worth further rays.
const CONTRAST: f32 = 0.25;

/// What rays saw so far, and where they saw different things.
#[derive(Debug)]
pub struct EmissionRays {
    width: usize,
    /// Further rays of a jitter at most, per pixel of the film.
    pub budget: f64,
    /// Smallest and largest brightness by pixel.
    seen: Vec<[f32; 2]>,
}

impl EmissionRays {
    pub fn new([width, height]: [u32; 2]) -> Self {
        let pixels = width as usize * height as usize;
        EmissionRays {
            width: width as usize,
            budget: BUDGET,
            seen: vec![[f32::INFINITY, f32::NEG_INFINITY]; pixels],
        }
    }

    pub fn pixel_count(&self) -> usize {
        self.seen.len()
    }

    /// Takes note of what rays saw.
    pub fn note(&mut self, samples: &EmissionSamples) {
        for (&pixel, radiance) in samples.pixels.iter().zip(&samples.radiance) {
            let [low, high] = &mut self.seen[pixel as usize];
            let brightness = radiance.mean();
            *low = low.min(brightness);
            *high = high.max(brightness);
        }
    }

    /// The pixels of further rays for a jitter, each as often as it gets rays. They depend on rays alone that add nothing to the
    /// picture, so that its mean stays unbiased. `level` is the mean brightness of the picture.
    pub fn pixels(&self, level: f32) -> Vec<u32> {
        let marked = self.marked(level);
        let budget = self.budget * self.seen.len() as f64;
        let contrast = |pixel: u32| {
            let [low, high] = self.seen[pixel as usize];
            f64::from((high - low).max(0.0))
        };
        let total: f64 = marked.iter().map(|&pixel| contrast(pixel)).sum();
        // What is brighter by far is far noisier: it gets half of all rays. All edges share the other half.
        let (evenly, by_contrast) = if total > 0.0 { (0.5, 0.5) } else { (1.0, 0.0) };
        let each = ((evenly * budget / marked.len().max(1) as f64) as usize).min(MOST_EVENLY);
        let of_pixel = |pixel: u32| {
            let share = by_contrast * budget * contrast(pixel) / total.max(f64::MIN_POSITIVE);
            std::iter::repeat_n(pixel, each + (share as usize).min(MOST_BY_CONTRAST))
        };
        marked.into_iter().flat_map(of_pixel).collect()
    }

    /// The pixels where further rays are worth while.
    pub fn marked(&self, level: f32) -> Vec<u32> {
        let worth = |pixel: &u32| {
            let [low, high] = self.around(*pixel as usize);
            high - low > CONTRAST * level
        };
        (0..self.seen.len() as u32).filter(worth).collect()
    }

    /// The range of a pixel and its neighbours.
    fn around(&self, pixel: usize) -> [f32; 2] {
        let (x, y) = (pixel % self.width, pixel / self.width);
        let height = self.seen.len() / self.width;
        let columns = x.saturating_sub(1)..(x + 2).min(self.width);
        let rows = y.saturating_sub(1)..(y + 2).min(height);
        let of_row = |row: usize| &self.seen[row * self.width..][columns.clone()];
        rows.flat_map(of_row).fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], seen| {
            [low.min(seen[0]), high.max(seen[1])]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Rgb;

    fn one_per_pixel(radiance: impl Fn(usize) -> Rgb) -> EmissionSamples {
        let (pixels, radiance) = ((0..200).collect(), (0..200).map(radiance).collect());
        EmissionSamples { pixels, radiance, ..EmissionSamples::default() }
    }

    fn lit(pixel: usize) -> Rgb {
        Rgb::splat(if pixel % 20 < 10 { 0.0 } else { 5.0 })
    }

    fn half_lit() -> EmissionRays {
        let mut rays = EmissionRays::new([20, 10]);
        rays.note(&one_per_pixel(lit));
        rays
    }

    #[test]
    fn edges_get_the_whole_budget() {
        let pixels = half_lit().pixels(1.0);
        // Two columns of ten pixels share half of the 200 pixels' rays.
        assert_eq!(pixels.len(), 100);
        assert!(pixels.iter().all(|pixel| [9, 10].contains(&(pixel % 20))));
    }

    #[test]
    fn what_is_dim_beside_the_picture_gets_none() {
        assert!(half_lit().pixels(30.0).is_empty());
    }

    #[test]
    fn what_flickers_within_a_pixel_is_an_edge() {
        let mut rays = EmissionRays::new([20, 10]);
        rays.note(&one_per_pixel(|_| Rgb::ZERO));
        assert!(rays.pixels(1.0).is_empty());
        let further = EmissionSamples {
            pixels: vec![105],
            radiance: vec![Rgb::splat(9.0)],
            ..EmissionSamples::default()
        };
        rays.note(&further);
        // Half of 100 rays for the pixel and its eight neighbours, half for where the difference is.
        let pixels = rays.pixels(1.0);
        assert_eq!(pixels.len(), 9 * (50 / 9) + 50);
        assert_eq!(pixels.iter().filter(|&&pixel| pixel == 105).count(), 50 / 9 + 50);
    }

    /// A lamp a thousand times brighter than others, behind a single pixel, is a thousand times noisier.
    #[test]
    fn what_is_brighter_by_far_gets_half() {
        let mut rays = half_lit();
        let lamp = |pixel: usize| if pixel == 105 { Rgb::splat(5e3) } else { lit(pixel) };
        rays.note(&one_per_pixel(lamp));
        let pixels = rays.pixels(1.0);
        let on_lamp = pixels.iter().filter(|&&pixel| pixel == 105).count();
        assert!((45..=52).contains(&on_lamp), "{on_lamp}");
        assert!(pixels.iter().any(|pixel| *pixel < 20), "edges get none");
    }
}
