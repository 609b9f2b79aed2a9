//! Mitsuba embedded in this process, without Python: one variant, any scene, the `vpt` integrator put
//! into it.

use super::abi::{
    VptHost, VptObserver, VptParameters, VptProgress, VptShooting, VptStats,
    VPT_SHOOTING_METROPOLIS, VPT_SHOOTING_UNIFORM,
};
use super::exports::read_parameters;
use super::HostScene;
use crate::density::radius::Radii;
use crate::markov::{FamilyReport, Mode};
use crate::method::{Observer, Parameters, Progress, RenderError, Stats};
use crate::scene::{PathLimits, UNBOUNDED_DEPTH};
use crate::transport::photon::PerFamily;
use std::ffi::{c_char, c_void, CStr, CString};
use std::marker::PhantomData;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Variants that the plugin works in, best first for a machine without a GPU.
pub const VARIANTS: [&str; 3] = ["scalar_rgb", "llvm_ad_rgb", "cuda_ad_rgb"];

/// What Mitsuba or the engine refused, in one sentence.
#[derive(Debug, Clone, thiserror::Error)]
#[error("{0}")]
pub struct HostError(String);

type HostResult<T> = Result<T, HostError>;

/// A scene file and what overrides it.
#[derive(Debug, Clone, Default)]
pub struct SceneFile {
    pub path: PathBuf,
    /// `$name` parameters of the XML.
    pub defines: Vec<(String, String)>,
    pub method: Option<String>,
    /// Seconds.
    pub timeout: Option<f64>,
    /// Parameters of the integrator, over those of the XML.
    pub settings: Vec<(String, String)>,
}

/// Mitsuba, started in one variant. One per process: Mitsuba's own state is global.
#[derive(Debug)]
pub struct Session {
    variant: String,
}

impl Session {
    /// Starts Mitsuba. `threads` of None uses all cores; `verbosity` 0 is silent but for errors.
    pub fn start(variant: Option<&str>, threads: Option<usize>, verbosity: u8) -> HostResult<Self> {
        let variant = variant.unwrap_or(VARIANTS[0]).to_owned();
        if !VARIANTS.contains(&variant.as_str()) {
            return Err(HostError(format!(
                "vpt works in the variants {}; \"{variant}\" is not one of them (spectral, mono and \
                 polarized variants are not supported)",
                VARIANTS.join(", ")
            )));
        }
        let name = c_string(&variant)?;
        let threads = u32::try_from(threads.unwrap_or(0)).unwrap_or(u32::MAX);
        call(|error, size| {
            // SAFETY: the name is null-terminated, the buffer holds `size` bytes.
            unsafe { vpt_session_start(name.as_ptr(), threads, verbosity.into(), error, size) }
        })?;
        Ok(Session { variant })
    }

    pub fn variant(&self) -> &str {
        &self.variant
    }

    /// Whether Mitsuba has an integrator of this name.
    pub fn knows_integrator(&self, name: &str) -> bool {
        // SAFETY: the name is null-terminated.
        c_string(name).is_ok_and(|name| unsafe { vpt_integrator_known(name.as_ptr()) != 0 })
    }

