//! Both sides of the C ABI: the scene that a renderer lends ([`HostScene`]), the functions that it
//! calls (`exports`), Mitsuba embedded in this process ([`session`]), and a scene in Rust served as C would
//! serve it ([`loopback`]).
//!
//! The only module with `unsafe` code.
#![allow(unsafe_code)]

pub mod abi;
mod crew;
mod exports;
pub mod loopback;
mod scene;
pub mod session;

pub use scene::HostScene;

/// Ends the process at once with an exit code. A thread that was given up may still work in Mitsuba, which an orderly end
/// would take down around it.
pub fn leave_at_once(exit_code: u8) -> ! {
    unsafe extern "C" {
        fn _exit(status: std::ffi::c_int) -> !;
    }
    // SAFETY: POSIX's function; it takes any number and touches nothing of this process.
    unsafe { _exit(exit_code.into()) }
}
