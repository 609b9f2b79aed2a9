//! Parts as EXR files: channels of 32-bit integers hold the sums bit by bit, red, green and blue what a viewer shows, and an
//! attribute everything else.

use super::{Ground, Part, PassRanges};
use crate::film::error::{ErrorSums, Trend, WORDS};
use crate::film::layers::LayerSums;
use crate::film::ExactSums;
use crate::markov::FamilyReport;
use crate::method::{Counters, Gathered, PhaseSeconds};
use crate::transport::photon::PerFamily;
use exr::prelude::*;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::result::Result;

/// Of the layout of these files.
const FORMAT: u32 = 1;
/// The attribute by which a part is told from other pictures.
const ATTRIBUTE: &str = "vpt.part";

/// A file that is no part, or no whole one.
#[derive(Debug, thiserror::Error)]
pub enum PartFileError {
    #[error("cannot read the part \"{}\"", .path.display())]
    Unreadable { path: PathBuf, source: io::Error },
    #[error("\"{}\" is no whole EXR file, so it is no part; render those passes again", .path.display())]
    NoPicture { path: PathBuf, source: exr::error::Error },
    #[error(
        "\"{}\" is a picture but no part; parts are what `vpt render --passes A..B`, `--checkpoint` and `vpt merge --part` write",
        .0.display()
    )]
    NoPart(PathBuf),
    #[error("the part \"{}\" has the format {found}, but this vpt reads {FORMAT}; merge with the version that wrote it", .path.display())]
    Format { path: PathBuf, found: u32 },
    #[error("the part \"{}\" is damaged: {what}; render its passes again", .path.display())]
    Damaged { path: PathBuf, what: String },
    #[error("cannot write the part")]
    Unwritable(#[from] io::Error),
    #[error("cannot encode the part")]
    Encoding(#[source] exr::error::Error),
}

/// What the attribute says.
#[derive(Serialize, Deserialize)]
struct Facts {
    format: u32,
    ground: Ground,
    scene: String,
    passes: PassRanges,
    has_emission: bool,
    has_layers: bool,
    error: Option<Trend>,
    counters: Counters,
    shooting: PerFamily<FamilyReport>,
    seconds: f64,
    phase_seconds: PhaseSeconds,
    /// SHA-256 of the planes.
    sums: String,
}

/// The format alone, which must be known before the rest can be read.
#[derive(Deserialize)]
struct Format {
    format: u32,
}

/// Integers of all pixels under one name; those that are 0 everywhere are left out.
type Planes = BTreeMap<String, Vec<u32>>;

/// A part whose sums belong to somebody else.
#[derive(Debug, Clone, Copy)]
pub struct PartView<'a> {
    pub ground: &'a Ground,
    pub scene: &'a str,
    pub passes: &'a PassRanges,
    pub gathered: &'a Gathered,
}

