//! Reproduces what was asked for, scene by scene.

use super::growth::Probe;
use super::job::ReproduceJob;
use super::scenes::PaperScene;
use super::{claims, evidence, statement};
use crate::cli::arguments::ReproduceArguments;
use crate::cli::compare::{self, Stage};
use crate::cli::failure::Failure;
use crate::cli::{print_result, teller};
use anyhow::Context;
use std::fs;
use std::path::PathBuf;

/// Writes all scenes, then renders them one after the other.
pub fn run(job: &ReproduceJob) -> Result<(), Failure> {
    let quiet = job.arguments.quiet;
    let tell = teller(quiet);
    let files = prepare(job, tell)?;
    if job.arguments.prepare {
        return files.iter().try_for_each(|file| print_result(&file.display().to_string()));
    }
    let comparisons =
        job.scenes.iter().zip(&files).map(|(&scene, file)| job.comparison(scene, file));
    let comparisons = comparisons.collect::<Result<Vec<_>, _>>().map_err(Failure::bad_input)?;
    let ReproduceArguments { variant, verbose, .. } = &job.arguments;
    let stage = Stage::open(variant.as_deref(), *verbose, quiet)?;
    for ((&scene, file), comparison) in job.scenes.iter().zip(&files).zip(&comparisons) {
        compare::measure(&stage, comparison)?;
        if !job.arguments.no_memory {
            tell("measuring how memory grows with photons, in renders of two passes");
            let probe = Probe { job, scene, file };
            probe.measure(|| stage.interrupt.requested()).map_err(Failure::failed)?;
        }
        if stage.interrupt.requested() {
            break;
        }
    }
    conclude(job)
}

/// Judges the claims by all that the folder holds.
fn conclude(job: &ReproduceJob) -> Result<(), Failure> {
    let output = &job.arguments.output;
    let evidence = evidence::read(output);
    let claims = claims::judge(&evidence);
    statement::write(output, &evidence, &claims).map_err(Failure::failed)?;
    if job.arguments.quiet {
        return Ok(());
    }
    print_result(&statement::summary(&claims))?;
    print_result(&format!("wrote \"{}\"", output.join("claims.md").display()))
}

/// The paths of all scenes, whose files are written where they are the project's.
fn prepare(job: &ReproduceJob, tell: impl Fn(&str) + Copy) -> Result<Vec<PathBuf>, Failure> {
    let path = |&scene: &PaperScene| {
        let folder = job.folder(scene);
        fs::create_dir_all(&folder)
            .with_context(|| format!("cannot make the folder \"{}\"", folder.display()))?;
        match &job.arguments.file {
            Some(file) => Ok(file.clone()),
            None => scene.write(&folder, job.arguments.dragon.as_deref(), tell),
        }
    };
    job.scenes.iter().map(path).collect::<anyhow::Result<_>>().map_err(Failure::failed)
}
