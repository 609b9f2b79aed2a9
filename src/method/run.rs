//! What all methods share: passes, jitters, radii, the film, clocks and counters.

use super::balance;
use super::effects::EffectReport;
use super::emission::DirectEmission;
use super::{Counters, Outcome, Parameters, PhaseSeconds, Progress, RenderError, Stats};
use crate::density::radius::{KernelDimensions, Radii, RadiusSequence};
use crate::effect::Effect;
use crate::film::error::{ErrorEstimate, ErrorSums};
use crate::film::layers::LayerSums;
use crate::film::{add_bias, add_emission, add_jitter, Emission, FilmSums};
use crate::markov::FamilyReport;
use crate::plan::Plan;
use crate::scene::{Scene, SceneResult};
use crate::transport::connect;
use crate::transport::deposits::PixelSums;
use crate::transport::footprint::{automatic_radii, resolvable_radii};
use crate::transport::gather::{Particles, Target};
use crate::transport::memory::HoldsReceivers;
use crate::transport::pairs::Pairs;
use crate::transport::photon::PerFamily;
use crate::transport::photon_map::PhotonMap;
use crate::transport::receivers::Receivers;
use crate::transport::store::{Storage, StoredPhotons};
use crate::transport::view::{self, ViewPaths};
use crate::transport::wavelengths;
use std::cell::Cell;
use std::time::Instant;

/// A number that no pass of a picture has: its photons are drawn from a stream of their own.
const PILOT_PASS: u64 = u64::MAX;

/// A render held between two passes, which the caller advances.
pub trait Progressive {
    /// How far it is. Its seconds run on while it is held.
    fn progress(&self) -> Progress;

    /// Runs the next pass, whatever the number of passes in the parameters.
    fn advance(&mut self) -> Result<(), RenderError>;

    /// The film of all passes so far, those of the present jitter among them.
    fn film(&self) -> Result<FilmSums, RenderError>;

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

    fn advance(&mut self) -> Result<(), RenderError> {
        let receivers_changed = self.run.jitter_when_due()?;
        if self.run.parameters.photons == 0 {
            self.run.settle_photons(&mut self.body)?;
        }
        self.run.pass(receivers_changed, &mut self.body)?;
        self.run.end_jitter_when_due()
    }

    fn film(&self) -> Result<FilmSums, RenderError> {
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
    prepare: fn(ViewPaths) -> R,
    /// Passes done, and those of them that shot at the present receivers.
    passes: u32,
    passes_of_jitter: u32,
    initial_radii: Radii,
    radii: RadiusSequence,
    receivers: R,
    sums: PixelSums,
    film: FilmSums,
    /// None where emission that is seen directly gets no rays of its own.
    emission: Option<DirectEmission>,
    /// None where layers are not asked for.
    layers: Option<LayerSums>,
    /// None where no error is to be estimated.
    error: Option<ErrorSums>,
    estimate: Option<ErrorEstimate>,
    counters: Counters,
    seconds: PhaseSeconds,
    shooting: PerFamily<FamilyReport>,
}

/// What one pass works with.
pub struct Pass<'a, R> {
    pub scene: &'a dyn Scene,
    pub parameters: &'a Parameters,
    pub plan: &'a Plan,
    pub receivers: &'a R,
    pub radii: Radii,
    pub number: u64,
    /// Whether the pass is the first after new ray paths took the place of others.
    pub receivers_changed: bool,
    /// What the shooter reported.
    shooting: Cell<PerFamily<FamilyReport>>,
    /// Of wall time spent on building trees over photons.
    tree_seconds: Cell<f64>,
}

impl<R: HoldsReceivers> Pass<'_, R> {
    pub fn pairs(&self) -> Pairs<'_> {
        Pairs::new(self.plan, self.receivers.as_ref(), self.radii)
    }

    /// Shoots the pass's photons and keeps them.
    pub fn store(&self, particles: Particles) -> SceneResult<(StoredPhotons, Counters)> {
        let Parameters { seed, photons, .. } = *self.parameters;
        let (paths, plan) = (self.receivers.as_ref(), self.plan);
        let (wanted, cone) = (paths.wanted(plan), paths.beam_cone);
        let storage = Storage { scene: self.scene, plan, particles, wanted, cone, seed };
        storage.shoot(self.number, photons)
    }

    /// Builds the structures over stored photons, on the clock of trees.
    pub fn build_map(&self, stored: StoredPhotons) -> PhotonMap {
        let clock = Instant::now();
        let map = PhotonMap::build(stored);
        self.tree_seconds.set(self.tree_seconds.get() + clock.elapsed().as_secs_f64());
        map
    }

    /// Hands on what the shooter reports, for progress and statistics.
    pub fn report_shooting(&self, report: PerFamily<FamilyReport>) {
        self.shooting.set(report);
    }
}

impl Pass<'_, Receivers> {
    /// What photons are shot at.
    pub fn target(&self, particles: Particles) -> Target<'_> {
        Target {
            scene: self.scene,
            receivers: self.receivers,
            particles,
            radii: self.radii,
            plan: self.plan,
        }
    }
}

