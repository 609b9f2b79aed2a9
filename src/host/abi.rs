//! The C ABI: what a renderer fills in ([`VptHost`]) and what it calls (`vpt_*`).
//!
//! Arrays are structures of arrays with the conventions of [`crate::scene`]: a vector array of `n`
//! lanes holds `n` x's, then `n` y's, then `n` z's. Every callback returns 0, or another value after
//! which `last_error` gives one sentence; it must not let a C++ exception out. No callback is called
//! by two threads at once unless `concurrent` was set.

use std::ffi::{c_char, c_void};

/// Raised whenever a struct or a meaning on this page changes.
pub const VPT_ABI_VERSION: u32 = 11;

/// "No medium" in arrays of medium indices.
pub const VPT_VACUUM: u32 = u32::MAX;

/// Phase functions that the engine can evaluate by itself.
pub const VPT_PHASE_ISOTROPIC: u32 = 0;
pub const VPT_PHASE_HENYEY_GREENSTEIN: u32 = 1;
pub const VPT_PHASE_OPAQUE: u32 = 2;

/// Bits of `VptViewVertices::flags`; see `scene::view_flags`.
pub const VPT_VIEW_CONTINUES: u32 = 1;
pub const VPT_VIEW_VISIBLE_POINT: u32 = 2;
pub const VPT_VIEW_LAMBERTIAN: u32 = 4;
pub const VPT_VIEW_EMISSION: u32 = 8;
pub const VPT_VIEW_HIT: u32 = 16;
pub const VPT_VIEW_SCATTERED: u32 = 32;
pub const VPT_VIEW_ABSENT: u32 = 64;

/// Values of `VptPhotonVertices::event`; see `scene::photon_event`.
pub const VPT_PHOTON_NONE: u32 = 0;
pub const VPT_PHOTON_MEDIUM: u32 = 1;
pub const VPT_PHOTON_SURFACE: u32 = 2;
/// Added to an event after which the walk ended because its flux was no longer finite.
pub const VPT_PHOTON_INVALID: u32 = 4;
/// Added where the segment comes straight from a lamp that `lamp_light` finds too.
pub const VPT_PHOTON_STRAIGHT: u32 = 8;
/// No segment: the walk had ended within an earlier step of the same call.
pub const VPT_PHOTON_ABSENT: u32 = 16;

/// Values of `VptParameters::connections`.
pub const VPT_CONNECTIONS_OFF: u32 = 0;
pub const VPT_CONNECTIONS_ON: u32 = 1;
pub const VPT_CONNECTIONS_AUTO: u32 = 2;

/// Values of `VptShooting::mode`.
pub const VPT_SHOOTING_OFF: u32 = 0;
pub const VPT_SHOOTING_UNIFORM: u32 = 1;
pub const VPT_SHOOTING_METROPOLIS: u32 = 2;

/// Bits of `VptSurface::lobes`; see `scene::lobes`.
pub const VPT_LOBE_SMOOTH: u32 = 1;
pub const VPT_LOBE_DELTA_REFLECTION: u32 = 2;
pub const VPT_LOBE_DELTA_TRANSMISSION: u32 = 4;
pub const VPT_LOBE_NULL: u32 = 8;
pub const VPT_LOBE_GLOSSY: u32 = 16;
pub const VPT_LOBE_GLOSSY_TRANSMISSION: u32 = 32;

/// Bits of `VptRules::effects`, as far as a renderer can leave out work; see `effect::Effect`.
pub const VPT_EFFECT_SURFACE_GATHERING: u32 = 1 << 0;
pub const VPT_EFFECT_MEDIUM_SAMPLING: u32 = 1 << 3;
pub const VPT_EFFECT_MULTIPLE_SCATTERING: u32 = 1 << 4;
pub const VPT_EFFECT_COLOURED_EXTINCTION: u32 = 1 << 6;
pub const VPT_EFFECT_SPECULAR_CHAINS: u32 = 1 << 8;
pub const VPT_EFFECT_DIRECT_EMISSION: u32 = 1 << 10;
pub const VPT_EFFECT_ENVIRONMENT: u32 = 1 << 11;

/// One medium of the scene.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct VptMedium {
    pub name: *const c_char,
    /// Nonzero where the extinction varies with position or direction.
    pub varying: u32,
    /// Constant extinction per colour channel [1/length]; unused where it varies.
    pub sigma_t: [f32; 3],
    /// Length over which a varying extinction changes; unused where it is constant.
    pub feature_size: f32,
    /// Nonzero where the extinction is known to be the same in all channels, everywhere.
    pub grey: u32,
    /// Nonzero where `scattering` must be asked; 0 also where nothing scatters, however the extinction varies.
    pub varying_scattering: u32,
    /// Constant scattering coefficient per colour channel [1/length]; unused where it varies.
    pub sigma_s: [f32; 3],
    /// One of `VPT_PHASE_*`.
    pub phase: u32,
    /// Mean cosine of a Henyey-Greenstein phase function.
    pub g: f32,
    pub bounds_min: [f32; 3],
    pub bounds_max: [f32; 3],
}

