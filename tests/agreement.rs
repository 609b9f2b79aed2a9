//! `vpt` against references that Mitsuba's own path tracers rendered, scene by scene.
//!
//! Each scene in `tests/agreement/scenes` is rendered from several independent seeds by the binary,
//! and judged against `tests/agreement/references` (see `make_references.py`) by the tests of
//! `support/stats.rs`:
//!
//! - the mean of the image may be off by 0.5 %, that of a block of 8 x 8 pixels by 2 %, per colour
//!   channel. These bounds are for what the radii of the density estimate do; they hold for the
//!   bias, and the noise of both sides comes on top;
//! - all tests of one table together raise a false alarm with a probability of 0.001 at most, half
//!   of it for the images and half for the blocks, which are many more (Bonferroni's correction
//!   within each half: it holds for dependent tests too, as blocks under the same photons are);
//! - a scene that passes must have been able to fail: where a bias of 2 % of the image, or 8 % of
//!   the median block, could hide in the noise, the test fails too.
//!
//! A scene that fails leaves expected, actual and difference in
//! `target/agreement/<scene>/<variant>`. `VPT_AGREEMENT_ONLY=name,name` narrows the long table
//! down, `VPT_AGREEMENT_VARIANT` renders it in another variant.

use std::collections::BTreeSet;
use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

#[path = "support/image.rs"]
mod image;
#[path = "support/llvm.rs"]
mod llvm;
#[path = "support/stats.rs"]
mod stats;

use image::Image;
use llvm::find_llvm;
use stats::{Comparison, Reference, Verdict, BLOCK};

const IMAGE_BOUND: f64 = 0.005;
const BLOCK_BOUND: f64 = 0.02;
const FALSE_ALARM: f64 = 1e-3;
const DETECTABLE_IMAGE_BIAS: f64 = 0.02;
const DETECTABLE_BLOCK_BIAS: f64 = 0.08;

const FAST_SEEDS: usize = 16;
const LONG_SEEDS: usize = 16;

/// How a scene is rendered: `passes` passes of `photons` emitted walks each, starting with these
/// radii in scene units.
struct Case {
    scene: &'static str,
    passes: u32,
    photons: u32,
    surface_radius: f32,
    medium_radius: f32,
}

const fn case(
    scene: &'static str,
    passes: u32,
    photons: u32,
    surface_radius: f32,
    medium_radius: f32,
) -> Case {
    Case { scene, passes, photons, surface_radius, medium_radius }
}

/// The scenes are about two units wide; the radii are 1.2 % and 1.5 % of that.
const TABLE: [Case; 27] = [
    case("albedo_grid", 8, 400_000, 0.024, 0.03),
    case("ball_rayleigh", 8, 100_000, 0.024, 0.03),
    case("beam", 8, 100_000, 0.024, 0.03),
    case("blend_point", 8, 800_000, 0.024, 0.03),
    case("box_constant", 8, 450_000, 0.024, 0.03),
    case("box_directional", 8, 320_000, 0.024, 0.03),
    case("cloud_in_fog", 8, 100_000, 0.024, 0.03),
    case("extinction_box", 8, 280_000, 0.024, 0.03),
    case("extinction_room", 8, 100_000, 0.024, 0.03),
    case("fibres_sggx", 8, 320_000, 0.024, 0.03),
    case("fog_room", 8, 100_000, 0.024, 0.03),
    case("fog_sunsky", 8, 360_000, 0.024, 0.03),
    case("fog_unbounded", 8, 100_000, 0.024, 0.03),
    case("glass_ball", 8, 1_000_000, 0.024, 0.03),
    case("glass_in_fog", 8, 100_000, 0.024, 0.03),
    case("glossy_constant", 8, 1_400_000, 0.024, 0.03),
    case("hidden_lamp", 8, 100_000, 0.024, 0.03),
    case("instances_sunsky", 8, 800_000, 0.024, 0.03),
    case("lamp_in_ball", 8, 100_000, 0.024, 0.03),
    case("layers_envmap", 8, 1_050_000, 0.024, 0.03),
    case("projector_crop", 8, 660_000, 0.024, 0.03),
    case("projector_smoke", 8, 100_000, 0.024, 0.03),
    case("room_diffuse", 8, 100_000, 0.024, 0.03),
    case("rough_glass_box", 8, 5_000_000, 0.024, 0.03),
    case("single_scatter", 8, 340_000, 0.024, 0.03),
    case("smoke_spot", 8, 200_000, 0.024, 0.03),
    case("textures_point_spot", 8, 1_250_000, 0.024, 0.03),
];

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

