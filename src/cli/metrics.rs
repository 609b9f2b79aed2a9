//! `vpt metrics`: how far a picture is from another.

use super::arguments::MetricsArguments;
use super::failure::Failure;
use super::{print_result, text};
use serde::Serialize;
use std::path::{Path, PathBuf};
use vpt::picture::{LayeredPicture, PictureFileError};
use vpt::report::flip::Flip;
use vpt::report::metrics::{relative_mse, rmse};
use vpt::report::picture::Picture;

/// Pixels that are named at most.
const NAMED: usize = 5;

/// Pictures that cannot be held against one another.
#[derive(Debug, thiserror::Error)]
enum MetricsError {
    #[error(transparent)]
    File(#[from] PictureFileError),
    #[error(
        "\"{}\" has {} x {} pixels, but \"{}\" has {} x {}; pictures of one size can be compared",
        .picture.display(), .size[0], .size[1], .reference.display(), .other[0], .other[1]
    )]
    Size { picture: PathBuf, size: [usize; 2], reference: PathBuf, other: [usize; 2] },
    #[error(
        "no pixel of \"{}\" and \"{}\" is a number in both, so there is nothing to compare",
        .0.display(), .1.display()
    )]
    NoNumbers(PathBuf, PathBuf),
}

/// What the command prints with `--json`.
#[derive(Debug, Serialize)]
struct Metrics {
    picture: String,
    reference: String,
    layer: Option<String>,
    width: usize,
    height: usize,
    rmse: f64,
    relative_mse: f64,
    /// The root of it.
    relative_error: f64,
    flip: f64,
    /// Over the pixels that were compared, and their channels.
    mean_of_picture: f64,
    mean_of_reference: f64,
    /// Pixels with a value that is no finite number; they were left out.
    not_finite_in_picture: usize,
    not_finite_in_reference: usize,
    /// The first of them, from the left and from the top.
    first_not_finite: Vec<[usize; 2]>,
}

/// Prints the metrics of a picture against a reference.
pub fn run(arguments: &MetricsArguments) -> Result<(), Failure> {
    let metrics = measure(arguments).map_err(Failure::bad_input)?;
    if arguments.json {
        let json = serde_json::to_string_pretty(&metrics);
        return print_result(&json.map_err(Failure::failed)?);
    }
    print_result(&metrics.lines().join("\n"))
}

fn measure(arguments: &MetricsArguments) -> Result<Metrics, MetricsError> {
    let MetricsArguments { picture, reference, layer, .. } = arguments;
    let layer = layer.as_deref();
    let (own, other) = (read(picture, layer)?, read(reference, layer)?);
    if own.size() != other.size() {
        return Err(MetricsError::Size {
            picture: picture.clone(),
            size: own.size(),
            reference: reference.clone(),
            other: other.size(),
        });
    }
    let is_finite = |pixel: &[f32; 3]| pixel.iter().all(|value| value.is_finite());
    let is_usable = |index: usize| is_finite(&own.pixels[index]) && is_finite(&other.pixels[index]);
    let usable: Vec<usize> = (0..own.pixels.len()).filter(|&index| is_usable(index)).collect();
    if usable.is_empty() {
        return Err(MetricsError::NoNumbers(picture.clone(), reference.clone()));
    }
    let left_out = (0..own.pixels.len()).filter(|&index| !is_usable(index));
    let not_finite = |of: &Picture| of.pixels.iter().filter(|pixel| !is_finite(pixel)).count();
    let (own_numbers, other_numbers) = (only(&own, &usable), only(&other, &usable));
    let relative_mse = relative_mse(&own_numbers, &other_numbers);
    Ok(Metrics {
        picture: picture.display().to_string(),
        reference: reference.display().to_string(),
        layer: layer.map(str::to_owned),
        width: own.width,
        height: own.height,
        rmse: rmse(&own_numbers, &other_numbers),
        relative_mse,
        relative_error: relative_mse.sqrt(),
        flip: flip(&own, &other, &usable),
        mean_of_picture: own_numbers.mean(),
        mean_of_reference: other_numbers.mean(),
        not_finite_in_picture: not_finite(&own),
        not_finite_in_reference: not_finite(&other),
        first_not_finite: left_out.take(NAMED).map(|i| [i % own.width, i / own.width]).collect(),
    })
}

fn read(path: &Path, layer: Option<&str>) -> Result<Picture, PictureFileError> {
    let (picture, _) = LayeredPicture::read(path)?;
    match picture.rgb(layer) {
        Some(pixels) => Ok(Picture { width: picture.width, height: picture.height, pixels }),
        None => Err(PictureFileError::NoLayer {
            path: path.to_owned(),
            layer: layer.map(str::to_owned),
            known: picture.channels.into_iter().map(|channel| channel.name).collect(),
        }),
    }
}

/// These pixels in a row, for metrics that do not look at their places.
fn only(picture: &Picture, pixels: &[usize]) -> Picture {
    let pixels: Vec<_> = pixels.iter().map(|&index| picture.pixels[index]).collect();
    Picture { width: pixels.len(), height: 1, pixels }
}

/// The mean over these pixels; the others are black in both pictures, so that their neighbours see no difference.
fn flip(picture: &Picture, reference: &Picture, pixels: &[usize]) -> f64 {
    let shown = |of: &Picture| {
        let mut shown = Picture { pixels: vec![[0.0; 3]; of.pixels.len()], ..*of };
        pixels.iter().for_each(|&index| shown.pixels[index] = of.pixels[index]);
        shown
    };
    let errors = Flip::new(&shown(reference)).errors(&shown(picture));
    pixels.iter().map(|&index| errors[index]).sum::<f64>() / pixels.len() as f64
}

