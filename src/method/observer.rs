use super::RenderError;
use crate::density::radius::Radii;
use crate::film::error::ErrorEstimate;
use crate::film::FilmSums;
use crate::markov::FamilyReport;
use crate::transport::photon::PerFamily;
use std::ops::ControlFlow;

/// The state of a render between two passes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// Number of the first pass, which is not 0 where the others are rendered elsewhere.
    pub first_pass: u32,
    pub passes_done: u32,
    pub passes: u32,
    /// Walks emitted so far.
    pub walks: u64,
    /// Radii of the pass that comes next.
    pub radii: Radii,
    pub seconds: f64,
    /// Of these, what passes took that were done before this render took them up.
    pub seconds_before: f64,
    /// How photons were shot in the last pass, by family.
    pub shooting: PerFamily<FamilyReport>,
    /// None before there is enough to judge by, or where no error is to be estimated.
    pub error: Option<ErrorEstimate>,
}

/// The film of a render between two passes, for those who ask.
pub trait FilmSoFar {
    /// Sums over all passes done; it costs a splat of the present jitter.
    fn film(&self) -> Result<FilmSums, RenderError>;
}

/// Watches a render; asked once before the first pass and after every pass.
pub trait Observer {
    /// `Break` ends the render with what has been gathered.
    fn progress(&mut self, progress: &Progress, film: &dyn FilmSoFar) -> ControlFlow<()>;
}

/// Watches nothing and never stops.
pub struct Silent;

impl Observer for Silent {
    fn progress(&mut self, _: &Progress, _: &dyn FilmSoFar) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}
