//! `vpt compare`: a [`job`] → [`contestants`] that take turns under a [`schedule`], each measured against the
//! [`reference`] → the [`folder`] with the report.

mod contestants;
mod folder;
mod job;
mod own;
mod reference;
mod run;
mod schedule;

pub use job::CompareJob;
pub use run::run;
