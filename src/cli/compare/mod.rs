//! `vpt compare`: a [`job`] → [`contestants`], some of them [`remote`], that take turns under a [`schedule`], each measured
//! against the [`reference`] and kept in the [`ledger`] → the [`folder`] with the report.

mod contestants;
mod entrant;
mod entry;
mod error;
mod folder;
mod job;
mod kernels;
mod ledger;
mod meaning;
mod meter;
mod own;
mod per_pass;
mod protocol;
mod reference;
mod remote;
mod run;
pub(super) mod scene_files;
mod schedule;
mod settings;
mod stage;

pub use error::CompareError;
pub use folder::{Folder, FolderError};
pub use job::CompareJob;
pub use per_pass::PerPass;
pub use remote::serve;
pub use run::{measure, run};
pub use stage::Stage;
