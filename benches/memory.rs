//! Peak memory of whole renders against photons per pass: photons are discarded as soon as they are
//! splatted, so the column must be flat. Prints a table; measures nothing else.

use std::path::Path;
use std::process::Command;

const PHOTONS: [u64; 4] = [10_000, 100_000, 1_000_000, 10_000_000];

fn peak_memory(photons: u64, folder: &Path) -> u64 {
    let stats = folder.join("stats.json");
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/mitsuba_scenes/cornell_fog/scene.xml");
    let status = Command::new(env!("CARGO_BIN_EXE_vpt"))
        .args(["render", scene, "-q", "--passes", "1"])
        .args(["--set", &format!("photons={photons}")])
        .args(["--set", "surface_radius=0.02", "--set", "medium_radius=0.02"])
        .arg("-o")
        .arg(folder.join("picture.exr"))
        .arg("--stats")
        .arg(&stats)
        .status()
        .expect("run vpt");
    assert!(status.success(), "vpt failed with {photons} photons");
    let text = std::fs::read_to_string(stats).expect("read the statistics");
    let json: serde_json::Value = serde_json::from_str(&text).expect("parse the statistics");
    json["peak_memory_bytes"].as_u64().expect("peak memory is reported on Linux")
}

fn main() {
    // `cargo test --benches` asks benches to run as tests; this one is for `cargo bench` alone.
    if !std::env::args().any(|argument| argument == "--bench") {
        return;
    }
    let folder = tempfile::tempdir().expect("make a temporary folder");
    println!("{:>12}  {:>14}  {:>8}", "photons", "peak MiB", "ratio");
    let first = peak_memory(PHOTONS[0], folder.path());
    for photons in PHOTONS {
        let peak = peak_memory(photons, folder.path());
        println!(
            "{photons:>12}  {:>14.1}  {:>8.3}",
            peak as f64 / f64::from(1 << 20),
            peak as f64 / first as f64
        );
    }
}
