//! `vpt compare` as its user meets it: a short comparison with all its files, interrupted ones that go on, contestants in
//! another variant, references by either side, and refusals.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

#[allow(dead_code)]
#[path = "support/image.rs"]
mod image;

#[path = "support/llvm.rs"]
mod llvm;

use image::Image;

fn scene() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/agreement/scenes/ball_rayleigh.xml")
}

fn command(folder: &Path, words: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_vpt"));
    command.arg("compare").arg(scene()).args(words).current_dir(folder).stdin(Stdio::null());
    command
}

fn compare(folder: &Path, words: &str) -> Output {
    command(folder, &words.split(' ').collect::<Vec<_>>()).output().unwrap()
}

fn results(folder: &Path) -> Value {
    serde_json::from_str(&fs::read_to_string(folder.join("out/results.json")).unwrap()).unwrap()
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn short_comparison_leaves_a_report_and_its_errors_fall() {
    let folder = tempfile::tempdir().unwrap();
    let words = "--methods ppt,volpath --time 1.5 --reference-time 3 --set photons=10000 -o out";
    let output = compare(folder.path(), words);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let table = String::from_utf8(output.stdout.clone()).unwrap();
    assert!(table.contains("volpath") && table.ends_with("wrote \"out/report.html\"\n"), "{table}");
    for file in ["report.html", "results.csv", "rmse.svg", "relative_mse.png", "flip.svg"] {
        assert!(folder.path().join("out").join(file).metadata().unwrap().len() > 500, "{file}");
    }
    for image in ["reference", "ppt", "volpath"] {
        assert!(folder.path().join(format!("out/images/{image}.exr")).is_file(), "{image}");
    }
    let results = results(folder.path());
    assert_eq!(results["interrupted"], false);
    assert!(results["reference"]["noise"]["rmse"].as_f64().unwrap() > 0.0);
    let origin = results["reference"]["origin"].as_str().unwrap();
    assert!(origin.contains("chosen by a trial, in which volpath had a noise of"), "{origin}");
    assert_eq!(results["summary"].as_array().unwrap().len(), 2);
    for method in results["methods"].as_array().unwrap() {
        assert_eq!(method["runs"].as_array().unwrap().len(), 2);
        for run in method["runs"].as_array().unwrap() {
            // The bias of the radii falls more slowly than noise.
            check_run(run, if method["ours"] == true { 0.95 } else { 0.5 });
            check_images(&folder.path().join("out"), run);
        }
    }
    picture_is_that_of_a_render(folder.path(), &results);
    reference_is_kept(folder.path(), words);
}

/// A picture taken between two passes, in the midst of a jitter or not, is what `vpt render` makes of as many.
fn picture_is_that_of_a_render(folder: &Path, results: &Value) {
    let passes = results["methods"][0]["runs"][0]["work"].to_string();
    let mut render = Command::new(env!("CARGO_BIN_EXE_vpt"));
    render.arg("render").arg(scene()).current_dir(folder).args(["-q", "-o", "same.exr"]);
    let options = ["--method", "ppt", "--set", "photons=10000", "--passes", &passes];
    assert!(render.args(options).status().unwrap().success());
    let read = |name: &str| Image::read_exr(&folder.join(name), "").unwrap().pixels;
    let (ours, same) = (read("out/images/ppt.exr"), read("same.exr"));
    for (a, b) in ours.iter().flatten().zip(same.iter().flatten()) {
        assert!((a - b).abs() <= 1e-5 * b.abs().max(1e-3), "{a} {b} after {passes} passes");
    }
}

/// Time grows and the error falls, over the whole run, to less than the given share.
fn check_run(run: &Value, share: f64) {
    let snapshots = run["snapshots"].as_array().unwrap();
    let of = |index: usize, field: &str| snapshots[index][field].as_f64().unwrap();
    let last = snapshots.len() - 1;
    assert!(last >= 3, "{run}");
    assert!((1..=last).all(|i| of(i, "seconds") > of(i - 1, "seconds")));
    assert!(of(last, "seconds") >= 1.5);
    assert!(of(last, "rmse") < share * of(0, "rmse"), "{run}");
    assert!((0.0..=1.0).contains(&of(last, "flip")));
}

/// Every picture of the first seed is kept, of others the last.
fn check_images(folder: &Path, run: &Value) {
    let snapshots = run["snapshots"].as_array().unwrap();
    for (index, snapshot) in snapshots.iter().enumerate() {
        let kept = run["seed"] == 0 || index + 1 == snapshots.len();
        assert_eq!(snapshot["image"].is_string(), kept, "{snapshot}");
        if let Some(image) = snapshot["image"].as_str() {
            assert!(folder.join(image).is_file(), "{image}");
        }
    }
}

fn reference_is_kept(folder: &Path, words: &str) {
    let output = compare(folder, &format!("{words} --seeds 1"));
    assert!(said(&output).contains("taking the reference from"), "{}", said(&output));
}

/// A folder with a grey picture of the scene's size.
fn folder_with_reference() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let reference = folder.path().join("reference.exr");
    exr::prelude::write_rgb_file(&reference, 64, 64, |_, _| (0.5f32, 0.5f32, 0.5f32)).unwrap();
    folder
}

