//! `vpt merge`: parts of a picture → the picture.

use super::arguments::MergeArguments;
use super::failure::Failure;
use super::job::{can_be_developed, JobError};
use super::target::Target;
use super::{print_result, teller, text};
use anyhow::{Context, Result};
use std::fs::File;
use std::path::Path;
use vpt::math::srgb;
use vpt::part::{MergeError, Merger, Part};
use vpt::picture::{FilmFormat, LayeredPicture, Metadata};

pub fn run(arguments: &MergeArguments) -> Result<(), Failure> {
    let target = Target::check(arguments.output.clone())
        .map_err(|source| JobError::Unwritable { option: "the picture (-o)", source })
        .map_err(Failure::bad_input)?;
    check_format(&target, arguments.part).map_err(Failure::bad_input)?;
    let part = merged(&arguments.parts).map_err(Failure::bad_input)?;
    let tell = teller(arguments.quiet);
    let missing = part.passes.missing();
    if !missing.is_empty() {
        tell(&format!("note: the passes {missing} are missing; the picture is of {}", part.passes));
    }
    part.gathered
        .counters
        .warnings()
        .iter()
        .for_each(|line| super::say(&format!("warning: {line}")));
    if arguments.part {
        target.replace(|aside| Ok(part.view().write(&File::create(aside)?)?))
    } else {
        let (picture, format) = (part.picture(), part.ground.film.format);
        target.replace(|aside| write_picture(&picture, format, &metadata(&part), aside))
    }
    .map_err(Failure::failed)?;
    if arguments.quiet {
        return Ok(());
    }
    let error = part.gathered.error.as_ref().and_then(|error| error.estimate());
    print_result(&format!(
        "wrote {}\"{}\": {} passes of {} parts, rendered in {}{}",
        if arguments.part { "the part " } else { "" },
        target.path().display(),
        part.passes.count(),
        arguments.parts.len(),
        text::seconds(part.gathered.seconds),
        error.map_or(String::new(), |e| format!(", about {} off", text::percent(e.relative)))
    ))
}

fn check_format(target: &Target, is_part: bool) -> Result<(), JobError> {
    match (is_part, target.is_exr()) {
        (true, false) => Err(JobError::PartIsExr(target.path().to_owned())),
        (false, _) if !can_be_developed(target) => {
            Err(JobError::MergeFormat(target.path().to_owned()))
        }
        _ => Ok(()),
    }
}

/// All parts together, one in memory at a time.
fn merged(files: &[impl AsRef<Path>]) -> Result<Part> {
    let mut merger = Merger::new();
    for file in files {
        let file = file.as_ref();
        let part = Part::read(file)?;
        merger.add(&file.display().to_string(), part)?;
    }
    merger.finish().map_err(|error: MergeError| error.into())
}

/// Writes a developed picture in the format of the path's extension, of those that need no Mitsuba.
pub fn write_picture(
    picture: &LayeredPicture,
    format: FilmFormat,
    metadata: &Metadata,
    path: &Path,
) -> Result<()> {
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("exr")) {
        return Ok(picture.write(path, format, metadata)?);
    }
    let rgb = picture.rgb(None).context("the film's picture has no colours")?;
    let bytes = rgb.as_flattened().iter().map(|&value| srgb::byte(value)).collect();
    image::RgbImage::from_raw(picture.width as u32, picture.height as u32, bytes)
        .context("the picture has an impossible size")?
        .save(path)
        .with_context(|| format!("cannot write \"{}\"", path.display()))
}

/// What the parts say of the picture's making.
fn metadata(part: &Part) -> Metadata {
    let (ground, gathered) = (&part.ground, &part.gathered);
    let mut own = Metadata::default();
    own.text("generatedBy", format!("vpt {} with Mitsuba {}", ground.vpt, ground.mitsuba));
    own.text("vpt.version", &ground.vpt);
    own.text("vpt.mitsuba", &ground.mitsuba);
    own.text("vpt.variant", &ground.variant);
    own.text("vpt.scene", &part.scene);
    own.text("vpt.scene_hash", &ground.scene_hash);
    if let Some(method) = ground.parameters().get("method").and_then(|method| method.as_str()) {
        own.text("vpt.method", method);
    }
    // Numbers and names alone: they always become JSON.
    own.text("vpt.parameters", serde_json::to_string(ground.parameters()).unwrap_or_default());
    own.integer("vpt.passes", part.passes.count().into());
    own.text("vpt.pass_ranges", part.passes.to_string());
    own.integer("vpt.seed", ground.seed);
    own.integer("vpt.sensor", ground.sensor as u64);
    own.number("vpt.surface_radius.first", ground.radii.surface);
    own.number("vpt.medium_radius.first", ground.radii.medium);
    if let Some(error) = gathered.error.as_ref().and_then(|error| error.estimate()) {
        own.number("vpt.error", error.relative);
        own.number("vpt.error.noise", error.noise);
        own.number("vpt.error.bias", error.bias);
    }
    own
}
