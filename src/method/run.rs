//! What all methods share: passes, jitters, radii, the film, clocks and counters.

mod learning;

use super::effects::EffectReport;
use super::emission::DirectEmission;
use super::gathered::Gathered;
use super::ground::{first_radii, Ground, Prepare};
use super::pass::Pass;
use super::trial::Trial;
use super::{
    Counters, Outcome, ParameterError, Parameters, PhaseSeconds, Progress, RenderError, Stats,
};
use crate::density::radius::{KernelDimensions, Radii, RadiusSequence};
use crate::effect::Effect;
use crate::film::error::{ErrorEstimate, ErrorSums};
use crate::film::layers::LayerSums;
use crate::film::round::Round;
use crate::film::{add_jitter, Emission, FilmSums};
use crate::markov::FamilyReport;
use crate::plan::{Connections, Plan};
use crate::scene::Scene;
use crate::transport::connect;
use crate::transport::deposits::PixelSums;
use crate::transport::footprint::resolvable_radii;
use crate::transport::memory::HoldsReceivers;
use crate::transport::photon::PerFamily;
use crate::transport::view;
use crate::transport::wavelengths;
use std::cell::Cell;
use std::time::Instant;

/// A render held between two passes, which the caller advances.
pub trait Progressive {
    /// How far it is. Its seconds run on while it is held.
    fn progress(&self) -> Progress;

    /// Goes on, before the first pass, where another render with the same parameters ended: its passes and what it gathered
    /// are this one's.
    fn take_up(&mut self, earlier: Gathered);

    /// Learns what passes go by; the first pass does so if nobody did before.
    fn learn(&mut self) -> Result<(), RenderError>;

    /// Runs the next pass, whatever the number of passes in the parameters.
    fn advance(&mut self) -> Result<(), RenderError>;

    /// What the jitters that ended brought; passes of the present one are not in it.
    fn gathered(&self) -> &Gathered;

    /// Parameters as they are in force. The photons per pass are not 0 once they are learnt.
    fn parameters(&self) -> &Parameters;

    /// Radii of the first of all passes, wherever this render begins.
    fn initial_radii(&self) -> Radii;

    /// Which receivers look for lamps by themselves; before that is learnt, which may.
    fn connections(&self) -> Connections;

    /// The film of all passes so far, those of the present jitter among them.
    fn film(&self) -> FilmSums;

    /// Wall time by phase so far.
    fn phase_seconds(&self) -> PhaseSeconds;

    /// Ends the render.
    fn finish(self: Box<Self>) -> Result<Outcome, RenderError>;
}

/// A run, and what the method does in a pass.
struct Held<'a, R, B> {
    run: Run<'a, R>,
    body: B,
}

impl<R, B> Progressive for Held<'_, R, B>
where
    R: HoldsReceivers,
    B: FnMut(&Pass<R>, &mut PixelSums) -> Result<Counters, RenderError>,
{
    fn progress(&self) -> Progress {
        self.run.progress()
    }

    fn take_up(&mut self, earlier: Gathered) {
        self.run.take_up(earlier);
    }

    fn learn(&mut self) -> Result<(), RenderError> {
        self.run.learn_when_due(&mut self.body)
    }

    fn advance(&mut self) -> Result<(), RenderError> {
        self.learn()?;
        let receivers_changed = self.run.jitter_when_due()?;
        self.run.pass(receivers_changed, &mut self.body)?;
        self.run.end_jitter_when_due();
        Ok(())
    }

    fn gathered(&self) -> &Gathered {
        &self.run.gathered
    }

    fn parameters(&self) -> &Parameters {
        &self.run.parameters
    }

    fn initial_radii(&self) -> Radii {
        self.run.initial_radii
    }

    fn connections(&self) -> Connections {
        self.run.plan.connections
    }

    fn film(&self) -> FilmSums {
        self.run.film_so_far()
    }

    fn phase_seconds(&self) -> PhaseSeconds {
        self.run.seconds
    }

    fn finish(self: Box<Self>) -> Result<Outcome, RenderError> {
        self.run.finish()
    }
}

