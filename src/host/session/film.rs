//! What Mitsuba's film holds, and how it would write it.

use super::ffi::*;
use super::loaded::LoadedScene;
use super::{HostError, HostResult};
use crate::picture::{FilmFormat, FilmImage, UnknownFormat};
use std::ffi::CStr;

/// Bytes for what a film says of itself.
const TEXT: usize = 1 << 14;

/// A film in its own words.
struct Description {
    says: String,
    /// Channels behind the weight.
    others: Vec<String>,
    has_alpha: bool,
}

impl LoadedScene<'_> {
    /// How the film of the picture last rendered would write it.
    pub fn film_format(&self) -> HostResult<Result<FilmFormat, UnknownFormat>> {
        Ok(FilmFormat::of_film(&self.describe_film(self.rendered)?.says))
    }

    /// How a sensor's film would write its picture, and the names of the channels behind its weight.
    pub fn film_facts(
        &self,
        sensor: usize,
    ) -> HostResult<(Result<FilmFormat, UnknownFormat>, Vec<String>)> {
        let Description { says, others, .. } = self.describe_film(self.checked(sensor))?;
        Ok((FilmFormat::of_film(&says), others))
    }

    /// The weighted sums of the picture last rendered, with its layers.
    pub fn film(&self) -> HostResult<FilmImage> {
        let Description { others, has_alpha, .. } = self.describe_film(self.rendered)?;
        let [width, height] = self.film_size(self.rendered as usize).map(|n| n as usize);
        let mut image = FilmImage { width, height, has_alpha, others, values: Vec::new() };
        image.values.resize(width * height * image.channel_count(), 0.0);
        // SAFETY: the scene is alive, and the shim checks the number of values.
        call(|error, size| unsafe {
            let (values, count) = (image.values.as_mut_ptr(), image.values.len());
            vpt_scene_read_film(self.scene, self.rendered, values, count, error, size)
        })?;
        Ok(image)
    }

    fn describe_film(&self, sensor: u32) -> HostResult<Description> {
        let (mut says, mut others, mut has_alpha) = (vec![0_u8; TEXT], vec![0_u8; TEXT], 0);
        // SAFETY: the scene is alive, and both texts have room for `TEXT` bytes.
        call(|error, size| unsafe {
            vpt_scene_describe_film(
                self.scene,
                sensor,
                says.as_mut_ptr().cast(),
                others.as_mut_ptr().cast(),
                TEXT,
                &mut has_alpha,
                error,
                size,
            )
        })?;
        let text = |bytes: &[u8]| {
            let text = CStr::from_bytes_until_nul(bytes);
            let text = text.map_err(|_| HostError("a text of the film has no end".to_owned()));
            text.map(|text| text.to_string_lossy().into_owned())
        };
        let others = text(&others)?.split_terminator(',').map(str::to_owned).collect();
        Ok(Description { says: text(&says)?, others, has_alpha: has_alpha != 0 })
    }
}