impl PartView<'_> {
    /// Writes the part to a file that lies open, and leaves it to the caller to bring it to the disk.
    pub fn write(&self, file: &File) -> Result<(), PartFileError> {
        let planes = self.planes();
        let facts = serde_json::to_string(&self.facts(&planes)).map_err(io::Error::from)?;
        let mut channels: SmallVec<[AnyChannel<FlatSamples>; 4]> = self.shown();
        let integers = |(name, plane): (String, Vec<u32>)| {
            AnyChannel::new(name.as_str(), FlatSamples::U32(plane))
        };
        channels.extend(planes.into_iter().map(integers));
        let mut attributes = LayerAttributes::default();
        let text = AttributeValue::Text(Text::from_bytes_unchecked(facts.bytes().collect()));
        attributes.other.insert(Text::from(ATTRIBUTE), text);
        let encoding = Encoding {
            compression: Compression::RLE,
            blocks: Blocks::ScanLines,
            line_order: LineOrder::Increasing,
        };
        let [width, height] = self.ground.film.size.map(|n| n as usize);
        let layer = Layer::new((width, height), attributes, encoding, AnyChannels::sort(channels));
        let mut buffer = BufWriter::new(file);
        let written = Image::from_layer(layer).write().to_buffered(&mut buffer);
        written.map_err(|error| match error {
            exr::error::Error::Io(error) => PartFileError::Unwritable(error),
            other => PartFileError::Encoding(other),
        })?;
        Ok(buffer.flush()?)
    }

    fn facts(&self, planes: &Planes) -> Facts {
        let gathered = self.gathered;
        Facts {
            format: FORMAT,
            ground: self.ground.clone(),
            scene: self.scene.to_owned(),
            passes: self.passes.clone(),
            has_emission: gathered.emission.is_some(),
            has_layers: gathered.layers.is_some(),
            error: gathered.error.as_ref().map(|error| error.trend().clone()),
            counters: gathered.counters,
            shooting: gathered.shooting,
            seconds: gathered.seconds,
            phase_seconds: gathered.phase_seconds,
            sums: checksum(planes),
        }
    }

    fn planes(&self) -> Planes {
        let (gathered, channels) = (self.gathered, self.ground.film.channels as usize);
        let mut planes = Planes::new();
        put_sums(&mut planes, "picture", &gathered.film, channels);
        if let Some(emission) = &gathered.emission {
            put_sums(&mut planes, "direct", emission, channels);
        }
        if let Some(LayerSums { surfaces, media, emission, samples }) = &gathered.layers {
            put_sums(&mut planes, "surfaces", surfaces, channels);
            put_sums(&mut planes, "media", media, channels);
            put_sums(&mut planes, "emission", emission, channels);
            put(&mut planes, "samples", samples.iter().map(|&count| halves(count)));
        }
        if let Some(error) = &gathered.error {
            put(&mut planes, "error", error.words());
        }
        planes
    }

    /// Red, green and blue for whoever opens the file in a viewer.
    fn shown(&self) -> SmallVec<[AnyChannel<FlatSamples>; 4]> {
        let channels = self.ground.film.channels as usize;
        let means = self.gathered.picture(channels).means(channels);
        let colour = |(index, name): (usize, &str)| {
            let values = means.iter().map(|pixel| pixel[index]).collect();
            AnyChannel::new(name, FlatSamples::F32(values))
        };
        ["R", "G", "B"].into_iter().enumerate().map(colour).collect()
    }
}

impl Part {
    pub fn view(&self) -> PartView<'_> {
        let Part { ground, scene, passes, gathered } = self;
        PartView { ground, scene, passes, gathered }
    }

    /// Reads a part, whatever its name.
    pub fn read(path: &Path) -> Result<Self, PartFileError> {
        let unreadable = |source| PartFileError::Unreadable { path: path.to_owned(), source };
        let no_picture = |source| PartFileError::NoPicture { path: path.to_owned(), source };
        let damaged = |what: &str| {
            Err(PartFileError::Damaged { path: path.to_owned(), what: what.to_owned() })
        };
        // Looked at before the pixels, which are as many as the header says.
        let file = File::open(path).map_err(unreadable)?;
        let meta = MetaData::read_from_unbuffered(file, false).map_err(no_picture)?;
        let header = meta.headers.first();
        let attribute = header.and_then(|h| h.own_attributes.other.get(&Text::from(ATTRIBUTE)));
        let (Some(header), Some(AttributeValue::Text(text))) = (header, attribute) else {
            return Err(PartFileError::NoPart(path.to_owned()));
        };
        let facts = facts(path, text.as_slice())?;
        let [width, height] = facts.ground.film.size.map(|n| n as usize);
        if (header.layer_size.width(), header.layer_size.height()) != (width, height) {
            return damaged("it has another size than its sums");
        }
        let image = exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .first_valid_layer()
            .all_attributes()
            .from_unbuffered(File::open(path).map_err(unreadable)?)
            .map_err(no_picture)?;
        let channels = image.layer_data.channel_data.list.into_iter();
        let planes: Planes = channels
            .filter_map(|channel| match channel.sample_data {
                FlatSamples::U32(plane) => Some((channel.name.to_string(), plane)),
                _ => None,
            })
            .collect();
        if !facts.passes.is_sound() {
            return damaged("its passes are in disorder");
        }
        if checksum(&planes) != facts.sums {
            return damaged("its sums are not those that were written");
        }
        Ok(assembled(facts, &planes))
    }
}

