//! Arguments that were found to make sense, and what can be wrong with them.

use super::arguments::{Passes, RenderArguments};
use super::checkpoint::Checkpoint;
use super::goal::{Goal, OPEN_PASSES};
use super::target::{Target, TargetError};
use super::tev::{Address, AddressError};
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;
use vpt::effect::{Effects, UnknownEffect};
use vpt::host::session::{SceneFile, VARIANTS};
use vpt::method::{Method, ParameterError};

/// Extensions of the pictures that Mitsuba writes.
const EXTENSIONS: [&str; 8] = ["exr", "png", "jpg", "jpeg", "hdr", "rgbe", "pfm", "ppm"];

/// Of these, what is written without Mitsuba's film.
const DEVELOPED: [&str; 5] = ["exr", "png", "jpg", "jpeg", "ppm"];

/// Parameters that have an option of their own: with `--set` they would be said twice.
const OPTIONS_OF_PARAMETERS: [(&str, &str); 7] = [
    ("method", "--method"),
    ("effects", "--effects"),
    ("passes", "--passes"),
    ("spp", "--passes"),
    ("timeout", "--timeout"),
    ("target_error", "--target-error"),
    ("seed", "--seed"),
];

/// A render whose arguments were checked as far as that goes without loading the scene.
pub struct RenderJob {
    pub scene: SceneFile,
    pub picture: Target,
    pub stats: Option<Target>,
    /// Where the picture is shown as it is rendered.
    pub viewer: Option<Address>,
    pub passes: Option<u32>,
    /// The first pass, where a part is to be written instead of a picture.
    pub first_pass: Option<u32>,
    pub checkpoint: Option<Checkpoint>,
    pub goal: Goal,
    pub seed: u32,
    pub threads: Option<usize>,
    pub variant: Option<String>,
    pub sensor: usize,
    pub verbosity: u8,
    pub quiet: bool,
}

/// A mistake in the arguments, with the mend.
#[derive(Debug, thiserror::Error)]
pub enum JobError {
    #[error("cannot read the scene \"{}\"; give the path of a Mitsuba XML file", .path.display())]
    Scene { path: PathBuf, source: io::Error },
    #[error("the scene \"{}\" is a folder; give the path of a Mitsuba XML file", .0.display())]
    SceneIsFolder(PathBuf),
    #[error(
        "the picture \"{}\" has no extension that names a format; use one of: {known}",
        .0.display(), known = EXTENSIONS.join(", ")
    )]
    Extension(PathBuf),
    #[error(
        "--layers needs an EXR file, but the picture is \"{}\"; give -o a name that ends in .exr", .0.display()
    )]
    LayersNeedExr(PathBuf),
    #[error("a range of passes is written as a part, which needs a name of its own; give -o")]
    PartWithoutName,
    #[error(
        "a range of passes is written as a part, which is an EXR file, but -o is \"{}\"; give a name that ends in .exr", .0.display()
    )]
    PartIsExr(PathBuf),
    #[error(
        "with --checkpoint pictures are written as {known}, but -o is \"{}\"; give a name with one of these extensions",
        .0.display(), known = DEVELOPED.join(", ")
    )]
    CheckpointFormat(PathBuf),
    #[error(
        "vpt merge writes pictures as {known}, but -o is \"{}\"; give a name with one of these extensions",
        .0.display(), known = DEVELOPED.join(", ")
    )]
    MergeFormat(PathBuf),
    #[error("--checkpoint \"{}\" is also the scene or the picture; name another file", .0.display())]
    CheckpointOverwrite(PathBuf),
    #[error(
        "the checkpoint \"{}\" exists; add --resume to go on with it, or remove it or name another to begin anew", .0.display()
    )]
    CheckpointExists(PathBuf),
    #[error("--tev cannot be used")]
    Viewer(#[source] AddressError),
    #[error("{option} cannot be written")]
    Unwritable { option: &'static str, source: TargetError },
    #[error("--stats \"{}\" is also the scene or the picture; name another file", .0.display())]
    StatsOverwrite(PathBuf),
    #[error("{option} gives \"{name}\" twice; keep one of them")]
    GivenTwice { option: &'static str, name: String },
    #[error("--set {name}=... is not for this parameter; use {option}")]
    OwnOption { name: &'static str, option: &'static str },
    #[error(transparent)]
    Method(ParameterError),
    #[error(transparent)]
    Effects(UnknownEffect),
    #[error("--timeout is {0}, but must be a number of seconds above 0")]
    Timeout(f64),
    #[error("--target-error is {0}, but must be a number above 0 and below 1 (0.01 is 1 %)")]
    TargetError(f64),
    #[error(
        "the variant \"{0}\" does not suit vpt, which computes in single precision and follows no polarized light; use \
         one of: {known}",
        known = VARIANTS.join(", ")
    )]
    UnsuitableVariant(String),
    #[error("unknown variant \"{0}\"; use one of: {known}", known = VARIANTS.join(", "))]
    UnknownVariant(String),
    #[error("the scene \"{}\" has no sensor; add a <sensor> to it", .0.display())]
    NoSensor(PathBuf),
    #[error("--sensor is {sensor}, but the scene's last sensor is {last} (the first is 0)")]
    Sensor { sensor: usize, last: usize },
}

