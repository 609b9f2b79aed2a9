//! `vpt reproduce`: the paper's measurements again. A [`job`] with the paper's [`setup`] → the files of its
//! [`scenes`] → a comparison of its methods for each, and the [`growth`] of their memory → the [`evidence`] → a
//! [`verdict`] for each of the paper's [`claims`] → the [`statement`].

mod assets;
mod claims;
mod evidence;
mod growth;
mod job;
mod run;
mod scenes;
mod setup;
mod statement;
mod verdict;

pub use job::ReproduceJob;
pub use run::run;
pub use scenes::Choice;
