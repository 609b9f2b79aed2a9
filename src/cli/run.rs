//! Renders a job and writes its picture.

use super::compare::scene_files;
use super::failure::Failure;
use super::gather;
use super::goal::OPEN_PASSES;
use super::interrupt::Interrupt;
use super::job::RenderJob;
use super::live::Live;
use super::memory::Watch;
use super::metadata::{metadata, Making};
use super::notices::{announce, cause, conclude, display, no_picture};
use super::progress::Reporter;
use super::statistics::{self, Ending};
use super::{say, text};
use anyhow::Context;
use std::path::Path;
use std::time::Instant;
use vpt::host::session::{LoadedScene, Session};
use vpt::method::Stats;
use vpt::picture::{develop, Metadata};

/// Loads, renders, writes. Nothing is rendered before everything that can be checked was checked.
pub fn render(job: &RenderJob) -> Result<(), Failure> {
    let session = Session::start(job.variant.as_deref(), job.threads, job.verbosity)
        .map_err(Failure::failed)?;
    let start = Instant::now();
    let mut scene = session.load(&job.scene).map_err(Failure::bad_input)?;
    let load_seconds = start.elapsed().as_secs_f64();
    job.check_sensor(scene.sensor_count()).map_err(Failure::bad_input)?;
    if job.first_pass.is_some() || job.checkpoint.is_some() {
        return gather::render(job, &session, &scene, load_seconds);
    }
    let scene_hash = hash(job);

    let memory = Watch::begin();
    let (stats, ending, live) = render_passes(job, &session, &mut scene)?;
    let metadata = metadata(job, &Making { session: &session, stats: &stats, scene_hash });
    job.picture.replace(|aside| write(job, &scene, &metadata, aside)).map_err(Failure::failed)?;
    let picture = || Ok(scene.read_rgb()?.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect());
    live.conclude(picture).map_err(Failure::failed)?;
    statistics::write(job, &session, &scene, load_seconds, &memory, ending, &stats)?;
    conclude(job, &stats)
}

/// Of the scene's files as they are before the render, while they are those that were loaded. A file that Mitsuba could do without
/// is no reason not to render.
fn hash(job: &RenderJob) -> Option<u64> {
    let hash = scene_files::hash(&job.scene);
    if let Err(error) = &hash {
        say(&format!("warning: the picture will have no hash of its scene, a file of which cannot be read: {error}"));
    }
    hash.ok()
}

/// Writes an EXR file with metadata, as the film would; other formats are Mitsuba's.
fn write(
    job: &RenderJob,
    scene: &LoadedScene,
    metadata: &Metadata,
    path: &Path,
) -> anyhow::Result<()> {
    match scene.film_format()? {
        Ok(format) if job.picture.is_exr() => {
            Ok(develop(&scene.film()?, format).write(path, format, metadata)?)
        }
        _ => Ok(scene.write(path)?),
    }
}

/// Renders until the passes or the time are over or the user has enough.
fn render_passes(
    job: &RenderJob,
    session: &Session,
    scene: &mut LoadedScene,
) -> Result<(Stats, Ending, Live<Reporter>), Failure> {
    let display = display(job);
    let herald = display.clone();
    let say = move || herald.say("stopping after this pass; Ctrl-C again aborts without a picture");
    let interrupt =
        Interrupt::listen(say).context("cannot listen for Ctrl-C").map_err(Failure::failed)?;
    announce(job, session, scene, &display);
    let reporter = Reporter::new(display.clone(), interrupt.clone(), job.goal);
    let mut live = Live::open(job, scene, &display, reporter).map_err(Failure::failed)?;
    let result = scene.render(job.sensor, job.seed, job.passes, &mut live);
    display.finish();

    let stats = result.map_err(Failure::failed)?;
    let reporter = live.observer();
    let ending = match Ending::of(stats.passes, reporter.passes(), interrupt.requested()) {
        Ending::Timeout if reporter.is_accurate() => Ending::Accuracy,
        ending => ending,
    };
    if stats.passes == 0 {
        return Err(no_picture(ending));
    }
    if let Some(cause) = cause(ending) {
        let (done, asked) = (stats.passes, reporter.passes());
        let of = if asked != OPEN_PASSES { format!(" of {asked}") } else { String::new() };
        display.say(&format!(
            "note: stopped by {cause} after {done}{of} passes; the picture is of those"
        ));
    }
    if let Some(target) = job.goal.target_error.filter(|_| !reporter.is_accurate()) {
        display.say(&format!("note: the error of {} was not reached", text::percent(target)));
    }
    Ok((stats, ending, live))
}
