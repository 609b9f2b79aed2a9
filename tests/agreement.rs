//! `vpt` against references that Mitsuba's own path tracers rendered, scene by scene and method by
//! method.
//!
//! Each scene in `tests/agreement/scenes` is rendered from many independent seeds and judged
//! against `tests/agreement/references` (see `make_references.py`) by the tests of
//! `support/stats.rs`:
//!
//! - the mean of the image may be off by 0.5 %, that of a block of 8 x 8 pixels by 2 %, per colour
//!   channel. These bounds are for what the radii of the density estimate do; they hold for the
//!   bias, and the noise of both sides comes on top;
//! - all tests of one run together raise a false alarm with a probability of 0.001 at most, half
//!   of it for the images and half for the blocks, which are many more (Bonferroni's correction
//!   within each half: it holds for dependent tests too, as blocks under the same photons are);
//! - a scene that passes must have been able to fail: where a bias of 2 % of the image, or 8 % of
//!   the median block, could hide in the noise, the test fails too (3.5 and 16 % for the methods
//!   that share all but the photons' weights with `ppt`).
//!
//! The long table ends with a matrix of scenes and methods, which it also writes to
//! `target/agreement/table.md` (`table-<variant>.md` in other variants than scalar_rgb). A scene
//! that fails leaves expected, actual and difference in
//! `target/agreement/<scene>/<method>/<variant>`.
//!
//! Spectral and mono variants have references of their own, of some scenes (`references/spectral`, `references/mono`).
//!
//! `VPT_AGREEMENT_ONLY=scene,scene` and `VPT_AGREEMENT_METHODS=method,method` narrow the long table
//! down, `VPT_AGREEMENT_VARIANT` renders it in another variant.

use std::collections::BTreeSet;
use std::env;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

#[path = "agreement/cases.rs"]
mod cases;
#[path = "support/image.rs"]
mod image;
#[path = "agreement/judge.rs"]
mod judge;
#[path = "support/llvm.rs"]
mod llvm;
#[path = "agreement/pictures.rs"]
mod pictures;
#[path = "support/stats.rs"]
mod stats;

use cases::{Case, Method, METHODS, TABLE};
use judge::judge;
use llvm::{find_llvm, llvm_or_skip};

/// Surfaces alone, an emitter in a ball of fog, a null-BSDF box under a delta lamp, an opaque phase
/// function, a grid of smoke, a hidden lamp.
const FAST: [&str; 6] = [
    "room_diffuse",
    "lamp_in_ball",
    "box_directional",
    "ball_rayleigh",
    "smoke_spot",
    "hidden_lamp",
];
const FAST_LLVM: [&str; 2] = ["ball_rayleigh", "room_diffuse"];
/// `ppt` on all of them, with connections and as it is by default on two, `ppbt` as it is by default on two, the other methods on one; in
/// other variants `ppt` as it is by default.
const FAST_METHODS: [&str; 1] = ["ppt"];
const FAST_METHODS_OF_VARIANTS: [&str; 1] = ["ppt_fast"];
const FAST_CONNECTIONS_SCENES: [&str; 2] = ["smoke_spot", "room_diffuse"];
const FAST_GLOSSY_SCENES: [&str; 1] = ["glossy_lamps"];
const FAST_BEAMS_SCENES: [&str; 2] = ["ball_rayleigh", "lamp_in_ball"];
const FAST_OTHERS: [&str; 5] = ["ppbt", "ppt_metro", "ppbt_metro", "apa", "ppb"];
const FAST_OTHERS_SCENE: [&str; 1] = ["ball_rayleigh"];

#[test]
fn fast_scenes_agree_in_scalar_rgb() {
    let table = judge("scalar_rgb", &cases(&FAST), &methods(&FAST_METHODS));
    assert!(table.faults().is_empty(), "\n{}", table.faults().join("\n"));
}

#[test]
fn other_methods_agree_in_scalar_rgb() {
    let table = judge("scalar_rgb", &cases(&FAST_OTHERS_SCENE), &methods(&FAST_OTHERS));
    assert!(table.faults().is_empty(), "\n{}", table.faults().join("\n"));
}