/// Waits until the results on disk are as wanted, which must be before the comparison is over.
fn wait_for(folder: &Path, child: &mut Child, wanted: impl Fn(&Value) -> bool) {
    let start = Instant::now();
    loop {
        if folder.join("out/results.json").is_file() && wanted(&results(folder)) {
            return;
        }
        assert!(child.try_wait().unwrap().is_none(), "it is over already");
        assert!(start.elapsed() < Duration::from_secs(120), "it was never as wanted");
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn complete_runs(results: &Value) -> usize {
    let methods = results["methods"].as_array().unwrap().iter();
    let runs = methods.flat_map(|method| method["runs"].as_array().unwrap());
    runs.filter(|run| run["complete"] == true).count()
}

#[test]
fn killed_comparison_goes_on_with_the_runs_that_were_not_complete() {
    let folder = folder_with_reference();
    let words =
        "--methods ppt,volpath --time 3 --set photons=1000 -o out --reference reference.exr";
    let list: Vec<_> = words.split(' ').collect();
    let mut child = command(folder.path(), &list).stderr(Stdio::null()).spawn().unwrap();
    wait_for(folder.path(), &mut child, |results| {
        complete_runs(results) == 2 && results["methods"][0]["runs"][1]["snapshots"][1].is_object()
    });
    child.kill().unwrap();
    child.wait().unwrap();
    let killed = results(folder.path());
    assert_eq!(killed["interrupted"], true);

    let output = compare(folder.path(), &words.replace("--time 3", "--time 4 --sensor 0"));
    let message = said(&output);
    assert_eq!(output.status.code(), Some(2), "{message}");
    for part in ["\"out\" holds an interrupted comparison", "--time was 3, is 4;", "--restart"] {
        assert!(message.contains(part), "no {part:?} in: {message}");
    }
    assert_eq!(results(folder.path()), killed);

    let output = compare(folder.path(), words);
    let message = said(&output);
    assert_eq!(output.status.code(), Some(0), "{message}");
    assert!(message.contains("2 of 4 runs are complete"), "{message}");
    let finished = results(folder.path());
    assert_eq!(finished["interrupted"], false);
    assert_eq!(complete_runs(&finished), 4);
    for method in 0..2 {
        let run = |results: &Value, seed: usize| results["methods"][method]["runs"][seed].clone();
        assert_eq!(run(&finished, 0), run(&killed, 0));
        assert_ne!(run(&finished, 1), run(&killed, 1));
        for seed in 0..2 {
            check_images(&folder.path().join("out"), &run(&finished, seed));
        }
    }
    let html = fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    assert!(html.contains("was interrupted and went on") && html.contains("<svg"));
}

#[test]
fn contestants_in_another_variant_render_the_same_picture() {
    let Some(path) = llvm::llvm_or_skip("contestants in another variant") else { return };
    let folder = tempfile::tempdir().unwrap();
    let words = "--methods volpath,volpath@llvm_ad_rgb,ppt@llvm_ad_rgb --time 6 --seeds 1 -o out \
                 --reference-time 2 --reference-method volpath";
    let list: Vec<_> = words.split_whitespace().collect();
    let mut command = command(folder.path(), &list);
    let output = command.env("DRJIT_LIBLLVM_PATH", path).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let results = results(folder.path());
    let methods = results["methods"].as_array().unwrap();
    for (method, variant) in methods.iter().zip(["scalar_rgb", "llvm_ad_rgb", "llvm_ad_rgb"]) {
        assert_eq!(method["variant"], variant);
        let memory = method["runs"][0]["peak_memory_bytes"].as_u64().unwrap();
        assert!(variant == "scalar_rgb" || memory > 0, "{method}");
        let last = method["runs"][0]["snapshots"].as_array().unwrap().last().unwrap();
        // An empty or wrong picture has an error of about 1.
        assert!(last["relative_mse"].as_f64().unwrap().sqrt() < 0.3, "{method}");
    }
    // Compiling the kernels takes longer than the scalar variant's first sample.
    let first =
        |method: usize| methods[method]["runs"][0]["snapshots"][0]["seconds"].as_f64().unwrap();
    assert!(first(1) > first(0) + 0.1, "{} {}", first(0), first(1));
}

#[test]
fn contestants_with_parameters_of_their_own_render_with_them() {
    let folder = tempfile::tempdir().unwrap();
    let words = "--methods ppt+photons=2000,ppt+photons=100000 --time 1.5 --seeds 1 -o out --reference-time 1 --reference-method volpath";
    let output = compare(folder.path(), words);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let results = results(folder.path());
    let methods = results["methods"].as_array().unwrap();
    assert_eq!(methods[1]["name"], "ppt+photons=100000");
    let work = |method: usize| {
        let snapshots = methods[method]["runs"][0]["snapshots"].as_array().unwrap();
        snapshots.last().unwrap()["work"].as_u64().unwrap()
    };
    // Far more photons per pass make far fewer passes.
    assert!(work(0) > 3 * work(1), "{} {}", work(0), work(1));
}

#[test]
fn variant_that_cannot_start_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let words = ["--methods", "ppt,volpath@llvm_ad_rgb", "-o", "out"];
    let mut command = command(folder.path(), &words);
    let output = command.env("DRJIT_LIBLLVM_PATH", "/nowhere/libLLVM.so").output().unwrap();
    assert_eq!(output.status.code(), Some(2), "{}", said(&output));
    for part in ["volpath@llvm_ad_rgb", "LLVM shared library", "DRJIT_LIBLLVM_PATH"] {
        assert!(said(&output).contains(part), "no {part:?} in: {}", said(&output));
    }
    assert!(!folder.path().join("out").exists());
}

#[test]
fn reference_by_a_method_of_vpt_tells_its_bias_and_its_kin() {
    let folder = tempfile::tempdir().unwrap();
    let words =
        "--methods apa,volpath --time 1 --seeds 1 -o out --set photons=5000 --reference-time 3 \
                 --reference-method ppt";
    let list: Vec<_> = words.split_whitespace().collect();
    let output = command(folder.path(), &list).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    let results = results(folder.path());
    let reference = &results["reference"];
    assert_eq!(reference["estimator"], "ppt");
    assert!(reference["bias"].as_f64().unwrap() > 0.0, "{reference}");
    assert!(reference["noise"]["relative_mse"].as_f64().unwrap() > 0.0, "{reference}");
    assert_eq!(results["methods"][0]["shares_reference"], true);
    assert_eq!(results["methods"][1]["shares_reference"], false);
    let table = String::from_utf8(output.stdout).unwrap();
    assert!(table.contains("† apa: the reference was rendered by the same estimator"), "{table}");
}

#[test]
fn interrupted_comparison_keeps_what_it_measured() {
    let folder = folder_with_reference();
    let words = "--methods ppt,volpath,ptracer --time 600 --set photons=1000 -o out --reference";
    let mut words: Vec<_> = words.split(' ').collect();
    words.push("reference.exr");
    let mut command = command(folder.path(), &words);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    std::thread::sleep(Duration::from_secs(6));
    let kill = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(kill.success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    assert!(said(&output).contains("stopped by Ctrl-C"), "{}", said(&output));
    let results = results(folder.path());
    assert_eq!(results["interrupted"], true);
    assert!(results["methods"][2]["flaw"].as_str().unwrap().contains("media"));
    let html = fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    assert!(html.contains("was interrupted") && html.contains("its own noise is not known"));
}

#[test]
fn mistakes_are_refused_before_any_rendering() {
    let folder = tempfile::tempdir().unwrap();
    exr::prelude::write_rgb_file(folder.path().join("small.exr"), 4, 3, |_, _| (1f32, 1f32, 1f32))
        .unwrap();
    fs::write(folder.path().join("file"), "").unwrap();
    for (words, parts) in [
        ("--methods ppt,mlt", &["unknown method or integrator \"mlt\"", "volpath"][..]),
        ("--methods aov", &["\"aov\" cannot be compared", "leave it out"]),
        ("--methods diffuse", &["unknown method or integrator \"diffuse\""]),
        ("--methods vpt", &["unknown method or integrator \"vpt\"", "ppt_metro"]),
        ("--methods ppt,ppt", &["\"ppt\" twice"]),
        ("--methods ,", &["empty name"]),
        ("--methods ppt+photons", &["\"photons\"", "NAME=VALUE"]),
        ("--methods volpath+rr_depth=3", &["\"volpath\"", "only vpt's methods"]),
        ("--methods ppt,ppt+alpha=2", &["alpha is 2"]),
        ("--methods ppt,volpath@fast", &["unknown variant \"fast\"", "llvm_ad_rgb"]),
        ("--reference-method mlt", &["--reference-method", "\"mlt\"", "volpath"]),
        ("--time 0", &["--time is 0", "above 0"]),
        ("--seeds 0", &["--seeds"]),
        ("--reference small.exr", &["4 x 3", "64 x 64", "of that size"]),
        ("--reference none.exr", &["none.exr", "EXR"]),
        ("--set alpha=2", &["alpha is 2"]),
        ("--sensor 2", &["--sensor is 2"]),
        ("-o file", &["\"file\" is no folder"]),
        ("-o none/out", &["\"none\" does not exist"]),
    ] {
        let output = compare(folder.path(), words);
        let message = said(&output);
        assert_eq!(output.status.code(), Some(2), "{words}: {message}");
        assert!(!message.contains("comparing"), "{words}: {message}");
        for part in parts {
            assert!(message.contains(part), "{words}: no {part:?} in: {message}");
        }
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2, "{words}");
    }
}