/// One surface of the scene.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct VptSurface {
    pub name: *const c_char,
    /// Bits `VPT_LOBE_*`.
    pub lobes: u32,
    /// Indices of the media on its two sides, or `VPT_VACUUM`.
    pub interior: u32,
    pub exterior: u32,
}

/// One emitter of the scene.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct VptEmitter {
    pub name: *const c_char,
    /// Nonzero where a ray can meet it.
    pub is_visible: u32,
    /// Nonzero for a sky.
    pub is_environment: u32,
    /// A ball around it; the radius is negative where it is infinitely far away.
    pub centre: [f32; 3],
    pub radius: f32,
}

/// Facts about the scene; pointers stay valid until the render ends.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct VptDescription {
    pub film_size: [u32; 2],
    pub film_offset: [i32; 2],
    /// 4: red, green, blue and the weight; or 5, with alpha before the weight.
    pub film_channels: u32,
    pub film_pixels: u32,
    pub film_width: u32,
    /// Pixels that the film's filter reaches to either side.
    pub film_filter_radius: f32,
    /// Its values for equal steps of the distance, from 0 on, and the last at the radius; at least 2.
    pub film_filter: *const f32,
    pub film_filter_count: u32,
    /// Nonzero where the three channels are wavelengths, which `tune` chooses; then constants of media before it are the largest
    /// of all light's.
    pub spectral: u32,
    /// Where `spectral`, the red, green and blue on the film of a unit of each channel.
    pub channel_colours: [[f32; 3]; 3],
    pub media: *const VptMedium,
    pub media_count: u32,
    pub bounds_min: [f32; 3],
    pub bounds_max: [f32; 3],
    pub surfaces: *const VptSurface,
    pub surface_count: u32,
    pub emitters: *const VptEmitter,
    pub emitter_count: u32,
    pub sensor_name: *const c_char,
    /// Nonzero where view rays start from an aperture.
    pub has_aperture: u32,
    pub warnings: *const *const c_char,
    pub warning_count: u32,
    /// Lanes per batch that suit the renderer.
    pub lanes: u32,
    /// Nonzero where several threads may call at the same time.
    pub concurrent: u32,
    /// Vertices that a call of `photon_step` or `view_step` should yield, where few are alive by several steps; at least 1.
    pub launch: u32,
}

/// Termination rules, and what is simulated.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct VptRules {
    pub max_depth: u32,
    pub rr_depth: u32,
    pub hide_emitters: u32,
    /// Bits `VPT_EFFECT_*`; what is not set may be left out.
    pub effects: u32,
    /// See `scene::PathRules`.
    pub glossy_chains: u32,
}

/// Where view rays start: `film` holds x's then y's, `numbers` aperture x, aperture y, shutter time and
/// wavelength.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct VptViewRequest {
    pub lanes: u32,
    pub film: *const f32,
    pub numbers: *const f32,
    pub rules: VptRules,
    /// Receives the weight of each ray on the film.
    pub importance: *mut f32,
}

/// See `scene::ViewVertices`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct VptViewVertices {
    /// Of all steps together.
    pub lanes: u32,
    pub ray: *mut u32,
    pub flags: *mut u32,
    pub medium: *mut u32,
    pub origin: *mut f32,
    pub direction: *mut f32,
    pub length: *mut f32,
    pub position: *mut f32,
    pub normal: *mut f32,
    pub geometric_normal: *mut f32,
    pub reflectance: *mut f32,
    pub emission: *mut f32,
    pub weight: *mut f32,
}

/// See `scene::PhotonVertices` and, for `segment_*`, `scene::PhotonSegments`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct VptPhotonVertices {
    /// Of all steps together.
    pub lanes: u32,
    pub walk: *mut u32,
    pub event: *mut u32,
    pub medium: *mut u32,
    pub depth: *mut u32,
    pub position: *mut f32,
    pub direction: *mut f32,
    pub length: *mut f32,
    pub geometric_normal: *mut f32,
    pub flux: *mut f32,
    /// These may be null: then they are not wanted.
    pub segment_origin: *mut f32,
    pub segment_flux: *mut f32,
    pub segment_density: *mut f32,
    pub segment_reach: *mut f32,
    pub lamp_density: *mut f32,
}