impl RenderJob {
    /// Checks everything that can be checked without loading the scene.
    pub fn new(arguments: RenderArguments) -> Result<Self, JobError> {
        check_scene(&arguments.scene)?;
        check_pairs("-D", &arguments.defines)?;
        check_pairs("--set", &arguments.settings)?;
        check_settings(&arguments.settings)?;
        check_method(arguments.method.as_deref())?;
        let effects = checked_effects(arguments.effects)?;
        if let Some(seconds) = arguments.timeout {
            check_timeout(seconds)?;
        }
        if let Some(error) = arguments.target_error {
            check_target_error(error)?;
        }
        if let Some(variant) = &arguments.variant {
            check_variant(variant)?;
        }
        let goal = Goal { timeout: arguments.timeout, target_error: arguments.target_error };
        let mut settings = arguments.settings;
        settings.extend(effects);
        settings.extend(goal.target_error.map(|e| ("target_error".to_owned(), e.to_string())));
        let (first_pass, end) = match arguments.passes {
            None => (None, None),
            Some(Passes::Count(count)) => (None, Some(count)),
            Some(Passes::Range { first, end }) => (Some(first), end),
        };
        if first_pass.is_some() && arguments.output.is_none() {
            return Err(JobError::PartWithoutName);
        }
        let picture = check_picture(arguments.output, &arguments.scene)?;
        if first_pass.is_some() && !picture.is_exr() {
            return Err(JobError::PartIsExr(picture.path().to_owned()));
        }
        let checkpoint = arguments
            .checkpoint
            .map(|path| {
                let others = [arguments.scene.as_path(), picture.path()];
                check_checkpoint(path, &others, arguments.every, arguments.resume)
            })
            .transpose()?;
        if checkpoint.is_some() && !can_be_developed(&picture) {
            return Err(JobError::CheckpointFormat(picture.path().to_owned()));
        }
        if arguments.layers {
            check_layers(&picture)?;
            settings.push(("layers".to_owned(), "true".to_owned()));
        }
        let viewer = arguments
            .tev
            .map(|text| text.parse::<Address>().map_err(JobError::Viewer))
            .transpose()?;
        let stats = arguments
            .stats
            .map(|path| check_stats(path, &[&arguments.scene, picture.path()]))
            .transpose()?;
        Ok(RenderJob {
            scene: SceneFile {
                path: arguments.scene,
                defines: arguments.defines,
                method: arguments.method,
                timeout: arguments.timeout,
                settings,
            },
            picture,
            stats,
            viewer,
            passes: end.or(goal.target_error.map(|_| OPEN_PASSES)),
            first_pass,
            checkpoint,
            goal,
            seed: arguments.seed,
            threads: arguments.threads,
            variant: arguments.variant,
            sensor: arguments.sensor,
            verbosity: arguments.verbose,
            quiet: arguments.quiet,
        })
    }