#[test]
fn connections_agree_in_scalar_rgb() {
    let table = judge(
        "scalar_rgb",
        &cases(&FAST_CONNECTIONS_SCENES),
        &methods(&["ppt_connections", "ppt_fast"]),
    );
    assert!(table.faults().is_empty(), "\n{}", table.faults().join("\n"));
}

/// Rays follow sharp lobes there, and lamps are small or without extent.
#[test]
fn glossy_surfaces_agree_as_they_are_by_default_in_scalar_rgb() {
    let table = judge("scalar_rgb", &cases(&FAST_GLOSSY_SCENES), &methods(&["ppt_fast"]));
    assert!(table.faults().is_empty(), "\n{}", table.faults().join("\n"));
}

#[test]
fn photon_beams_agree_as_they_are_by_default_in_scalar_rgb() {
    let table = judge("scalar_rgb", &cases(&FAST_BEAMS_SCENES), &methods(&["ppbt_fast"]));
    assert!(table.faults().is_empty(), "\n{}", table.faults().join("\n"));
}

/// A method without a column is not tested.
#[test]
fn every_method_is_in_the_table() {
    let names: BTreeSet<&str> = METHODS.iter().map(|method| method.method).collect();
    assert_eq!(names, vpt::method::Method::ALL.map(vpt::method::Method::name).into());
}

#[test]
fn fast_scenes_agree_in_llvm_ad_rgb() {
    fast_scenes_in_llvm("llvm_ad_rgb", &FAST_LLVM);
}

#[test]
fn fast_scenes_agree_in_llvm_ad_mono() {
    fast_scenes_in_llvm("llvm_ad_mono", &FAST_MONO);
}

#[test]
fn fast_scenes_agree_in_llvm_ad_spectral() {
    fast_scenes_in_llvm("llvm_ad_spectral", &FAST_LLVM_SPECTRAL);
}

fn fast_scenes_in_llvm(variant: &str, scenes: &[&str]) {
    let Some(llvm) = llvm_or_skip(variant) else { return };
    long_table_in_another_process(&[
        ("VPT_AGREEMENT_VARIANT", OsStr::new(variant)),
        ("VPT_AGREEMENT_ONLY", OsStr::new(&scenes.join(","))),
        ("VPT_AGREEMENT_METHODS", OsStr::new(&FAST_METHODS_OF_VARIANTS.join(","))),
        ("DRJIT_LIBLLVM_PATH", llvm.as_os_str()),
    ]);
}

#[test]
#[ignore = "long: just agreement"]
fn every_scene_agrees() {
    let variant = env::var("VPT_AGREEMENT_VARIANT").unwrap_or("scalar_rgb".into());
    if variant.starts_with("llvm") && env::var_os("DRJIT_LIBLLVM_PATH").is_none() {
        let llvm = find_llvm().unwrap();
        return long_table_in_another_process(&[("DRJIT_LIBLLVM_PATH", llvm.as_os_str())]);
    }
    let all = |names: Vec<&'static str>| names.join(",");
    let only = env::var("VPT_AGREEMENT_ONLY")
        .unwrap_or_else(|_| Vec::from_iter(reference_scenes(&variant)).join(","));
    let chosen = env::var("VPT_AGREEMENT_METHODS")
        .unwrap_or_else(|_| all(METHODS.iter().map(|method| method.name).collect()));
    let split = |names: &'static str| -> Vec<&'static str> { names.split(',').collect() };
    let (only, chosen) = (split(only.leak()), split(chosen.leak()));

    let table = judge(&variant, &cases(&only), &methods(&chosen));
    let suffix = if variant == "scalar_rgb" { String::new() } else { format!("-{variant}") };
    let file = output_folder().join(format!("table{suffix}.md"));
    println!("\n{}", table.markdown());
    fs::write(&file, table.markdown()).unwrap();
    assert!(table.faults().is_empty(), "\n{}", table.faults().join("\n"));
}