/// A renderer that owns a scene. `walk` pointers are the renderer's own.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct VptHost {
    /// Must be `VPT_ABI_VERSION`.
    pub abi_version: u32,
    pub context: *mut c_void,
    pub describe: unsafe extern "C" fn(context: *mut c_void, out: *mut VptDescription) -> i32,
    /// Where the description is `spectral`: gives the context of the same scene at the wavelengths that a number in [0,1)
    /// chooses. All callbacks take it in place of their own, several such contexts side by side.
    pub tune:
        unsafe extern "C" fn(context: *mut c_void, number: f32, tuned: *mut *mut c_void) -> i32,
    pub tuned_free: unsafe extern "C" fn(context: *mut c_void, tuned: *mut c_void),
    pub view_rays: unsafe extern "C" fn(
        context: *mut c_void,
        request: *const VptViewRequest,
        walk: *mut *mut c_void,
        alive: *mut u32,
    ) -> i32,
    /// As `photon_step`.
    pub view_step: unsafe extern "C" fn(
        context: *mut c_void,
        walk: *mut c_void,
        steps: u32,
        numbers: *const f32,
        out: *const VptViewVertices,
        alive: *mut u32,
    ) -> i32,
    pub view_free: unsafe extern "C" fn(context: *mut c_void, walk: *mut c_void),
    pub emit: unsafe extern "C" fn(
        context: *mut c_void,
        lanes: u32,
        numbers: *const f32,
        rules: *const VptRules,
        walk: *mut *mut c_void,
        alive: *mut u32,
    ) -> i32,
    /// Writes the indices, within the batch as it was emitted, of the walks that are alive.
    pub photon_alive:
        unsafe extern "C" fn(context: *mut c_void, walk: *mut c_void, out: *mut u32) -> i32,
    /// Takes so many steps, writes for each of them one vertex per lane alive before the first, and then the number of lanes
    /// alive after the last.
    pub photon_step: unsafe extern "C" fn(
        context: *mut c_void,
        walk: *mut c_void,
        steps: u32,
        numbers: *const f32,
        out: *const VptPhotonVertices,
        alive: *mut u32,
    ) -> i32,
    pub photon_free: unsafe extern "C" fn(context: *mut c_void, walk: *mut c_void),
    pub extinction: unsafe extern "C" fn(
        context: *mut c_void,
        count: u32,
        medium: *const u32,
        position: *const f32,
        direction: *const f32,
        out: *mut f32,
    ) -> i32,
    pub scattering: unsafe extern "C" fn(
        context: *mut c_void,
        count: u32,
        medium: *const u32,
        position: *const f32,
        direction: *const f32,
        out: *mut f32,
    ) -> i32,
    pub eval_phase: unsafe extern "C" fn(
        context: *mut c_void,
        count: u32,
        medium: *const u32,
        position: *const f32,
        photon_direction: *const f32,
        view_direction: *const f32,
        out: *mut f32,
    ) -> i32,
    pub store_points: unsafe extern "C" fn(
        context: *mut c_void,
        count: u32,
        origin: *const f32,
        direction: *const f32,
        skips_emitters: *const u32,
        glossy_chains: u32,
    ) -> i32,
    pub eval_bsdf: unsafe extern "C" fn(
        context: *mut c_void,
        count: u32,
        point: *const u32,
        photon_direction: *const f32,
        lamp_density: *const f32,
        out: *mut f32,
    ) -> i32,
    /// Samples a lamp for each place (`medium`, position, geometric normal or 0) and what of its light arrives there straight,
    /// through null boundaries and media: the direction in which it travels, and its radiance over the density of
    /// directions. `density` is as in `scene::LampLight`, or null.
    pub lamp_light: unsafe extern "C" fn(
        context: *mut c_void,
        count: u32,
        medium: *const u32,
        position: *const f32,
        normal: *const f32,
        numbers: *const f32,
        direction: *mut f32,
        irradiance: *mut f32,
        density: *mut f32,
    ) -> i32,
    /// Writes where on the film places on lamps would be seen if nothing were in the way: x's then y's, not a number where that is
    /// not on the film or not known. `numbers` are those for the lamp, and two for the place.
    pub aim: unsafe extern "C" fn(
        context: *mut c_void,
        count: u32,
        numbers: *const f32,
        film: *mut f32,
    ) -> i32,
    /// Has one of the renderer's threads call `task(payload)`, once, even while another callback is under way; after a failure
    /// it is not called. Like `work_until` null where the renderer lends no threads.
    pub spawn: Option<
        unsafe extern "C" fn(
            context: *mut c_void,
            task: unsafe extern "C" fn(payload: *mut c_void),
            payload: *mut c_void,
        ) -> i32,
    >,
    /// Has the calling thread do tasks until `is_done(payload)` is nonzero.
    pub work_until: Option<
        unsafe extern "C" fn(
            context: *mut c_void,
            is_done: unsafe extern "C" fn(payload: *mut c_void) -> u32,
            payload: *mut c_void,
        ) -> i32,
    >,
    /// The sentence that belongs to the calling thread's last failed call.
    pub last_error: unsafe extern "C" fn(context: *mut c_void) -> *const c_char,
}

