//! Compiles `cpp/*.cpp` into a static library.

use crate::sdk::Sdk;
use crate::Failure;
use std::path::PathBuf;
use std::process::Output;

const LIBRARY: &str = "vpt_shim";

/// What C++17 compilers of old fail at: the library's part of the standard, not the grammar.
const PROBE: &str = "#include <charconv>\n\
                     #include <memory_resource>\n\
                     #include <optional>\n\
                     #include <string_view>\n\
                     static_assert(__cplusplus >= 201703L);\n\
                     template <typename T> int f(T t) { if constexpr (sizeof(T) > 4) return t.x; return 0; }\n\
                     int main() { return f(std::optional<char>().value_or('a')); }\n";

/// Asks for a working C++17 compiler before anything is fetched.
pub fn require_cpp17() -> Result<(), Failure> {
    let mend = "install g++ 9 or newer, or Clang 10 or newer (Debian: `apt-get install g++`), or \
                name one in the environment variable CXX";
    let probe = crate::out_dir().join("cpp17.cpp");
    std::fs::write(&probe, PROBE).map_err(|e| {
        Failure::new(
            format!("{} cannot be written: {e}", probe.display()),
            "make room in the target folder and let it be written to",
        )
    })?;
    let compiler = builder()
        .cargo_warnings(false)
        .try_get_compiler()
        .map_err(|e| Failure::new(format!("no C++ compiler was found: {e}"), mend))?;
    let name = compiler.path().display().to_string();
    let Output { status, stderr, .. } =
        compiler.to_command().arg("-fsyntax-only").arg(&probe).output().map_err(|e| {
            Failure::new(format!("the C++ compiler `{name}` cannot be run: {e}"), mend)
        })?;
    if status.success() {
        return Ok(());
    }
    let stderr = String::from_utf8_lossy(&stderr);
    let first = stderr.lines().find(|line| line.contains("error")).unwrap_or("it said nothing");
    Err(Failure::new(format!("the C++ compiler `{name}` is not up to C++17: {first}"), mend))
}

pub fn compile(sdk: &Sdk) -> Result<(), Failure> {
    for input in ["cpp", "include"] {
        println!("cargo::rerun-if-changed={input}");
    }
    if is_clippy() {
        return Ok(());
    }
    let mut build = builder();
    for folder in sdk.include_dirs() {
        // Third parties' headers must not drown our own warnings.
        build.flag("-isystem").flag(folder);
    }
    // Their messages name the header that they come from: not by a folder of this machine.
    build.flag(format!("-ffile-prefix-map={}/=", sdk.root.display()));
    // cc has shown the compiler's messages and the command by then.
    build.files(sources()?).try_compile(LIBRARY).map_err(|_| {
        Failure::new(
            format!("the C++ shim did not compile against Mitsuba in {}", sdk.root.display()),
            "read the compiler's messages above",
        )
    })
}

/// Clippy keeps build results of its own, and links nothing: it need not wait for the C++ compiler.
fn is_clippy() -> bool {
    std::env::var("RUSTC_WORKSPACE_WRAPPER").is_ok_and(|wrapper| wrapper.ends_with("clippy-driver"))
}

/// Flags that decide class layouts are those of the wheel; the profile's do not matter.
fn builder() -> cc::Build {
    let mut build = cc::Build::new();
    build
        .cpp(true)
        .std("c++17")
        .opt_level(2)
        .inherit_rustflags(false)
        .debug(false)
        .extra_warnings(true)
        // Dr.Jit aligns its arrays otherwise with plain SSE2; from SSE 4.2 up they agree with the
        // wheel's, whatever machine this is.
        .flag("-msse4.2")
        .flag("-fno-strict-aliasing")
        // The wheel keeps GCC's default visibility: with hidden types, its templates are not found.
        .flag("-fvisibility=default")
        .define("NDEBUG", None)
        .define("MI_ENABLE_EMBREE", "1")
        .define("MI_ENABLE_CUDA", "1")
        .define("MI_ENABLE_LLVM", "1")
        .include("cpp/include")
        .include("include");
    build
}

/// All of `cpp/*.cpp`, the same on every machine.
fn sources() -> Result<Vec<PathBuf>, Failure> {
    let unreadable =
        |e| Failure::new(format!("the folder cpp cannot be read: {e}"), "restore the sources");
    let mut files: Vec<PathBuf> = std::fs::read_dir("cpp")
        .map_err(unreadable)?
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| path.extension().is_some_and(|extension| extension == "cpp"))
        .collect();
    files.sort();
    Ok(files)
}
