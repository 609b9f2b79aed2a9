//! Mitsuba's own integrators, and what they render.

use super::ffi::*;
use super::{HostResult, Session};
use crate::scene::{PathLimits, UNBOUNDED_DEPTH};
use std::ffi::c_void;
use std::marker::PhantomData;

impl Session {
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
}

/// One of Mitsuba's own integrators.
#[derive(Debug)]
pub struct OwnIntegrator<'a> {
    pub(super) integrator: *mut c_void,
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
