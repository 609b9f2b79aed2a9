//! The C header is what cbindgen makes of the engine's C ABI, and C and C++ compilers accept it.

use std::path::Path;
use std::process::Command;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");
const HEADER: &str = "include/vpt.h";
/// What the engine exports; what it calls in turn, it takes from the shim and not from the header.
const SOURCES: [&str; 2] = ["src/host/abi.rs", "src/host/exports.rs"];

#[test]
fn header_is_up_to_date() {
    let mut generated = Vec::new();
    generate_header().write(&mut generated);
    let generated = String::from_utf8(generated).unwrap();
    let path = Path::new(ROOT).join(HEADER);
    if std::env::var_os("VPT_BLESS").is_some_and(|value| value == "1") {
        std::fs::write(&path, &generated).unwrap();
        return;
    }
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    let line = |text: &str, index| text.lines().nth(index).unwrap_or("(end of file)").to_owned();
    let differs = (0..generated.lines().count().max(committed.lines().count()))
        .find(|&index| line(&generated, index) != line(&committed, index));
    if let Some(index) = differs {
        panic!(
            "{HEADER} is not what {SOURCES:?} say, first in line {}:\n  committed: {}\n  generated: {}\n\
             renew it with `VPT_BLESS=1 cargo test --release --test abi_header`",
            index + 1,
            line(&committed, index),
            line(&generated, index),
        );
    }
}

#[test]
fn c11_accepts_header() {
    compile("CC", "cc", &["-std=c11", "-pedantic", "-x", "c"]);
}

#[test]
fn cpp17_accepts_header() {
    compile("CXX", "c++", &["-std=c++17", "-pedantic", "-x", "c++"]);
}

fn generate_header() -> cbindgen::Bindings {
    let config = cbindgen::Config::from_file(Path::new(ROOT).join("cbindgen.toml")).unwrap();
    SOURCES
        .iter()
        .fold(cbindgen::Builder::new().with_config(config), |builder, source| {
            builder.with_src(Path::new(ROOT).join(source))
        })
        .generate()
        .unwrap_or_else(|e| panic!("cbindgen cannot read {SOURCES:?}: {e}"))
}

fn compile(variable: &str, default: &str, flags: &[&str]) {
    let compiler = std::env::var(variable).unwrap_or_else(|_| default.to_owned());
    let output = Command::new(&compiler)
        .args(flags)
        .args(["-Wall", "-Wextra", "-Werror", "-fsyntax-only", "-Iinclude", "tests/abi/header.c"])
        .current_dir(ROOT)
        .output()
        .unwrap_or_else(|e| panic!("`{compiler}` cannot be run: {e}"));
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "`{compiler}` refuses {HEADER}:\n{said}");
}
