//! Arguments of a reproduction that were found to make sense, and what can be wrong with them.

use super::assets::dragon::{self, DragonError};
use super::scenes::{Choice, PaperScene};
use super::setup::{Row, Times, ALPHA};
use crate::cli::arguments::{CompareArguments, ReproduceArguments};
use crate::cli::compare::{CompareError, CompareJob, Folder, FolderError};
use crate::cli::job::{check_pairs, check_scene, check_variant, JobError};
use std::path::{Path, PathBuf};
use std::time::Duration;
use vpt::method::Method;

/// Time for each scene where the user names none.
const BUDGET: Duration = Duration::from_secs(600);

/// A reproduction whose arguments were checked as far as that goes without loading scenes.
pub struct ReproduceJob {
    pub scenes: &'static [PaperScene],
    pub arguments: ReproduceArguments,
}

/// A mistake in the arguments of a reproduction, with the mend.
#[derive(Debug, thiserror::Error)]
pub enum ReproduceError {
    #[error(transparent)]
    Common(#[from] JobError),
    #[error("{0} is for one scene, but all are asked for; name one of dragon_smokes, breakfast_hall, kitchen")]
    OneScene(&'static str),
    #[error("--dragon is for dragon_smokes alone; leave it out")]
    NoDragon,
    #[error("--prepare writes the project's scenes, but --scene gives one that is there; leave one of them out")]
    NothingToPrepare,
    #[error(transparent)]
    Dragon(#[from] DragonError),
    #[error("the folder (-o) cannot be used")]
    Folder(#[from] FolderError),
    #[error(transparent)]
    Compare(#[from] CompareError),
}

impl ReproduceJob {
    /// Checks everything that can be checked without writing or loading a scene.
    pub fn new(arguments: ReproduceArguments) -> Result<Self, ReproduceError> {
        check_pairs("-D", &arguments.defines)?;
        if let Some(variant) = &arguments.variant {
            check_variant(variant)?;
        }
        let scenes = arguments.choice.scenes();
        check_of_one_scene(&arguments)?;
        if let Some(path) = &arguments.file {
            check_scene(path)?;
        }
        if let Some(path) = &arguments.dragon {
            dragon::check(path)?;
        }
        Folder::check(arguments.output.clone())?;
        Ok(ReproduceJob { scenes, arguments })
    }

    /// The folder of a scene's files and its report.
    pub fn folder(&self, scene: PaperScene) -> PathBuf {
        self.arguments.output.join(scene.name())
    }

    pub fn row(&self, scene: PaperScene) -> Row {
        match self.arguments.paper {
            true => Row::paper(scene),
            false => Row::small(scene),
        }
    }

    pub fn times(&self, scene: PaperScene) -> Times {
        let ReproduceArguments { budget, seeds, paper, .. } = self.arguments;
        match budget {
            None if paper => Times::paper(&self.row(scene)),
            _ => Times::within(budget.unwrap_or(BUDGET), seeds),
        }
    }

    /// The parameters of the scene: the user's, and the resolution of a scene of the project.
    pub fn defines(&self, scene: PaperScene) -> Vec<(String, String)> {
        let mut defines = self.arguments.defines.clone();
        let [width, height] = self.row(scene).resolution;
        for (name, value) in [("resx", width), ("resy", height)] {
            let free = self.arguments.file.is_none() && defines.iter().all(|(own, _)| own != name);
            defines.extend(free.then(|| (name.to_owned(), value.to_string())));
        }
        defines
    }

    /// The comparison of all methods on a scene whose files are there.
    pub fn comparison(&self, scene: PaperScene, file: &Path) -> Result<CompareJob, ReproduceError> {
        let times = self.times(scene);
        let arguments = &self.arguments;
        let own_reference = arguments.reference.is_some();
        let job = CompareJob::new(CompareArguments {
            scene: file.to_owned(),
            methods: methods(),
            time: times.method,
            seeds: arguments.seeds,
            reference: arguments.reference.clone(),
            reference_method: "auto".to_owned(),
            reference_time: (!own_reference).then_some(times.reference),
            output: Some(self.folder(scene)),
            restart: arguments.restart,
            defines: self.defines(scene),
            settings: paper_settings(),
            variant: arguments.variant.clone(),
            sensor: 0,
            verbose: arguments.verbose,
            quiet: arguments.quiet,
        })?;
        Ok(CompareJob { per_pass: Some(self.row(scene).per_pass), ..job })
    }
}

/// The paper's method, with radii that fit the kernels: its printed cube root is one of its claims, not a setting.
fn paper_settings() -> Vec<(String, String)> {
    let alpha = ALPHA.to_string();
    [("preset", "paper"), ("radius_schedule", "matched"), ("alpha", &alpha)]
        .map(|(name, value)| (name.to_owned(), value.to_owned()))
        .into()
}

/// The paper's six methods, which are all of vpt's. [Collin 2013 §6]
fn methods() -> Vec<String> {
    Method::ALL.map(|method| method.name().to_owned()).into()
}

/// Refuses options that the chosen scenes have no use for.
fn check_of_one_scene(arguments: &ReproduceArguments) -> Result<(), ReproduceError> {
    if arguments.choice == Choice::All {
        for (option, given) in
            [("--scene", arguments.file.is_some()), ("--reference", arguments.reference.is_some())]
        {
            if given {
                return Err(ReproduceError::OneScene(option));
            }
        }
    }
    let draws_dragon = arguments.choice.scenes().contains(&PaperScene::DragonSmokes);
    if arguments.dragon.is_some() && (!draws_dragon || arguments.file.is_some()) {
        return Err(ReproduceError::NoDragon);
    }
    if arguments.prepare && arguments.file.is_some() {
        return Err(ReproduceError::NothingToPrepare);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::bench::Bench;
    use crate::cli::failure::Failure;
    use vpt::method::Parameters;

    fn job_of(bench: &Bench, words: &[&str]) -> Result<ReproduceJob, ReproduceError> {
        let output = bench.path("out");
        let mut all = words.to_vec();
        if !words.contains(&"-o") {
            all.extend(["-o", &output]);
        }
        ReproduceJob::new(ReproduceArguments::parse(&all).unwrap())
    }

    #[test]
    fn paper_is_followed_where_the_user_says_nothing() {
        let bench = Bench::new();
        let job = job_of(&bench, &["kitchen", "--paper"]).unwrap();
        assert_eq!(job.times(PaperScene::Kitchen).method, 36_000.0);
        let pair = |name: &str, value: &str| (name.to_owned(), value.to_owned());
        let size = [pair("resx", "1280"), pair("resy", "720")];
        assert_eq!(job.defines(PaperScene::Kitchen), size);
        std::fs::create_dir(bench.path("out")).unwrap();
        let compare =
            job.comparison(PaperScene::Kitchen, bench.path("scene.xml").as_ref()).unwrap();
        let scene = Parameters { photons: 7, ..Parameters::default() };
        let photons = compare.entrants.iter().map(|e| compare.parameters_of(e, &scene).photons);
        let (points, beams) = (100_000, 10_000);
        assert_eq!(photons.collect::<Vec<_>>(), [points, beams, points, beams, points, beams]);
    }

    #[test]
    fn user_has_the_last_word() {
        let bench = Bench::new();
        let scene = bench.path("scene.xml");
        let job =
            job_of(&bench, &["kitchen", "--paper", "--budget", "4m", "--seeds", "1"]).unwrap();
        assert!((job.times(PaperScene::Kitchen).method - 30.0).abs() < 1e-9);
        let job = job_of(&bench, &["kitchen", "-D", "resx=32"]).unwrap();
        assert_eq!(job.defines(PaperScene::Kitchen)[0].1, "32");
        let job = job_of(&bench, &["kitchen", "--scene", &scene]).unwrap();
        assert_eq!(job.defines(PaperScene::Kitchen), []);
    }

    #[test]
    fn every_mistake_is_named_with_its_mend() {
        let bench = Bench::new();
        let (scene, none, below) = (bench.path("scene.xml"), bench.path("none"), bench.path("a/b"));
        for (words, parts) in [
            (&["all", "--scene", &scene][..], &["--scene is for one scene", "name one of"][..]),
            (&["all", "--reference", &scene], &["--reference is for one scene"]),
            (&["kitchen", "--scene", &none], &["cannot read the scene", "none"]),
            (&["kitchen", "--dragon", &scene], &["--dragon is for dragon_smokes", "leave it out"]),
            (&["dragon_smokes", "--dragon", &none], &["cannot read the dragon", "--dragon"]),
            (&["dragon_smokes", "--dragon", &scene], &["scene.xml", "a .ply or .obj file"]),
            (&["kitchen", "--prepare", "--scene", &scene], &["--prepare", "leave one"]),
            (&["kitchen", "--variant", "scalar_mono"], &["unknown variant \"scalar_mono\""]),
            (&["kitchen", "-D", "a=1", "-D", "a=2"], &["-D", "\"a\" twice"]),
            (&["kitchen", "-o", &scene], &["-o", "no folder"]),
            (&["kitchen", "-o", &below], &["-o", "does not exist", "make it"]),
        ] {
            let Err(error) = job_of(&bench, words) else { panic!("{words:?} was not refused") };
            let message = Failure::bad_input(error).message();
            for part in parts {
                assert!(message.contains(part), "{words:?}: no {part:?} in: {message}");
            }
        }
        assert!(!bench.folder.path().join("out").exists());
    }
}
