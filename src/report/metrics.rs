//! Errors of a picture against a reference, in linear RGB.

use super::flip::Flip;
use super::picture::Picture;
use serde::{Deserialize, Deserializer, Serialize};

/// Errors of a picture against the reference.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// Root of the mean squared difference, in the picture's unit.
    #[serde(deserialize_with = "or_nan")]
    pub rmse: f64,
    /// Mean of the squared differences, each over the reference's square; see [`relative_mse`].
    #[serde(deserialize_with = "or_nan")]
    pub relative_mse: f64,
    /// Mean perceptual error in \[0,1\]; see [`super::flip`].
    #[serde(deserialize_with = "or_nan")]
    pub flip: f64,
}

/// JSON has no NaN and holds null instead.
fn or_nan<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(from)?.unwrap_or(f64::NAN))
}

impl Errors {
    /// The root of the relative mean squared error: the error of which percentages are told.
    pub fn relative(&self) -> f64 {
        self.relative_mse.sqrt()
    }
}

/// A reference, prepared to judge pictures of its size.
pub struct Judge {
    reference: Picture,
    flip: Flip,
}

impl Judge {
    pub fn new(reference: Picture) -> Self {
        let flip = Flip::new(&reference);
        Judge { reference, flip }
    }

    pub fn reference(&self) -> &Picture {
        &self.reference
    }

    /// Judges a picture, which must have the reference's size.
    pub fn errors(&self, picture: &Picture) -> Errors {
        Errors {
            rmse: rmse(picture, &self.reference),
            relative_mse: relative_mse(picture, &self.reference),
            flip: self.flip.mean_error(picture),
        }
    }
}

/// Mean over pixels and channels of `(x - r)² / (r² + (m/10)²)`, `m` being the reference's [`Picture::brightness`]: the usual
/// relative error, kept finite in the dark. The pictures must have one size.
pub fn relative_mse(picture: &Picture, reference: &Picture) -> f64 {
    let floor = reference.dark_floor();
    mean_over(picture, reference, |x, r| (x - r).powi(2) / (r * r + floor))
}

/// Root of the mean squared difference over pixels and channels. The pictures must have one size.
pub fn rmse(picture: &Picture, reference: &Picture) -> f64 {
    mean_over(picture, reference, |x, r| (x - r).powi(2)).sqrt()
}

fn mean_over(picture: &Picture, reference: &Picture, term: impl Fn(f64, f64) -> f64) -> f64 {
    assert_eq!(picture.size(), reference.size(), "pictures of one size");
    let values = |of: &Picture| of.pixels.clone().into_iter().flatten().map(f64::from);
    let sum: f64 = values(picture).zip(values(reference)).map(|(x, r)| term(x, r)).sum();
    sum / (3 * reference.pixels.len()) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(value: f32) -> Picture {
        Picture::from_fn(8, 4, |_, _| [value; 3])
    }

    #[test]
    fn equal_pictures_have_no_error() {
        let errors = Judge::new(grey(0.3)).errors(&grey(0.3));
        assert_eq!((errors.rmse, errors.relative_mse), (0.0, 0.0));
        assert!(errors.flip < 1e-9);
    }

    #[test]
    fn constant_difference_in_closed_form() {
        let errors = Judge::new(grey(2.0)).errors(&grey(2.5));
        assert!((errors.rmse - 0.5).abs() < 1e-12);
        assert!((errors.relative_mse - 0.25 / (4.0 + 0.04)).abs() < 1e-12);
    }

    #[test]
    fn relative_error_does_not_depend_on_the_exposure() {
        let judge = |scale: f32| {
            let reference = Picture::from_fn(8, 4, |x, _| [scale * x as f32; 3]);
            let picture = Picture::from_fn(8, 4, |x, y| [scale * (x + y) as f32; 3]);
            relative_mse(&picture, &reference)
        };
        assert!((judge(1.0) / judge(64.0) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn errors_that_are_no_numbers_survive_a_file() {
        let errors = Errors { rmse: f64::NAN, relative_mse: f64::INFINITY, flip: 0.5 };
        let text = serde_json::to_string(&errors).unwrap();
        let read: Errors = serde_json::from_str(&text).unwrap();
        assert!(read.rmse.is_nan() && read.relative_mse.is_nan() && read.flip == 0.5);
    }

    #[test]
    fn black_reference_gives_finite_errors() {
        let errors = Judge::new(grey(0.0)).errors(&grey(0.0));
        assert_eq!(errors.relative_mse, 0.0);
        assert!(errors.flip.is_finite());
    }
}