impl<'a, R: HoldsReceivers> Run<'a, R> {
    /// Traces the first ray paths and chooses radii. View rays are jittered every `jitter_every` passes.
    pub fn new(
        scene: &'a dyn Scene,
        parameters: &Parameters,
        kernels: KernelDimensions,
        jitter_every: u32,
        prepare: fn(ViewPaths) -> R,
    ) -> Result<Self, RenderError> {
        let start = Instant::now();
        let (mut counters, mut seconds) = (Counters::default(), PhaseSeconds::default());
        let mut plan = parameters.plan(scene.description());
        let tuned = wavelengths::tuned(scene, parameters.seed, 0)?;
        let now = tuned.as_deref().unwrap_or(scene);
        plan.retune(now.description());
        let clock = Instant::now();
        let paths = view::trace(now, &plan, parameters.seed, 0)?;
        if parameters.connections.is_none() {
            plan.connections = connect::worthwhile(now, &plan, parameters.seed, &paths)?;
        }
        seconds.view += clock.elapsed().as_secs_f64();
        let (first_radii, least_radii) =
            (first_radii(now, parameters, &paths)?, resolvable_radii(&paths));
        let ground =
            Ground { scene: now, seed: parameters.seed, plan: &plan, layers: parameters.layers };
        let receivers = ground.receivers(paths, 0, prepare, &mut counters, &mut seconds)?;
        let wants_emission_rays =
            parameters.emission_rays && plan.simulates(Effect::DirectEmission);
        let connects = plan.connections.any();
        let (alpha, schedule) = (parameters.alpha, parameters.radius_schedule);
        let radii =
            RadiusSequence::new(first_radii, alpha, schedule, kernels).not_below(least_radii);
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
            initial_radii: radii.current(),
            radii,
            sums: receivers.as_ref().new_sums(),
            receivers,
            film: FilmSums::new(scene.description()),
            emission: wants_emission_rays.then(|| DirectEmission::new(scene.description())),
            layers: parameters.layers.then(|| LayerSums::new(scene.description())),
            error: parameters
                .estimate_error
                .then(|| ErrorSums::new(scene.description(), alpha, connects)),
            estimate: None,
            counters,
            seconds,
            shooting: PerFamily::default(),
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

    /// Traces new ray paths if the present ones have had all their passes; says whether it did.
    // [Collin 2013 Algorithm 1, lines 2 to 5]
    fn jitter_when_due(&mut self) -> Result<bool, RenderError> {
        if self.passes == 0 || self.passes_of_jitter > 0 {
            return Ok(false);
        }
        let jitter = u64::from(self.passes / self.jitter_every);
        let Parameters { seed, layers, .. } = self.parameters;
        self.tuned = wavelengths::tuned(self.scene, seed, jitter)?;
        let scene = self.tuned.as_deref().unwrap_or(self.scene);
        self.plan.retune(scene.description());
        let ground = Ground { scene, seed, plan: &self.plan, layers };
        let (counters, seconds) = (&mut self.counters, &mut self.seconds);
        self.receivers = ground.trace(jitter, self.prepare, counters, seconds)?;
        if let Some(emission) = &mut self.emission {
            let clock = Instant::now();
            emission.trace(scene, &self.plan, self.parameters.seed, jitter)?;
            self.counters.add(&emission.further.counters);
            self.seconds.view += clock.elapsed().as_secs_f64();
        }
        Ok(true)
    }

    /// Chooses the photons of all passes by a pilot, whose picture and counts are thrown away.
    fn settle_photons(
        &mut self,
        body: impl FnOnce(&Pass<R>, &mut PixelSums) -> Result<Counters, RenderError>,
    ) -> Result<(), RenderError> {
        let clock = Instant::now();
        let pixels = self.sums.len() as u64;
        self.parameters.photons = balance::pilot(pixels);
        let mut thrown_away = self.receivers.as_ref().new_sums();
        let counters = body(&self.next_pass(PILOT_PASS, false), &mut thrown_away)?;
        self.parameters.photons =
            balance::photons(pixels, self.plan.connections.per_receiver(), &counters);
        self.seconds.photons += clock.elapsed().as_secs_f64();
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
            receivers_changed,
            shooting: Cell::new(self.shooting),
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
        let pass = self.next_pass(u64::from(self.passes), receivers_changed);
        let counters = body(&pass, &mut sums)?;
        let (tree_seconds, shooting) = (pass.tree_seconds.get(), pass.shooting.get());
        self.sums = sums;
        self.shooting = shooting;
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
            self.end_jitter()?;
        }
        let mut warnings = self.scene.description().warnings.clone();
        warnings.extend(self.counters.warnings());
        let stats = Stats {
            parameters: self.parameters,
            connections: self.plan.connections,
            passes: self.passes,
            threads: rayon::current_num_threads(),
            seconds: self.start.elapsed().as_secs_f64(),
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
        let error_image = self.error.map(|error| error.image());
        let (description, mut film) = (self.scene.description(), self.film);
        let emission = self.emission.map(|emission| emission.film);
        let layers =
            self.layers.map(|own| own.finish(description, &film, emission.as_ref(), self.passes));
        if let Some(emission) = emission {
            film.add_mean(&emission, description);
        }
        Ok(Outcome { film, layers, error_image, stats })
    }

    fn end_jitter_when_due(&mut self) -> Result<(), RenderError> {
        if self.passes_of_jitter < self.jitter_every {
            return Ok(());
        }
        self.end_jitter()
    }

    /// Adds the jitter under way to the film and, if it has had all its passes, to the estimate of the error.
    // [Collin 2013 Algorithm 1, lines 10 and 11]: the running mean over passes, by weights on the film.
    fn end_jitter(&mut self) -> Result<(), RenderError> {
        let clock = Instant::now();
        let passes = std::mem::take(&mut self.passes_of_jitter);
        let scene = self.tuned.as_deref().unwrap_or(self.scene);
        let paths = self.receivers.as_ref();
        let mut film = FilmSums::new(scene.description());
        let place = self.place_of_emission();
        add_jitter(scene, paths, place, &self.sums, passes, &mut film)?;
        if let Some(layers) = &mut self.layers {
            layers.add_jitter(scene, paths, place, &self.sums, passes)?;
        }
        let emission =
            self.emission.as_mut().map(|own| own.end_jitter(scene, paths, &self.sums, passes));
        let emission = emission.transpose()?;
        if let Some(error) = self.error.as_mut().filter(|_| passes == self.jitter_every) {
            let mut bias = FilmSums::new(scene.description());
            add_bias(scene, paths, &self.sums, passes, &mut bias)?;
            match &emission {
                None => error.add(&film, &bias),
                Some(emission) => {
                    let mut whole = film.clone();
                    whole.add_channels(emission, scene.description());
                    error.add(&whole, &bias);
                }
            }
            self.estimate = error.estimate();
        }
        self.film.add(&film);
        self.sums.clear();
        self.seconds.film += clock.elapsed().as_secs_f64();
        Ok(())
    }

    /// The film, with the jitter under way weighted by the passes that it has had.
    fn film_so_far(&self) -> Result<FilmSums, RenderError> {
        let mut film = self.film.clone();
        let mut emission = self.emission.as_ref().map(|own| own.film.clone());
        if self.passes_of_jitter > 0 {
            let (paths, passes) = (self.receivers.as_ref(), self.passes_of_jitter);
            let scene = self.scene_now();
            add_jitter(scene, paths, self.place_of_emission(), &self.sums, passes, &mut film)?;
            if let (Some(sums), Some(own)) = (&mut emission, &self.emission) {
                add_emission(scene, paths, &own.further, passes, sums)?;
            }
        }
        if let Some(emission) = emission {
            film.add_mean(&emission, self.scene.description());
        }
        Ok(film)
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
            passes: self.parameters.passes,
            walks: self.counters.walks,
            radii: self.radii.current(),
            seconds: self.start.elapsed().as_secs_f64(),
            shooting: self.shooting,
            error: self.estimate,
        }
    }
}

