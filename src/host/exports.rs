//! Functions that a renderer calls. No panic leaves them: it becomes an error with its message.

use super::abi::*;
use super::scene::HostScene;
use crate::markov::{FamilyReport, Mode};
use crate::method::{
    self, ErrorEstimate, FilmSoFar, Observer, Outcome, ParameterError, Parameters, Preset,
    Progress, Stats,
};
use crate::scene::{PathLimits, Scene, SceneDescription, UNBOUNDED_DEPTH};
use std::ffi::{c_char, c_void, CStr, CString};
use std::ops::ControlFlow;
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::time::Duration;

/// Writes the parameters of a preset, the default one where its name is null or empty; names are null. Returns 0, or 1
/// with one sentence in `error`.
///
/// # Safety
/// `preset` must be null or null-terminated, `out` valid, and `error` hold `error_size` bytes.
#[no_mangle]
pub unsafe extern "C" fn vpt_default_parameters(
    preset: *const c_char,
    out: *mut VptParameters,
    error: *mut c_char,
    error_size: usize,
) -> i32 {
    fenced(error, error_size, || {
        // SAFETY: the caller's promise.
        let preset = unsafe { read_preset(preset) }?;
        // SAFETY: the caller's promise.
        unsafe { out.write(raw_parameters(&preset.parameters())) };
        Ok(())
    })
}

/// All but the names, which are null.
pub(super) fn raw_parameters(p: &Parameters) -> VptParameters {
    VptParameters {
        preset: std::ptr::null(),
        method: std::ptr::null(),
        radius_schedule: std::ptr::null(),
        shooting: std::ptr::null(),
        photon_beams: std::ptr::null(),
        effects: std::ptr::null(),
        passes: p.passes,
        photons: p.photons as i64,
        chains: p.chains as i64,
        jitter_every: i64::from(p.jitter_every),
        alpha: p.alpha,
        surface_radius: p.surface_radius,
        medium_radius: p.medium_radius,
        max_depth: -1,
        rr_depth: i64::from(p.limits.rr_depth),
        hide_emitters: 0,
        connections: match p.connections {
            Some(false) => VPT_CONNECTIONS_OFF,
            Some(true) => VPT_CONNECTIONS_ON,
            None => VPT_CONNECTIONS_AUTO,
        },
        emission_rays: p.emission_rays.into(),
        glossy_chains: p.glossy_chains.into(),
        guided_emission: p.guided_emission.into(),
        connection_samples: i64::from(p.connection_samples),
        estimate_error: p.estimate_error.into(),
        layers: p.layers.into(),
        target_error: p.target_error,
        seed: p.seed,
        timeout: 0.0,
        threads: 0,
    }
}

/// Checks parameters before any rendering. Returns 0, or 1 with one sentence in `error`.
///
/// # Safety
/// `parameters` must be valid, with null-terminated strings, and `error` must hold `error_size` bytes.
#[no_mangle]
pub unsafe extern "C" fn vpt_check_parameters(
    parameters: *const VptParameters,
    error: *mut c_char,
    error_size: usize,
) -> i32 {
    fenced(error, error_size, || {
        // SAFETY: the caller vouches for `parameters`.
        let parameters = unsafe { read_parameters(&*parameters) }?;
        parameters.validate()?;
        Ok(())
    })
}

