//! A scene that Mitsuba holds in memory.

use super::bridge::observed;
use super::ffi::*;
use super::own::{OwnIntegrator, OwnPicture};
use super::{HostError, HostResult, Session};
use crate::host::exports::read_parameters;
use crate::host::HostScene;
use crate::math::srgb;
use crate::method::{Observer, Parameters, RenderError, Stats};
use crate::scene::PathLimits;
use std::ffi::{c_void, CStr};
use std::marker::PhantomData;
use std::path::Path;

/// A scene in memory, with the picture last rendered.
#[derive(Debug)]
pub struct LoadedScene<'a> {
    _session: &'a Session,
    pub(super) scene: *mut c_void,
    sensors: u32,
    pub(super) rendered: u32,
    notes: Vec<String>,
}

impl<'a> LoadedScene<'a> {
    pub(super) fn new(session: &'a Session, scene: *mut c_void) -> HostResult<Self> {
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
        // SAFETY: the observer's table outlives the call, which is made on this thread.
        observed(observer, |table, error, size| unsafe {
            vpt_scene_render(self.scene, sensor, seed, passes.unwrap_or(0), table, error, size)
        })
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
        let mut linear = self.black_picture(self.rendered as usize);
        // SAFETY: the film's bitmap has this size and three channels after conversion.
        call(|error, size| unsafe {
            vpt_scene_read_rgb(self.scene, self.rendered, linear.as_mut_ptr(), error, size)
        })?;
        Ok(linear)
    }

    fn write_srgb(&self, path: &Path) -> HostResult<()> {
        let [width, height] = self.film_size(self.rendered as usize);
        let linear = self.read_rgb()?;
        let bytes = linear.iter().map(|&value| srgb::byte(value)).collect();
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
        let mut rgb = self.black_picture(sensor);
        let (sensor, mut spp) = (self.checked(sensor), spp);
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

    /// Room for red, green and blue of every pixel.
    fn black_picture(&self, sensor: usize) -> Vec<f32> {
        let [width, height] = self.film_size(sensor);
        vec![0.0; 3 * width as usize * height as usize]
    }

    pub(super) fn checked(&self, sensor: usize) -> u32 {
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
