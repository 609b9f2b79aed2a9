//! Where Mitsuba's headers and libraries come from: a folder that the user names, the Mitsuba that
//! python3 imports, or the pinned wheels, fetched once into Cargo's target folder.

use crate::Failure;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::SystemTime;

/// The pinned packages and the hashes of their wheels, as pip reads them.
const LOCK: &str = include_str!("../mitsuba.lock");

/// Prints the folder that python3 imports Mitsuba from, without importing it. The working folder
/// is no place to import from.
const FIND_MITSUBA: &str = "\
import sys, os, importlib.util
sys.path = [folder for folder in sys.path if folder]
spec = importlib.util.find_spec('mitsuba')
if spec and spec.origin: print(os.path.dirname(os.path.dirname(spec.origin)))";

const LIBRARIES: [(&str, &str); 4] = [
    ("mitsuba", "mitsuba"),
    ("drjit", "drjit-core"),
    ("drjit", "drjit-extra"),
    ("drjit", "nanothread"),
];

pub struct Sdk {
    /// Holds the folders `mitsuba` and `drjit`, side by side as their libraries expect it.
    pub root: PathBuf,
    /// Holds the folder `nanobind`; usually the same.
    nanobind: PathBuf,
}

/// The version that `mitsuba.lock` pins a package to.
pub fn pinned_version(package: &str) -> &'static str {
    requirement(package)
        .split(['=', ' '])
        .find(|word| word.starts_with(|c: char| c.is_ascii_digit()))
        .expect("mitsuba.lock pins with ==")
}

pub fn locate() -> Result<Sdk, Failure> {
    println!("cargo::rerun-if-env-changed=MITSUBA_SDK");
    let root = match std::env::var_os("MITSUBA_SDK").filter(|path| !path.is_empty()) {
        Some(path) => named(Path::new(&path))?,
        None => match importable() {
            Some(root) => root,
            None => fetch("mitsuba-sdk", &["mitsuba", "drjit", "nanobind"])?,
        },
    };
    println!("cargo::rerun-if-changed={}", header(&root, "mitsuba").display());
    let nanobind = match version(&root, "nanobind") {
        Some(found) if found == pinned_version("nanobind") => root.clone(),
        _ => fetch("nanobind", &["nanobind"])?,
    };
    Ok(Sdk { root, nanobind })
}

impl Sdk {
    pub fn mitsuba(&self) -> PathBuf {
        self.root.join("mitsuba")
    }

    pub fn include_dirs(&self) -> [PathBuf; 4] {
        [
            self.root.join("mitsuba/include"),
            self.root.join("drjit/include"),
            self.nanobind.join("nanobind/include"),
            self.nanobind.join("nanobind/ext/robin_map/include"),
        ]
    }

    /// The plugin meets libraries that are loaded already and known by name; programs of our own
    /// find them where they were linked.
    pub fn emit_link_directives(&self) {
        for package in ["mitsuba", "drjit"] {
            let folder = self.root.join(package);
            println!("cargo::rustc-link-search=native={}", folder.display());
            println!("cargo::rustc-link-arg=-Wl,-rpath,{}", folder.display());
        }
        for (_, library) in LIBRARIES {
            println!("cargo::rustc-link-lib=dylib={library}");
        }
    }
}

/// The folder that the user named, if it is of use.
fn named(path: &Path) -> Result<PathBuf, Failure> {
    let mend = format!(
        "let MITSUBA_SDK name the site-packages folder into which `pip install mitsuba=={}` went, \
         or unset it to have that version found or fetched",
        pinned_version("mitsuba")
    );
    let root = path.canonicalize().map_err(|e| {
        Failure::new(format!("MITSUBA_SDK names {}: {e}", path.display()), mend.clone())
    })?;
    check(&root).map_err(|cause| Failure::new(format!("MITSUBA_SDK: {cause}"), mend))?;
    Ok(root)
}

/// The site-packages folder of python3's own Mitsuba, if there is one and it is of use.
fn importable() -> Option<PathBuf> {
    let output = Command::new("python3").args(["-c", FIND_MITSUBA]).output().ok()?;
    let found = String::from_utf8(output.stdout).ok()?;
    let root = Path::new(found.trim_end()).canonicalize().ok()?;
    match check(&root) {
        Ok(()) => Some(root),
        Err(cause) => {
            println!("cargo::warning=python3's Mitsuba is passed over: {cause}");
            None
        }
    }
}

/// Tells what a would-be SDK lacks.
fn check(root: &Path) -> Result<(), String> {
    for package in ["mitsuba", "drjit"] {
        let wanted = pinned_version(package);
        match version(root, package) {
            Some(found) if found == wanted => {}
            Some(found) => {
                let root = root.display();
                return Err(format!("{root} holds {package} {found}, but {wanted} is needed"));
            }
            None => return Err(format!("{} is missing", header(root, package).display())),
        }
    }
    for (package, library) in LIBRARIES {
        let path = root.join(package).join(format!("lib{library}.so"));
        if !path.exists() {
            return Err(format!("{} is missing", path.display()));
        }
    }
    Ok(())
}

/// The header that states a package's version.
fn header(root: &Path, package: &str) -> PathBuf {
    root.join(match package {
        "mitsuba" => "mitsuba/include/mitsuba/mitsuba.h",
        "drjit" => "drjit/include/drjit/fwd.h",
        _ => "nanobind/include/nanobind/nanobind.h",
    })
}