fn facts(path: &Path, text: &[u8]) -> Result<Facts, PartFileError> {
    let damaged = |error: serde_json::Error| PartFileError::Damaged {
        path: path.to_owned(),
        what: error.to_string(),
    };
    let Format { format } = serde_json::from_slice(text).map_err(damaged)?;
    if format != FORMAT {
        return Err(PartFileError::Format { path: path.to_owned(), found: format });
    }
    serde_json::from_slice(text).map_err(damaged)
}

fn assembled(facts: Facts, planes: &Planes) -> Part {
    let [width, height] = facts.ground.film.size.map(|n| n as usize);
    let (pixels, channels) = (width * height, facts.ground.film.channels as usize);
    let sums = |name| take_sums(planes, name, pixels, channels);
    let layers = || LayerSums {
        surfaces: sums("surfaces"),
        media: sums("media"),
        emission: sums("emission"),
        samples: take(planes, "samples", pixels).map(whole).collect(),
    };
    let error = |trend: Trend| {
        ErrorSums::from_words(trend, take::<WORDS>(planes, "error", pixels), width, channels)
    };
    Part {
        gathered: Gathered {
            film: sums("picture"),
            emission: facts.has_emission.then(|| sums("direct")),
            layers: facts.has_layers.then(layers),
            error: facts.error.map(error),
            passes: facts.passes.count(),
            counters: facts.counters,
            shooting: facts.shooting,
            seconds: facts.seconds,
            phase_seconds: facts.phase_seconds,
        },
        ground: facts.ground,
        scene: facts.scene,
        passes: facts.passes,
    }
}

fn checksum(planes: &Planes) -> String {
    let mut hash = Sha256::new();
    for (name, plane) in planes {
        hash.update(name.as_bytes());
        hash.update((plane.len() as u64).to_le_bytes());
        for block in plane.chunks(1 << 12) {
            let bytes: Vec<u8> = block.iter().flat_map(|word| word.to_le_bytes()).collect();
            hash.update(&bytes);
        }
    }
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Puts so many words of each pixel into planes of their own.
fn put<const N: usize>(planes: &mut Planes, name: &str, words: impl Iterator<Item = [u32; N]>) {
    let mut own = vec![Vec::new(); N];
    for of_pixel in words {
        own.iter_mut().zip(of_pixel).for_each(|(plane, word)| plane.push(word));
    }
    let named = (0..N).map(|word| format!("{name}.{word:02}")).zip(own);
    planes.extend(named.filter(|(_, plane)| plane.iter().any(|&word| word != 0)));
}

fn take<'a, const N: usize>(
    planes: &'a Planes,
    name: &str,
    pixels: usize,
) -> impl Iterator<Item = [u32; N]> + 'a {
    let own: [Option<&Vec<u32>>; N] =
        std::array::from_fn(|word| planes.get(&format!("{name}.{word:02}")));
    (0..pixels).map(move |pixel| own.map(|plane| plane.map_or(0, |plane| plane[pixel])))
}

/// Four words of each value, channel by channel.
fn put_sums(planes: &mut Planes, name: &str, sums: &ExactSums, channels: usize) {
    for channel in 0..channels {
        let pairs = sums.pairs().iter().skip(channel).step_by(channels);
        let words = pairs.map(|&[sum, rest]| {
            let ([a, b], [c, d]) = (halves(sum.to_bits()), halves(rest.to_bits()));
            [a, b, c, d]
        });
        put(planes, &format!("{name}.{channel}"), words);
    }
}

fn take_sums(planes: &Planes, name: &str, pixels: usize, channels: usize) -> ExactSums {
    let mut pairs = vec![[0.0; 2]; pixels * channels];
    for channel in 0..channels {
        let words = take(planes, &format!("{name}.{channel}"), pixels);
        let own = pairs.iter_mut().skip(channel).step_by(channels);
        for (pair, [a, b, c, d]) in own.zip(words) {
            *pair = [[a, b], [c, d]].map(|halves| f64::from_bits(whole(halves)));
        }
    }
    ExactSums::from_pairs(pairs)
}