    /// Checks the sensor against the number that the loaded scene has.
    pub fn check_sensor(&self, count: usize) -> Result<(), JobError> {
        check_sensor(self.sensor, count, &self.scene.path)
    }
}

/// No other format holds channels of other names than a picture's.
fn check_layers(picture: &Target) -> Result<(), JobError> {
    match picture.is_exr() {
        true => Ok(()),
        false => Err(JobError::LayersNeedExr(picture.path().to_owned())),
    }
}

pub(super) fn check_sensor(sensor: usize, count: usize, scene: &Path) -> Result<(), JobError> {
    match count.checked_sub(1) {
        None => Err(JobError::NoSensor(scene.to_owned())),
        Some(last) if sensor > last => Err(JobError::Sensor { sensor, last }),
        Some(_) => Ok(()),
    }
}

pub(super) fn check_scene(path: &Path) -> Result<(), JobError> {
    if path.is_dir() {
        return Err(JobError::SceneIsFolder(path.to_owned()));
    }
    match File::open(path) {
        Ok(_) => Ok(()),
        Err(source) => Err(JobError::Scene { path: path.to_owned(), source }),
    }
}

pub(super) fn check_pairs(
    option: &'static str,
    pairs: &[(String, String)],
) -> Result<(), JobError> {
    for (index, (name, _)) in pairs.iter().enumerate() {
        if pairs[..index].iter().any(|(earlier, _)| earlier == name) {
            return Err(JobError::GivenTwice { option, name: name.clone() });
        }
    }
    Ok(())
}

pub(super) fn check_settings(settings: &[(String, String)]) -> Result<(), JobError> {
    for (name, option) in OPTIONS_OF_PARAMETERS {
        if settings.iter().any(|(set, _)| set == name) {
            return Err(JobError::OwnOption { name, option });
        }
    }
    Ok(())
}

pub(super) fn check_method(method: Option<&str>) -> Result<(), JobError> {
    method.map_or(Ok(()), |name| name.parse::<Method>().map(drop).map_err(JobError::Method))
}

/// The parameter that an option gives.
pub(super) fn checked_effects(
    effects: Option<String>,
) -> Result<Option<(String, String)>, JobError> {
    let Some(list) = effects else { return Ok(None) };
    list.parse::<Effects>().map_err(JobError::Effects)?;
    Ok(Some(("effects".to_owned(), list)))
}

fn check_timeout(seconds: f64) -> Result<(), JobError> {
    match Duration::try_from_secs_f64(seconds) {
        Ok(timeout) if !timeout.is_zero() => Ok(()),
        _ => Err(JobError::Timeout(seconds)),
    }
}

fn check_target_error(error: f64) -> Result<(), JobError> {
    if error > 0.0 && error < 1.0 {
        Ok(())
    } else {
        Err(JobError::TargetError(error))
    }
}

pub(super) fn check_variant(variant: &str) -> Result<(), JobError> {
    if VARIANTS.contains(&variant) {
        return Ok(());
    }
    let unsuitable = ["polarized", "double"];
    Err(if unsuitable.iter().any(|kind| variant.contains(kind)) {
        JobError::UnsuitableVariant(variant.to_owned())
    } else {
        JobError::UnknownVariant(variant.to_owned())
    })
}

/// The picture to write: by default the scene's name with `.exr`, in the current folder.
fn check_picture(output: Option<PathBuf>, scene: &Path) -> Result<Target, JobError> {
    let path = output.unwrap_or_else(|| {
        let mut name = scene.file_stem().unwrap_or_default().to_owned();
        name.push(".exr");
        PathBuf::from(name)
    });
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
    if !path.is_dir() && !EXTENSIONS.contains(&extension.as_str()) {
        return Err(JobError::Extension(path));
    }
    check_target("the picture (-o)", path)
}

