//! Where Dr.Jit keeps the kernels that it compiles: in the user's folder they would last, and a method's preparation would
//! seem cheaper than it is to whoever renders for the first time.

use anyhow::{Context, Result};
use tempfile::TempDir;

/// The variable of the environment that names Dr.Jit's folder.
pub const VARIABLE: &str = "DRJIT_CACHE_DIR";

/// An empty folder, which goes when dropped.
pub fn empty_folder() -> Result<TempDir> {
    tempfile::tempdir().context("cannot make a folder for compiled kernels")
}
