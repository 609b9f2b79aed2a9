//! `vpt compare`: a [`job`] → [`contestants`], some of them [`remote`], that take turns under a [`schedule`], each measured
//! against the [`reference`] and kept in the [`ledger`] → the [`folder`] with the report.

mod contestants;
mod entrant;
mod entry;
mod folder;
mod job;
mod kernels;
mod ledger;
mod meter;
mod own;
mod protocol;
mod reference;
mod remote;
mod run;
mod scene_files;
mod schedule;
mod settings;
mod stage;

pub use folder::{Folder, FolderError};
pub use job::{CompareError, CompareJob, PerPass};
pub use remote::serve;
pub use run::{measure, run};
pub use stage::Stage;
