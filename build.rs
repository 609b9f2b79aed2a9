//! Finds (or fetches) the pinned Mitsuba, compiles the C++ shim against it and says how to link.

#[path = "build/sdk.rs"]
mod sdk;
#[path = "build/shim.rs"]
mod shim;

use std::path::PathBuf;

/// Why the build cannot go on, and what the user can do about it.
struct Failure {
    cause: String,
    mend: String,
}

impl Failure {
    fn new(cause: impl Into<String>, mend: impl Into<String>) -> Self {
        Failure { cause: cause.into(), mend: mend.into() }
    }
}

fn main() {
    if let Err(failure) = run() {
        // Cargo prints nothing but these lines: no dump of the script's output, no backtrace.
        println!("cargo::error={}", failure.cause.replace('\n', " "));
        println!("cargo::error=to mend this: {}", failure.mend.replace('\n', " "));
    }
}

fn run() -> Result<(), Failure> {
    require_supported_target()?;
    shim::require_cpp17()?;
    let sdk = sdk::locate()?;
    shim::compile(&sdk)?;
    sdk.emit_link_directives();
    println!("cargo::rustc-env=VPT_MITSUBA_DIR={}", sdk.mitsuba().display());
    println!("cargo::rustc-env=VPT_MITSUBA_VERSION={}", sdk::pinned_version("mitsuba"));
    Ok(())
}

/// Mitsuba's wheels exist for few systems, and only this one has been tried.
fn require_supported_target() -> Result<(), Failure> {
    let part = |name: &str| cargo_env(&format!("CARGO_CFG_TARGET_{name}"));
    let target = (part("ARCH"), part("OS"), part("ENV"));
    if (target.0.as_str(), target.1.as_str(), target.2.as_str()) == ("x86_64", "linux", "gnu") {
        return Ok(());
    }
    Err(Failure::new(
        format!("vpt cannot be built for {}", cargo_env("TARGET")),
        "build for x86_64-unknown-linux-gnu, the system that the plugin supports",
    ))
}

/// A variable that Cargo sets for every build script.
fn cargo_env(name: &str) -> String {
    std::env::var(name).unwrap_or_else(|_| panic!("{name} is not set: run this through cargo"))
}

fn out_dir() -> PathBuf {
    PathBuf::from(cargo_env("OUT_DIR"))
}