    /// Makes one of Mitsuba's own integrators. Limits that it does not have are without effect.
    pub fn integrator(&self, name: &str, limits: PathLimits) -> HostResult<OwnIntegrator<'_>> {
        let (variant, name) = (c_string(&self.variant)?, c_string(name)?);
        let max_depth = match limits.max_depth {
            UNBOUNDED_DEPTH => -1,
            depth => i64::from(depth),
        };
        let mut integrator = std::ptr::null_mut();
        // SAFETY: both strings are null-terminated and the out pointer is valid.
        call(|error, size| unsafe {
            vpt_integrator_create(
                variant.as_ptr(),
                name.as_ptr(),
                max_depth,
                i64::from(limits.rr_depth),
                limits.hide_emitters.into(),
                &mut integrator,
                error,
                size,
            )
        })?;
        Ok(OwnIntegrator { integrator, _session: PhantomData })
    }

    /// Loads a scene and refuses what cannot be rendered.
    pub fn load(&self, file: &SceneFile) -> HostResult<LoadedScene<'_>> {
        let path = file.path.to_str().ok_or_else(|| {
            HostError(format!("the path \"{}\" is not UTF-8; rename the file", file.path.display()))
        })?;
        let (variant, path) = (c_string(&self.variant)?, c_string(path)?);
        let mut settings = file.settings.clone();
        settings.extend(file.method.iter().map(|method| ("method".to_owned(), method.clone())));
        settings.extend(file.timeout.iter().map(|t| ("timeout".to_owned(), t.to_string())));
        let (defines, settings) = (Pairs::new(&file.defines)?, Pairs::new(&settings)?);
        let arguments = SceneFileArguments {
            defines: defines.pointers.as_ptr(),
            define_count: file.defines.len() as u32,
            settings: settings.pointers.as_ptr(),
            setting_count: (settings.pointers.len() / 2) as u32,
        };
        let mut scene = std::ptr::null_mut();
        call(|error, size| {
            // SAFETY: all strings and arrays outlive the call.
            unsafe {
                vpt_scene_load(variant.as_ptr(), path.as_ptr(), &arguments, &mut scene, error, size)
            }
        })?;
        LoadedScene::new(self, scene)
    }
}

/// One of Mitsuba's own integrators.
#[derive(Debug)]
pub struct OwnIntegrator<'a> {
    integrator: *mut c_void,
    _session: PhantomData<&'a Session>,
}

impl Drop for OwnIntegrator<'_> {
    fn drop(&mut self) {
        // SAFETY: the integrator came from `vpt_integrator_create` and is freed once.
        unsafe { vpt_integrator_free(self.integrator) }
    }
}

/// What one of Mitsuba's own integrators rendered.
#[derive(Debug, Clone)]
pub struct OwnPicture {
    /// Samples per pixel that the sampler took; it may round up what was asked for.
    pub spp: u32,
    /// Linear red, green and blue of every pixel, row by row.
    pub rgb: Vec<f32>,
}

/// A scene in memory, with the picture last rendered.
#[derive(Debug)]
pub struct LoadedScene<'a> {
    _session: &'a Session,
    scene: *mut c_void,
    sensors: u32,
    rendered: u32,
    notes: Vec<String>,
}

impl<'a> LoadedScene<'a> {
    fn new(session: &'a Session, scene: *mut c_void) -> HostResult<Self> {
        // SAFETY: `scene` was just loaded; its notes live as long as it does.
        let note = unsafe { CStr::from_ptr(vpt_scene_notes(scene)) }.to_string_lossy().into_owned();
        let notes = if note.is_empty() { Vec::new() } else { vec![note] };
        let mut loaded = LoadedScene { _session: session, scene, sensors: 0, rendered: 0, notes };
        let (mut sensors, mut emitters) = (0, 0);
        // SAFETY: the scene is alive and the out pointers are valid.
        call(|error, size| unsafe {
            vpt_scene_facts(scene, &mut sensors, &mut emitters, error, size)
        })?;
        if emitters == 0 {
            return Err(HostError(RenderError::NoEmitter.to_string()));
        }
        loaded.sensors = sensors;
        Ok(loaded)
    }

    pub fn sensor_count(&self) -> usize {
        self.sensors as usize
    }

    /// Width and height in pixels, crop window applied.
    pub fn film_size(&self, sensor: usize) -> [u32; 2] {
        let mut size = [0; 2];
        let sensor = self.checked(sensor);
        // SAFETY: the scene is alive, the sensor exists, the array holds two values.
        let result = call(|error, length| unsafe {
            vpt_scene_film_size(self.scene, sensor, size.as_mut_ptr(), error, length)
        });
        result.map(|()| size).unwrap_or_default()
    }

    /// Remarks about what was loaded, for the user.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Renders one sensor; `passes` of None uses the sampler's sample count.
    pub fn render(
        &mut self,
        sensor: usize,
        seed: u32,
        passes: Option<u32>,
        observer: &mut dyn Observer,
    ) -> HostResult<Stats> {
        let sensor = self.checked(sensor);
        self.rendered = sensor;
        let mut bridge = Bridge { observer, stats: None };
        let table = VptObserver {
            context: (&raw mut bridge).cast(),
            progress: bridge_progress,
            finished: bridge_finished,
            warn: bridge_warn,
        };
        // SAFETY: the bridge outlives the call, which is made on this thread.
        call(|error, size| unsafe {
            vpt_scene_render(self.scene, sensor, seed, passes.unwrap_or(0), &table, error, size)
        })?;
        bridge.stats.ok_or_else(|| HostError("the render ended without a report".to_owned()))
    }

