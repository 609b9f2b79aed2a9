//! `vpt compare`: a [`job`] → [`contestants`] that take turns under a [`schedule`], each measured against the
//! [`reference`] → the [`folder`] with the report.

mod contestants;
mod folder;
mod job;
mod own;
mod reference;
mod run;
mod schedule;

pub use folder::{Folder, FolderError};
pub use job::{CompareError, CompareJob, PerPass};
pub use run::{measure, run};