#[test]
fn fast_scenes_agree_in_scalar_rgb() {
    judge(&cases(|scene| FAST.contains(&scene)), "scalar_rgb", None, FAST_SEEDS);
}

#[test]
fn fast_scenes_agree_in_llvm_ad_rgb() {
    match find_llvm() {
        Ok(llvm) => judge(
            &cases(|scene| FAST_LLVM.contains(&scene)),
            "llvm_ad_rgb",
            Some(&llvm),
            FAST_SEEDS,
        ),
        Err(reason) => {
            assert!(
                env::var_os("VPT_REQUIRE_LLVM").is_none_or(|v| v != "1"),
                "VPT_REQUIRE_LLVM=1, but {reason}"
            );
            println!("skipped fast_scenes_agree_in_llvm_ad_rgb: {reason}");
        }
    }
}

#[test]
#[ignore = "long: just agreement"]
fn every_scene_agrees() {
    let variant = env::var("VPT_AGREEMENT_VARIANT").unwrap_or("scalar_rgb".into());
    let only = env::var("VPT_AGREEMENT_ONLY").ok();
    let llvm = variant.starts_with("llvm").then(|| find_llvm().unwrap());
    let chosen =
        cases(|scene| only.as_ref().is_none_or(|names| names.split(',').any(|name| name == scene)));
    judge(&chosen, &variant, llvm.as_deref(), LONG_SEEDS);
}

/// Neither a scene without a case, nor a reference without a scene: what is not in the table is not
/// tested.
#[test]
fn scenes_references_and_cases_are_the_same_set() {
    let table: BTreeSet<String> = TABLE.iter().map(|case| case.scene.to_string()).collect();
    assert_eq!(table, file_stems("scenes", "xml"));
    assert_eq!(table, file_stems("references", "exr"));
    assert!(FAST.iter().chain(&FAST_LLVM).all(|scene| table.contains(*scene)));
}

/// The references are precise enough for the bounds: one standard error is at most 0.1 % for the
/// image and 0.5 % for each block. Compared with copies of itself, which have no variance, a
/// reference shows its own error.
#[test]
fn references_are_precise() {
    for case in &TABLE {
        let reference = read_reference(case.scene).unwrap();
        let verdict =
            Verdict::new(&[reference.mean.clone(), reference.mean.clone()], &reference, 0.0, 0.0);
        let worst = |list: &[Comparison]| list.iter().map(|c| c.error).fold(0.0, f64::max);
        let (image, block) = (worst(&verdict.image), worst(&verdict.blocks));
        assert!(image <= 0.001 && block <= 0.005, "{}: image {image}, block {block}", case.scene);
    }
}

/// The levels at which one test rejects, such that the whole table keeps `FALSE_ALARM`.
struct Levels {
    image: f64,
    block: f64,
}

/// Render and judge `cases` and print the table; panic with all that is wrong.
fn judge(cases: &[&Case], variant: &str, llvm: Option<&Path>, seeds: usize) {
    assert!(!cases.is_empty(), "no such scene");
    let levels = Levels {
        image: 0.5 * FALSE_ALARM / (3 * cases.len()) as f64,
        block: 0.5 * FALSE_ALARM / (3 * 64 * cases.len()) as f64,
    };
    println!(
        "\n{variant}, {seeds} seeds\n{:20} {:>7} {:>7} {:>7} {:>6} | {:>8} {:>6} {:>6} | {:>7}",
        "scene", "mean", "dev %", "z", "sees %", "block %", "z", "sees %", "seconds"
    );
    let judged = cases.iter().map(|case| (case, judge_scene(case, variant, llvm, seeds, &levels)));
    let failures: Vec<String> = judged
        .filter_map(|(case, result)| Some(format!("{}: {}", case.scene, result.err()?)))
        .collect();
    assert!(failures.is_empty(), "\n{}", failures.join("\n"));
}

