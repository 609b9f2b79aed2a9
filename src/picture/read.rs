//! Reading EXR files of any channels.

use super::{Channel, LayeredPicture, Metadata, PictureFileError};
use exr::prelude::*;
use std::path::Path;

impl LayeredPicture {
    /// Reads the channels and attributes of an EXR file. Of a file of several parts, the channels of parts with names are
    /// `PART.CHANNEL`, and those of another size than the first are left out.
    pub fn read(path: &Path) -> std::result::Result<(Self, Metadata), PictureFileError> {
        let image = exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .all_layers()
            .all_attributes()
            .from_file(path)
            .map_err(|source| PictureFileError::Unreadable { path: path.to_owned(), source })?;
        let mut metadata = Metadata::default();
        let Some(first) = image.layer_data.first() else {
            return Ok((LayeredPicture { width: 0, height: 0, channels: Vec::new() }, metadata));
        };
        let others = image.attributes.other.iter().chain(&first.attributes.other);
        others.for_each(|(name, value)| metadata.insert_attribute(name, value));
        let (width, height) = (first.size.width(), first.size.height());
        let of_size = image.layer_data.iter().filter(|layer| layer.size == first.size);
        let channels = of_size.flat_map(|layer| {
            let part = layer.attributes.layer_name.as_ref().map(Text::to_string);
            layer.channel_data.list.iter().map(move |channel| Channel {
                name: full_name(part.as_deref(), &channel.name.to_string()),
                values: channel.sample_data.values_as_f32().collect(),
            })
        });
        Ok((LayeredPicture { width, height, channels: channels.collect() }, metadata))
    }
}

fn full_name(part: Option<&str>, channel: &str) -> String {
    match part {
        Some(part) if !part.is_empty() && !channel.starts_with(&format!("{part}.")) => {
            format!("{part}.{channel}")
        }
        _ => channel.to_owned(),
    }
}