/// Neither a scene without a case, nor a reference without a scene: what is not in the table is not
/// tested.
#[test]
fn scenes_references_and_cases_are_the_same_set() {
    let table: BTreeSet<String> = TABLE.iter().map(|case| case.scene.to_string()).collect();
    assert_eq!(table, file_stems("scenes", "xml"));
    assert_eq!(table, reference_scenes("scalar_rgb"));
    for variant in ["scalar_spectral", "llvm_ad_mono"] {
        assert!(reference_scenes(variant).is_subset(&table));
    }
}

/// Coloured fog under a panel, textures under a point and a spot; what other lamps emit at given wavelengths, `tests/spectral.rs`
/// has fast.
const FAST_LLVM_SPECTRAL: [&str; 1] = ["extinction_box"];
const FAST_MONO: [&str; 1] = ["extinction_box"];
const FAST_SPECTRAL: [&str; 2] = ["extinction_box", "textures_point_spot"];

#[test]
fn fast_scenes_agree_in_scalar_spectral() {
    long_table_in_another_process(&[
        ("VPT_AGREEMENT_VARIANT", OsStr::new("scalar_spectral")),
        ("VPT_AGREEMENT_ONLY", OsStr::new(&FAST_SPECTRAL.join(","))),
        ("VPT_AGREEMENT_METHODS", OsStr::new(&FAST_METHODS_OF_VARIANTS.join(","))),
    ]);
}

/// The scenes that a variant is judged by.
fn reference_scenes(variant: &str) -> BTreeSet<String> {
    file_stems(reference_folder(variant), "exr")
}

/// What Mitsuba's own path tracers rendered in variants of the same kind.
fn reference_folder(variant: &str) -> &'static str {
    match variant {
        _ if variant.ends_with("spectral") => "references/spectral",
        _ if variant.ends_with("mono") => "references/mono",
        _ => "references",
    }
}

/// `every_scene_agrees` with these variables: Mitsuba has one variant per process, and takes its
/// LLVM from the environment.
fn long_table_in_another_process(variables: &[(&str, &OsStr)]) {
    let output = Command::new(env::current_exe().unwrap())
        .args(["every_scene_agrees", "--exact", "--ignored", "--nocapture"])
        .envs(variables.iter().copied())
        .output()
        .unwrap();
    let [printed, errors] = [output.stdout, output.stderr].map(|b| String::from_utf8(b).unwrap());
    println!("{printed}");
    assert!(output.status.success(), "{}\n{errors}", output.status);
    assert!(printed.contains("1 passed"), "no test ran:\n{errors}");
}

fn cases(scenes: &[&str]) -> Vec<&'static Case> {
    static CASES: &[Case] = &TABLE;
    let find = |scene: &&str| CASES.iter().find(|case| case.scene == *scene);
    scenes.iter().map(|scene| find(scene).unwrap_or_else(|| panic!("no scene {scene}"))).collect()
}

fn methods(names: &[&str]) -> Vec<&'static Method> {
    static ALL: &[Method] = &METHODS;
    let find = |name: &&str| ALL.iter().find(|method| method.name == *name);
    names.iter().map(|name| find(name).unwrap_or_else(|| panic!("no method {name}"))).collect()
}

fn agreement_folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/agreement").join(name)
}

/// `target/agreement`, wherever `target` is.
fn output_folder() -> PathBuf {
    let target =
        Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("target/tmp lies in target");
    target.join("agreement")
}

/// The names of the files in `folder` with this extension, without it and without the twins
/// `*.reference.xml`.
fn file_stems(folder: &str, extension: &str) -> BTreeSet<String> {
    let suffix = format!(".{extension}");
    let files =
        fs::read_dir(agreement_folder(folder)).unwrap().map(|file| file.unwrap().file_name());
    let stems = files.filter_map(|name| Some(name.to_str()?.strip_suffix(&suffix)?.to_string()));
    stems.filter(|stem| !stem.ends_with(".reference")).collect()
}
