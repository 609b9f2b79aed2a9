//! Renders pass by pass in the program's own hands, to keep what the passes bring: as a part, and in checkpoints.

use super::checkpoint::{CheckpointError, Keeper};
use super::compare::scene_files;
use super::failure::Failure;
use super::goal::OPEN_PASSES;
use super::interrupt::Interrupt;
use super::job::RenderJob;
use super::live::Live;
use super::memory::Watch;
use super::merge::write_picture;
use super::metadata::{metadata, Making};
use super::notices::{announce, cause, conclude, display, no_picture};
use super::progress::{Display, Reporter};
use super::statistics::{self, Ending};
use super::{print_result, text};
use anyhow::{anyhow, Context};
use std::fs::File;
use vpt::host::session::{LoadedScene, Session};
use vpt::method::{self, Outcome, Parameters, Progressive, RenderError};
use vpt::part::{FilmGround, Ground, PartView, PassRanges};
use vpt::picture::develop;

/// A render under way.
struct Gathering<'a> {
    job: &'a RenderJob,
    parameters: Parameters,
    ground: Ground,
    keeper: Option<Keeper<'a>>,
}

/// What came of it.
struct Gathered {
    outcome: Outcome,
    ending: Ending,
    passes: PassRanges,
}

pub fn render(
    job: &RenderJob,
    session: &Session,
    scene: &LoadedScene,
    load_seconds: f64,
) -> Result<(), Failure> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(job.threads.unwrap_or(0))
        .build_global()
        .map_err(Failure::failed)?;
    let scene_hash = scene_files::hash(&job.scene)
        .context("cannot read the scene's files, by which parts and checkpoints are told apart")
        .map_err(Failure::bad_input)?;
    let film = film_ground(job, scene)?;
    let memory = Watch::begin();
    let parameters = parameters(job, scene)?;
    let mitsuba = session.mitsuba_version();
    let versions = [env!("CARGO_PKG_VERSION"), &mitsuba, session.variant()];
    let ground = Ground::new(versions, scene_hash, &job.scene.defines, job.sensor, film);
    let mut gathering = Gathering { job, parameters, ground, keeper: None };
    let Gathered { outcome, ending, passes } = gathering.render(session, scene)?;
    let Gathering { ground, .. } = gathering;

    let stats = &outcome.stats;
    if job.first_pass.is_some() {
        let scene = &job.scene.path.display().to_string();
        let part =
            PartView { ground: &ground, scene, passes: &passes, gathered: &outcome.gathered };
        let write = |aside: &std::path::Path| Ok(part.write(&File::create(aside)?)?);
        job.picture.replace(write).map_err(Failure::failed)?;
    } else {
        let making = Making { session, stats, scene_hash: Some(scene_hash) };
        let picture = developed(&ground.film, &outcome);
        let write = |aside: &std::path::Path| {
            write_picture(&picture, ground.film.format, &metadata(job, &making), aside)
        };
        job.picture.replace(write).map_err(Failure::failed)?;
    }
    statistics::write(job, session, scene, load_seconds, &memory, ending, stats)?;
    if job.first_pass.is_none() {
        return conclude(job, stats);
    }
    stats.warnings.iter().for_each(|warning| super::say(&format!("warning: {warning}")));
    if job.quiet {
        return Ok(());
    }
    print_result(&format!(
        "wrote the part \"{}\": passes {passes} of {} photons in {}",
        job.picture.path().display(),
        text::count(stats.parameters.photons as f64),
        text::seconds(stats.seconds)
    ))
}

fn developed(film: &FilmGround, outcome: &Outcome) -> vpt::picture::LayeredPicture {
    let errors = outcome.error_image.as_deref().filter(|_| film.error_image);
    develop(&film.image(&outcome.film.values, outcome.layers.as_deref(), errors), film.format)
}

/// How the scene's film keeps and writes its picture.
fn film_ground(job: &RenderJob, scene: &LoadedScene) -> Result<FilmGround, Failure> {
    let (format, others) = scene.film_facts(job.sensor).map_err(Failure::failed)?;
    let format = format
        .context("parts and checkpoints need a film of the type \"hdrfilm\"")
        .map_err(Failure::bad_input)?;
    let channels = if format.pixel.has_alpha() { 5 } else { 4 };
    let error_image = others.iter().any(|name| name.starts_with("error."));
    Ok(FilmGround { size: scene.film_size(job.sensor), channels, format, error_image })
}

/// The scene's parameters, for the passes asked for.
fn parameters(job: &RenderJob, scene: &LoadedScene) -> Result<Parameters, Failure> {
    let own = scene.parameters(job.sensor).map_err(Failure::failed)?;
    let (first, end) = (job.first_pass.unwrap_or(0), job.passes.unwrap_or(own.passes));
    if end <= first {
        return Err(Failure::bad_input(anyhow!(
            "--passes {first}.. begins behind the last pass, as the scene's sampler asks for {end}; give the end, too: \
             --passes {first}..B"
        )));
    }
    let passes = if end == OPEN_PASSES { OPEN_PASSES } else { end - first };
    Ok(Parameters { first_pass: first, passes, seed: job.seed.into(), ..own })
}

fn failure(error: RenderError) -> Failure {
    match error {
        RenderError::Parameter(_) | RenderError::NoEmitter => Failure::bad_input(error),
        RenderError::Scene(_) => Failure::failed(error),
    }
}