/// Renders the scene behind `host` and adds the film's weighted sums to `storage`. Writes the estimated
/// standard error of red, green and blue of every film pixel to `error_image`, unless that is null; zeros
/// where nothing is known. Writes the layers' sums, to be divided by the film's weights, to `layers`, unless that is null; zeros
/// where the parameters do not ask for them. Returns 0, or 1 with one sentence in `error`.
///
/// # Safety
/// All pointers must be valid for the call; `storage` must hold `storage_size` values and `error_image`
/// three and `layers` `VPT_LAYER_CHANNELS` per film pixel; the callbacks of `host` and `observer` must keep the promises of this page.
#[no_mangle]
pub unsafe extern "C" fn vpt_render(
    host: *const VptHost,
    parameters: *const VptParameters,
    observer: *const VptObserver,
    storage: *mut f64,
    storage_size: usize,
    error_image: *mut f32,
    layers: *mut f64,
    error: *mut c_char,
    error_size: usize,
) -> i32 {
    fenced(error, error_size, || {
        // SAFETY: the caller vouches for every pointer.
        let (threads, parameters, scene, storage) = unsafe {
            (
                (*parameters).threads as usize,
                read_parameters(&*parameters)?,
                HostScene::new(*host)?,
                std::slice::from_raw_parts_mut(storage, storage_size),
            )
        };
        // SAFETY: as above; the observer outlives the call.
        let mut watch = Watch::new(unsafe { &*observer }, scene.description());
        let outcome = on_threads(threads, &scene, &parameters, &mut watch)?;
        check_size(storage, &outcome.film.values)?;
        for (sum, value) in storage.iter_mut().zip(&outcome.film.values) {
            *sum += value;
        }
        let pixels = scene.description().film_pixels as usize;
        if !layers.is_null() {
            let size = VPT_LAYER_CHANNELS as usize * pixels;
            // SAFETY: the caller promised room for so many values per film pixel.
            let out = unsafe { std::slice::from_raw_parts_mut(layers, size) };
            match &outcome.layers {
                Some(sums) => out.copy_from_slice(sums),
                None => out.fill(0.0),
            }
        }
        if !error_image.is_null() {
            let size = 3 * pixels;
            // SAFETY: the caller promised room for three values per film pixel.
            let out = unsafe { std::slice::from_raw_parts_mut(error_image, size) };
            match &outcome.error_image {
                Some(image) => out.copy_from_slice(image.as_flattened()),
                None => out.fill(0.0),
            }
        }
        watch.finish(&outcome.stats);
        Ok(())
    })
}

type AnyError = Box<dyn std::error::Error>;

/// Renders with as many threads as the renderer was given. A renderer that is driven by one thread
/// (Dr.Jit keeps state per thread) is driven by the caller's.
fn on_threads(
    threads: usize,
    scene: &HostScene,
    parameters: &Parameters,
    watch: &mut Watch,
) -> Result<Outcome, AnyError> {
    let builder = rayon::ThreadPoolBuilder::new().num_threads(threads);
    if scene.batching().concurrent {
        let pool = builder.build()?;
        let watch = Lent(watch);
        Ok(pool.install(move || method::render(scene, parameters, watch.into_inner()))?)
    } else {
        // The first render of a process decides; a later request finds the pool built.
        let _: Result<(), rayon::ThreadPoolBuildError> = builder.build_global();
        Ok(method::render(scene, parameters, watch)?)
    }
}

/// Hands the caller's observer to the one pool thread that runs the render.
struct Lent<'a, 'b>(&'a mut Watch<'b>);

// SAFETY: the caller is blocked while the observer is away, so one thread at a time uses it.
unsafe impl Send for Lent<'_, '_> {}

impl<'a, 'b> Lent<'a, 'b> {
    fn into_inner(self) -> &'a mut Watch<'b> {
        self.0
    }
}

/// Runs `body`, turning an error or a panic into a status and a sentence.
fn fenced(error: *mut c_char, size: usize, body: impl FnOnce() -> Result<(), AnyError>) -> i32 {
    let sentence = match catch_unwind(AssertUnwindSafe(body)) {
        Ok(Ok(())) => return 0,
        Ok(Err(error)) => error.to_string(),
        Err(panic) => {
            let message = panic
                .downcast_ref::<String>()
                .map(String::as_str)
                .or_else(|| panic.downcast_ref::<&str>().copied())
                .unwrap_or("no message");
            format!("internal error, please report it: {message}")
        }
    };
    write_sentence(error, size, &sentence);
    1
}

fn write_sentence(out: *mut c_char, size: usize, sentence: &str) {
    if out.is_null() || size == 0 {
        return;
    }
    let bytes = sentence.as_bytes();
    let count = bytes.len().min(size - 1);
    // SAFETY: the caller promised `size` writable bytes, and `count < size`.
    unsafe {
        std::ptr::copy_nonoverlapping(bytes.as_ptr().cast(), out, count);
        *out.add(count) = 0;
    }
}