/// Reads `#define <PREFIX>_VERSION_MAJOR 3` and so on.
fn version(root: &Path, package: &str) -> Option<String> {
    let text = fs::read_to_string(header(root, package)).ok()?;
    let prefix = match package {
        "mitsuba" => "MI",
        "drjit" => "DRJIT",
        _ => "NB",
    };
    let part = |name: &str| {
        let define = format!("#define {prefix}_VERSION_{name} ");
        text.lines().find_map(|line| line.strip_prefix(&define)).map(str::trim)
    };
    Some(format!("{}.{}.{}", part("MAJOR")?, part("MINOR")?, part("PATCH")?))
}

/// One package's lines of `mitsuba.lock`.
fn requirement(package: &str) -> &'static str {
    let start = LOCK.find(&format!("{package}==")).expect("mitsuba.lock pins this package");
    let rest = &LOCK[start..];
    rest.split_once("\n\n").map_or(rest, |(lines, _)| lines)
}

/// A folder in Cargo's target folder with packages that pip installed, fetched unless it is there.
/// It appears at once and complete, so that builds of several profiles may run side by side.
fn fetch(name: &str, packages: &[&str]) -> Result<PathBuf, Failure> {
    let folder = target_dir().join(format!("{name}-{}", pinned_version(packages[0])));
    let lock = packages.iter().map(|p| requirement(p)).collect::<Vec<_>>().join("\n\n");
    let is_complete =
        || fs::read_to_string(folder.join("mitsuba.lock")).is_ok_and(|stamp| stamp == lock);
    if is_complete() {
        return Ok(folder);
    }
    let partial = crate::out_dir().join(name);
    let unwritable = |e: std::io::Error| {
        Failure::new(
            format!("the fetched wheels cannot be put into {}: {e}", folder.display()),
            "make room there and let it be written to",
        )
    };
    let _ = fs::remove_dir_all(&partial);
    fs::create_dir_all(&partial).map_err(unwritable)?;
    let stamp = partial.join("mitsuba.lock");
    fs::write(&stamp, &lock).map_err(unwritable)?;
    pip_install(&stamp, &partial, packages)?;
    if packages.contains(&"mitsuba") {
        make_older_than_this_build(&header(&partial, "mitsuba")).map_err(unwritable)?;
    }
    if fs::rename(&partial, &folder).is_err() {
        // Another build was faster, or the folder dates from another mitsuba.lock.
        if is_complete() {
            let _ = fs::remove_dir_all(&partial);
        } else {
            fs::remove_dir_all(&folder).map_err(unwritable)?;
            fs::rename(&partial, &folder).map_err(unwritable)?;
        }
    }
    Ok(folder)
}

/// Cargo would run this script once more for a file that is younger than its own start.
fn make_older_than_this_build(path: &Path) -> std::io::Result<()> {
    fs::File::options().write(true).open(path)?.set_modified(SystemTime::UNIX_EPOCH)
}

fn pip_install(requirements: &Path, folder: &Path, packages: &[&str]) -> Result<(), Failure> {
    let wanted: Vec<String> =
        packages.iter().map(|package| format!("{package}=={}", pinned_version(package))).collect();
    let wanted = wanted.join(" ");
    let instead = format!(", or let MITSUBA_SDK name a site-packages folder that holds {wanted}");
    let failure = |cause: &str, mend: &str| {
        Failure::new(format!("{wanted} cannot be fetched: {cause}"), format!("{mend}{instead}"))
    };
    let output = Command::new("python3")
        .args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--no-input"])
        .args(["--no-deps", "--require-hashes", "--only-binary=:all:", "--no-compile"])
        .arg("--requirement")
        .arg(requirements)
        .arg("--target")
        .arg(folder)
        // A user's settings for packages of his own do not go with --target.
        .env("PIP_USER", "0")
        .env("PIP_REQUIRE_VIRTUALENV", "0")
        .output()
        .map_err(|e| {
            let mend = "install Python with pip (Debian: `apt-get install python3-pip`)";
            failure(&format!("python3 cannot be run: {e}"), mend)
        })?;
    if output.status.success() {
        return Ok(());
    }
    let said = String::from_utf8_lossy(&output.stderr);
    let says = |words: &str| said.contains(words);
    Err(if says("No module named pip") {
        failure("python3 has no pip", "install it (Debian: `apt-get install python3-pip`)")
    } else if says("DO NOT MATCH THE HASHES") {
        failure(
            "pip was served other files than mitsuba.lock names",
            "let pip use an index that serves PyPI's own files",
        )
    } else if says("connection broken") || says("Max retries") || says("ConnectionError") {
        failure("pip reaches no package index", "connect to the network")
    } else if says("No matching distribution") {
        failure(
            "there is no wheel for this python3, or its pip is too old to see it",
            "let python3 be Python 3.9 to 3.14 with a pip of 2021 or newer",
        )
    } else {
        let last = said.lines().rfind(|line| !line.trim().is_empty()).unwrap_or("it said nothing");
        failure(&format!("pip failed: {last}"), "mend what pip complains about")
    })
}

/// Cargo's target folder, of which it tells a build script only
/// `<target folder>/[<triple>/]<profile>/build/<package>/out`.
fn target_dir() -> PathBuf {
    let out = crate::out_dir();
    let Some(build) = out.ancestors().find(|folder| folder.ends_with("build")) else {
        return out;
    };
    let triple = crate::cargo_env("TARGET");
    let above_profile = build.ancestors().nth(2).unwrap_or(&out);
    match above_profile.parent() {
        Some(above_triple) if above_profile.ends_with(&triple) => above_triple.to_owned(),
        _ => above_profile.to_owned(),
    }
}
