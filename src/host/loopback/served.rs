//! A [`Scene`] behind the callbacks of a [`VptHost`].

use crate::effect::Effects;
use crate::host::abi::*;
use crate::math::Rgb;
use crate::scene::*;
use std::cell::RefCell;
use std::ffi::{c_char, c_void, CString};
use std::ops::Deref;
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::slice::{from_raw_parts, from_raw_parts_mut};

/// A scene with the arrays that its description points to.
pub struct ServedScene<'a> {
    scene: Kept<'a>,
    /// Keeps the texts that the arrays point to.
    _names: Vec<CString>,
    media: Vec<VptMedium>,
    surfaces: Vec<VptSurface>,
    emitters: Vec<VptEmitter>,
    sensor: CString,
    warnings: Vec<*const c_char>,
}

/// The caller's scene, or a tuned one.
enum Kept<'a> {
    Lent(&'a dyn Scene),
    Own(Box<dyn Scene + 'a>),
}

impl<'a> Deref for Kept<'a> {
    type Target = dyn Scene + 'a;

    fn deref(&self) -> &Self::Target {
        match self {
            Kept::Lent(scene) => *scene,
            Kept::Own(scene) => scene.as_ref(),
        }
    }
}

/// A walk and the lanes that its next step takes.
struct Walk<W> {
    walk: W,
    lanes: usize,
}

type ViewBox<'a> = Walk<Box<dyn ViewWalk + 'a>>;
type PhotonBox<'a> = Walk<Box<dyn PhotonWalk + 'a>>;

thread_local! {
    static LAST_ERROR: RefCell<CString> = RefCell::default();
}

impl<'a> ServedScene<'a> {
    pub fn new(scene: &'a dyn Scene) -> Self {
        Self::of(Kept::Lent(scene))
    }

    fn of(scene: Kept<'a>) -> Self {
        let description = scene.description();
        let mut names = Names(Vec::new());
        ServedScene {
            media: description.media.iter().map(|m| raw_medium(m, names.keep(&m.name))).collect(),
            surfaces: description
                .surfaces
                .iter()
                .map(|s| VptSurface {
                    name: names.keep(&s.name),
                    lobes: s.lobes,
                    interior: s.interior,
                    exterior: s.exterior,
                })
                .collect(),
            emitters: description
                .emitters
                .iter()
                .map(|e| VptEmitter {
                    name: names.keep(&e.name),
                    is_visible: e.is_visible.into(),
                    is_environment: e.is_environment.into(),
                    centre: e.place.map_or([0.0; 3], |place| place.centre.into()),
                    radius: e.place.map_or(-1.0, |place| place.radius),
                })
                .collect(),
            warnings: description.warnings.iter().map(|w| names.keep(w)).collect(),
            sensor: text(&description.sensor.name),
            _names: names.0,
            scene,
        }
    }

    /// The callbacks; they work for as long as `self` lives and stays where it is.
    pub fn host(&self) -> VptHost {
        VptHost {
            abi_version: VPT_ABI_VERSION,
            context: std::ptr::from_ref(self).cast_mut().cast(),
            describe,
            tune,
            tuned_free,
            view_rays,
            view_step,
            view_free,
            emit,
            photon_alive,
            photon_step,
            photon_free,
            extinction,
            scattering,
            eval_phase,
            store_points,
            eval_bsdf,
            lamp_light,
            aim,
            spawn: None,
            work_until: None,
            last_error,
        }
    }

    fn description(&self) -> VptDescription {
        let (d, batching) = (self.scene.description(), self.scene.batching());
        VptDescription {
            film_size: d.film_size,
            film_offset: d.film_offset,
            film_channels: d.film_channels,
            film_pixels: d.film_pixels,
            film_width: d.film_width,
            film_filter_radius: d.film_filter.radius(),
            film_filter: d.film_filter.values().as_ptr(),
            film_filter_count: d.film_filter.values().len() as u32,
            spectral: d.channel_colours.is_some().into(),
            channel_colours: d
                .channel_colours
                .map_or([[0.0; 3]; 3], |colours| colours.map(|rgb| glam::Vec3::from(rgb).into())),
            media: self.media.as_ptr(),
            media_count: self.media.len() as u32,
            bounds_min: d.bounds.min.into(),
            bounds_max: d.bounds.max.into(),
            surfaces: self.surfaces.as_ptr(),
            surface_count: self.surfaces.len() as u32,
            emitters: self.emitters.as_ptr(),
            emitter_count: self.emitters.len() as u32,
            sensor_name: self.sensor.as_ptr(),
            has_aperture: d.sensor.has_aperture.into(),
            warnings: self.warnings.as_ptr(),
            warning_count: self.warnings.len() as u32,
            lanes: batching.lanes as u32,
            launch: batching.launch as u32,
            concurrent: batching.concurrent.into(),
        }
    }
}

struct Names(Vec<CString>);

impl Names {
    /// The text's heap memory stays where it is when the list grows.
    fn keep(&mut self, name: &str) -> *const c_char {
        self.0.push(text(name));
        self.0[self.0.len() - 1].as_ptr()
    }
}

fn text(name: &str) -> CString {
    CString::new(name.replace('\0', " ")).unwrap_or_default()
}

fn raw_medium(m: &Medium, name: *const c_char) -> VptMedium {
    let (varying, sigma_t, feature_size) = match m.extinction {
        Extinction::Constant(sigma_t) => (0, sigma_t, f32::INFINITY),
        Extinction::Varying { feature_size } => (1, Rgb::ZERO, feature_size),
    };
    let (phase, g) = match m.phase {
        Phase::Isotropic => (VPT_PHASE_ISOTROPIC, 0.0),
        Phase::HenyeyGreenstein { g } => (VPT_PHASE_HENYEY_GREENSTEIN, g),
        Phase::Opaque => (VPT_PHASE_OPAQUE, 0.0),
    };
    VptMedium {
        name,
        varying,
        sigma_t: glam::Vec3::from(sigma_t).into(),
        feature_size,
        grey: m.grey.into(),
        varying_scattering: m.scattering.is_none().into(),
        sigma_s: glam::Vec3::from(m.scattering.unwrap_or(Rgb::ZERO)).into(),
        phase,
        g,
        bounds_min: m.bounds.min.into(),
        bounds_max: m.bounds.max.into(),
    }
}

fn rules(raw: &VptRules) -> PathRules {
    PathRules {
        limits: PathLimits {
            max_depth: raw.max_depth,
            rr_depth: raw.rr_depth,
            hide_emitters: raw.hide_emitters != 0,
        },
        effects: Effects::from_bits(raw.effects),
        glossy_chains: raw.glossy_chains != 0,
    }
}

/// Runs a callback; an error or a panic becomes a status and a sentence.
fn guarded(body: impl FnOnce() -> SceneResult<()>) -> i32 {
    let sentence = match catch_unwind(AssertUnwindSafe(body)) {
        Ok(Ok(())) => return 0,
        Ok(Err(error)) => error.to_string(),
        Err(_) => "the scene panicked".to_owned(),
    };
    LAST_ERROR.with(|last| *last.borrow_mut() = text(&sentence));
    1
}

/// # Safety
/// `context` must come from [`ServedScene::host`], whose scene must be alive.
unsafe fn served<'a>(context: *mut c_void) -> &'a ServedScene<'a> {
    // SAFETY: the caller's promise.
    unsafe { &*context.cast::<ServedScene>() }
}