/// A render between two passes. `R` is what becomes of the ray paths of one jitter.
pub struct Run<'a, R> {
    scene: &'a dyn Scene,
    /// The scene at the wavelengths of the present jitter; none where its channels are colours.
    tuned: Option<Box<dyn Scene + 'a>>,
    parameters: Parameters,
    plan: Plan,
    start: Instant,
    jitter_every: u32,
    prepare: Prepare<R>,
    /// Passes done, those that were taken up among them, and those of them that shot at the present receivers.
    passes: u32,
    passes_of_jitter: u32,
    /// The jitter of the present receivers, none if they are those of a trial.
    jitter: Option<u64>,
    trial: Option<Trial>,
    has_learnt: bool,
    initial_radii: Radii,
    radii: RadiusSequence,
    receivers: R,
    sums: PixelSums,
    gathered: Gathered,
    /// None where emission that is seen directly gets no rays of its own.
    emission: Option<DirectEmission>,
    /// What of the present round of jitters the estimate has not seen yet.
    round: Round,
    estimate: Option<ErrorEstimate>,
    counters: Counters,
    seconds: PhaseSeconds,
    /// Of wall time, before this render took up what another had done.
    seconds_before: f64,
    shooting: PerFamily<FamilyReport>,
    shooting_before: PerFamily<FamilyReport>,
}

/// What one jitter adds to the films.
struct JitterFilms {
    film: FilmSums,
    emission: Option<FilmSums>,
}

impl<'a, R: HoldsReceivers> Run<'a, R> {
    /// Traces the first ray paths and chooses radii. View rays are jittered every `jitter_every` passes.
    pub fn new(
        scene: &'a dyn Scene,
        parameters: &Parameters,
        kernels: KernelDimensions,
        jitter_every: u32,
        prepare: Prepare<R>,
    ) -> Result<Self, RenderError> {
        let start = Instant::now();
        check_first_pass(parameters.first_pass, jitter_every)?;
        let (mut counters, mut seconds) = (Counters::default(), PhaseSeconds::default());
        let mut plan = parameters.plan(scene.description());
        let tuned = wavelengths::tuned(scene, parameters.seed, 0)?;
        let now = tuned.as_deref().unwrap_or(scene);
        plan.retune(now.description());
        let clock = Instant::now();
        let mut paths = view::trace(now, &plan, parameters.seed, 0)?;
        if parameters.connections.is_none() {
            plan.connections = connect::worthwhile(now, &plan, parameters.seed, &paths)?;
        }
        let (first_radii, least_radii) =
            (first_radii(now, parameters, &paths)?, resolvable_radii(&paths));
        let seed = parameters.seed;
        let ground = Ground { scene: now, seed, plan: &plan, layers: parameters.layers };
        let trial = if is_open(parameters, plan.connections) {
            let (trial, others) = Trial::new(&ground, plan.connections, paths)?;
            paths = others;
            Some(trial)
        } else {
            None
        };
        seconds.view += clock.elapsed().as_secs_f64();
        let jitter = trial.is_none().then_some(0);
        let receivers = ground.receivers(paths, jitter, prepare, &mut counters, &mut seconds)?;
        let wants_emission_rays =
            parameters.emission_rays && plan.simulates(Effect::DirectEmission);
        let (alpha, schedule) = (parameters.alpha, parameters.radius_schedule);
        let mut radii =
            RadiusSequence::new(first_radii, alpha, schedule, kernels).not_below(least_radii);
        let initial_radii = radii.current();
        radii.advance_by(parameters.first_pass);
        let emission = wants_emission_rays.then(|| DirectEmission::new(scene.description()));
        let error = error_sums(scene, parameters, plan.connections);
        let layers = parameters.layers.then(|| LayerSums::new(scene.description()));
        Ok(Run {
            scene,
            tuned,
            parameters: parameters.clone(),
            plan,
            start,
            jitter_every,
            prepare,
            passes: 0,
            passes_of_jitter: 0,
            jitter,
            trial,
            has_learnt: false,
            initial_radii,
            radii,
            sums: receivers.as_ref().new_sums(),
            receivers,
            gathered: Gathered::new(scene.description(), emission.is_some(), layers, error),
            emission,
            round: Round::new(scene.description().channel_colours.is_some()),
            estimate: None,
            counters,
            seconds,
            seconds_before: 0.0,
            shooting: PerFamily::default(),
            shooting_before: PerFamily::default(),
        })
    }

    /// Adds what the method does in a pass.
    pub fn with_pass<B>(self, body: B) -> Box<dyn Progressive + 'a>
    where
        R: 'a,
        B: FnMut(&Pass<R>, &mut PixelSums) -> Result<Counters, RenderError> + 'a,
    {
        Box::new(Held { run: self, body })
    }

    /// Makes what another render gathered the beginning of this one.
    fn take_up(&mut self, earlier: Gathered) {
        assert!(!self.has_learnt, "a render takes up another's passes before its own");
        if earlier.passes == 0 {
            return;
        }
        self.passes = earlier.passes;
        self.radii.advance_by(earlier.passes);
        // The first jitter serves to learn from; what it took to trace is among the earlier counts.
        self.counters = earlier.counters;
        self.seconds.add(&earlier.phase_seconds);
        self.seconds_before = earlier.seconds;
        (self.shooting, self.shooting_before) = (earlier.shooting, earlier.shooting);
        self.estimate = earlier.error.as_ref().and_then(ErrorSums::estimate);
        self.gathered = earlier;
    }