impl<'a> Gathering<'a> {
    fn render(&mut self, session: &Session, scene: &LoadedScene) -> Result<Gathered, Failure> {
        let display = display(self.job);
        let herald = display.clone();
        let left = match self.job.checkpoint {
            Some(_) => "with what the checkpoint holds",
            None => "without a part",
        };
        let say = move || {
            herald.say(&format!("stopping after this pass; Ctrl-C again aborts {left}"));
        };
        let interrupt =
            Interrupt::listen(say).context("cannot listen for Ctrl-C").map_err(Failure::failed)?;
        let lent = scene.lend(self.job.sensor).map_err(Failure::failed)?;
        let mut render = method::begin(lent.scene(), &self.parameters).map_err(failure)?;
        self.ground = self.ground.clone().with_render(&*render);
        let taken_up = self.take_up(&mut *render, &display).map_err(Failure::bad_input)?;
        announce(self.job, session, scene, &display);
        if taken_up > 0 {
            display.say(&format!("going on after {taken_up} passes of the checkpoint"));
        }

        let reporter = Reporter::new(display.clone(), interrupt.clone(), self.job.goal);
        let live = Live::open(self.job, scene, &display, reporter);
        let mut live = live.map_err(Failure::failed)?;
        let mut is_settled = false;
        while method::goes_on(&*render, &self.parameters, &mut live) {
            render.advance().map_err(failure)?;
            if !is_settled {
                self.settle(&*render, taken_up > 0).map_err(Failure::failed)?;
                is_settled = true;
            }
            let passes = render.gathered().passes;
            if self.keeper.as_ref().is_some_and(|keeper| keeper.is_due(passes)) {
                self.keep(&*render);
            }
        }
        display.finish();
        self.keep(&*render);
        let gathered = self.end(render, &interrupt, &display)?;
        let ending = match gathered.ending {
            Ending::Timeout if live.observer().is_accurate() => Ending::Accuracy,
            ending => ending,
        };
        let picture = || {
            let picture = developed(&self.ground.film, &gathered.outcome);
            picture.rgb(None).context("the film's picture has no colours")
        };
        live.conclude(picture).map_err(Failure::failed)?;
        if let Some(cause) = cause(ending) {
            let passes = gathered.outcome.stats.passes;
            display.say(&format!("note: stopped by {cause} after {passes} passes"));
        }
        Ok(Gathered { ending, ..gathered })
    }

    /// Makes the checkpoint's passes the render's, and returns how many there are.
    fn take_up(
        &mut self,
        render: &mut dyn Progressive,
        display: &Display,
    ) -> Result<u32, CheckpointError> {
        let Some(checkpoint) = &self.job.checkpoint else { return Ok(0) };
        let earlier = checkpoint.read()?;
        let passes = earlier.as_ref().map_or(0, |part| part.passes.count());
        self.keeper = Some(Keeper::new(checkpoint, passes, display.clone()));
        let Some(part) = earlier else {
            if checkpoint.resume {
                let path = checkpoint.path().display();
                display
                    .say(&format!("note: there is no checkpoint \"{path}\" yet; beginning anew"));
            }
            return Ok(0);
        };
        let differences = part.ground.differences_but_learnt(&self.ground);
        if !differences.is_empty() {
            let path = checkpoint.path().to_owned();
            return Err(CheckpointError::OtherPicture { path, differences });
        }
        checkpoint.check_passes(&part, self.parameters.first_pass, self.parameters.passes)?;
        self.ground = part.ground;
        render.take_up(part.gathered);
        Ok(passes)
    }

    /// Takes note of what the first pass settled; where passes were taken up, it must be what was settled for them.
    fn settle(&mut self, render: &dyn Progressive, goes_on: bool) -> Result<(), CheckpointError> {
        let ground = self.ground.clone().with_render(render);
        if let (true, Some(checkpoint)) = (goes_on, &self.job.checkpoint) {
            let differences = self.ground.differences(&ground);
            if !differences.is_empty() {
                let path = checkpoint.path().to_owned();
                return Err(CheckpointError::OtherPicture { path, differences });
            }
        }
        self.ground = ground;
        Ok(())
    }

    fn keep(&mut self, render: &dyn Progressive) {
        let Some(keeper) = &mut self.keeper else { return };
        let gathered = render.gathered();
        let passes = held(self.parameters.first_pass, gathered.passes);
        let scene = &self.job.scene.path.display().to_string();
        keeper.keep(&PartView { ground: &self.ground, scene, passes: &passes, gathered });
    }

    /// Ends the render. A part that was stopped holds whole jitters alone, as others go on behind them.
    fn end(
        &self,
        render: Box<dyn Progressive + '_>,
        interrupt: &Interrupt,
        display: &Display,
    ) -> Result<Gathered, Failure> {
        let (first, asked) = (self.parameters.first_pass, self.parameters.passes);
        let done = render.progress().passes_done;
        let ending = Ending::of(done, asked, interrupt.requested());
        let whole = render.gathered().passes;
        let is_cut = self.job.first_pass.is_some() && done < asked && whole < done;
        if done == 0 || (is_cut && whole == 0) {
            return Err(no_picture(ending));
        }
        let kept = is_cut.then(|| render.gathered().clone());
        let mut outcome = render.finish().map_err(failure)?;
        if let Some(kept) = kept {
            let left_out = held(first + whole, done - whole);
            display.say(&format!(
                "note: the passes {left_out} are left out, as their view rays had not had all of theirs"
            ));
            outcome.gathered = kept;
        }
        let passes = held(first, outcome.gathered.passes);
        Ok(Gathered { outcome, ending, passes })
    }
}

fn held(first: u32, count: u32) -> PassRanges {
    PassRanges::of(first..first + count)
}