/// Whether pictures of this name need no film of Mitsuba's.
pub(super) fn can_be_developed(picture: &Target) -> bool {
    let extension = picture.path().extension().unwrap_or_default().to_string_lossy();
    DEVELOPED.contains(&extension.to_lowercase().as_str())
}

fn check_checkpoint(
    path: PathBuf,
    others: &[&Path],
    every: Duration,
    resume: bool,
) -> Result<Checkpoint, JobError> {
    if others.iter().any(|other| is_same(&path, other)) {
        return Err(JobError::CheckpointOverwrite(path));
    }
    if path.exists() && !resume {
        return Err(JobError::CheckpointExists(path));
    }
    let target = check_target("the checkpoint (--checkpoint)", path)?;
    Ok(Checkpoint { target, every, resume })
}

fn is_same(path: &Path, other: &Path) -> bool {
    match (path.canonicalize(), other.canonicalize()) {
        (Ok(path), Ok(other)) => path == other,
        _ => path == other,
    }
}

fn check_stats(path: PathBuf, others: &[&Path]) -> Result<Target, JobError> {
    if others.iter().any(|other| is_same(&path, other)) {
        return Err(JobError::StatsOverwrite(path));
    }
    check_target("the statistics (--stats)", path)
}

fn check_target(option: &'static str, path: PathBuf) -> Result<Target, JobError> {
    Target::check(path).map_err(|source| JobError::Unwritable { option, source })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::bench::Bench;
    use crate::cli::failure::Failure;

    fn job_of(bench: &Bench, words: &[&str]) -> Result<RenderJob, JobError> {
        let (scene, output) = (bench.path("scene.xml"), bench.path("out.exr"));
        let mut all = vec![scene.as_str()];
        all.extend(words);
        if !words.contains(&"-o") {
            all.extend(["-o", &output]);
        }
        RenderJob::new(RenderArguments::parse(&all).unwrap())
    }

    fn refusal(bench: &Bench, words: &[&str]) -> String {
        match job_of(bench, words) {
            Ok(_) => panic!("{words:?} was not refused"),
            Err(error) => Failure::bad_input(error).message(),
        }
    }

    #[test]
    fn arguments_reach_the_job() {
        let bench = Bench::new();
        let job = job_of(
            &bench,
            &["-D", "a=1", "--set", "alpha=0.5", "--method", "ppt", "--timeout", "2.5"],
        )
        .unwrap();
        assert_eq!(job.scene.path, Path::new(&bench.path("scene.xml")));
        assert_eq!(job.scene.defines, [("a".to_owned(), "1".to_owned())]);
        assert_eq!(job.scene.settings, [("alpha".to_owned(), "0.5".to_owned())]);
        assert_eq!(job.scene.method.as_deref(), Some("ppt"));
        assert_eq!(job.scene.timeout, Some(2.5));
        assert_eq!((job.seed, job.sensor, job.passes, job.verbosity), (0, 0, None, 0));
    }

    #[test]
    fn picture_is_named_after_the_scene() {
        let picture = check_picture(None, Path::new("/some/where/box.v2.xml")).unwrap();
        assert_eq!(picture.path(), Path::new("box.v2.exr"));
    }

    #[test]
    fn every_mistake_is_named_with_its_mend() {
        let bench = Bench::new();
        let (no_folder, scene) = (bench.path("no/out.exr"), bench.path("scene.xml"));
        let (gif, bare) = (bench.path("out.gif"), bench.path("out"));
        let (folder, picture) = (bench.path(""), bench.path("out.exr"));
        let (png, hdr, kept) =
            (bench.path("out.png"), bench.path("out.hdr"), bench.path("kept.exr"));
        let none = bench.path("none.exr");
        std::fs::write(&kept, "").unwrap();
        for (words, parts) in [
            (&["--method", "mlt"][..], &["\"mlt\"", "ppt"][..]),
            (&["--effects", "fog"], &["\"fog\"", "auto", "view_beams"]),
            (&["--set", "effects=all"], &["--set effects", "--effects"]),
            (&["--timeout", "0"], &["--timeout is 0", "above 0"]),
            (&["--timeout", "-5"], &["--timeout is -5", "above 0"]),
            (&["--timeout", "nan"], &["--timeout is NaN", "above 0"]),
            (&["--timeout", "1e300"], &["--timeout is 1", "above 0"]),
            (&["--target-error", "0"], &["--target-error is 0", "0.01 is 1 %"]),
            (&["--target-error", "2"], &["--target-error is 2", "below 1"]),
            (&["--set", "target_error=0.1"], &["--set target_error", "--target-error"]),
            (
                &["--variant", "scalar_spectral_polarized"],
                &["scalar_spectral_polarized", "no polarized light", "llvm_ad_rgb"],
            ),
            (&["--variant", "llvm_ad_mono_polarized"], &["polarized light", "scalar_rgb"]),
            (&["--variant", "fast"], &["unknown variant \"fast\"", "cuda_ad_rgb"]),
            (&["-D", "a=1", "-D", "a=2"], &["-D", "\"a\" twice", "keep one"]),
            (&["--set", "alpha=.5", "--set", "alpha=.5"], &["--set", "\"alpha\" twice"]),
            (&["--set", "method=ppt"], &["--set method", "--method"]),
            (&["--set", "spp=4"], &["--set spp", "--passes"]),
            (&["-o", &gif], &["out.gif", "exr, png"]),
            (&["--passes", "0..4", "-o", &png], &["out.png", ".exr"]),
            (&["--checkpoint", &scene], &["--checkpoint", "scene.xml", "another file"]),
            (&["--checkpoint", &picture], &["--checkpoint", "out.exr", "another file"]),
            (&["--checkpoint", &no_folder], &["--checkpoint", "does not exist", "make it"]),
            (&["--checkpoint", &folder, "--resume"], &["--checkpoint", "is a folder"]),
            (&["--checkpoint", &kept], &["kept.exr\" exists", "--resume", "remove it"]),
            (&["--checkpoint", &none, "-o", &hdr], &["out.hdr", "exr, png"]),
            (&["-o", &bare], &["no extension", "exr, png"]),
            (&["-o", &no_folder], &["-o", "/no\" does not exist", "make it"]),
            (&["-o", &folder], &["-o", "is a folder", "name a file"]),
            (&["--stats", &folder], &["--stats", "is a folder", "name a file"]),
            (&["--stats", &scene], &["--stats", "scene.xml", "another file"]),
            (&["--stats", &picture], &["--stats", "out.exr", "another file"]),
        ] {
            let message = refusal(&bench, words);
            for part in parts {
                assert!(message.contains(part), "{words:?}: no {part:?} in: {message}");
            }
        }
    }

    #[test]
    fn scene_must_be_a_readable_file() {
        let bench = Bench::new();
        for (scene, part) in [(bench.path("none.xml"), "cannot read"), (bench.path(""), "folder")] {
            let arguments = RenderArguments::parse(&[&scene]).unwrap();
            let Err(error) = RenderJob::new(arguments) else { panic!("{scene} was not refused") };
            assert!(error.to_string().contains(part), "{error}");
        }
    }

    #[test]
    fn sensor_must_exist() {
        let job = job_of(&Bench::new(), &["--sensor", "2"]).unwrap();
        assert!(job.check_sensor(3).is_ok());
        let message = job.check_sensor(2).unwrap_err().to_string();
        assert!(message.contains("--sensor is 2") && message.contains("last sensor is 1"));
        assert!(job.check_sensor(0).unwrap_err().to_string().contains("add a <sensor>"));
    }
}