/// What ray paths depend on.
struct Ground<'a> {
    scene: &'a dyn Scene,
    seed: u64,
    plan: &'a Plan,
    /// Whether layers are kept apart.
    layers: bool,
}

impl Ground<'_> {
    /// Ray paths of one jitter and what is built over them. [Collin 2013 §5.1]
    fn trace<R: HoldsReceivers>(
        &self,
        jitter: u64,
        prepare: fn(ViewPaths) -> R,
        counters: &mut Counters,
        seconds: &mut PhaseSeconds,
    ) -> Result<R, RenderError> {
        let clock = Instant::now();
        let paths = view::trace(self.scene, self.plan, self.seed, jitter)?;
        seconds.view += clock.elapsed().as_secs_f64();
        self.receivers(paths, jitter, prepare, counters, seconds)
    }

    fn receivers<R: HoldsReceivers>(
        &self,
        mut paths: ViewPaths,
        jitter: u64,
        prepare: fn(ViewPaths) -> R,
        counters: &mut Counters,
        seconds: &mut PhaseSeconds,
    ) -> Result<R, RenderError> {
        let clock = Instant::now();
        if self.layers {
            paths.keep_layers_apart();
        }
        if self.plan.connections.any() {
            connect::connect(self.scene, self.plan, self.seed, jitter, &mut paths)?;
        }
        counters.add(&paths.counters);
        paths.shrink_for_passes();
        seconds.view += clock.elapsed().as_secs_f64();
        let clock = Instant::now();
        let receivers = prepare(paths);
        seconds.trees += clock.elapsed().as_secs_f64();
        Ok(receivers)
    }
}

/// Radii as given, or from the pixel footprint where they are 0.
fn first_radii(
    scene: &dyn Scene,
    parameters: &Parameters,
    paths: &ViewPaths,
) -> Result<Radii, RenderError> {
    let automatic = automatic_radii(scene, paths)?;
    let choose = |given: f32, automatic: f32| if given > 0.0 { given } else { automatic };
    Ok(Radii {
        surface: choose(parameters.surface_radius, automatic.surface),
        medium: choose(parameters.medium_radius, automatic.medium),
    })
}