/// Three planes of `lanes` values.
///
/// # Safety
/// `values` must hold `3 * lanes` values.
unsafe fn planes(lanes: usize, values: *const f32) -> Planes {
    let mut out = Planes::default();
    out.resize(lanes);
    // SAFETY: the caller's promise.
    out.as_mut_slice().copy_from_slice(unsafe { from_raw_parts(values, 3 * lanes) });
    out
}

/// # Safety
/// `to` must have room for the values, unless it is null.
unsafe fn put<T: Copy>(values: &[T], to: *mut T) {
    if !to.is_null() {
        // SAFETY: the caller's promise.
        unsafe { from_raw_parts_mut(to, values.len()) }.copy_from_slice(values);
    }
}

/// Writes what the scene answers.
///
/// # Safety
/// `out` must have room for as many values as the scene was asked for.
unsafe fn answer(
    out: *mut f32,
    ask: impl FnOnce(&mut Planes) -> SceneResult<()>,
) -> SceneResult<()> {
    let mut values = Planes::default();
    ask(&mut values)?;
    // SAFETY: the caller's promise.
    unsafe { put(values.as_slice(), out) };
    Ok(())
}

unsafe extern "C" fn describe(context: *mut c_void, out: *mut VptDescription) -> i32 {
    // SAFETY: the engine gives a valid out pointer.
    guarded(|| unsafe {
        *out = served(context).description();
        Ok(())
    })
}