fn judge_scene(
    case: &Case,
    variant: &str,
    llvm: Option<&Path>,
    seeds: usize,
    levels: &Levels,
) -> Result<(), String> {
    let start = Instant::now();
    let folder = output_folder(case.scene, variant);
    let reference = read_reference(case.scene)?;
    let runs = render_runs(case, variant, llvm, seeds, &folder)?;
    let size = |image: &Image| (image.width, image.height);
    if let Some(run) = runs.iter().find(|run| size(run) != size(&reference.mean)) {
        return Err(format!("the size of the image is {:?}", size(run)));
    }
    let verdict = Verdict::new(&runs, &reference, IMAGE_BOUND, BLOCK_BOUND);
    print_row(case.scene, &verdict, levels, start.elapsed().as_secs_f64());

    let faults = faults(&verdict, levels, reference.mean.width / BLOCK);
    if faults.is_empty() {
        return fs::remove_dir_all(&folder).map_err(|e| e.to_string());
    }
    write_evidence(&folder, &runs, &reference.mean)?;
    Err(format!("{}, see {}", faults.join("; "), folder.display()))
}

/// The least believable colour of the image and the least believable block, each with its z-score
/// and with the bias that the noise would let one see.
fn print_row(scene: &str, verdict: &Verdict, levels: &Levels, seconds: f64) {
    let image = Verdict::worst(&verdict.image);
    let block = Verdict::worst(&verdict.blocks);
    println!(
        "{scene:20} {:7.4} {:7.2} {:7.1} {:6.2} | {:8.2} {:6.1} {:6.1} | {seconds:7.1}",
        image.ratio,
        100.0 * image.deviation,
        image.z(),
        100.0 * verdict.detectable_in_image(levels.image),
        100.0 * block.deviation,
        block.z(),
        100.0 * verdict.detectable_in_median_block(levels.block),
    );
}

fn faults(verdict: &Verdict, levels: &Levels, columns: usize) -> Vec<String> {
    let mut faults = Vec::new();
    if verdict.image.iter().any(|c| c.rejected(levels.image)) {
        let worst = Verdict::worst(&verdict.image);
        faults.push(format!("the mean is off by {:.2} %", 100.0 * worst.deviation));
    }
    let places: BTreeSet<(usize, usize)> = (0..verdict.blocks.len())
        .filter(|&i| verdict.blocks[i].rejected(levels.block))
        .map(|i| (i / 3 % columns, i / 3 / columns))
        .collect();
    if !places.is_empty() {
        let worst = 100.0 * Verdict::worst(&verdict.blocks).deviation;
        faults.push(format!("blocks (column, row) {places:?} are off, the worst by {worst:.1} %"));
    }
    let sharp = verdict.detectable_in_image(levels.image) <= DETECTABLE_IMAGE_BIAS
        && verdict.detectable_in_median_block(levels.block) <= DETECTABLE_BLOCK_BIAS;
    if !sharp {
        faults.push("too noisy to judge: it takes more photons or seeds".into());
    }
    faults
}

fn render_runs(
    case: &Case,
    variant: &str,
    llvm: Option<&Path>,
    seeds: usize,
    folder: &Path,
) -> Result<Vec<Image>, String> {
    if folder.exists() {
        fs::remove_dir_all(folder).map_err(|e| e.to_string())?;
    }
    fs::create_dir_all(folder).map_err(|e| e.to_string())?;
    (0..seeds).map(|seed| render_extrapolated(case, variant, llvm, seed, folder)).collect()
}

