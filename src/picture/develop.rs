//! From weighted sums to a picture, operation by operation as Mitsuba's `hdrfilm` does when it writes a file: in single precision,
//! by the reciprocal of the weight, which comes after the change of colours.

use super::{Channel, LayeredPicture};
use serde::{Deserialize, Serialize};

/// Weights of red, green and blue in X, Y and Z. [Mitsuba's `hdrfilm`]
const XYZ: [[f32; 3]; 3] =
    [[0.412453, 0.35758, 0.180423], [0.212671, 0.71516, 0.072169], [0.019334, 0.119193, 0.950227]];

/// The film's parameter `pixel_format`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PixelFormat {
    Luminance,
    LuminanceAlpha,
    Rgb,
    Rgba,
    Xyz,
    Xyza,
}

/// The film's parameter `component_format`, but for integers, to which Mitsuba dithers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ComponentFormat {
    Float16,
    Float32,
}

/// How a film stores its picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct FilmFormat {
    pub pixel: PixelFormat,
    pub component: ComponentFormat,
}

/// The film is no `hdrfilm`, or stores integers.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the film does not write floating-point pictures as hdrfilm does: {0}")]
pub struct UnknownFormat(pub String);

impl FilmFormat {
    /// From what Mitsuba's film says of itself, the only way in which it tells.
    pub fn of_film(description: &str) -> Result<Self, UnknownFormat> {
        let field = |name: &str| {
            let lines = description.lines().map(|line| line.trim().trim_end_matches(','));
            let mut values = lines.filter_map(|line| line.split_once(" = "));
            values.find(|(field, _)| *field == name).map(|(_, value)| value)
        };
        let unknown = || UnknownFormat(description.to_owned());
        if !description.starts_with("HDRFilm[") {
            return Err(unknown());
        }
        let pixel = match field("pixel_format") {
            Some("y") => PixelFormat::Luminance,
            Some("ya") => PixelFormat::LuminanceAlpha,
            Some("rgb") => PixelFormat::Rgb,
            Some("rgba") => PixelFormat::Rgba,
            Some("xyz") => PixelFormat::Xyz,
            Some("xyza") => PixelFormat::Xyza,
            _ => return Err(unknown()),
        };
        let component = match field("component_format") {
            Some("float16") => ComponentFormat::Float16,
            Some("float32") => ComponentFormat::Float32,
            _ => return Err(unknown()),
        };
        Ok(FilmFormat { pixel, component })
    }
}

impl PixelFormat {
    pub fn has_alpha(self) -> bool {
        matches!(self, PixelFormat::LuminanceAlpha | PixelFormat::Rgba | PixelFormat::Xyza)
    }

    /// Names of the colours, and the weights of red, green and blue in each; none where they are red, green and blue.
    fn colours(self) -> (&'static [&'static str], Option<&'static [[f32; 3]]>) {
        match self {
            PixelFormat::Luminance | PixelFormat::LuminanceAlpha => (&["Y"], Some(&XYZ[1..2])),
            PixelFormat::Rgb | PixelFormat::Rgba => (&["R", "G", "B"], None),
            PixelFormat::Xyz | PixelFormat::Xyza => (&["X", "Y", "Z"], Some(&XYZ)),
        }
    }
}

/// A film's weighted sums: red, green, blue, alpha if it has one and the weight, then other channels with names.
#[derive(Debug, Clone, PartialEq)]
pub struct FilmImage {
    pub width: usize,
    pub height: usize,
    pub has_alpha: bool,
    /// Names of the channels behind the weight, `LAYER.COLOUR`.
    pub others: Vec<String>,
    /// Pixel by pixel, row by row from the top.
    pub values: Vec<f32>,
}

impl FilmImage {
    fn base(&self) -> usize {
        if self.has_alpha {
            5
        } else {
            4
        }
    }

    /// Values per pixel.
    pub fn channel_count(&self) -> usize {
        self.base() + self.others.len()
    }
}