unsafe extern "C" fn tune(context: *mut c_void, number: f32, tuned: *mut *mut c_void) -> i32 {
    // SAFETY: the engine gives a valid out pointer; the scene outlives what is tuned of it.
    guarded(|| unsafe {
        let scene = served(context).scene.tuned(number)?;
        let scene = scene.ok_or_else(|| SceneError("channels are colours".to_owned()))?;
        *tuned = Box::into_raw(Box::new(ServedScene::of(Kept::Own(scene)))).cast();
        Ok(())
    })
}

unsafe extern "C" fn tuned_free(_: *mut c_void, tuned: *mut c_void) {
    // SAFETY: the context came from `tune` and is freed once.
    guarded(|| unsafe {
        drop(Box::from_raw(tuned.cast::<ServedScene>()));
        Ok(())
    });
}

unsafe extern "C" fn view_rays(
    context: *mut c_void,
    request: *const VptViewRequest,
    walk: *mut *mut c_void,
    alive: *mut u32,
) -> i32 {
    // SAFETY: the engine's arrays hold what `lanes` says; the scene outlives its walks.
    guarded(|| unsafe {
        let raw = &*request;
        let lanes = raw.lanes as usize;
        let request = ViewRayRequest {
            lanes,
            film: from_raw_parts(raw.film, 2 * lanes),
            numbers: from_raw_parts(raw.numbers, VIEW_RAY_DIMENSIONS * lanes),
            rules: rules(&raw.rules),
        };
        let mut importance = Planes::default();
        let started = served(context).scene.view_rays(&request, &mut importance)?;
        put(importance.as_slice(), raw.importance);
        let lanes = started.lanes();
        *alive = lanes as u32;
        *walk = Box::into_raw(Box::new(ViewBox { walk: started, lanes })).cast();
        Ok(())
    })
}

unsafe extern "C" fn view_step(
    _: *mut c_void,
    walk: *mut c_void,
    steps: u32,
    numbers: *const f32,
    out: *const VptViewVertices,
    alive: *mut u32,
) -> i32 {
    // SAFETY: the walk came from `view_rays`; arrays hold its lanes.
    guarded(|| unsafe {
        let (walk, out) = (&mut *walk.cast::<ViewBox>(), &*out);
        let mut vertices = ViewVertices::default();
        let lanes = steps as usize * walk.lanes;
        vertices.resize(lanes);
        let numbers = from_raw_parts(numbers, VIEW_STEP_DIMENSIONS * lanes);
        walk.walk.step(steps as usize, numbers, &mut vertices)?;
        put(&vertices.ray, out.ray);
        put(&vertices.flags, out.flags);
        put(&vertices.medium, out.medium);
        put(&vertices.length, out.length);
        for (planes, to) in [
            (&vertices.origin, out.origin),
            (&vertices.direction, out.direction),
            (&vertices.position, out.position),
            (&vertices.normal, out.normal),
            (&vertices.geometric_normal, out.geometric_normal),
            (&vertices.reflectance, out.reflectance),
            (&vertices.emission, out.emission),
            (&vertices.weight, out.weight),
        ] {
            put(planes.as_slice(), to);
        }
        walk.lanes = walk.walk.lanes();
        *alive = walk.lanes as u32;
        Ok(())
    })
}

unsafe extern "C" fn view_free(_: *mut c_void, walk: *mut c_void) {
    // SAFETY: the walk came from `view_rays` and is freed once.
    guarded(|| unsafe {
        drop(Box::from_raw(walk.cast::<ViewBox>()));
        Ok(())
    });
}