fn halves(word: u64) -> [u32; 2] {
    [(word >> 32) as u32, word as u32]
}

fn whole([high, low]: [u32; 2]) -> u64 {
    u64::from(high) << 32 | u64::from(low)
}

#[cfg(test)]
mod tests {
    use super::super::FilmGround;
    use super::*;
    use crate::picture::{ComponentFormat, FilmFormat, PixelFormat};

    /// Two pixels with sums of all kinds: rests, zeros of both signs, and what no picture should hold.
    fn part() -> Part {
        let format = FilmFormat { pixel: PixelFormat::Rgb, component: ComponentFormat::Float16 };
        let film = FilmGround { size: [2, 1], channels: 4, format, error_image: false };
        let defines = [("a".to_owned(), "ü \"1\"".to_owned())];
        let sums = |first: f64| {
            let pairs = (0..8).map(|i| [first + f64::from(i), f64::from(i) * 1e-20]).collect();
            ExactSums::from_pairs(pairs)
        };
        let odd = vec![[-0.0, 0.0], [f64::INFINITY, 0.0], [1e-320, -0.0], [0.1, 1e-18]];
        let layers = LayerSums {
            surfaces: sums(0.1),
            media: ExactSums::from_pairs([odd.clone(), odd].concat()),
            emission: ExactSums::new(8),
            samples: vec![0, u64::MAX - 1],
        };
        Part {
            ground: Ground::new(["1", "2", "scalar_rgb"], 7, &defines, 0, film),
            scene: "Säle/scene.xml".to_owned(),
            passes: PassRanges::of(3..5),
            gathered: Gathered {
                film: sums(1.0 / 3.0),
                emission: Some(sums(1e30)),
                layers: Some(layers),
                error: None,
                passes: 2,
                counters: Counters { walks: 12, ..Counters::default() },
                shooting: PerFamily::default(),
                seconds: 0.1 + 0.2,
                phase_seconds: PhaseSeconds { view: 1.0 / 3.0, ..PhaseSeconds::default() },
            },
        }
    }

    fn written(folder: &Path, part: &Part) -> PathBuf {
        let path = folder.join("some file");
        part.view().write(&File::create(&path).unwrap()).unwrap();
        path
    }

    #[test]
    fn files_hold_every_bit() {
        let folder = tempfile::tempdir().unwrap();
        let read = Part::read(&written(folder.path(), &part())).unwrap();
        let bits = |part: &Part| -> Vec<u64> {
            let layers = part.gathered.layers.as_ref().unwrap();
            let emission = part.gathered.emission.as_ref().unwrap();
            let sums = [&part.gathered.film, emission, &layers.surfaces, &layers.media];
            let values = sums.iter().flat_map(|sums| sums.pairs().as_flattened());
            values.map(|value| value.to_bits()).collect()
        };
        assert_eq!(bits(&read), bits(&part()));
        assert_eq!(read, part());
    }

    #[test]
    fn damage_is_found() {
        let folder = tempfile::tempdir().unwrap();
        let path = written(folder.path(), &part());
        let bytes = std::fs::read(&path).unwrap();
        let sound = part();
        // Whatever byte is flipped: the file is refused, or says the same.
        for at in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[at] ^= 0x10;
            std::fs::write(&path, damaged).unwrap();
            if let Ok(read) = Part::read(&path) {
                let (read, sound) = (&read.gathered, &sound.gathered);
                assert!(
                    (&read.film, &read.emission, &read.layers)
                        == (&sound.film, &sound.emission, &sound.layers),
                    "{at}"
                );
            }
        }
    }

    #[test]
    fn formats_to_come_are_refused() {
        let facts = facts(Path::new("a part"), br#"{"format": 2, "more": []}"#);
        let Err(error) = facts.map(drop) else { panic!("it was read") };
        assert!(error.to_string().contains("has the format 2"), "{error}");
    }
}
