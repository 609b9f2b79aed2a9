//! `vpt reproduce`: the paper's measurements again. A [`job`] with the paper's [`setup`] → the files of its
//! [`scenes`] → a comparison of its methods for each → what they say of its claims.

mod assets;
mod job;
mod run;
mod scenes;
mod setup;

pub use job::ReproduceJob;
pub use run::run;
pub use scenes::Choice;