    /// Writes the picture last rendered, in the format of the path's extension.
    pub fn write(&self, path: &Path) -> HostResult<()> {
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_lowercase();
        if ["png", "jpg", "jpeg", "ppm"].contains(&extension.as_str()) {
            return self.write_srgb(path);
        }
        let name = c_string(&path.to_string_lossy())?;
        // SAFETY: the scene is alive and the path null-terminated.
        call(|error, size| unsafe {
            vpt_scene_write(self.scene, self.rendered, name.as_ptr(), error, size)
        })
    }

    /// The picture last rendered: red, green, blue of each pixel, row by row, linear.
    pub fn read_rgb(&self) -> HostResult<Vec<f32>> {
        let [width, height] = self.film_size(self.rendered as usize);
        let mut linear = vec![0.0f32; width as usize * height as usize * 3];
        // SAFETY: the film's bitmap has this size and three channels after conversion.
        call(|error, size| unsafe {
            vpt_scene_read_rgb(self.scene, self.rendered, linear.as_mut_ptr(), error, size)
        })?;
        Ok(linear)
    }

    fn write_srgb(&self, path: &Path) -> HostResult<()> {
        let [width, height] = self.film_size(self.rendered as usize);
        let linear = self.read_rgb()?;
        let bytes = linear.iter().map(|&value| srgb_byte(value)).collect();
        let picture = image::RgbImage::from_raw(width, height, bytes)
            .ok_or_else(|| HostError("the picture has an impossible size".to_owned()))?;
        picture
            .save(path)
            .map_err(|error| HostError(format!("cannot write \"{}\": {error}", path.display())))
    }

    /// The parameters of the scene's integrator, as the command line left them; `passes` is the sampler's
    /// sample count.
    pub fn parameters(&self, sensor: usize) -> HostResult<Parameters> {
        let sensor = self.checked(sensor);
        let mut raw = std::mem::MaybeUninit::uninit();
        // SAFETY: the scene is alive and the out pointer valid.
        call(|error, size| unsafe {
            vpt_scene_parameters(self.scene, sensor, raw.as_mut_ptr(), error, size)
        })?;
        // SAFETY: the call filled it, and the scene, which holds its strings, is alive.
        let parameters = unsafe { read_parameters(&raw.assume_init()) };
        parameters.map_err(|error| HostError(error.to_string()))
    }

    /// Renders one sensor with one of Mitsuba's own integrators, over the picture last rendered.
    pub fn render_with(
        &self,
        integrator: &OwnIntegrator,
        sensor: usize,
        seed: u32,
        spp: u32,
    ) -> HostResult<OwnPicture> {
        let [width, height] = self.film_size(sensor);
        let (sensor, mut spp) = (self.checked(sensor), spp);
        let mut rgb = vec![0.0f32; width as usize * height as usize * 3];
        // SAFETY: scene and integrator are alive; the array has room for the film's pixels.
        call(|error, size| unsafe {
            let (scene, integrator) = (self.scene, integrator.integrator);
            vpt_scene_render_with(
                scene,
                integrator,
                sensor,
                seed,
                &mut spp,
                rgb.as_mut_ptr(),
                error,
                size,
            )
        })?;
        Ok(OwnPicture { spp, rgb })
    }