unsafe extern "C" fn emit(
    context: *mut c_void,
    lanes: u32,
    numbers: *const f32,
    raw: *const VptRules,
    walk: *mut *mut c_void,
    alive: *mut u32,
) -> i32 {
    // SAFETY: as in `view_rays`.
    guarded(|| unsafe {
        let numbers = from_raw_parts(numbers, EMIT_DIMENSIONS * lanes as usize);
        let started = served(context).scene.emit(lanes as usize, numbers, rules(&*raw))?;
        let lanes = started.lanes();
        *alive = lanes as u32;
        *walk = Box::into_raw(Box::new(PhotonBox { walk: started, lanes })).cast();
        Ok(())
    })
}

unsafe extern "C" fn photon_alive(_: *mut c_void, walk: *mut c_void, out: *mut u32) -> i32 {
    // SAFETY: the walk came from `emit`; the array holds its lanes.
    guarded(|| unsafe {
        let mut alive = Vec::new();
        (*walk.cast::<PhotonBox>()).walk.alive(&mut alive)?;
        put(&alive, out);
        Ok(())
    })
}

unsafe extern "C" fn photon_step(
    _: *mut c_void,
    walk: *mut c_void,
    steps: u32,
    numbers: *const f32,
    out: *const VptPhotonVertices,
    alive: *mut u32,
) -> i32 {
    // SAFETY: the walk came from `emit`; arrays hold its lanes.
    guarded(|| unsafe {
        let (walk, out) = (&mut *walk.cast::<PhotonBox>(), &*out);
        let segments = (!out.segment_reach.is_null()).then(PhotonSegments::default);
        let lamp_density = (!out.lamp_density.is_null()).then(Vec::new);
        let mut vertices = PhotonVertices { segments, lamp_density, ..PhotonVertices::default() };
        let lanes = steps as usize * walk.lanes;
        vertices.resize(lanes);
        let numbers = from_raw_parts(numbers, PHOTON_STEP_DIMENSIONS * lanes);
        walk.walk.step(steps as usize, numbers, &mut vertices)?;
        put(&vertices.walk, out.walk);
        put(&vertices.event, out.event);
        put(&vertices.medium, out.medium);
        put(&vertices.depth, out.depth);
        put(&vertices.length, out.length);
        for (planes, to) in [
            (&vertices.position, out.position),
            (&vertices.direction, out.direction),
            (&vertices.geometric_normal, out.geometric_normal),
            (&vertices.flux, out.flux),
        ] {
            put(planes.as_slice(), to);
        }
        if let Some(density) = &vertices.lamp_density {
            put(density, out.lamp_density);
        }
        if let Some(segments) = &vertices.segments {
            put(segments.origin.as_slice(), out.segment_origin);
            put(segments.flux.as_slice(), out.segment_flux);
            put(segments.density.as_slice(), out.segment_density);
            put(&segments.reach, out.segment_reach);
        }
        walk.lanes = walk.walk.lanes();
        *alive = walk.lanes as u32;
        Ok(())
    })
}

unsafe extern "C" fn photon_free(_: *mut c_void, walk: *mut c_void) {
    // SAFETY: the walk came from `emit` and is freed once.
    guarded(|| unsafe {
        drop(Box::from_raw(walk.cast::<PhotonBox>()));
        Ok(())
    });
}

/// # Safety
/// The arrays must hold `count` lanes.
unsafe fn medium_points(
    count: usize,
    medium: *const u32,
    position: *const f32,
    direction: *const f32,
) -> MediumPoints {
    // SAFETY: the caller's promise.
    unsafe {
        MediumPoints {
            medium: from_raw_parts(medium, count).to_vec(),
            position: planes(count, position),
            direction: planes(count, direction),
        }
    }
}

unsafe extern "C" fn extinction(
    context: *mut c_void,
    count: u32,
    medium: *const u32,
    position: *const f32,
    direction: *const f32,
    out: *mut f32,
) -> i32 {
    // SAFETY: all arrays hold `count` lanes.
    guarded(|| unsafe {
        let points = medium_points(count as usize, medium, position, direction);
        answer(out, |values| served(context).scene.extinction(&points, values))
    })
}