    /// The number of the pass that is next, among all that the picture may ever get.
    fn next_number(&self) -> u64 {
        u64::from(self.parameters.first_pass) + u64::from(self.passes)
    }

    /// Traces new ray paths if the present ones are those of another jitter than the next pass's; says whether it did.
    // [Collin 2013 Algorithm 1, lines 2 to 5]
    fn jitter_when_due(&mut self) -> Result<bool, RenderError> {
        let jitter = self.next_number() / u64::from(self.jitter_every);
        if self.jitter == Some(jitter) {
            return Ok(false);
        }
        self.jitter = Some(jitter);
        if self.passes == 0 {
            // The first jitter served to learn from, and adds nothing to this picture.
            self.counters = Counters::default();
        }
        let Parameters { seed, layers, .. } = self.parameters;
        self.tuned = wavelengths::tuned(self.scene, seed, jitter)?;
        let scene = self.tuned.as_deref().unwrap_or(self.scene);
        self.plan.retune(scene.description());
        let ground = Ground { scene, seed, plan: &self.plan, layers };
        let (counters, seconds) = (&mut self.counters, &mut self.seconds);
        self.receivers = ground.trace(jitter, self.prepare, counters, seconds)?;
        self.sums = self.receivers.as_ref().new_sums();
        self.trace_emission(jitter)?;
        Ok(true)
    }

    /// Traces rays that look for emission alone, where there are any.
    fn trace_emission(&mut self, jitter: u64) -> Result<(), RenderError> {
        if let Some(emission) = &mut self.emission {
            let clock = Instant::now();
            let (seed, now) = (self.parameters.seed, self.tuned.as_deref().unwrap_or(self.scene));
            emission.learn(self.scene, &self.plan, seed, jitter)?;
            emission.trace(now, &self.plan, seed, jitter)?;
            self.counters.add(&emission.further.counters);
            self.seconds.view += clock.elapsed().as_secs_f64();
        }
        Ok(())
    }

