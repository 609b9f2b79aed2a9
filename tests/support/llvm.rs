//! The libLLVM that Dr.Jit shall load.

use std::env;
use std::fs;
use std::path::PathBuf;

/// What DRJIT_LIBLLVM_PATH names, or the newest installed. Dr.Jit 1.5 emits `llvm.minimum`, which LLVM
/// lowers for x86 since version 17; older ones abort the process.
pub fn find_llvm() -> Result<PathBuf, String> {
    const OLDEST: u32 = 17;
    if let Some(path) = env::var_os("DRJIT_LIBLLVM_PATH").map(PathBuf::from) {
        let reason = format!("DRJIT_LIBLLVM_PATH={} does not exist", path.display());
        return path.exists().then_some(path).ok_or(reason);
    }
    let folders = [
        "/usr/lib/x86_64-linux-gnu",
        "/usr/lib/aarch64-linux-gnu",
        "/usr/lib64",
        "/usr/lib",
        "/usr/local/lib",
    ];
    let files = folders.iter().filter_map(|folder| fs::read_dir(folder).ok()).flatten().flatten();
    let libraries =
        files.filter_map(|file| Some((llvm_version(file.file_name().to_str()?)?, file.path())));
    match libraries.max() {
        Some((version, path)) if version >= OLDEST => Ok(path),
        Some((version, path)) => {
            Err(format!("{} is LLVM {version}, Dr.Jit needs {OLDEST}", path.display()))
        }
        None => Err(format!("no libLLVM in {}", folders.join(", "))),
    }
}

/// As [`find_llvm`]; None, and a line that says why, where a test has to be skipped. With VPT_REQUIRE_LLVM=1 that is a failure.
pub fn llvm_or_skip(test: &str) -> Option<PathBuf> {
    let reason = match find_llvm() {
        Ok(path) => return Some(path),
        Err(reason) => reason,
    };
    let is_required = env::var_os("VPT_REQUIRE_LLVM").is_some_and(|value| value == "1");
    assert!(!is_required, "VPT_REQUIRE_LLVM=1, but {reason}");
    println!("skipped {test}: {reason}");
    None
}

/// The major version in `libLLVM-15.so.1` or `libLLVM.so.19.1`.
fn llvm_version(file_name: &str) -> Option<u32> {
    let rest = file_name.strip_prefix("libLLVM")?;
    let rest = rest.strip_prefix('-').or(rest.strip_prefix(".so."))?;
    rest.split('.').next()?.parse().ok()
}

#[test]
fn llvm_versions_from_file_names() {
    let names = [
        "libLLVM-15.so.1",
        "libLLVM.so.19.1",
        "libLLVM-19.so",
        "libLLVM.so",
        "libLLVMTableGen.so.19",
    ];
    assert_eq!(names.map(llvm_version), [Some(15), Some(19), Some(19), None, None]);
}