/// Twice the picture of the case's radii minus that of twice the radii, from the same photons. Near
/// the edges of surfaces and media the kernel reaches over them, and what it misses grows with the
/// radius `R`: `I(R) = I(0) + a R + O(R²)`, so `2 I(R) - I(2R) = I(0) + O(R²)`.
fn render_extrapolated(
    case: &Case,
    variant: &str,
    llvm: Option<&Path>,
    seed: usize,
    folder: &Path,
) -> Result<Image, String> {
    let picture = |scale: f32| {
        let out = folder.join(format!("seed-{seed}-radius-{scale}.exr"));
        render(case, scale, variant, llvm, seed, &out)
    };
    let (narrow, wide) = (picture(1.0)?, picture(2.0)?);
    Ok(Image::from_fn(narrow.width, narrow.height, |x, y| {
        let pixel = y * narrow.width + x;
        [0, 1, 2].map(|c| 2.0 * narrow.pixels[pixel][c] - wide.pixels[pixel][c])
    }))
}

fn render(
    case: &Case,
    radius_scale: f32,
    variant: &str,
    llvm: Option<&Path>,
    seed: usize,
    out: &Path,
) -> Result<Image, String> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_vpt"));
    command.arg("render").arg(agreement_folder("scenes").join(format!("{}.xml", case.scene)));
    command.args(["--variant", variant]).args(["--passes", &case.passes.to_string()]);
    command.args(["--seed", &seed.to_string()]).arg("-o").arg(out);
    command.args(["--set", &format!("photons={}", case.photons)]);
    command.args(["--set", &format!("surface_radius={}", radius_scale * case.surface_radius)]);
    command.args(["--set", &format!("medium_radius={}", radius_scale * case.medium_radius)]);
    if let Some(llvm) = llvm {
        command.env("DRJIT_LIBLLVM_PATH", llvm);
    }
    let output = command.output().map_err(|e| e.to_string())?;
    if !output.status.success() {
        return Err(format!(
            "seed {seed}: {}\n{}",
            output.status,
            String::from_utf8_lossy(&output.stderr)
        ));
    }
    Image::read_exr(out, "")
}

fn read_reference(scene: &str) -> Result<Reference, String> {
    let folder = agreement_folder("references");
    let path = folder.join(format!("{scene}.exr"));
    let index = fs::read_to_string(folder.join("references.json")).map_err(|e| e.to_string())?;
    let index: serde_json::Value = serde_json::from_str(&index).map_err(|e| e.to_string())?;
    let seeds =
        index[scene]["seeds"].as_f64().ok_or(format!("references.json does not know {scene}"))?;
    Ok(Reference {
        mean: Image::read_exr(&path, "")?,
        variance: Image::read_exr(&path, "var.")?,
        freedom: seeds - 1.0,
    })
}

/// Expected, actual and difference, as EXR with the values and as PNG to look at. In the PNG of the
/// difference grey is none, black and white are a fifth of the white of the other two.
fn write_evidence(folder: &Path, runs: &[Image], expected: &Image) -> Result<(), String> {
    let each = |pixel: &dyn Fn(usize, usize) -> f32| {
        Image::from_fn(expected.width, expected.height, |x, y| {
            [0, 1, 2].map(|c| pixel(y * expected.width + x, c))
        })
    };
    let actual =
        each(&|i, c| runs.iter().map(|run| run.pixels[i][c]).sum::<f32>() / runs.len() as f32);
    let difference = each(&|i, c| actual.pixels[i][c] - expected.pixels[i][c]);
    let white = 3.0 * expected.mean().into_iter().fold(0.0, f64::max) as f32;
    let shown_difference = each(&|i, c| 0.5 * white + 2.5 * difference.pixels[i][c]);
    expected.write_exr(&folder.join("expected.exr"))?;
    actual.write_exr(&folder.join("actual.exr"))?;
    difference.write_exr(&folder.join("difference.exr"))?;
    expected.write_png(&folder.join("expected.png"), white)?;
    actual.write_png(&folder.join("actual.png"), white)?;
    shown_difference.write_png(&folder.join("difference.png"), white)
}

fn cases(wanted: impl Fn(&str) -> bool) -> Vec<&'static Case> {
    const CASES: &[Case] = &TABLE;
    CASES.iter().filter(|case| wanted(case.scene)).collect()
}

fn agreement_folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/agreement").join(name)
}

/// `target/agreement/<scene>/<variant>`, wherever `target` is.
fn output_folder(scene: &str, variant: &str) -> PathBuf {
    let target =
        Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("target/tmp lies in target");
    target.join("agreement").join(scene).join(variant)
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
