//! The C ABI there and back: a scene in Rust is served as a renderer in C would serve its own, and the engine
//! renders it through `super::exports`. With it tests and fuzzers drive the ABI without Mitsuba.

mod served;

use super::abi::{VptObserver, VptParameters, VptProgress, VptStats, VPT_LAYER_CHANNELS};
use super::exports::{raw_parameters, vpt_render};
use crate::method::Preset;
use crate::scene::Scene;
use served::ServedScene;
use std::ffi::{c_char, c_void, CStr, CString, NulError};

/// [`VptParameters`] with strings of their own: whatever a renderer may hand over.
#[derive(Debug, Clone)]
pub struct RawParameters {
    /// Everything but the names, which are null.
    pub numbers: VptParameters,
    pub method: CString,
    pub radius_schedule: CString,
    pub shooting: CString,
    pub photon_beams: CString,
    pub effects: CString,
    pub preset: CString,
    /// Whether the observer reads the film between passes.
    pub reads_film: bool,
}

impl RawParameters {
    /// The numbers of the paper's preset with these names; empty ones are left to the engine.
    pub fn named(
        [method, radius_schedule, shooting, photon_beams, effects]: [&str; 5],
    ) -> Result<Self, NulError> {
        Ok(RawParameters {
            numbers: raw_parameters(&Preset::Paper.parameters()),
            method: CString::new(method)?,
            radius_schedule: CString::new(radius_schedule)?,
            shooting: CString::new(shooting)?,
            photon_beams: CString::new(photon_beams)?,
            effects: CString::new(effects)?,
            preset: CString::default(),
            reads_film: false,
        })
    }

    fn bound(&self) -> VptParameters {
        VptParameters {
            method: self.method.as_ptr(),
            radius_schedule: self.radius_schedule.as_ptr(),
            shooting: self.shooting.as_ptr(),
            photon_beams: self.photon_beams.as_ptr(),
            effects: self.effects.as_ptr(),
            preset: self.preset.as_ptr(),
            ..self.numbers
        }
    }
}

/// What a renderer gets back.
#[derive(Debug, Clone, PartialEq)]
pub struct Returned {
    /// The film's weighted sums, see [`crate::scene::SceneDescription::film_channels`].
    pub storage: Vec<f64>,
    /// Red, green and blue of every film pixel.
    pub error_image: Vec<f32>,
    /// [`VPT_LAYER_CHANNELS`] values for every film pixel.
    pub layers: Vec<f64>,
    /// The film as the last call of `progress` read it; empty where none did.
    pub last_film: Vec<f64>,
    pub progress_calls: u32,
    pub warnings: Vec<String>,
}

/// Renders a scene through the C ABI. `storage_size` of None is what the film needs. An error is the sentence
/// that the renderer gets.
pub fn render(
    scene: &dyn Scene,
    parameters: &RawParameters,
    storage_size: Option<usize>,
) -> Result<Returned, String> {
    let served = ServedScene::new(scene);
    let (host, raw) = (served.host(), parameters.bound());
    let description = scene.description();
    let pixels = description.film_pixels as usize;
    let size = storage_size.unwrap_or(pixels * description.film_channels as usize);
    let mut returned = Returned {
        storage: vec![0.0; size],
        error_image: vec![0.0; 3 * pixels],
        layers: vec![0.0; VPT_LAYER_CHANNELS as usize * pixels],
        last_film: Vec::new(),
        progress_calls: 0,
        warnings: Vec::new(),
    };
    let mut watched = Watched { reads_film: parameters.reads_film, ..Watched::default() };
    let observer = VptObserver {
        context: (&raw mut watched).cast(),
        progress: Watched::progress,
        finished: Watched::finished,
        warn: Watched::warn,
    };
    let mut sentence: [c_char; 512] = [0; 512];
    // SAFETY: every pointer is to a value that outlives the call, and the sizes are those of the arrays.
    let status = unsafe {
        vpt_render(
            &host,
            &raw,
            &observer,
            returned.storage.as_mut_ptr(),
            size,
            returned.error_image.as_mut_ptr(),
            returned.layers.as_mut_ptr(),
            sentence.as_mut_ptr(),
            sentence.len(),
        )
    };
    if status != 0 {
        // SAFETY: the engine ends the sentence with a null within the array.
        return Err(unsafe { CStr::from_ptr(sentence.as_ptr()) }.to_string_lossy().into_owned());
    }
    (returned.progress_calls, returned.warnings) = (watched.calls, watched.warnings);
    returned.last_film = watched.film;
    Ok(returned)
}

/// What the observer was told.
#[derive(Default)]
struct Watched {
    calls: u32,
    reads_film: bool,
    film: Vec<f64>,
    warnings: Vec<String>,
}

impl Watched {
    /// Reads the film where that is wanted, and ends the render where that fails.
    unsafe extern "C" fn progress(context: *mut c_void, progress: *const VptProgress) -> i32 {
        // SAFETY: `context` is the value that `render` keeps, `progress` valid during the call.
        let (watched, progress) = unsafe { (&mut *context.cast::<Watched>(), &*progress) };
        watched.calls += 1;
        if !watched.reads_film {
            return 0;
        }
        let sizes = [progress.film_size[0], progress.film_size[1], progress.film_channels];
        watched.film.resize(sizes.map(|n| n as usize).iter().product(), f64::NAN);
        let mut sentence: [c_char; 512] = [0; 512];
        // SAFETY: the film is the progress's own, and the sizes are those of the arrays.
        unsafe {
            (progress.read_film)(
                progress.film,
                watched.film.as_mut_ptr(),
                watched.film.len(),
                sentence.as_mut_ptr(),
                sentence.len(),
            )
        }
    }

    unsafe extern "C" fn finished(_: *mut c_void, _: *const VptStats) {}

    unsafe extern "C" fn warn(context: *mut c_void, message: *const c_char) {
        // SAFETY: as above; the message is null-terminated and lives during the call.
        let (watched, message) =
            unsafe { (&mut *context.cast::<Watched>(), CStr::from_ptr(message)) };
        watched.warnings.push(message.to_string_lossy().into_owned());
    }
}
