use super::abi::*;
use super::crew::Lender;
use crate::crew::{self, Crew};
use crate::math::{Aabb, Rgb};
use crate::scene::*;
use glam::Vec3;
use std::ffi::{c_char, c_void, CStr};

/// [`VptHost::extinction`] or [`VptHost::scattering`].
type CoefficientCallback =
    unsafe extern "C" fn(*mut c_void, u32, *const u32, *const f32, *const f32, *mut f32) -> i32;

/// A [`Scene`] that a renderer lends through the C ABI.
#[derive(Debug)]
pub struct HostScene {
    host: VptHost,
    description: SceneDescription,
    batching: Batching,
    spectral: bool,
    /// Whether the host's context is one that `tune` gave.
    is_tuned: bool,
}

// SAFETY: with `concurrent` set the renderer promises that its callbacks may run on several threads
// at once; without it the engine drives the scene from one thread at a time.
unsafe impl Sync for HostScene {}

impl HostScene {
    /// # Safety
    /// The callbacks must keep the promises of [`super::abi`] for as long as the scene lives.
    pub unsafe fn new(host: VptHost) -> SceneResult<Self> {
        if host.abi_version != VPT_ABI_VERSION {
            return Err(SceneError(format!(
                "the renderer speaks version {} of the C ABI, this engine version {VPT_ABI_VERSION}; \
                 rebuild both from one source",
                host.abi_version
            )));
        }
        let mut raw = std::mem::MaybeUninit::<VptDescription>::zeroed();
        // SAFETY: the out pointer is valid; all-zero bytes are a valid description.
        let description = unsafe {
            check(&host, (host.describe)(host.context, raw.as_mut_ptr()))?;
            raw.assume_init()
        };
        Ok(HostScene {
            host,
            batching: Batching {
                lanes: description.lanes.max(1) as usize,
                concurrent: description.concurrent != 0,
                launch: description.launch as usize,
            },
            spectral: description.spectral != 0,
            is_tuned: false,
            // SAFETY: the renderer filled the description.
            description: unsafe { read_description(&description)? },
        })
    }

    fn check(&self, status: i32) -> SceneResult<()> {
        check(&self.host, status)
    }

    /// Asks for a coefficient of media at points.
    fn coefficients(
        &self,
        callback: CoefficientCallback,
        points: &MediumPoints,
        out: &mut Planes,
    ) -> SceneResult<()> {
        let count = points.medium.len();
        assert!(points.position.lanes() == count && points.direction.lanes() == count);
        out.resize(count);
        // SAFETY: all arrays hold `count` lanes.
        self.check(unsafe {
            callback(
                self.host.context,
                lane_count(count),
                points.medium.as_ptr(),
                points.position.as_slice().as_ptr(),
                points.direction.as_slice().as_ptr(),
                out.as_mut_slice().as_mut_ptr(),
            )
        })
    }
}

impl Drop for HostScene {
    fn drop(&mut self) {
        if self.is_tuned {
            // SAFETY: the context came from `tune` and is freed once.
            unsafe { (self.host.tuned_free)(self.host.context, self.host.context) }
        }
    }
}

fn check(host: &VptHost, status: i32) -> SceneResult<()> {
    if status == 0 {
        return Ok(());
    }
    // SAFETY: `last_error` gives a null-terminated sentence, or null.
    let sentence = unsafe { read_text((host.last_error)(host.context)) };
    Err(SceneError(sentence))
}

/// # Safety
/// `text` must be null or null-terminated.
unsafe fn read_text(text: *const c_char) -> String {
    if text.is_null() {
        return "no reason was given".to_owned();
    }
    // SAFETY: the caller's promise.
    unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned()
}

fn check_film(d: &VptDescription) -> SceneResult<()> {
    let (pixels, width, channels) = (d.film_pixels, d.film_width, d.film_channels);
    if ![RGB_WEIGHT, RGB_ALPHA_WEIGHT].contains(&channels) {
        return Err(SceneError(format!(
            "the film has {channels} channels; it needs red, green, blue and a weight, and may have alpha"
        )));
    }
    if pixels.checked_rem(width) != Some(0) {
        return Err(SceneError(format!(
            "the film has {pixels} pixels in rows of {width}; it needs whole rows"
        )));
    }
    Ok(())
}

