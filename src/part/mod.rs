//! Parts of a picture: what some passes of a render brought, with all that tells whether other passes belong to the same
//! picture. A part is a file ([`Part::read`], `Part::write`); parts add up to what one render of all their passes gives
//! ([`Merger`]).

mod file;
mod ground;
mod merge;
mod ranges;

pub use file::{PartFileError, PartView};
pub use ground::{Difference, FilmGround, Ground};
pub use merge::{MergeError, Merger};
pub use ranges::PassRanges;

use crate::film::layers::LAYER_CHANNELS;
use crate::method::Gathered;
use crate::picture::{develop, FilmImage, LayeredPicture};

/// Some passes of a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    pub ground: Ground,
    /// The scene's file, as the user named it; the hash in the ground tells scenes apart.
    pub scene: String,
    pub passes: PassRanges,
    pub gathered: Gathered,
}

impl Part {
    /// What a film's file would hold of these passes.
    pub fn picture(&self) -> LayeredPicture {
        let gathered = &self.gathered;
        let channels = self.ground.film.channels as usize;
        let errors = gathered.error.as_ref().filter(|_| self.ground.film.error_image);
        let image = self.ground.film.image(
            &gathered.picture(channels).values,
            gathered.layer_sums(channels).as_deref(),
            errors.map(|errors| errors.image()).as_deref(),
        );
        develop(&image, self.ground.film.format)
    }
}

impl FilmGround {
    /// Sums as Mitsuba's film keeps them, in the order in which the integrator puts them there.
    pub fn image(
        &self,
        film: &[f64],
        layers: Option<&[f64]>,
        errors: Option<&[[f32; 3]]>,
    ) -> FilmImage {
        let channels = self.channels as usize;
        let mut others: Vec<String> = Vec::new();
        if layers.is_some() {
            others.extend(LAYER_CHANNELS.map(str::to_owned));
        }
        if errors.is_some() {
            others.extend(["error.R", "error.G", "error.B"].map(str::to_owned));
        }
        let mut values = Vec::with_capacity(film.len() / channels * (channels + others.len()));
        for (pixel, sums) in film.chunks_exact(channels).enumerate() {
            values.extend(sums.iter().map(|&sum| sum as f32));
            if let Some(layers) = layers {
                let first = pixel * LAYER_CHANNELS.len();
                let own = &layers[first..first + LAYER_CHANNELS.len()];
                values.extend(own.iter().map(|&sum| sum as f32));
            }
            if let Some(errors) = errors {
                let weight = sums[channels - 1] as f32;
                values.extend(errors[pixel].map(|error| error * weight));
            }
        }
        let [width, height] = self.size.map(|n| n as usize);
        FilmImage { width, height, has_alpha: channels == 5, others, values }
    }
}