    fn next_pass(&self, number: u64, receivers_changed: bool) -> Pass<'_, R> {
        Pass {
            scene: self.scene_now(),
            parameters: &self.parameters,
            plan: &self.plan,
            receivers: &self.receivers,
            radii: self.radii.current(),
            number,
            walks: self.parameters.photons,
            lessons: 0,
            receivers_changed,
            shooting: Cell::new(PerFamily::default()),
            tree_seconds: Cell::new(0.0),
        }
    }

    /// Runs one pass; the radii shrink after it.
    // [Collin 2013 Algorithm 1, lines 6 to 9 and 12]
    fn pass(
        &mut self,
        receivers_changed: bool,
        body: impl FnOnce(&Pass<R>, &mut PixelSums) -> Result<Counters, RenderError>,
    ) -> Result<(), RenderError> {
        let clock = Instant::now();
        let mut sums = std::mem::take(&mut self.sums);
        let pass = self.next_pass(self.next_number(), receivers_changed);
        let counters = body(&pass, &mut sums)?;
        let (tree_seconds, shooting) = (pass.tree_seconds.get(), pass.shooting.get());
        self.sums = sums;
        let before = self.shooting_before;
        self.shooting = PerFamily::from_fn(|family| before[family].and(shooting[family]));
        self.seconds.trees += tree_seconds;
        self.seconds.photons += clock.elapsed().as_secs_f64() - tree_seconds;
        self.counters.add(&counters);
        self.radii.advance();
        self.passes += 1;
        self.passes_of_jitter += 1;
        Ok(())
    }

    /// The picture of all passes.
    fn finish(mut self) -> Result<Outcome, RenderError> {
        if self.passes_of_jitter > 0 {
            self.end_jitter();
        }
        let seconds = self.total_seconds();
        let mut warnings = self.scene.description().warnings.clone();
        warnings.extend(self.counters.warnings());
        let stats = Stats {
            parameters: self.parameters,
            connections: self.plan.connections,
            passes: self.passes,
            threads: rayon::current_num_threads(),
            seconds,
            phase_seconds: self.seconds,
            initial_radii: self.initial_radii,
            final_radii: self.radii.current(),
            counters: self.counters,
            memory: self.receivers.memory(),
            effects: EffectReport::all(&self.plan, &self.counters, self.shooting),
            shooting: self.shooting,
            estimated_error: self.estimate,
            warnings,
        };
        let channels = self.scene.description().film_channels as usize;
        let error_image = self.gathered.error.as_ref().map(ErrorSums::image);
        let film = self.gathered.picture(channels);
        let layers = self.gathered.layer_sums(channels);
        Ok(Outcome { film, layers, error_image, stats, gathered: self.gathered })
    }

    fn end_jitter_when_due(&mut self) {
        if self.passes_of_jitter >= self.jitter_every {
            self.end_jitter();
        }
    }

    /// Adds the jitter under way to the film and, if it has had all its passes, to the estimate of the error.
    // [Collin 2013 Algorithm 1, lines 10 and 11]: the running mean over passes, by weights on the film.
    fn end_jitter(&mut self) {
        let clock = Instant::now();
        let passes = self.passes_of_jitter;
        let is_estimated = self.gathered.error.is_some() && passes == self.jitter_every;
        let pixels = self.scene.description().film_pixels as usize;
        let mut bias = is_estimated.then(|| vec![0.0; pixels]);
        let JitterFilms { mut film, emission } = self.jitter_films(bias.as_deref_mut());
        let (place, paths) = (self.place_of_emission(), self.receivers.as_ref());
        let scene = self.tuned.as_deref().unwrap_or(self.scene);
        self.gathered.add(scene, &film, emission.as_ref());
        if let Some(layers) = &mut self.gathered.layers {
            layers.add_jitter(scene, paths, place, &self.sums, passes);
        }
        if let Some((error, bias)) = self.gathered.error.as_mut().zip(bias) {
            if let Some(emission) = &emission {
                film.add_channels(emission, scene.description().film_channels as usize);
            }
            let jitter = self.jitter.expect("passes have receivers of their jitter");
            if let Some((picture, bias)) = self.round.add(jitter, film, bias) {
                error.add(scene, &picture, &bias);
                self.estimate = error.estimate_by(scene);
            }
        }
        self.passes_of_jitter = 0;
        self.seconds.film += clock.elapsed().as_secs_f64();
        self.gathered.passes = self.passes;
        self.gathered.counters = self.counters;
        self.gathered.shooting = self.shooting;
        self.gathered.seconds = self.total_seconds();
        self.gathered.phase_seconds = self.seconds;
    }

    /// What the jitter under way adds, weighted by the passes that it has had; its bias, too, if that is asked for.
    fn jitter_films(&self, bias: Option<&mut [f64]>) -> JitterFilms {
        let (scene, passes) = (self.scene_now(), self.passes_of_jitter);
        let paths = self.receivers.as_ref();
        let mut film = FilmSums::new(scene.description());
        add_jitter(scene, paths, self.place_of_emission(), &self.sums, passes, &mut film, bias);
        let emission = self.emission.as_ref().map(|own| own.film(scene, paths, passes));
        JitterFilms { film, emission }
    }

    /// The film, with the jitter under way.
    fn film_so_far(&self) -> FilmSums {
        if self.passes_of_jitter == 0 {
            let channels = self.scene.description().film_channels as usize;
            return self.gathered.picture(channels);
        }
        let films = self.jitter_films(None);
        self.gathered.picture_with(self.scene, &films.film, films.emission.as_ref())
    }

    fn total_seconds(&self) -> f64 {
        self.seconds_before + self.start.elapsed().as_secs_f64()
    }

    /// The scene as the present jitter sees it.
    fn scene_now(&self) -> &dyn Scene {
        self.tuned.as_deref().unwrap_or(self.scene)
    }

    fn place_of_emission(&self) -> Emission {
        if self.emission.is_some() {
            Emission::LeftOut
        } else {
            Emission::Included
        }
    }

    fn progress(&self) -> Progress {
        Progress {
            passes_done: self.passes,
            first_pass: self.parameters.first_pass,
            passes: self.parameters.passes,
            walks: self.counters.walks,
            radii: self.radii.current(),
            seconds: self.total_seconds(),
            seconds_before: self.seconds_before,
            shooting: self.shooting,
            error: self.estimate,
        }
    }
}

fn error_sums(
    scene: &dyn Scene,
    parameters: &Parameters,
    connections: Connections,
) -> Option<ErrorSums> {
    let Parameters { estimate_error, alpha, .. } = *parameters;
    estimate_error.then(|| ErrorSums::new(scene.description(), alpha, connections.any()))
}

/// Whether a trial has to say what passes are made of.
fn is_open(parameters: &Parameters, candidates: Connections) -> bool {
    let Parameters { photons, connections, connection_samples, .. } = *parameters;
    photons == 0 || candidates.any() && (connections.is_none() || connection_samples == 0)
}

/// Passes at the same view rays cannot be shared out.
fn check_first_pass(first_pass: u32, jitter_every: u32) -> Result<(), ParameterError> {
    if first_pass % jitter_every == 0 {
        return Ok(());
    }
    let before = first_pass - first_pass % jitter_every;
    Err(ParameterError::SplitJitter { first_pass, jitter_every, before })
}