/// # Safety
/// The strings must be null or null-terminated.
pub(super) unsafe fn read_parameters(p: &VptParameters) -> Result<Parameters, ParameterError> {
    // SAFETY: the caller's promise.
    let [method, schedule, shooting, photon_beams, effects] = unsafe {
        [p.method, p.radius_schedule, p.shooting, p.photon_beams, p.effects]
            .map(|name| read_string(name))
    };
    let automatic_or_more = |name, value: i64| {
        if value < 0 {
            Err(ParameterError::TooSmall { name, value })
        } else {
            Ok(value)
        }
    };
    // SAFETY: the caller's promise.
    let defaults = unsafe { read_preset(p.preset) }?.parameters();
    Ok(Parameters {
        method: method.as_deref().map_or(Ok(defaults.method), str::parse)?,
        shooting: shooting.as_deref().map(str::parse).transpose()?,
        photon_beams: photon_beams.as_deref().map_or(Ok(defaults.photon_beams), str::parse)?,
        connections: match p.connections {
            VPT_CONNECTIONS_OFF => Some(false),
            VPT_CONNECTIONS_ON => Some(true),
            _ => None,
        },
        effects: effects.as_deref().map_or(Ok(defaults.effects), str::parse)?,
        chains: match p.chains {
            chains if chains >= 0 => chains as u64,
            chains => return Err(ParameterError::BadChains(chains)),
        },
        passes: p.passes,
        first_pass: 0,
        photons: automatic_or_more("photons", p.photons)? as u64,
        jitter_every: automatic_or_more("jitter_every", p.jitter_every)?.min(i64::from(u32::MAX))
            as u32,
        alpha: p.alpha,
        surface_radius: p.surface_radius,
        medium_radius: p.medium_radius,
        radius_schedule: schedule.as_deref().map_or(Ok(defaults.radius_schedule), str::parse)?,
        limits: PathLimits {
            max_depth: match p.max_depth {
                -1 => UNBOUNDED_DEPTH,
                depth if depth >= 0 => depth.min(i64::from(UNBOUNDED_DEPTH - 1)) as u32,
                depth => return Err(ParameterError::BadMaxDepth(depth)),
            },
            rr_depth: match p.rr_depth {
                depth if depth >= 1 => depth.min(i64::from(u32::MAX)) as u32,
                depth => return Err(ParameterError::BadRrDepth(depth)),
            },
            hide_emitters: p.hide_emitters != 0,
        },
        emission_rays: p.emission_rays != 0,
        glossy_chains: p.glossy_chains != 0,
        guided_emission: p.guided_emission != 0,
        connection_samples: u32::try_from(p.connection_samples)
            .map_err(|_| ParameterError::BadConnectionSamples(p.connection_samples))?,
        estimate_error: p.estimate_error != 0,
        layers: p.layers != 0,
        target_error: p.target_error,
        seed: p.seed,
        // What no clock can count to never comes.
        timeout: Duration::try_from_secs_f64(p.timeout).ok().filter(|timeout| !timeout.is_zero()),
    })
}

/// # Safety
/// The name must be null or null-terminated.
unsafe fn read_preset(name: *const c_char) -> Result<Preset, ParameterError> {
    // SAFETY: the caller's promise.
    let name = unsafe { read_string(name) };
    name.map_or(Ok(Preset::default()), |name| name.parse())
}

/// None where there is no text.
///
/// # Safety
/// `s` must be null or null-terminated.
unsafe fn read_string(s: *const c_char) -> Option<String> {
    // SAFETY: the caller's promise.
    let text = (!s.is_null()).then(|| unsafe { CStr::from_ptr(s) }.to_string_lossy().into_owned());
    text.filter(|text| !text.is_empty())
}

fn raw_shooting(report: &FamilyReport) -> VptShooting {
    VptShooting {
        mode: match report.mode {
            Mode::Off => VPT_SHOOTING_OFF,
            Mode::Uniform => VPT_SHOOTING_UNIFORM,
            Mode::Metropolis => VPT_SHOOTING_METROPOLIS,
        },
        visible_share: report.visible_share,
        acceptance: report.acceptance,
        mutation_size: report.mutation_size,
    }
}

fn raw_error(e: ErrorEstimate) -> VptError {
    VptError {
        relative: e.relative,
        noise: e.noise,
        bias: e.bias,
        noise_decay: e.noise_decay,
        bias_decay: e.bias_decay,
        correlation: e.correlation,
        jitters: e.jitters,
    }
}

/// The caller's observer.
struct Watch<'a> {
    observer: &'a VptObserver,
    film_size: [u32; 2],
    film_channels: u32,
}

impl<'a> Watch<'a> {
    fn new(observer: &'a VptObserver, scene: &SceneDescription) -> Self {
        let SceneDescription { film_pixels, film_width, film_channels, .. } = *scene;
        let film_size = [film_width, film_pixels / film_width.max(1)];
        Watch { observer, film_size, film_channels }
    }