/// # Safety
/// Pointers and counts must describe valid arrays.
unsafe fn read_description(d: &VptDescription) -> SceneResult<SceneDescription> {
    check_film(d)?;
    // SAFETY: the caller's promise.
    let film_filter = unsafe { read_array(d.film_filter, d.film_filter_count) };
    let film_filter = FilmFilter::new(d.film_filter_radius, film_filter.to_vec())?;
    // SAFETY: the caller's promise; empty arrays may be null.
    let (media, warnings) = unsafe {
        (
            read_array(d.media, d.media_count).iter().map(|m| read_medium(m)).collect(),
            read_array(d.warnings, d.warning_count).iter().map(|&w| read_text(w)).collect(),
        )
    };
    // SAFETY: the caller's promise; empty arrays may be null.
    let (surfaces, emitters, sensor) = unsafe {
        (
            read_array(d.surfaces, d.surface_count).iter().map(|s| read_surface(s)).collect(),
            read_array(d.emitters, d.emitter_count).iter().map(|e| read_emitter(e)).collect(),
            SensorFacts { name: read_text(d.sensor_name), has_aperture: d.has_aperture != 0 },
        )
    };
    Ok(SceneDescription {
        film_size: d.film_size,
        film_offset: d.film_offset,
        film_channels: d.film_channels,
        film_pixels: d.film_pixels,
        film_width: d.film_width,
        film_filter,
        channel_colours: (d.spectral != 0)
            .then(|| d.channel_colours.map(|colour| Rgb::from(Vec3::from(colour)))),
        media,
        bounds: Aabb { min: Vec3::from(d.bounds_min), max: Vec3::from(d.bounds_max) },
        surfaces,
        emitters,
        sensor,
        warnings,
    })
}

/// # Safety
/// `data` must point to `count` values, or `count` be 0.
unsafe fn read_array<'a, T>(data: *const T, count: u32) -> &'a [T] {
    if count == 0 {
        return &[];
    }
    // SAFETY: the caller's promise.
    unsafe { std::slice::from_raw_parts(data, count as usize) }
}

/// # Safety
/// `name` must be null-terminated.
unsafe fn read_medium(m: &VptMedium) -> Medium {
    Medium {
        // SAFETY: the caller's promise.
        name: unsafe { read_text(m.name) },
        extinction: match m.varying {
            0 => Extinction::Constant(Rgb::from(Vec3::from(m.sigma_t))),
            _ => Extinction::Varying { feature_size: m.feature_size },
        },
        grey: m.grey != 0,
        scattering: (m.varying_scattering == 0).then(|| Rgb::from(Vec3::from(m.sigma_s))),
        phase: match m.phase {
            VPT_PHASE_ISOTROPIC => Phase::Isotropic,
            VPT_PHASE_HENYEY_GREENSTEIN => Phase::HenyeyGreenstein { g: m.g },
            _ => Phase::Opaque,
        },
        bounds: Aabb { min: Vec3::from(m.bounds_min), max: Vec3::from(m.bounds_max) },
    }
}

/// # Safety
/// `name` must be null-terminated.
unsafe fn read_surface(s: &VptSurface) -> SurfaceFacts {
    SurfaceFacts {
        // SAFETY: the caller's promise.
        name: unsafe { read_text(s.name) },
        lobes: s.lobes,
        interior: s.interior,
        exterior: s.exterior,
    }
}

/// # Safety
/// `name` must be null-terminated.
unsafe fn read_emitter(e: &VptEmitter) -> EmitterFacts {
    EmitterFacts {
        // SAFETY: the caller's promise.
        name: unsafe { read_text(e.name) },
        is_visible: e.is_visible != 0,
        is_environment: e.is_environment != 0,
        place: (e.radius >= 0.0).then(|| Place { centre: e.centre.into(), radius: e.radius }),
    }
}

fn raw_rules(rules: PathRules) -> VptRules {
    VptRules {
        max_depth: rules.limits.max_depth,
        rr_depth: rules.limits.rr_depth,
        hide_emitters: rules.limits.hide_emitters.into(),
        effects: rules.effects.bits(),
        glossy_chains: rules.glossy_chains.into(),
    }
}

fn lane_count(lanes: usize) -> u32 {
    u32::try_from(lanes).expect("a batch holds fewer than 2^32 lanes")
}

/// Where values go; null where they are not wanted.
fn optional(values: &mut Option<Vec<f32>>) -> *mut f32 {
    values.as_mut().map_or(std::ptr::null_mut(), |values| values.as_mut_ptr())
}

struct HostViewWalk<'a> {
    scene: &'a HostScene,
    walk: *mut c_void,
    lanes: u32,
}