/// The integrator's parameters; names and meanings are those of `method::Parameters`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct VptParameters {
    /// What is in force where nothing else is said.
    pub preset: *const c_char,
    pub method: *const c_char,
    pub radius_schedule: *const c_char,
    /// Null or empty for what the method's name says.
    pub shooting: *const c_char,
    /// Null or empty for the default.
    pub photon_beams: *const c_char,
    /// Effects that are forced on, `all` or names with commas between; null or empty for none.
    pub effects: *const c_char,
    pub passes: u32,
    /// 0 for automatic.
    pub photons: i64,
    /// 0 for automatic.
    pub chains: i64,
    /// 0 for automatic.
    pub jitter_every: i64,
    pub alpha: f32,
    pub surface_radius: f32,
    pub medium_radius: f32,
    /// -1 for no bound.
    pub max_depth: i64,
    pub rr_depth: i64,
    pub hide_emitters: u32,
    /// One of `VPT_CONNECTIONS_*`.
    pub connections: u32,
    pub emission_rays: u32,
    pub glossy_chains: u32,
    pub guided_emission: u32,
    /// 0 for automatic.
    pub connection_samples: i64,
    pub estimate_error: u32,
    pub layers: u32,
    /// 0 for none.
    pub target_error: f64,
    pub seed: u64,
    /// Seconds; not positive for none.
    pub timeout: f64,
    /// Threads of the engine; 0 for one per core.
    pub threads: u32,
}

/// How one family of photons, on surfaces or in media, is shot; see `markov::FamilyReport`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct VptShooting {
    /// One of `VPT_SHOOTING_*`.
    pub mode: u32,
    pub visible_share: f64,
    pub acceptance: f64,
    pub mutation_size: f32,
}

/// How far the picture is off; see `film::error::ErrorEstimate`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct VptError {
    pub relative: f64,
    pub noise: f64,
    pub bias: f64,
    pub noise_decay: f64,
    pub bias_decay: f64,
    pub correlation: f64,
    /// 0 while nothing is known.
    pub jitters: u32,
}

/// A film that only the engine can read.
pub struct VptFilm {
    _opaque: [u8; 0],
}

/// The state of a render between two passes.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct VptProgress {
    pub passes_done: u32,
    pub passes: u32,
    pub walks: u64,
    pub surface_radius: f32,
    pub medium_radius: f32,
    pub seconds: f64,
    pub surface_shooting: VptShooting,
    pub medium_shooting: VptShooting,
    pub error: VptError,
    /// Width and height of the film's storage, and values per pixel: red, green and blue first, the weight that divides
    /// them last.
    pub film_size: [u32; 2],
    pub film_channels: u32,
    /// The film so far, to be handed to `read_film`. Valid during the call, on its thread.
    pub film: *const VptFilm,
    /// Writes the film's weighted sums over all passes done, the present jitter's among them, to `storage` of
    /// `storage_size` values (width x height x channels, row by row). It costs a splat of a jitter, so ask where the
    /// picture is wanted. Returns 0, or 1 with one sentence in `error`.
    pub read_film: unsafe extern "C" fn(
        film: *const VptFilm,
        storage: *mut f64,
        storage_size: usize,
        error: *mut c_char,
        error_size: usize,
    ) -> i32,
}

/// Values per film pixel of the layers that `vpt_render` writes: red, green and blue of surfaces, media and direct emission, and
/// the number of deposits per pass.
pub const VPT_LAYER_CHANNELS: u32 = 10;

/// A statistics report that only the engine can read.
pub struct VptStats {
    _opaque: [u8; 0],
}

/// Watches a render.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct VptObserver {
    pub context: *mut c_void,
    /// Returns nonzero to end the render after this pass.
    pub progress: unsafe extern "C" fn(context: *mut c_void, progress: *const VptProgress) -> i32,
    /// Called once at the end; the report is valid during the call.
    pub finished: unsafe extern "C" fn(context: *mut c_void, stats: *const VptStats),
    /// Called for each remark that the user should read.
    pub warn: unsafe extern "C" fn(context: *mut c_void, message: *const c_char),
}
