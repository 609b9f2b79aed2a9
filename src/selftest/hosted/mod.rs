//! Scenes in Mitsuba, by theme.

mod films;
mod glass;
mod grids;
mod lamps;
mod media;
mod meshes;

use super::case::Case;

pub fn cases() -> Vec<Case> {
    [media::CASES, glass::CASES, meshes::CASES, lamps::CASES, grids::CASES, films::CASES].concat()
}