impl ViewWalk for HostViewWalk<'_> {
    fn lanes(&self) -> usize {
        self.lanes as usize
    }

    fn step(&mut self, steps: usize, numbers: &[f32], out: &mut ViewVertices) -> SceneResult<()> {
        let lanes = steps * self.lanes as usize;
        assert_eq!(numbers.len(), VIEW_STEP_DIMENSIONS * lanes);
        out.resize(lanes);
        let raw = VptViewVertices {
            lanes: lane_count(lanes),
            ray: out.ray.as_mut_ptr(),
            flags: out.flags.as_mut_ptr(),
            medium: out.medium.as_mut_ptr(),
            origin: out.origin.as_mut_slice().as_mut_ptr(),
            direction: out.direction.as_mut_slice().as_mut_ptr(),
            length: out.length.as_mut_ptr(),
            position: out.position.as_mut_slice().as_mut_ptr(),
            normal: out.normal.as_mut_slice().as_mut_ptr(),
            geometric_normal: out.geometric_normal.as_mut_slice().as_mut_ptr(),
            reflectance: out.reflectance.as_mut_slice().as_mut_ptr(),
            emission: out.emission.as_mut_slice().as_mut_ptr(),
            weight: out.weight.as_mut_slice().as_mut_ptr(),
        };
        let host = &self.scene.host;
        let mut alive = 0;
        // SAFETY: all arrays were just sized for `lanes`; the walk is alive until drop.
        let status = unsafe {
            let (walk, steps, numbers) = (self.walk, lane_count(steps), numbers.as_ptr());
            (host.view_step)(host.context, walk, steps, numbers, &raw, &mut alive)
        };
        self.scene.check(status)?;
        self.lanes = alive;
        Ok(())
    }
}

impl Drop for HostViewWalk<'_> {
    fn drop(&mut self) {
        let host = &self.scene.host;
        // SAFETY: the walk came from `view_rays` and is freed once.
        unsafe { (host.view_free)(host.context, self.walk) }
    }
}

struct HostPhotonWalk<'a> {
    scene: &'a HostScene,
    walk: *mut c_void,
    lanes: u32,
}

impl PhotonWalk for HostPhotonWalk<'_> {
    fn lanes(&self) -> usize {
        self.lanes as usize
    }

    fn alive(&self, out: &mut Vec<u32>) -> SceneResult<()> {
        out.resize(self.lanes as usize, 0);
        let host = &self.scene.host;
        // SAFETY: the array was just sized for the walks that are alive.
        let status = unsafe { (host.photon_alive)(host.context, self.walk, out.as_mut_ptr()) };
        self.scene.check(status)
    }

    fn step(&mut self, steps: usize, numbers: &[f32], out: &mut PhotonVertices) -> SceneResult<()> {
        let lanes = steps * self.lanes as usize;
        assert_eq!(numbers.len(), PHOTON_STEP_DIMENSIONS * lanes);
        out.resize(lanes);
        let segments = out.segments.as_mut().map(|segments| {
            [
                segments.origin.as_mut_slice().as_mut_ptr(),
                segments.flux.as_mut_slice().as_mut_ptr(),
                segments.density.as_mut_slice().as_mut_ptr(),
                segments.reach.as_mut_ptr(),
            ]
        });
        let [segment_origin, segment_flux, segment_density, segment_reach] =
            segments.unwrap_or([std::ptr::null_mut(); 4]);
        let raw = VptPhotonVertices {
            lanes: lane_count(lanes),
            walk: out.walk.as_mut_ptr(),
            event: out.event.as_mut_ptr(),
            medium: out.medium.as_mut_ptr(),
            depth: out.depth.as_mut_ptr(),
            position: out.position.as_mut_slice().as_mut_ptr(),
            direction: out.direction.as_mut_slice().as_mut_ptr(),
            length: out.length.as_mut_ptr(),
            geometric_normal: out.geometric_normal.as_mut_slice().as_mut_ptr(),
            flux: out.flux.as_mut_slice().as_mut_ptr(),
            segment_origin,
            segment_flux,
            segment_density,
            segment_reach,
            lamp_density: optional(&mut out.lamp_density),
        };
        let host = &self.scene.host;
        let mut alive = 0;
        // SAFETY: all arrays were just sized for `lanes`; the walk is alive until drop.
        let status = unsafe {
            let (walk, steps, numbers) = (self.walk, lane_count(steps), numbers.as_ptr());
            (host.photon_step)(host.context, walk, steps, numbers, &raw, &mut alive)
        };
        self.scene.check(status)?;
        self.lanes = alive;
        Ok(())
    }
}

impl Drop for HostPhotonWalk<'_> {
    fn drop(&mut self) {
        let host = &self.scene.host;
        // SAFETY: the walk came from `emit` and is freed once.
        unsafe { (host.photon_free)(host.context, self.walk) }
    }
}