/// Divides sums by their weights and brings colours into the film's format; other channels stay as they are.
pub fn develop(film: &FilmImage, format: FilmFormat) -> LayeredPicture {
    let base = film.base();
    let pixels = || film.values.chunks_exact(film.channel_count());
    let channel = |name: &str, sum: &dyn Fn(&[f32]) -> f32| Channel {
        name: name.to_owned(),
        values: pixels().map(|pixel| sum(pixel) * reciprocal(pixel[base - 1])).collect(),
    };
    let (names, blend) = format.pixel.colours();
    let mut channels: Vec<Channel> = (0..names.len())
        .map(|colour| match blend {
            None => channel(names[colour], &|pixel| pixel[colour]),
            Some(weights) => channel(names[colour], &|pixel| blended(weights[colour], pixel)),
        })
        .collect();
    if format.pixel.has_alpha() {
        channels.push(channel("A", &|pixel| pixel[3]));
    }
    let others = film.others.iter().enumerate();
    channels.extend(others.map(|(index, name)| channel(name, &|pixel| pixel[base + index])));
    LayeredPicture { width: film.width, height: film.height, channels }
}

fn blended(weights: [f32; 3], pixel: &[f32]) -> f32 {
    weights[0] * pixel[0] + weights[1] * pixel[1] + weights[2] * pixel[2]
}

fn reciprocal(weight: f32) -> f32 {
    if weight == 0.0 {
        1.0
    } else {
        1.0 / weight
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FILM: &str =
        "HDRFilm[\n  size = [7, 5],\n  filter = BoxFilter[],\n  file_format = OpenEXR,\n  \
                        pixel_format = rgba,\n  component_format = float16,\n]";

    #[test]
    fn format_is_read_from_what_the_film_says() {
        let format = FilmFormat::of_film(FILM).unwrap();
        assert_eq!(format.pixel, PixelFormat::Rgba);
        assert_eq!(format.component, ComponentFormat::Float16);
        assert!(FilmFormat::of_film(&FILM.replace("HDRFilm", "OtherFilm")).is_err());
        assert!(FilmFormat::of_film(&FILM.replace("rgba", "multichannel")).is_err());
        assert!(FilmFormat::of_film(&FILM.replace("float16", "uint32")).is_err());
    }

    /// Two pixels, one without any weight: its sums are 0, and so is what comes of them.
    #[test]
    fn sums_are_divided_by_their_weights() {
        let film = FilmImage {
            width: 2,
            height: 1,
            has_alpha: true,
            others: vec!["media.R".to_owned()],
            values: vec![2.0, 4.0, 6.0, 1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        };
        let developed = |pixel| {
            let component = ComponentFormat::Float32;
            develop(&film, FilmFormat { pixel, component })
        };
        let rgba = developed(PixelFormat::Rgba);
        let names: Vec<_> = rgba.channels.iter().map(|channel| channel.name.as_str()).collect();
        assert_eq!(names, ["R", "G", "B", "A", "media.R"]);
        let first: Vec<_> = rgba.channels.iter().map(|channel| channel.values[0]).collect();
        assert_eq!(first, [1.0, 2.0, 3.0, 0.5, 1.5]);
        assert!(rgba.channels.iter().all(|channel| channel.values[1] == 0.0));
        // The weights of red, green and blue add up to 1, and 1 + green + 2 blue is what is left.
        let y = &developed(PixelFormat::Luminance).channels[0];
        assert!((y.values[0] - (1.0 + 0.71516 + 2.0 * 0.072169)).abs() < 1e-6);
        let xyz = developed(PixelFormat::Xyz);
        assert_eq!(xyz.channels.len(), 4);
        for picture in [rgba, xyz] {
            let colours = picture.rgb(None).unwrap()[0].into_iter().zip([1.0, 2.0, 3.0]);
            assert!(colours.into_iter().all(|(colour, expected)| (colour - expected).abs() < 1e-5));
        }
    }
}