    /// The scene as the engine sees it, for callers that bring their own loop.
    pub fn lend(&self, sensor: usize) -> HostResult<LentScene<'_>> {
        let sensor = self.checked(sensor);
        let mut host = std::mem::MaybeUninit::uninit();
        let mut owner = std::ptr::null_mut();
        // SAFETY: the scene is alive; both out pointers are valid.
        call(|error, size| unsafe {
            vpt_scene_lend(self.scene, sensor, host.as_mut_ptr(), &mut owner, error, size)
        })?;
        // SAFETY: the call filled `host`, whose callbacks work until `owner` is given back.
        let scene = unsafe { HostScene::new(host.assume_init()) };
        Ok(LentScene {
            scene: scene.map_err(|error| HostError(error.to_string()))?,
            owner,
            _loaded: PhantomData,
        })
    }

    /// Walks photons in a plain C++ loop of Mitsuba calls and returns the number of path vertices: the
    /// yardstick for walks through the seam. `scalar_rgb` only.
    pub fn bare_walks(&self, sensor: usize, walks: u64, limits: PathLimits) -> HostResult<u64> {
        let sensor = self.checked(sensor);
        let mut vertices = 0;
        // SAFETY: the scene is alive and the out pointer valid.
        call(|error, size| unsafe {
            vpt_scene_bare_walks(
                self.scene,
                sensor,
                walks,
                limits.max_depth,
                limits.rr_depth,
                &mut vertices,
                error,
                size,
            )
        })?;
        Ok(vertices)
    }

    fn checked(&self, sensor: usize) -> u32 {
        assert!(sensor < self.sensor_count(), "sensor {sensor} of {}", self.sensors);
        sensor as u32
    }
}

impl Drop for LoadedScene<'_> {
    fn drop(&mut self) {
        // SAFETY: the scene came from `vpt_scene_load` and is freed once.
        unsafe { vpt_scene_free(self.scene) }
    }
}

/// Mitsuba's scene behind the engine's own seam.
#[derive(Debug)]
pub struct LentScene<'a> {
    scene: HostScene,
    owner: *mut c_void,
    _loaded: PhantomData<&'a ()>,
}

impl LentScene<'_> {
    pub fn scene(&self) -> &HostScene {
        &self.scene
    }
}

impl Drop for LentScene<'_> {
    fn drop(&mut self) {
        // SAFETY: the owner came from `vpt_scene_lend` and is given back once.
        unsafe { vpt_scene_give_back(self.owner) }
    }
}

/// The sRGB transfer curve, clipped to a byte. [IEC 61966-2-1]
fn srgb_byte(linear: f32) -> u8 {
    let value = linear.clamp(0.0, 1.0);
    let curved =
        if value <= 0.003_130_8 { 12.92 * value } else { 1.055 * value.powf(1.0 / 2.4) - 0.055 };
    (curved * 255.0).round() as u8
}

struct Bridge<'a> {
    observer: &'a mut dyn Observer,
    stats: Option<Stats>,
}

unsafe extern "C" fn bridge_progress(context: *mut c_void, progress: *const VptProgress) -> i32 {
    // SAFETY: `context` is the bridge of the render under way, `progress` valid during the call.
    let (bridge, p) = unsafe { (&mut *context.cast::<Bridge>(), &*progress) };
    let progress = Progress {
        passes_done: p.passes_done,
        passes: p.passes,
        walks: p.walks,
        radii: Radii { surface: p.surface_radius, medium: p.medium_radius },
        seconds: p.seconds,
        shooting: PerFamily {
            surface: read_shooting(&p.surface_shooting),
            medium: read_shooting(&p.medium_shooting),
        },
    };
    let watched = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
        bridge.observer.progress(&progress)
    }));
    i32::from(!matches!(watched, Ok(ControlFlow::Continue(()))))
}

fn read_shooting(raw: &VptShooting) -> FamilyReport {
    FamilyReport {
        mode: match raw.mode {
            VPT_SHOOTING_METROPOLIS => Mode::Metropolis,
            VPT_SHOOTING_UNIFORM => Mode::Uniform,
            _ => Mode::Off,
        },
        visible_share: raw.visible_share,
        acceptance: raw.acceptance,
        mutation_size: raw.mutation_size,
        ..FamilyReport::default()
    }
}

unsafe extern "C" fn bridge_finished(context: *mut c_void, stats: *const VptStats) {
    // SAFETY: `context` is the bridge; the report was written by this very engine.
    let (bridge, stats) = unsafe { (&mut *context.cast::<Bridge>(), &*stats.cast::<Stats>()) };
    bridge.stats = Some(stats.clone());
}

/// Warnings arrive with the report as well.
unsafe extern "C" fn bridge_warn(_: *mut c_void, _: *const c_char) {}