impl Metrics {
    fn lines(&self) -> Vec<String> {
        let layer = self.layer.as_ref().map_or(String::new(), |layer| format!(", layer {layer}"));
        let mut lines = vec![
            format!(
                "\"{}\" against the reference \"{}\", {} x {} pixels{layer}",
                self.picture, self.reference, self.width, self.height
            ),
            format!("RMSE          {:.6e}", self.rmse),
            format!(
                "relative MSE  {:.6e}, which is {} off",
                self.relative_mse,
                text::percent(self.relative_error)
            ),
            format!("FLIP          {:.6}", self.flip),
            format!(
                "mean          {:.6e}, reference {:.6e}",
                self.mean_of_picture, self.mean_of_reference
            ),
        ];
        if !self.first_not_finite.is_empty() {
            let places = self.first_not_finite.iter().map(|[x, y]| format!("({x}, {y})"));
            lines.push(format!(
                "left out      {} pixels of the picture and {} of the reference, which are no finite numbers: {}{}",
                self.not_finite_in_picture,
                self.not_finite_in_reference,
                places.collect::<Vec<_>>().join(", "),
                if self.first_not_finite.len() == NAMED { ", ..." } else { "" }
            ));
        }
        lines
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vpt::picture::{Channel, ComponentFormat, FilmFormat, Metadata, PixelFormat};

    /// A picture of one colour, and a layer `media` of half of it.
    fn write(path: &Path, [width, height]: [usize; 2], value: f32, hole: Option<usize>) {
        let plane = |name: &str, value: f32| {
            let mut values = vec![value; width * height];
            hole.into_iter().for_each(|index| values[index] = f32::NAN);
            Channel { name: name.to_owned(), values }
        };
        let channels = ["R", "G", "B"]
            .into_iter()
            .flat_map(|name| [plane(name, value), plane(&format!("media.{name}"), 0.5 * value)]);
        let picture = LayeredPicture { width, height, channels: channels.collect() };
        let format = FilmFormat { pixel: PixelFormat::Rgb, component: ComponentFormat::Float32 };
        picture.write(path, format, &Metadata::default()).unwrap();
    }

    fn arguments(folder: &Path, layer: Option<&str>) -> MetricsArguments {
        MetricsArguments {
            picture: folder.join("a.exr"),
            reference: folder.join("b.exr"),
            layer: layer.map(str::to_owned),
            json: false,
        }
    }

    /// 2.5 against 2: differences of 0.5, over 2² and the floor of (0.1 x 2)².
    #[test]
    fn constant_pictures_in_closed_form() {
        let folder = tempfile::tempdir().unwrap();
        write(&folder.path().join("a.exr"), [8, 4], 2.5, None);
        write(&folder.path().join("b.exr"), [8, 4], 2.0, None);
        let whole = measure(&arguments(folder.path(), None)).unwrap();
        assert!((whole.rmse - 0.5).abs() < 1e-12);
        assert!((whole.relative_mse - 0.25 / 4.04).abs() < 1e-12);
        assert!((0.0..=1.0).contains(&whole.flip) && whole.lines().len() == 5);
        let media = measure(&arguments(folder.path(), Some("media"))).unwrap();
        assert!((media.rmse - 0.25).abs() < 1e-12);
        assert!((media.relative_mse - whole.relative_mse).abs() < 1e-12);
    }

    /// A hole in either picture leaves the errors of the rest as they are, and is told.
    #[test]
    fn pixels_that_are_no_numbers_are_left_out_and_named() {
        let folder = tempfile::tempdir().unwrap();
        write(&folder.path().join("a.exr"), [8, 4], 2.5, Some(11));
        write(&folder.path().join("b.exr"), [8, 4], 2.0, Some(30));
        let metrics = measure(&arguments(folder.path(), None)).unwrap();
        assert!((metrics.rmse - 0.5).abs() < 1e-12 && metrics.flip.is_finite());
        assert_eq!((metrics.not_finite_in_picture, metrics.not_finite_in_reference), (1, 1));
        assert_eq!(metrics.first_not_finite, [[3, 1], [6, 3]]);
        assert!(metrics.lines()[5].contains("(3, 1), (6, 3)"));
        write(&folder.path().join("a.exr"), [1, 1], 0.0, Some(0));
        write(&folder.path().join("b.exr"), [1, 1], 0.0, None);
        let error = measure(&arguments(folder.path(), None)).unwrap_err().to_string();
        assert!(error.contains("nothing to compare"), "{error}");
    }

    #[test]
    fn what_cannot_be_compared_is_named() {
        let folder = tempfile::tempdir().unwrap();
        write(&folder.path().join("a.exr"), [8, 4], 1.0, None);
        write(&folder.path().join("b.exr"), [4, 8], 1.0, None);
        let error = measure(&arguments(folder.path(), None)).unwrap_err().to_string();
        assert!(error.contains("8 x 4") && error.contains("4 x 8"), "{error}");
        let error = measure(&arguments(folder.path(), Some("fog"))).unwrap_err().to_string();
        assert!(error.contains("\"fog\"") && error.contains("media.R"), "{error}");
        std::fs::write(folder.path().join("b.exr"), "text").unwrap();
        let error = measure(&arguments(folder.path(), None)).unwrap_err().to_string();
        assert!(error.contains("b.exr") && error.contains("give an EXR file"), "{error}");
    }
}
