//! Mitsuba embedded in this process, without Python: one variant, any scene, the `vpt` integrator put
//! into it.

mod bridge;
mod ffi;
mod film;
mod loaded;
mod own;

pub use loaded::{LentScene, LoadedScene};
pub use own::{OwnIntegrator, OwnPicture};

use ffi::*;
use std::ffi::CStr;
use std::path::PathBuf;

/// Variants that the plugin works in, best first for a machine without a GPU.
pub const VARIANTS: [&str; 8] = [
    "scalar_rgb",
    "scalar_spectral",
    "llvm_ad_rgb",
    "llvm_ad_mono",
    "llvm_ad_spectral",
    "cuda_ad_rgb",
    "cuda_ad_mono",
    "cuda_ad_spectral",
];

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
                "vpt works in the variants {}; \"{variant}\" is not one of them (it follows no polarized light)",
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

    /// Mitsuba's own version.
    pub fn mitsuba_version(&self) -> String {
        // SAFETY: a constant of the shim.
        unsafe { CStr::from_ptr(vpt_mitsuba_version()) }.to_string_lossy().into_owned()
    }

    /// Whether Mitsuba has an integrator of this name.
    pub fn knows_integrator(&self, name: &str) -> bool {
        // SAFETY: the name is null-terminated.
        c_string(name).is_ok_and(|name| unsafe { vpt_integrator_known(name.as_ptr()) != 0 })
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
