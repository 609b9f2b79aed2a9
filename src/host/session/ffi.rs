//! The functions of the shim that embed Mitsuba, and how they are called.

use super::{HostError, HostResult};
use crate::host::abi::{VptHost, VptObserver, VptParameters};
use std::ffi::{c_char, c_void, CStr, CString};

/// Calls a function that returns 0 or writes a sentence into a buffer.
pub(super) fn call(body: impl FnOnce(*mut c_char, usize) -> i32) -> HostResult<()> {
    let mut sentence = vec![0u8; 8192];
    if body(sentence.as_mut_ptr().cast(), sentence.len()) == 0 {
        return Ok(());
    }
    let text = CStr::from_bytes_until_nul(&sentence).unwrap_or_default().to_string_lossy();
    Err(HostError(text.trim().to_owned()))
}

pub(super) fn c_string(text: &str) -> HostResult<CString> {
    CString::new(text).map_err(|_| HostError(format!("{text:?} holds a zero byte; remove it")))
}

/// Names and values as null-terminated strings, by turns.
pub(super) struct Pairs {
    _strings: Vec<CString>,
    pub pointers: Vec<*const c_char>,
}

impl Pairs {
    pub(super) fn new(pairs: &[(String, String)]) -> HostResult<Self> {
        let strings = pairs
            .iter()
            .flat_map(|(name, value)| [c_string(name), c_string(value)])
            .collect::<HostResult<Vec<_>>>()?;
        let pointers = strings.iter().map(|s| s.as_ptr()).collect();
        Ok(Pairs { _strings: strings, pointers })
    }
}

#[repr(C)]
pub(super) struct SceneFileArguments {
    pub defines: *const *const c_char,
    pub define_count: u32,
    pub settings: *const *const c_char,
    pub setting_count: u32,
}

// cpp/session.cpp
extern "C" {
    pub(super) fn vpt_session_start(
        variant: *const c_char,
        threads: u32,
        verbosity: u32,
        error: *mut c_char,
        size: usize,
    ) -> i32;
    pub(super) fn vpt_scene_load(
        variant: *const c_char,
        path: *const c_char,
        file: *const SceneFileArguments,
        scene: *mut *mut c_void,
        error: *mut c_char,
        size: usize,
    ) -> i32;
    pub(super) fn vpt_scene_free(scene: *mut c_void);
    pub(super) fn vpt_scene_lend(
        scene: *mut c_void,
        sensor: u32,
        host: *mut VptHost,
        owner: *mut *mut c_void,
        error: *mut c_char,
        size: usize,
    ) -> i32;
    pub(super) fn vpt_scene_give_back(owner: *mut c_void);
    pub(super) fn vpt_scene_parameters(
        scene: *mut c_void,
        sensor: u32,
        out: *mut VptParameters,
        error: *mut c_char,
        size: usize,
    ) -> i32;
    pub(super) fn vpt_integrator_create(
        variant: *const c_char,
        name: *const c_char,
        max_depth: i64,
        rr_depth: i64,
        hide_emitters: u32,
        integrator: *mut *mut c_void,
        error: *mut c_char,
        size: usize,
    ) -> i32;
    pub(super) fn vpt_integrator_free(integrator: *mut c_void);
    pub(super) fn vpt_integrator_known(name: *const c_char) -> u32;
    pub(super) fn vpt_scene_render_with(
        scene: *mut c_void,
        integrator: *mut c_void,
        sensor: u32,
        seed: u32,
        spp: *mut u32,
        rgb: *mut f32,
        error: *mut c_char,
        size: usize,
    ) -> i32;
    pub(super) fn vpt_scene_bare_walks(
        scene: *mut c_void,
        sensor: u32,
        walks: u64,
        max_depth: u32,
        rr_depth: u32,
        vertices: *mut u64,
        error: *mut c_char,
        size: usize,
    ) -> i32;
    pub(super) fn vpt_scene_notes(scene: *mut c_void) -> *const c_char;
    pub(super) fn vpt_scene_facts(
        scene: *mut c_void,
        sensors: *mut u32,
        emitters: *mut u32,
        error: *mut c_char,
        size: usize,
    ) -> i32;
    pub(super) fn vpt_scene_film_size(
        scene: *mut c_void,
        sensor: u32,
        out: *mut u32,
        error: *mut c_char,
        size: usize,
    ) -> i32;
    pub(super) fn vpt_scene_render(
        scene: *mut c_void,
        sensor: u32,
        seed: u32,
        passes: u32,
        observer: *const VptObserver,
        error: *mut c_char,
        size: usize,
    ) -> i32;
    pub(super) fn vpt_scene_write(
        scene: *mut c_void,
        sensor: u32,
        path: *const c_char,
        error: *mut c_char,
        size: usize,
    ) -> i32;
    pub(super) fn vpt_scene_describe_film(
        scene: *mut c_void,
        sensor: u32,
        says: *mut c_char,
        others: *mut c_char,
        text_size: usize,
        has_alpha: *mut u32,
        error: *mut c_char,
        size: usize,
    ) -> i32;
    pub(super) fn vpt_scene_read_film(
        scene: *mut c_void,
        sensor: u32,
        out: *mut f32,
        values: usize,
        error: *mut c_char,
        size: usize,
    ) -> i32;
    pub(super) fn vpt_mitsuba_version() -> *const c_char;
    pub(super) fn vpt_scene_read_rgb(
        scene: *mut c_void,
        sensor: u32,
        out: *mut f32,
        error: *mut c_char,
        size: usize,
    ) -> i32;
}