unsafe extern "C" fn scattering(
    context: *mut c_void,
    count: u32,
    medium: *const u32,
    position: *const f32,
    direction: *const f32,
    out: *mut f32,
) -> i32 {
    // SAFETY: all arrays hold `count` lanes.
    guarded(|| unsafe {
        let points = medium_points(count as usize, medium, position, direction);
        answer(out, |values| served(context).scene.scattering(&points, values))
    })
}

unsafe extern "C" fn eval_phase(
    context: *mut c_void,
    count: u32,
    medium: *const u32,
    position: *const f32,
    photon_direction: *const f32,
    view_direction: *const f32,
    out: *mut f32,
) -> i32 {
    // SAFETY: all arrays hold `count` lanes.
    guarded(|| unsafe {
        let count = count as usize;
        let pairs = PhasePairs {
            medium: from_raw_parts(medium, count).to_vec(),
            position: planes(count, position),
            photon_direction: planes(count, photon_direction),
            view_direction: planes(count, view_direction),
        };
        answer(out, |values| served(context).scene.eval_phase(&pairs, values))
    })
}

unsafe extern "C" fn store_points(
    context: *mut c_void,
    count: u32,
    origin: *const f32,
    direction: *const f32,
    skips_emitters: *const u32,
    glossy_chains: u32,
) -> i32 {
    // SAFETY: all arrays hold `count` lanes.
    guarded(|| unsafe {
        let count = count as usize;
        served(context).scene.store_points(&PointSegments {
            origin: planes(count, origin),
            direction: planes(count, direction),
            skips_emitters: from_raw_parts(skips_emitters, count).to_vec(),
            glossy_chains: glossy_chains != 0,
        })
    })
}

unsafe extern "C" fn eval_bsdf(
    context: *mut c_void,
    count: u32,
    point: *const u32,
    photon_direction: *const f32,
    lamp_density: *const f32,
    out: *mut f32,
) -> i32 {
    // SAFETY: all arrays hold `count` lanes.
    guarded(|| unsafe {
        let count = count as usize;
        let pairs = SurfacePairs {
            point: from_raw_parts(point, count).to_vec(),
            photon_direction: planes(count, photon_direction),
            lamp_density: from_raw_parts(lamp_density, count).to_vec(),
        };
        answer(out, |values| served(context).scene.eval_bsdf(&pairs, values))
    })
}

unsafe extern "C" fn lamp_light(
    context: *mut c_void,
    count: u32,
    medium: *const u32,
    position: *const f32,
    normal: *const f32,
    numbers: *const f32,
    direction: *mut f32,
    irradiance: *mut f32,
    density: *mut f32,
) -> i32 {
    // SAFETY: all arrays hold `count` lanes.
    guarded(|| unsafe {
        let count = count as usize;
        let places = Places {
            medium: from_raw_parts(medium, count).to_vec(),
            position: planes(count, position),
            normal: planes(count, normal),
        };
        let numbers = from_raw_parts(numbers, LAMP_DIMENSIONS * count);
        let wanted = (!density.is_null()).then(Vec::new);
        let mut light = LampLight { density: wanted, ..LampLight::default() };
        served(context).scene.lamp_light(&places, numbers, &mut light)?;
        put(light.direction.as_slice(), direction);
        put(light.irradiance.as_slice(), irradiance);
        if let Some(values) = &light.density {
            put(values, density);
        }
        Ok(())
    })
}

unsafe extern "C" fn aim(
    context: *mut c_void,
    count: u32,
    numbers: *const f32,
    film: *mut f32,
) -> i32 {
    // SAFETY: all arrays hold `count` lanes.
    guarded(|| unsafe {
        let count = count as usize;
        let numbers = from_raw_parts(numbers, AIM_DIMENSIONS * count);
        let mut positions = Vec::new();
        served(context).scene.aim(count, numbers, &mut positions)?;
        put(&positions, film);
        Ok(())
    })
}

unsafe extern "C" fn last_error(_: *mut c_void) -> *const c_char {
    LAST_ERROR.with(|last| last.borrow().as_ptr())
}
