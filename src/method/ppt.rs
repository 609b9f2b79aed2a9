//! Progressive photon tracing: uniform photons into view beams and visible points.
//! [Collin 2013 Algorithm 1]

use super::{Counters, Observer, Outcome, Parameters, PhaseSeconds, Progress, RenderError, Stats};
use crate::density::radius::{Radii, RadiusSequence};
use crate::film::{add_jitter, FilmSums};
use crate::scene::Scene;
use crate::transport::deposits::PixelSums;
use crate::transport::footprint::automatic_radii;
use crate::transport::photons::PhotonShooter;
use crate::transport::receivers::Receivers;
use crate::transport::view;
use std::time::Instant;

/// Renders with method `ppt`.
pub fn render(
    scene: &dyn Scene,
    parameters: &Parameters,
    observer: &mut dyn Observer,
) -> Result<Outcome, RenderError> {
    let mut run = Run::new(scene, parameters)?;
    let mut stopped = observer.progress(&run.progress()).is_break();
    while !stopped && run.passes < parameters.passes {
        if run.passes > 0 && run.passes % parameters.jitter_every == 0 {
            run.end_jitter()?;
            run.jitter_view_rays()?;
        }
        run.shoot_photons()?;
        stopped = observer.progress(&run.progress()).is_break() || run.timed_out();
    }
    run.end_jitter()?;
    Ok(run.finish())
}

/// A render between two passes.
struct Run<'a> {
    scene: &'a dyn Scene,
    parameters: &'a Parameters,
    start: Instant,
    /// Passes done, and those of them that shot at the present receivers.
    passes: u32,
    passes_of_jitter: u32,
    initial_radii: Radii,
    radii: RadiusSequence,
    receivers: Receivers,
    shooter: PhotonShooter,
    sums: PixelSums,
    film: FilmSums,
    counters: Counters,
    seconds: PhaseSeconds,
}

impl<'a> Run<'a> {
    fn new(scene: &'a dyn Scene, parameters: &'a Parameters) -> Result<Self, RenderError> {
        let start = Instant::now();
        let description = scene.description();
        let (mut counters, mut seconds) = (Counters::default(), PhaseSeconds::default());
        let receivers = preprocess(scene, parameters, 0, &mut counters, &mut seconds)?;
        let initial_radii = first_radii(scene, parameters, &receivers)?;
        Ok(Run {
            scene,
            parameters,
            start,
            passes: 0,
            passes_of_jitter: 0,
            initial_radii,
            radii: RadiusSequence::new(initial_radii, parameters.alpha, parameters.radius_schedule),
            shooter: PhotonShooter::new(parameters.seed, parameters.limits),
            sums: PixelSums::new(receivers.pixels()),
            receivers,
            film: FilmSums::new(description),
            counters,
            seconds,
        })
    }

    // [Collin 2013 Algorithm 1, lines 2 to 5]
    fn jitter_view_rays(&mut self) -> Result<(), RenderError> {
        let jitter = u64::from(self.passes / self.parameters.jitter_every);
        let (counters, seconds) = (&mut self.counters, &mut self.seconds);
        self.receivers = preprocess(self.scene, self.parameters, jitter, counters, seconds)?;
        Ok(())
    }

    // [Collin 2013 Algorithm 1, lines 6 to 9 and 12]
    fn shoot_photons(&mut self) -> Result<(), RenderError> {
        let clock = Instant::now();
        let counters = self.shooter.shoot(
            self.scene,
            &self.receivers,
            self.radii.current(),
            u64::from(self.passes),
            self.parameters.photons,
            &mut self.sums,
        )?;
        self.counters.add(&counters);
        self.radii.advance();
        self.passes += 1;
        self.passes_of_jitter += 1;
        self.seconds.photons += clock.elapsed().as_secs_f64();
        Ok(())
    }

    // [Collin 2013 Algorithm 1, lines 10 and 11]: the running mean over passes, by weights on the film.
    fn end_jitter(&mut self) -> Result<(), RenderError> {
        let clock = Instant::now();
        let passes = std::mem::take(&mut self.passes_of_jitter);
        if passes > 0 {
            add_jitter(self.scene, &self.receivers.paths, &self.sums, passes, &mut self.film)?;
            self.sums.clear();
        }
        self.seconds.film += clock.elapsed().as_secs_f64();
        Ok(())
    }

    fn timed_out(&self) -> bool {
        self.parameters.timeout.is_some_and(|limit| self.start.elapsed() >= limit)
    }

    fn progress(&self) -> Progress {
        Progress {
            passes_done: self.passes,
            passes: self.parameters.passes,
            walks: self.counters.walks,
            radii: self.radii.current(),
            seconds: self.start.elapsed().as_secs_f64(),
        }
    }

    fn finish(self) -> Outcome {
        let mut warnings = self.scene.description().warnings.clone();
        warnings.extend(self.counters.warnings());
        let stats = Stats {
            parameters: self.parameters.clone(),
            passes: self.passes,
            seconds: self.start.elapsed().as_secs_f64(),
            phase_seconds: self.seconds,
            initial_radii: self.initial_radii,
            final_radii: self.radii.current(),
            counters: self.counters,
            warnings,
        };
        Outcome { film: self.film, stats }
    }
}

/// Ray paths and both trees for one jitter. [Collin 2013 §5.1]
fn preprocess(
    scene: &dyn Scene,
    parameters: &Parameters,
    jitter: u64,
    counters: &mut Counters,
    seconds: &mut PhaseSeconds,
) -> Result<Receivers, RenderError> {
    let clock = Instant::now();
    let paths = view::trace(scene, parameters.limits, parameters.seed, jitter)?;
    counters.view_rays += paths.film.len() as u64;
    counters.view_beams += paths.beams.len() as u64;
    counters.visible_points += paths.points.len() as u64;
    counters.dropped_view_rays += paths.dropped;
    seconds.view += clock.elapsed().as_secs_f64();
    let clock = Instant::now();
    let receivers = Receivers::build(paths);
    seconds.trees += clock.elapsed().as_secs_f64();
    Ok(receivers)
}

/// Radii as given, or from the pixel footprint where they are 0.
fn first_radii(
    scene: &dyn Scene,
    parameters: &Parameters,
    receivers: &Receivers,
) -> Result<Radii, RenderError> {
    let automatic = automatic_radii(scene, &receivers.paths)?;
    let choose = |given: f32, automatic: f32| if given > 0.0 { given } else { automatic };
    Ok(Radii {
        surface: choose(parameters.surface_radius, automatic.surface),
        medium: choose(parameters.medium_radius, automatic.medium),
    })
}
