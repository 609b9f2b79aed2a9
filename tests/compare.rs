//! `vpt compare` as its user meets it: a short comparison with all its files, an interrupted one, and refusals.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use serde_json::Value;

#[allow(dead_code)]
#[path = "support/image.rs"]
mod image;

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
    assert_eq!(results["summary"].as_array().unwrap().len(), 2);
    for method in results["methods"].as_array().unwrap() {
        assert_eq!(method["runs"].as_array().unwrap().len(), 2);
        for run in method["runs"].as_array().unwrap() {
            // The bias of the radii falls more slowly than noise.
            check_run(run, if method["ours"] == true { 0.95 } else { 0.5 });
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

fn reference_is_kept(folder: &Path, words: &str) {
    let output = compare(folder, &format!("{words} --seeds 1"));
    assert!(said(&output).contains("taking the reference from"), "{}", said(&output));
}

#[test]
fn interrupted_comparison_keeps_what_it_measured() {
    let folder = tempfile::tempdir().unwrap();
    let reference = folder.path().join("reference.exr");
    let size = 64;
    exr::prelude::write_rgb_file(&reference, size, size, |_, _| (0.5f32, 0.5f32, 0.5f32)).unwrap();
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
