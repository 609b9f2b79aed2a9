//! Linear pictures as bytes that a screen shows.

use super::picture::Picture;
use crate::math::srgb;
use image::{ImageFormat, RgbImage};
use std::io::Cursor;

/// Share of the reference's pixels that the exposure leaves below white.
const BELOW_WHITE: f64 = 0.99;

/// Relative difference at which a difference picture has its full colour.
const FULL_COLOUR: f64 = 0.5;

/// The factor that brings a linear picture to the screen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exposure(pub f32);

impl Exposure {
    /// 99 % of the reference's pixels are below white in their brightest channel; 1 for a black picture.
    pub fn of(reference: &Picture) -> Self {
        let brightest = |pixel: &[f32; 3]| pixel.iter().copied().fold(0.0, f32::max);
        let mut values: Vec<f32> = reference.pixels.iter().map(brightest).collect();
        values.sort_by(f32::total_cmp);
        let index = (values.len().saturating_sub(1) as f64 * BELOW_WHITE) as usize;
        match values.get(index) {
            Some(&white) if white > 0.0 && white.is_finite() => Exposure(1.0 / white),
            _ => Exposure(1.0),
        }
    }

    /// A pixel as the screen gets it, in \[0,1\], still linear.
    pub fn expose(self, pixel: [f32; 3]) -> [f64; 3] {
        pixel.map(|value| {
            let exposed = f64::from(self.0 * value);
            if exposed.is_nan() {
                0.0
            } else {
                exposed.clamp(0.0, 1.0)
            }
        })
    }

    /// The picture with the sRGB transfer curve.
    pub fn show(self, picture: &Picture) -> RgbImage {
        to_image(picture, |index| {
            self.expose(picture.pixels[index])
                .map(|value| (srgb::encode(value) * 255.0).round() as u8)
        })
    }
}

/// Where a picture is too bright (red) and too dark (blue); white where it is right. Relative to the
/// reference's luminance, full colour at 50 %.
pub fn difference(picture: &Picture, reference: &Picture) -> RgbImage {
    let floor = reference.dark_level();
    to_image(reference, |index| {
        let (x, r) = (luminance(picture.pixels[index]), luminance(reference.pixels[index]));
        let share = ((x - r) / (r.abs() + floor) / FULL_COLOUR).clamp(-1.0, 1.0);
        let fade = |full: f64| (255.0 - (255.0 - full) * share.abs()).round() as u8;
        if share > 0.0 {
            [fade(178.0), fade(24.0), fade(43.0)]
        } else {
            [fade(33.0), fade(102.0), fade(172.0)]
        }
    })
}

/// The image as a PNG file.
pub fn png(image: &RgbImage) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image
        .write_to(&mut bytes, ImageFormat::Png)
        .expect("PNG holds every RGB image, memory takes it");
    bytes.into_inner()
}

/// Rec. 709 luminance.
pub fn luminance([r, g, b]: [f32; 3]) -> f64 {
    0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b)
}

fn to_image(picture: &Picture, byte: impl Fn(usize) -> [u8; 3]) -> RgbImage {
    let (width, height) = (picture.width as u32, picture.height as u32);
    RgbImage::from_fn(width, height, |x, y| {
        image::Rgb(byte(y as usize * picture.width + x as usize))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exposure_brings_the_reference_into_range() {
        let ramp = Picture::from_fn(100, 1, |x, _| [x as f32 + 1.0; 3]);
        assert_eq!(Exposure::of(&ramp), Exposure(1.0 / 99.0));
        assert_eq!(Exposure::of(&Picture::from_fn(2, 2, |_, _| [0.0; 3])), Exposure(1.0));
        assert_eq!(Exposure(1.0).expose([f32::NAN, -1.0, 7.0]), [0.0, 0.0, 1.0]);
    }

    #[test]
    fn difference_is_white_where_equal_red_above_and_blue_below() {
        let reference = Picture::from_fn(3, 1, |_, _| [1.0; 3]);
        let picture = Picture::from_fn(3, 1, |x, _| [[1.0, 9.0, 0.0][x]; 3]);
        let shown = difference(&picture, &reference);
        let pixels: Vec<_> = shown.pixels().map(|pixel| pixel.0).collect();
        assert_eq!(pixels, [[255; 3], [178, 24, 43], [33, 102, 172]]);
    }
}
