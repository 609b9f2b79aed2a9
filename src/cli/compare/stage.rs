//! What comparisons take place on: Mitsuba, started once for all of them, and an ear for Ctrl-C.

use super::kernels;
use crate::cli::failure::Failure;
use crate::cli::interrupt::Interrupt;
use crate::cli::teller;
use anyhow::Context;
use tempfile::TempDir;
use vpt::host::session::Session;

pub struct Stage {
    pub session: Session,
    pub interrupt: Interrupt,
    _kernels: TempDir,
}

impl Stage {
    /// Starts Mitsuba, in a process that has done nothing else so far.
    pub fn open(variant: Option<&str>, verbosity: u8, quiet: bool) -> Result<Self, Failure> {
        let kernels = kernels::empty_folder().map_err(Failure::failed)?;
        // No other thread runs yet.
        std::env::set_var(kernels::VARIABLE, kernels.path());
        let session = Session::start(variant, None, verbosity).map_err(Failure::failed)?;
        let tell = teller(quiet);
        let interrupt = Interrupt::listen(move || {
            tell("stopping after this step, to write the report; Ctrl-C again aborts without one");
        });
        let interrupt = interrupt.context("cannot listen for Ctrl-C").map_err(Failure::failed)?;
        Ok(Stage { session, interrupt, _kernels: kernels })
    }
}