impl Scene for HostScene {
    fn description(&self) -> &SceneDescription {
        &self.description
    }

    fn batching(&self) -> Batching {
        self.batching
    }

    fn with_crew<'scope>(&self, body: &mut dyn FnMut(&dyn Crew<'scope>)) {
        match (self.host.spawn, self.host.work_until) {
            (Some(spawn), Some(work_until)) => {
                let lender = Lender { context: self.host.context, spawn, work_until };
                // SAFETY: `HostScene::new` was promised callbacks that do what the ABI says.
                unsafe { lender.lend(body) }
            }
            _ => crew::of_rayon(body),
        }
    }

    fn tuned(&self, number: f32) -> SceneResult<Option<Box<dyn Scene + '_>>> {
        if !self.spectral {
            return Ok(None);
        }
        let mut context = std::ptr::null_mut();
        // SAFETY: the out pointer is valid.
        self.check(unsafe { (self.host.tune)(self.host.context, number, &mut context) })?;
        // SAFETY: the callbacks keep their promises for the tuned context, too, which lives until it is freed.
        match unsafe { HostScene::new(VptHost { context, ..self.host }) } {
            Ok(mut scene) => {
                scene.is_tuned = true;
                Ok(Some(Box::new(scene)))
            }
            Err(error) => {
                // SAFETY: the context came from `tune` and is freed once.
                unsafe { (self.host.tuned_free)(self.host.context, context) };
                Err(error)
            }
        }
    }

    fn view_rays<'a>(
        &'a self,
        request: &ViewRayRequest,
        importance: &mut Planes,
    ) -> SceneResult<Box<dyn ViewWalk + 'a>> {
        assert_eq!(request.film.len(), 2 * request.lanes);
        assert_eq!(request.numbers.len(), VIEW_RAY_DIMENSIONS * request.lanes);
        importance.resize(request.lanes);
        let raw = VptViewRequest {
            lanes: lane_count(request.lanes),
            film: request.film.as_ptr(),
            numbers: request.numbers.as_ptr(),
            rules: raw_rules(request.rules),
            importance: importance.as_mut_slice().as_mut_ptr(),
        };
        let (mut walk, mut alive) = (std::ptr::null_mut(), 0);
        // SAFETY: the arrays have the sizes just asserted.
        self.check(unsafe {
            (self.host.view_rays)(self.host.context, &raw, &mut walk, &mut alive)
        })?;
        Ok(Box::new(HostViewWalk { scene: self, walk, lanes: alive }))
    }

    fn emit<'a>(
        &'a self,
        lanes: usize,
        numbers: &[f32],
        rules: PathRules,
    ) -> SceneResult<Box<dyn PhotonWalk + 'a>> {
        assert_eq!(numbers.len(), EMIT_DIMENSIONS * lanes);
        let rules = raw_rules(rules);
        let (mut walk, mut alive) = (std::ptr::null_mut(), 0);
        // SAFETY: `numbers` has the size just asserted.
        self.check(unsafe {
            (self.host.emit)(
                self.host.context,
                lane_count(lanes),
                numbers.as_ptr(),
                &rules,
                &mut walk,
                &mut alive,
            )
        })?;
        Ok(Box::new(HostPhotonWalk { scene: self, walk, lanes: alive }))
    }

    fn extinction(&self, points: &MediumPoints, out: &mut Planes) -> SceneResult<()> {
        self.coefficients(self.host.extinction, points, out)
    }

    fn scattering(&self, points: &MediumPoints, out: &mut Planes) -> SceneResult<()> {
        self.coefficients(self.host.scattering, points, out)
    }

    fn eval_phase(&self, pairs: &PhasePairs, out: &mut Planes) -> SceneResult<()> {
        let count = pairs.medium.len();
        assert!(
            pairs.position.lanes() == count
                && pairs.photon_direction.lanes() == count
                && pairs.view_direction.lanes() == count
        );
        out.resize(count);
        // SAFETY: all arrays hold `count` lanes.
        self.check(unsafe {
            (self.host.eval_phase)(
                self.host.context,
                lane_count(count),
                pairs.medium.as_ptr(),
                pairs.position.as_slice().as_ptr(),
                pairs.photon_direction.as_slice().as_ptr(),
                pairs.view_direction.as_slice().as_ptr(),
                out.as_mut_slice().as_mut_ptr(),
            )
        })
    }

    fn store_points(&self, points: &PointSegments) -> SceneResult<()> {
        let count = points.skips_emitters.len();
        assert!(points.origin.lanes() == count && points.direction.lanes() == count);
        // SAFETY: all arrays hold `count` lanes.
        self.check(unsafe {
            (self.host.store_points)(
                self.host.context,
                lane_count(count),
                points.origin.as_slice().as_ptr(),
                points.direction.as_slice().as_ptr(),
                points.skips_emitters.as_ptr(),
                points.glossy_chains.into(),
            )
        })
    }

    fn eval_bsdf(&self, pairs: &SurfacePairs, out: &mut Planes) -> SceneResult<()> {
        let count = pairs.point.len();
        assert!(pairs.photon_direction.lanes() == count && pairs.lamp_density.len() == count);
        out.resize(count);
        // SAFETY: all arrays hold `count` lanes.
        self.check(unsafe {
            (self.host.eval_bsdf)(
                self.host.context,
                lane_count(count),
                pairs.point.as_ptr(),
                pairs.photon_direction.as_slice().as_ptr(),
                pairs.lamp_density.as_ptr(),
                out.as_mut_slice().as_mut_ptr(),
            )
        })
    }

    fn lamp_light(&self, places: &Places, numbers: &[f32], out: &mut LampLight) -> SceneResult<()> {
        let count = places.medium.len();
        assert!(places.position.lanes() == count && places.normal.lanes() == count);
        assert_eq!(numbers.len(), LAMP_DIMENSIONS * count);
        out.resize(count);
        // SAFETY: all arrays hold `count` lanes.
        self.check(unsafe {
            (self.host.lamp_light)(
                self.host.context,
                lane_count(count),
                places.medium.as_ptr(),
                places.position.as_slice().as_ptr(),
                places.normal.as_slice().as_ptr(),
                numbers.as_ptr(),
                out.direction.as_mut_slice().as_mut_ptr(),
                out.irradiance.as_mut_slice().as_mut_ptr(),
                optional(&mut out.density),
            )
        })
    }

    fn aim(&self, lanes: usize, numbers: &[f32], film: &mut Vec<f32>) -> SceneResult<()> {
        assert_eq!(numbers.len(), AIM_DIMENSIONS * lanes);
        film.resize(2 * lanes, f32::NAN);
        // SAFETY: the arrays hold `lanes` lanes.
        self.check(unsafe {
            (self.host.aim)(
                self.host.context,
                lane_count(lanes),
                numbers.as_ptr(),
                film.as_mut_ptr(),
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effect::{Effect, Effects};

    #[test]
    fn films_that_cannot_be_summed_up_are_refused() {
        // SAFETY: all-zero bytes are a valid description.
        let nothing = unsafe { std::mem::zeroed::<VptDescription>() };
        let film = |film_channels, film_pixels, film_width| {
            check_film(&VptDescription { film_channels, film_pixels, film_width, ..nothing })
        };
        assert!(film(4, 6, 3).is_ok() && film(5, 6, 3).is_ok());
        assert!(film(3, 6, 3).unwrap_err().0.contains("3 channels"));
        assert!(film(4, 7, 3).unwrap_err().0.contains("rows of 3"));
        assert!(film(4, 6, 0).unwrap_err().0.contains("rows of 0"));
    }

    /// Both sides of the ABI count the same bits.
    #[test]
    fn bits_of_the_abi_are_those_of_the_engine() {
        let bit = |effect| Effects::NONE.with(effect).bits();
        for (raw, effect) in [
            (VPT_EFFECT_SURFACE_GATHERING, Effect::SurfaceGathering),
            (VPT_EFFECT_MEDIUM_SAMPLING, Effect::MediumSampling),
            (VPT_EFFECT_MULTIPLE_SCATTERING, Effect::MultipleScattering),
            (VPT_EFFECT_COLOURED_EXTINCTION, Effect::ColouredExtinction),
            (VPT_EFFECT_SPECULAR_CHAINS, Effect::SpecularChains),
            (VPT_EFFECT_DIRECT_EMISSION, Effect::DirectEmission),
            (VPT_EFFECT_ENVIRONMENT, Effect::Environment),
        ] {
            assert_eq!(raw, bit(effect), "{}", effect.name());
        }
        assert_eq!(
            [
                VPT_LOBE_SMOOTH,
                VPT_LOBE_DELTA_REFLECTION,
                VPT_LOBE_DELTA_TRANSMISSION,
                VPT_LOBE_NULL
            ],
            [lobes::SMOOTH, lobes::DELTA_REFLECTION, lobes::DELTA_TRANSMISSION, lobes::NULL],
        );
    }
}