fn call(body: impl FnOnce(*mut c_char, usize) -> i32) -> HostResult<()> {
    let mut sentence = vec![0u8; 8192];
    if body(sentence.as_mut_ptr().cast(), sentence.len()) == 0 {
        return Ok(());
    }
    let text = CStr::from_bytes_until_nul(&sentence).unwrap_or_default().to_string_lossy();
    Err(HostError(text.trim().to_owned()))
}

fn c_string(text: &str) -> HostResult<CString> {
    CString::new(text).map_err(|_| HostError(format!("{text:?} holds a zero byte; remove it")))
}

/// Names and values as null-terminated strings, by turns.
struct Pairs {
    _strings: Vec<CString>,
    pointers: Vec<*const c_char>,
}

impl Pairs {
    fn new(pairs: &[(String, String)]) -> HostResult<Self> {
        let strings = pairs
            .iter()
            .flat_map(|(name, value)| [c_string(name), c_string(value)])
            .collect::<HostResult<Vec<_>>>()?;
        let pointers = strings.iter().map(|s| s.as_ptr()).collect();
        Ok(Pairs { _strings: strings, pointers })
    }
}

#[repr(C)]
struct SceneFileArguments {
    defines: *const *const c_char,
    define_count: u32,
    settings: *const *const c_char,
    setting_count: u32,
}

// cpp/session.cpp
extern "C" {
    fn vpt_session_start(
        variant: *const c_char,
        threads: u32,
        verbosity: u32,
        error: *mut c_char,
        size: usize,
    ) -> i32;
    fn vpt_scene_load(
        variant: *const c_char,
        path: *const c_char,
        file: *const SceneFileArguments,
        scene: *mut *mut c_void,
        error: *mut c_char,
        size: usize,
    ) -> i32;
    fn vpt_scene_free(scene: *mut c_void);
    fn vpt_scene_lend(
        scene: *mut c_void,
        sensor: u32,
        host: *mut VptHost,
        owner: *mut *mut c_void,
        error: *mut c_char,
        size: usize,
    ) -> i32;
    fn vpt_scene_give_back(owner: *mut c_void);
    fn vpt_scene_parameters(
        scene: *mut c_void,
        sensor: u32,
        out: *mut VptParameters,
        error: *mut c_char,
        size: usize,
    ) -> i32;
    fn vpt_integrator_create(
        variant: *const c_char,
        name: *const c_char,
        max_depth: i64,
        rr_depth: i64,
        hide_emitters: u32,
        integrator: *mut *mut c_void,
        error: *mut c_char,
        size: usize,
    ) -> i32;
    fn vpt_integrator_free(integrator: *mut c_void);
    fn vpt_integrator_known(name: *const c_char) -> u32;
    fn vpt_scene_render_with(
        scene: *mut c_void,
        integrator: *mut c_void,
        sensor: u32,
        seed: u32,
        spp: *mut u32,
        rgb: *mut f32,
        error: *mut c_char,
        size: usize,
    ) -> i32;
    fn vpt_scene_bare_walks(
        scene: *mut c_void,
        sensor: u32,
        walks: u64,
        max_depth: u32,
        rr_depth: u32,
        vertices: *mut u64,
        error: *mut c_char,
        size: usize,
    ) -> i32;
    fn vpt_scene_notes(scene: *mut c_void) -> *const c_char;
    fn vpt_scene_facts(
        scene: *mut c_void,
        sensors: *mut u32,
        emitters: *mut u32,
        error: *mut c_char,
        size: usize,
    ) -> i32;
    fn vpt_scene_film_size(
        scene: *mut c_void,
        sensor: u32,
        out: *mut u32,
        error: *mut c_char,
        size: usize,
    ) -> i32;
    fn vpt_scene_render(
        scene: *mut c_void,
        sensor: u32,
        seed: u32,
        passes: u32,
        observer: *const VptObserver,
        error: *mut c_char,
        size: usize,
    ) -> i32;
    fn vpt_scene_write(
        scene: *mut c_void,
        sensor: u32,
        path: *const c_char,
        error: *mut c_char,
        size: usize,
    ) -> i32;
    fn vpt_scene_read_rgb(
        scene: *mut c_void,
        sensor: u32,
        out: *mut f32,
        error: *mut c_char,
        size: usize,
    ) -> i32;
}
