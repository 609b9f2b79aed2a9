//! Peak memory of whole renders against photons per pass, for every method. Where photons are discarded as
//! soon as they are splatted, the row must be flat; where they are kept in maps, it grows. Then the bytes that each receiver
//! takes between passes. Prints tables; measures nothing else.

use std::path::Path;
use std::process::Command;
use vpt::method::Method;

const PHOTONS: [u64; 4] = [10_000, 100_000, 1_000_000, 10_000_000];
/// Photons per pass that methods other than `ppt` are asked for at most, for their time's sake.
const MOST_BUT_PPT: u64 = 1_000_000;

/// What a render of one pass tells of itself.
fn statistics(method: Method, photons: u64, folder: &Path) -> serde_json::Value {
    let stats = folder.join("stats.json");
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/mitsuba_scenes/cornell_fog/scene.xml");
    let status = Command::new(env!("CARGO_BIN_EXE_vpt"))
        .args(["render", scene, "-q", "--passes", "1", "--method", method.name()])
        .args(["--set", &format!("photons={photons}")])
        .args(["--set", "surface_radius=0.01", "--set", "medium_radius=0.001"])
        .arg("-o")
        .arg(folder.join("picture.exr"))
        .arg("--stats")
        .arg(&stats)
        .status()
        .expect("run vpt");
    assert!(status.success(), "vpt failed with {} and {photons} photons", method.name());
    let text = std::fs::read_to_string(stats).expect("read the statistics");
    serde_json::from_str(&text).expect("parse the statistics")
}

fn peak_memory(method: Method, photons: u64, folder: &Path) -> u64 {
    let statistics = statistics(method, photons, folder);
    statistics["peak_memory_bytes"].as_u64().expect("peak memory is reported on Linux")
}

fn print_receivers(folder: &Path) {
    println!("{:>12}  {:>10}  {:>13}", "bytes per", "view beam", "visible point");
    for method in Method::ALL {
        let memory = &statistics(method, PHOTONS[0], folder)["memory"];
        let bytes = |per: &str| memory[per].as_f64().expect("the scene has beams and points");
        let (beam, point) = (bytes("bytes_per_view_beam"), bytes("bytes_per_visible_point"));
        println!("{:>12}  {beam:>10.1}  {point:>13.1}", method.name());
    }
}

fn main() {
    // `cargo test --benches` asks benches to run as tests; this one is for `cargo bench` alone.
    if !std::env::args().any(|argument| argument == "--bench") {
        return;
    }
    let folder = tempfile::tempdir().expect("make a temporary folder");
    print!("{:>12}", "MiB");
    PHOTONS.iter().for_each(|photons| print!("  {photons:>10}"));
    println!("  last / first");
    for method in Method::ALL {
        print!("{:>12}", method.name());
        let affordable = PHOTONS.iter().filter(|&&n| method == Method::Ppt || n <= MOST_BUT_PPT);
        let peaks: Vec<f64> = affordable
            .map(|&photons| peak_memory(method, photons, folder.path()) as f64)
            .inspect(|peak| print!("  {:>10.1}", peak / f64::from(1 << 20)))
            .collect();
        let blank = "  ".len() + 10;
        let missing = (PHOTONS.len() - peaks.len()) * blank;
        println!("{:missing$}  {:>12.3}", "", peaks[peaks.len() - 1] / peaks[0]);
    }
    print_receivers(folder.path());
}
