//! Both sides of the C ABI: the scene that a renderer lends ([`HostScene`]), the functions that it
//! calls ([`exports`]), Mitsuba embedded in this process ([`session`]), and a scene in Rust served as C would
//! serve it ([`loopback`]).
//!
//! The only module with `unsafe` code.
#![allow(unsafe_code)]

pub mod abi;
mod exports;
pub mod loopback;
mod scene;
pub mod session;

pub use scene::HostScene;
