//! Hands what a render tells through the C ABI to the caller's observer.

use super::ffi::call;
use super::{HostError, HostResult};
use crate::density::radius::Radii;
use crate::film::FilmSums;
use crate::host::abi::{
    VptError, VptObserver, VptProgress, VptShooting, VptStats, VPT_SHOOTING_METROPOLIS,
    VPT_SHOOTING_UNIFORM,
};
use crate::markov::{FamilyReport, Mode};
use crate::method::{ErrorEstimate, FilmSoFar, Observer, Progress, RenderError, Stats};
use crate::scene::SceneError;
use crate::transport::photon::PerFamily;
use std::ffi::{c_char, c_void};
use std::ops::ControlFlow;

/// Runs a render that reports to the table it is given, and returns its statistics.
pub(super) fn observed(
    observer: &mut dyn Observer,
    render: impl FnOnce(&VptObserver, *mut c_char, usize) -> i32,
) -> HostResult<Stats> {
    let mut bridge = Bridge { observer, stats: None };
    let table = VptObserver {
        context: (&raw mut bridge).cast(),
        progress: bridge_progress,
        finished: bridge_finished,
        warn: bridge_warn,
    };
    call(|error, size| render(&table, error, size))?;
    bridge.stats.ok_or_else(|| HostError("the render ended without a report".to_owned()))
}

struct Bridge<'a> {
    observer: &'a mut dyn Observer,
    stats: Option<Stats>,
}

unsafe extern "C" fn bridge_progress(context: *mut c_void, progress: *const VptProgress) -> i32 {
    // SAFETY: `context` is the bridge of the render under way, `progress` valid during the call.
    let (bridge, p) = unsafe { (&mut *context.cast::<Bridge>(), &*progress) };
    let progress = Progress {
        first_pass: 0,
        passes_done: p.passes_done,
        passes: p.passes,
        walks: p.walks,
        radii: Radii { surface: p.surface_radius, medium: p.medium_radius },
        seconds: p.seconds,
        seconds_before: 0.0,
        shooting: PerFamily {
            surface: read_shooting(&p.surface_shooting),
            medium: read_shooting(&p.medium_shooting),
        },
        error: read_error(&p.error),
    };
    let watched = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
        bridge.observer.progress(&progress, &LentFilm(p))
    }));
    i32::from(!matches!(watched, Ok(ControlFlow::Continue(()))))
}

/// The film of the progress under way.
struct LentFilm<'a>(&'a VptProgress);

impl FilmSoFar for LentFilm<'_> {
    fn film(&self) -> Result<FilmSums, RenderError> {
        let VptProgress { film_size: [width, height], film_channels, film, read_film, .. } =
            *self.0;
        let mut values =
            vec![0.0; [width, height, film_channels].map(|n| n as usize).iter().product()];
        // SAFETY: the progress lends its film for as long as the callback runs, and the sizes are the array's.
        call(|error, size| unsafe {
            read_film(film, values.as_mut_ptr(), values.len(), error, size)
        })
        .map_err(|HostError(sentence)| SceneError(sentence))?;
        Ok(FilmSums { values })
    }
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

fn read_error(raw: &VptError) -> Option<ErrorEstimate> {
    (raw.jitters > 0).then_some(ErrorEstimate {
        relative: raw.relative,
        noise: raw.noise,
        bias: raw.bias,
        noise_decay: raw.noise_decay,
        bias_decay: raw.bias_decay,
        correlation: raw.correlation,
        jitters: raw.jitters,
    })
}

unsafe extern "C" fn bridge_finished(context: *mut c_void, stats: *const VptStats) {
    // SAFETY: `context` is the bridge; the report was written by this very engine.
    let (bridge, stats) = unsafe { (&mut *context.cast::<Bridge>(), &*stats.cast::<Stats>()) };
    bridge.stats = Some(stats.clone());
}

/// Warnings arrive with the report as well.
unsafe extern "C" fn bridge_warn(_: *mut c_void, _: *const c_char) {}
