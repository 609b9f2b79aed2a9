//! A render that is watched in tev (https://github.com/Tom94/tev) as it goes on.

mod packet;
mod viewer;

pub use packet::ImageInfo;
pub use viewer::{Address, AddressError, Viewer};
