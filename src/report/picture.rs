//! A picture in linear RGB.

use crate::math::brightness;
use exr::prelude::{read_first_rgba_layer_from_file, write_rgb_file};
use std::path::{Path, PathBuf};

/// Linear red, green and blue, row by row from the top.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    pub width: usize,
    pub height: usize,
    pub pixels: Vec<[f32; 3]>,
}

/// An EXR file that cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum PictureError {
    #[error("cannot read the picture \"{}\"; give an EXR file with channels R, G and B", .path.display())]
    Unreadable { path: PathBuf, source: exr::error::Error },
    #[error("cannot write the picture \"{}\"", .path.display())]
    Unwritable { path: PathBuf, source: exr::error::Error },
    #[error(
        "the picture \"{}\" holds values that are not finite; mend those pixels first",
        .0.display()
    )]
    NotFinite(PathBuf),
}

impl Picture {
    pub fn from_fn(width: usize, height: usize, pixel: impl Fn(usize, usize) -> [f32; 3]) -> Self {
        let pixels = (0..width * height).map(|i| pixel(i % width, i / width)).collect();
        Picture { width, height, pixels }
    }

    /// Width and height in pixels.
    pub fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// Mean over all pixels and channels.
    pub fn mean(&self) -> f64 {
        let sum: f64 = self.pixels.iter().flatten().map(|&value| f64::from(value)).sum();
        sum / (3 * self.pixels.len()).max(1) as f64
    }

    /// How bright the picture is, see [`brightness`].
    pub fn brightness(&self) -> f64 {
        let channel = |index: usize| f64::from(self.pixels[index / 3][index % 3]);
        brightness((0..3 * self.pixels.len()).map(channel))
    }

    /// What is added to a reference that errors are divided by: a look at the whole picture, so not to be asked for pixel by pixel.
    pub(super) fn dark_level(&self) -> f64 {
        0.1 * self.brightness() + f64::MIN_POSITIVE
    }

    /// What is added to a squared reference that squared errors are divided by.
    pub(super) fn dark_floor(&self) -> f64 {
        self.dark_level().powi(2).max(f64::MIN_POSITIVE)
    }

    /// Reads channels R, G and B of an EXR file's first layer.
    pub fn read_exr(path: &Path) -> Result<Self, PictureError> {
        let image = read_first_rgba_layer_from_file(
            path,
            |size, _| Picture::from_fn(size.width(), size.height(), |_, _| [0.0; 3]),
            |picture, at, (r, g, b, _): (f32, f32, f32, f32)| {
                let index = at.y() * picture.width + at.x();
                picture.pixels[index] = [r, g, b];
            },
        );
        let image =
            image.map_err(|source| PictureError::Unreadable { path: path.to_owned(), source })?;
        let picture = image.layer_data.channel_data.pixels;
        if picture.pixels.iter().flatten().any(|value| !value.is_finite()) {
            return Err(PictureError::NotFinite(path.to_owned()));
        }
        Ok(picture)
    }

    /// Writes an EXR file with channels R, G and B in f32.
    pub fn write_exr(&self, path: &Path) -> Result<(), PictureError> {
        let pixel = |x: usize, y: usize| {
            let [r, g, b] = self.pixels[y * self.width + x];
            (r, g, b)
        };
        write_rgb_file(path, self.width, self.height, pixel)
            .map_err(|source| PictureError::Unwritable { path: path.to_owned(), source })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exr_holds_the_same_numbers() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let picture = Picture::from_fn(5, 3, |x, y| [x as f32, y as f32, 0.25]);
        picture.write_exr(&path).unwrap();
        assert_eq!(Picture::read_exr(&path).unwrap(), picture);
        assert!((picture.mean() - (2.0 + 1.0 + 0.25) / 3.0).abs() < 1e-7);
    }

    #[test]
    fn what_is_no_exr_or_not_finite_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        std::fs::write(&path, "text").unwrap();
        assert!(matches!(Picture::read_exr(&path), Err(PictureError::Unreadable { .. })));
        Picture::from_fn(2, 2, |_, _| [f32::NAN; 3]).write_exr(&path).unwrap();
        assert!(matches!(Picture::read_exr(&path), Err(PictureError::NotFinite(_))));
    }
}
