//! Pictures of several layers: what a film makes of its sums ([`develop`]), and the EXR files that hold them, with what is known
//! of their making.

mod develop;
mod header;
mod metadata;
mod read;
mod write;

pub use develop::{develop, ComponentFormat, FilmFormat, FilmImage, PixelFormat, UnknownFormat};
pub use metadata::{Metadata, Value};

use std::path::PathBuf;

/// Values of one name, row by row from the top.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// `R`, or `LAYER.R`.
    pub name: String,
    pub values: Vec<f32>,
}

/// Channels of one size.
#[derive(Debug, Clone, PartialEq)]
pub struct LayeredPicture {
    pub width: usize,
    pub height: usize,
    pub channels: Vec<Channel>,
}

/// A picture file that cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum PictureFileError {
    #[error("cannot read the picture \"{}\"; give an EXR file", .path.display())]
    Unreadable { path: PathBuf, source: exr::error::Error },
    #[error("cannot write the picture \"{}\"", .path.display())]
    Unwritable { path: PathBuf, source: std::io::Error },
    #[error("cannot encode the picture \"{}\"", .path.display())]
    Encoding { path: PathBuf, source: exr::error::Error },
    #[error(
        "the picture \"{}\" has no channels of a colour{of}; it has: {known}", .path.display(),
        of = .layer.as_ref().map_or(String::new(), |layer| format!(" in a layer \"{layer}\"")),
        known = .known.join(", ")
    )]
    NoLayer { path: PathBuf, layer: Option<String>, known: Vec<String> },
}

impl LayeredPicture {
    pub fn channel(&self, name: &str) -> Option<&[f32]> {
        let found = self.channels.iter().find(|channel| channel.name == name);
        found.map(|channel| channel.values.as_slice())
    }

    /// Red, green and blue of a layer, or of the picture where none is named: as they are, from X, Y and Z, or the same number three
    /// times where there is luminance alone.
    pub fn rgb(&self, layer: Option<&str>) -> Option<Vec<[f32; 3]>> {
        let named = |colour: &str| match layer {
            Some(layer) => self.channel(&format!("{layer}.{colour}")),
            None => self.channel(colour),
        };
        let pixels = 0..self.width * self.height;
        if let [Some(r), Some(g), Some(b)] = ["R", "G", "B"].map(named) {
            return Some(pixels.map(|i| [r[i], g[i], b[i]]).collect());
        }
        let y = named("Y")?;
        Some(match [named("X"), named("Z")] {
            [Some(x), Some(z)] => pixels.map(|i| rgb_of_xyz([x[i], y[i], z[i]])).collect(),
            _ => pixels.map(|i| [y[i]; 3]).collect(),
        })
    }
}

/// Linear sRGB. [Mitsuba's `xyz_to_srgb`]
fn rgb_of_xyz(xyz: [f32; 3]) -> [f32; 3] {
    const ROWS: [[f32; 3]; 3] = [
        [3.240479, -1.53715, -0.498535],
        [-0.969256, 1.875991, 0.041556],
        [0.055648, -0.204043, 1.057311],
    ];
    ROWS.map(|row| row.into_iter().zip(xyz).map(|(weight, value)| weight * value).sum())
}
