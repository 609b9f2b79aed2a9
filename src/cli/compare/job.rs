//! Arguments of a comparison that were found to make sense.

use super::entrant::Entrant;
use super::error::CompareError;
use super::folder::Folder;
use super::per_pass::PerPass;
use crate::cli::arguments::CompareArguments;
use crate::cli::job::{check_pairs, check_scene, check_settings, check_variant};
use std::path::PathBuf;
use std::time::Duration;
use vpt::host::session::{SceneFile, VARIANTS};
use vpt::method::Parameters;
use vpt::report::picture::Picture;

/// The rendered reference has so many times the time of a method.
const REFERENCE_TIMES: f64 = 4.0;

/// A comparison whose arguments were checked as far as that goes without loading the scene.
pub struct CompareJob {
    pub scene: SceneFile,
    pub entrants: Vec<Entrant>,
    /// Seconds of each method, for each seed.
    pub time: f64,
    pub seeds: u32,
    /// The file's path and picture.
    pub reference: Option<(PathBuf, Picture)>,
    /// Who renders it otherwise; None leaves that to a trial.
    pub reference_method: Option<String>,
    /// Seconds.
    pub reference_time: f64,
    /// None leaves the photons per pass to the scene, for all methods.
    pub per_pass: Option<PerPass>,
    pub folder: Folder,
    /// Whether to forget an interrupted comparison.
    pub restart: bool,
    pub variant: Option<String>,
    pub sensor: usize,
    pub verbosity: u8,
    pub quiet: bool,
}

impl CompareJob {
    /// Checks everything that can be checked without loading the scene.
    pub fn new(arguments: CompareArguments) -> Result<Self, CompareError> {
        check_scene(&arguments.scene)?;
        check_pairs("-D", &arguments.defines)?;
        check_pairs("--set", &arguments.settings)?;
        check_settings(&arguments.settings)?;
        if let Some(variant) = &arguments.variant {
            check_variant(variant)?;
        }
        let own_variant = arguments.variant.as_deref().unwrap_or(VARIANTS[0]);
        let entrants = Entrant::parse_all(&arguments.methods, own_variant)?;
        if arguments.reference_method.contains('@') {
            return Err(CompareError::ReferenceVariant(arguments.reference_method));
        }
        let reference_time = arguments.reference_time.unwrap_or(REFERENCE_TIMES * arguments.time);
        check_seconds("--time", arguments.time)?;
        check_seconds("--reference-time", reference_time)?;
        let reference = arguments.reference.map(read_reference).transpose()?;
        let folder = arguments.output.unwrap_or_else(|| {
            let mut name = arguments.scene.file_stem().unwrap_or_default().to_owned();
            name.push("-compare");
            PathBuf::from(name)
        });
        Ok(CompareJob {
            scene: SceneFile {
                path: arguments.scene,
                defines: arguments.defines,
                settings: arguments.settings,
                ..SceneFile::default()
            },
            entrants,
            time: arguments.time,
            seeds: arguments.seeds,
            reference,
            reference_method: Some(arguments.reference_method).filter(|name| name != "auto"),
            reference_time,
            per_pass: None,
            folder: Folder::check(folder)?,
            restart: arguments.restart,
            variant: arguments.variant,
            sensor: arguments.sensor,
            verbosity: arguments.verbose,
            quiet: arguments.quiet,
        })
    }

    /// The scene's parameters, with the photons per pass that the job has for a method.
    pub fn parameters_of(&self, entrant: &Entrant, scene: &Parameters) -> Parameters {
        match (self.per_pass, entrant.integrator.parse()) {
            (Some(per_pass), Ok(method)) => {
                Parameters { photons: per_pass.of(method), ..scene.clone() }
            }
            _ => scene.clone(),
        }
    }

    /// Checks the reference against the film of the loaded scene.
    pub fn check_reference(&self, film: [u32; 2]) -> Result<(), CompareError> {
        let wanted = film.map(|side| side as usize);
        match &self.reference {
            Some((path, picture)) if picture.size() != wanted => Err(CompareError::ReferenceSize {
                path: path.clone(),
                found: picture.size(),
                wanted,
            }),
            _ => Ok(()),
        }
    }
}

fn check_seconds(option: &'static str, seconds: f64) -> Result<(), CompareError> {
    match Duration::try_from_secs_f64(seconds) {
        Ok(time) if !time.is_zero() => Ok(()),
        _ => Err(CompareError::Seconds { option, seconds }),
    }
}

fn read_reference(path: PathBuf) -> Result<(PathBuf, Picture), CompareError> {
    let picture = Picture::read_exr(&path)?;
    if picture.mean() > 0.0 {
        Ok((path, picture))
    } else {
        Err(CompareError::ReferenceBlack(path))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::failure::Failure;

    #[test]
    fn every_mistake_is_named_with_its_mend() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
        let (scene, dir, below) = (path("scene.xml"), path("out"), path("none/out"));
        std::fs::write(&scene, "<scene version=\"3.0.0\"/>").unwrap();
        for (words, parts) in [
            (&["--methods", "ppt,,apa"][..], &["--methods", "empty name", "ppt,volpath"][..]),
            (&["--methods", ""], &["--methods", "empty name"]),
            (&["--methods", "ppt,apa,ppt"], &["\"ppt\" twice", "keep one"]),
            (&["--methods", "ppt,volpath@fast"], &["unknown variant \"fast\"", "llvm_ad_rgb"]),
            (&["--methods", "ppt,ppt@scalar_rgb"], &["\"ppt\" twice", "keep one"]),
            (&["--methods", "@llvm_ad_rgb"], &["empty name"]),
            (&["--reference-method", "ppt@llvm_ad_rgb"], &["--reference-method", "leave \"@"]),
            (&["--time", "0"], &["--time is 0", "above 0"]),
            (&["--time", "nan"], &["--time is NaN", "above 0"]),
            (&["--reference-time", "-1"], &["--reference-time is -1", "above 0"]),
            (&["--reference", &scene], &["--reference", "scene.xml", "EXR"]),
            (&["--variant", "scalar_mono"], &["unknown variant \"scalar_mono\"", "llvm_ad_mono"]),
            (&["--set", "method=ppt"], &["--set method", "--method"]),
            (&["-o", &scene], &["-o", "scene.xml", "no folder"]),
            (&["-o", &below], &["-o", "none\" does not exist", "make it"]),
        ] {
            let mut all = vec![scene.as_str()];
            all.extend(words);
            if !words.contains(&"-o") {
                all.extend(["-o", &dir]);
            }
            let Err(error) = CompareJob::new(CompareArguments::parse(&all).unwrap()) else {
                panic!("{words:?} was not refused")
            };
            let message = Failure::bad_input(error).message();
            for part in parts {
                assert!(message.contains(part), "{words:?}: no {part:?} in: {message}");
            }
        }
        assert!(!folder.path().join("out").exists());
    }
}
