//! Writing EXR files, as Mitsuba does: scan lines, PIZ, the picture's corner at the origin whatever the film crops.

use super::header::sort_attributes;
use super::{ComponentFormat, FilmFormat, LayeredPicture, Metadata, PictureFileError, PixelFormat};
use exr::prelude::*;
use std::io::Cursor;
use std::path::Path;

impl LayeredPicture {
    /// Writes an EXR file with all channels in the film's component format. The same picture and metadata give the same bytes.
    pub fn write(
        &self,
        path: &Path,
        format: FilmFormat,
        metadata: &Metadata,
    ) -> std::result::Result<(), PictureFileError> {
        let unwritable = |source| PictureFileError::Unwritable { path: path.to_owned(), source };
        let bytes = self
            .encode(format, metadata)
            .map_err(|source| PictureFileError::Encoding { path: path.to_owned(), source })?;
        std::fs::write(path, bytes).map_err(unwritable)
    }

    fn encode(&self, format: FilmFormat, metadata: &Metadata) -> exr::error::Result<Vec<u8>> {
        let channels: SmallVec<[_; 4]> = self
            .channels
            .iter()
            .map(|channel| {
                let samples = samples(&channel.values, format.component);
                AnyChannel::new(channel.name.as_str(), samples)
            })
            .collect();
        let encoding = Encoding {
            compression: Compression::PIZ,
            blocks: Blocks::ScanLines,
            line_order: LineOrder::Increasing,
        };
        let size = (self.width, self.height);
        let mut attributes = LayerAttributes::default();
        attributes.other.extend(metadata.attributes());
        let layer = Layer::new(size, attributes, encoding, AnyChannels::sort(channels));
        let mut image = Image::from_layer(layer);
        if matches!(format.pixel, PixelFormat::Xyz | PixelFormat::Xyza) {
            image.attributes.chromaticities = Some(XYZ_CHROMATICITIES);
        }
        let mut file = Cursor::new(Vec::new());
        image.write().to_unbuffered(&mut file)?;
        let mut bytes = file.into_inner();
        sort_attributes(&mut bytes).ok_or(Error::Invalid("header".into()))?;
        Ok(bytes)
    }
}

/// That the primaries are X, Y and Z themselves. [Mitsuba's `Bitmap`]
const XYZ_CHROMATICITIES: attribute::Chromaticities = attribute::Chromaticities {
    red: Vec2(1.0, 0.0),
    green: Vec2(0.0, 1.0),
    blue: Vec2(0.0, 0.0),
    white: Vec2(1.0 / 3.0, 1.0 / 3.0),
};

fn samples(values: &[f32], format: ComponentFormat) -> FlatSamples {
    match format {
        ComponentFormat::Float16 => {
            FlatSamples::F16(values.iter().map(|&value| f16::from_f32(value)).collect())
        }
        ComponentFormat::Float32 => FlatSamples::F32(values.to_vec()),
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Channel, Value};
    use super::*;

    fn picture() -> LayeredPicture {
        let channel = |name: &str, first: f32| Channel {
            name: name.to_owned(),
            values: (0..35).map(|i| first + i as f32 / 7.0).collect(),
        };
        let channels = vec![channel("R", 0.0), channel("G", -1.0), channel("media.R", 1e-3)];
        LayeredPicture { width: 7, height: 5, channels }
    }

    fn metadata() -> Metadata {
        let mut metadata = Metadata::default();
        metadata.text("vpt.scene", "Nebel über Sälen.xml");
        metadata.integer("vpt.passes", 12);
        metadata.integer("vpt.seed", u64::from(u32::MAX));
        metadata.number("vpt.error", 0.25);
        metadata
    }

    #[test]
    fn a_file_holds_channels_and_metadata() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.exr");
        let format = |component| FilmFormat { pixel: PixelFormat::Rgb, component };
        picture().write(&path, format(ComponentFormat::Float32), &metadata()).unwrap();
        let (read, told) = LayeredPicture::read(&path).unwrap();
        assert_eq!(read.channel("media.R"), picture().channel("media.R"));
        assert_eq!(read.channel("G"), picture().channel("G"));
        assert_eq!((read.width, read.height, read.channels.len()), (7, 5, 3));
        for (name, value) in metadata().iter() {
            assert_eq!(told.get(name), Some(value));
        }
        assert_eq!(told.get("vpt.seed"), Some(&Value::Text("4294967295".to_owned())));
        let first = std::fs::read(&path).unwrap();
        for _ in 0..8 {
            picture().write(&path, format(ComponentFormat::Float32), &metadata()).unwrap();
            assert!(first == std::fs::read(&path).unwrap(), "the same picture in other bytes");
        }
        picture().write(&path, format(ComponentFormat::Float16), &metadata()).unwrap();
        let (halves, _) = LayeredPicture::read(&path).unwrap();
        let half = |value: &f32| f16::from_f32(*value).to_f32();
        let expected: Vec<f32> = picture().channel("R").unwrap().iter().map(half).collect();
        assert_eq!(halves.channel("R").unwrap(), expected);
    }

    #[test]
    fn what_cannot_be_written_is_named() {
        let format = FilmFormat { pixel: PixelFormat::Rgb, component: ComponentFormat::Float16 };
        let path = Path::new("no such folder/a.exr");
        let error = picture().write(path, format, &metadata()).unwrap_err().to_string();
        assert!(error.contains("no such folder/a.exr"), "{error}");
    }
}