    fn finish(&self, stats: &Stats) {
        for warning in &stats.warnings {
            let message = CString::new(warning.replace('\0', " ")).unwrap_or_default();
            // SAFETY: the message lives during the call.
            unsafe { (self.observer.warn)(self.observer.context, message.as_ptr()) };
        }
        let report: *const Stats = stats;
        // SAFETY: the report lives during the call; only `session` looks into it.
        unsafe { (self.observer.finished)(self.observer.context, report.cast()) };
    }
}

impl Observer for Watch<'_> {
    fn progress(&mut self, progress: &Progress, film: &dyn FilmSoFar) -> ControlFlow<()> {
        let lent = LentFilm { film };
        let out = VptProgress {
            passes_done: progress.passes_done,
            passes: progress.passes,
            walks: progress.walks,
            surface_radius: progress.radii.surface,
            medium_radius: progress.radii.medium,
            seconds: progress.seconds,
            surface_shooting: raw_shooting(&progress.shooting.surface),
            medium_shooting: raw_shooting(&progress.shooting.medium),
            error: raw_error(progress.error.unwrap_or_default()),
            film_size: self.film_size,
            film_channels: self.film_channels,
            film: (&raw const lent).cast(),
            read_film,
        };
        // SAFETY: the callback was promised to be valid for the render.
        match unsafe { (self.observer.progress)(self.observer.context, &out) } {
            0 => ControlFlow::Continue(()),
            _ => ControlFlow::Break(()),
        }
    }
}

/// A film as it goes through the C ABI.
struct LentFilm<'a> {
    film: &'a dyn FilmSoFar,
}

/// # Safety
/// `film` must be that of the progress under way, `storage` hold `size` values and `error` `error_size` bytes.
unsafe extern "C" fn read_film(
    film: *const VptFilm,
    storage: *mut f64,
    size: usize,
    error: *mut c_char,
    error_size: usize,
) -> i32 {
    fenced(error, error_size, || {
        // SAFETY: the caller hands back the pointer of its progress, which lives during the call.
        let lent = unsafe { &*film.cast::<LentFilm>() };
        // SAFETY: the caller promised room for `size` values.
        let storage = unsafe { std::slice::from_raw_parts_mut(storage, size) };
        let film = lent.film.film()?;
        check_size(storage, &film.values)?;
        storage.copy_from_slice(&film.values);
        Ok(())
    })
}

fn check_size(storage: &[f64], film: &[f64]) -> Result<(), AnyError> {
    if film.len() == storage.len() {
        return Ok(());
    }
    Err(format!(
        "the film's storage holds {} values, but {} were expected",
        storage.len(),
        film.len()
    )
    .into())
}

extern "C" {
    fn vpt_register_plugin(name: *const c_char, length: usize, callback: *mut c_void);
    fn vpt_shim_install(error: *mut c_char, size: usize) -> i32;
    fn vpt_shim_watch(observer: *const VptObserver) -> *const VptObserver;
}

/// `VPT_ABI_VERSION`, for programs that were not compiled with `vpt.h`.
#[no_mangle]
pub extern "C" fn vpt_abi_version() -> u32 {
    VPT_ABI_VERSION
}

/// Makes the Mitsuba of this process know the integrator in every variant, wherever it looks for plugins. Returns 0, or 1
/// with one sentence in `error`.
///
/// # Safety
/// `error` must hold `error_size` bytes.
#[no_mangle]
pub unsafe extern "C" fn vpt_install(error: *mut c_char, error_size: usize) -> i32 {
    // SAFETY: the caller's promise.
    unsafe { vpt_shim_install(error, error_size) }
}

/// Lets `observer` watch all renders that Mitsuba starts on the calling thread from now on, in place of Mitsuba's log; null
/// for the log. Returns the one that watched before. `progress` may be called on another thread, while the calling one waits.
///
/// # Safety
/// The observer must be valid until another one takes its place.
#[no_mangle]
pub unsafe extern "C" fn vpt_watch(observer: *const VptObserver) -> *const VptObserver {
    // SAFETY: the caller's promise.
    unsafe { vpt_shim_watch(observer) }
}

/// Mitsuba's entry point of a plugin: a `std::string_view` (length, pointer) and a callback. rustc
/// exports no symbols of C++ archives, so it is here that the shared library gets it.
///
/// # Safety
/// Called by Mitsuba's plugin manager alone.
#[no_mangle]
pub unsafe extern "C" fn init_plugin(length: usize, name: *const c_char, callback: *mut c_void) {
    // SAFETY: forwarded as received.
    unsafe { vpt_register_plugin(name, length, callback) }
}
