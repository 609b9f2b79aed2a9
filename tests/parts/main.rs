//! Parts of pictures: passes that are rendered apart add up to what one render gives, and renders survive whatever ends them.

mod desk;
mod engine;
mod merge;
mod survive;
