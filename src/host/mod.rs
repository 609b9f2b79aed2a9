//! Both sides of the C ABI: the scene that a renderer lends ([`HostScene`]), the functions that it
//! calls ([`exports`]), and Mitsuba embedded in this process ([`session`]).
//!
//! The only module with `unsafe` code.
#![allow(unsafe_code)]

pub mod abi;
mod exports;
mod scene;
pub mod session;

pub use scene::HostScene;
