//! How much memory a method takes for each photon of a pass: two renders, one with several times the photons of the
//! other, each in a process of its own, so that nothing of one is left to the other.

use super::job::ReproduceJob;
use super::scenes::PaperScene;
use anyhow::{ensure, Context, Result};
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use vpt::method::Method;

/// The second render has so many times the photons of the first.
const TIMES: u64 = 8;
/// Memory varies little from seed to seed.
const SEEDS: u32 = 3;
/// Width and height of the pictures of a scene of the project: what photons take does not depend on them.
const SIDE: &str = "48";
/// Passes of each render: the second pass is planned by what the first one was like.
const PASSES: &str = "2";

/// The growth of one method's memory.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Growth {
    pub method: String,
    /// Walks per pass of the two renders.
    pub photons: [u64; 2],
    /// Bytes for each further walk per pass, one for each seed.
    pub bytes_per_photon: Vec<f64>,
}

/// A scene whose memory is measured.
pub struct Probe<'a> {
    pub job: &'a ReproduceJob,
    pub scene: PaperScene,
    pub file: &'a Path,
}

impl Probe<'_> {
    /// Measures all methods, until `stop` says so; leaves the measurements in the scene's folder.
    pub fn measure(&self, stop: impl Fn() -> bool) -> Result<()> {
        let mut all = Vec::new();
        for method in Method::ALL {
            let few = self.job.row(self.scene).per_pass.of(method);
            let photons = [few, TIMES * few];
            let mut bytes_per_photon = Vec::new();
            for seed in 0..SEEDS {
                if stop() {
                    return Ok(());
                }
                let [few, many] = photons.map(|count| self.memory(method, count, seed));
                let (Some(few), Some(many)) = (few?, many?) else { return Ok(()) };
                bytes_per_photon.push((many - few) / (photons[1] - photons[0]) as f64);
            }
            all.push(Growth { method: method.name().to_owned(), photons, bytes_per_photon });
        }
        let path = path(&self.job.folder(self.scene));
        fs::write(&path, serde_json::to_string_pretty(&all)? + "\n")
            .with_context(|| format!("cannot write \"{}\"", path.display()))
    }

    /// The most memory [bytes] that a render took on top of the scene; None where the system does not tell.
    fn memory(&self, method: Method, photons: u64, seed: u32) -> Result<Option<f64>> {
        let folder = tempfile::tempdir()?;
        let stats = folder.path().join("stats.json");
        let mut command = Command::new(std::env::current_exe()?);
        command.arg("render").arg(self.file).args(["--quiet", "--passes", PASSES]);
        command.args(["--method", method.name(), "--seed", &seed.to_string()]);
        command.args(["--set", &format!("photons={photons}")]);
        command.arg("-o").arg(folder.path().join("picture.exr")).arg("--stats").arg(&stats);
        for (name, value) in self.job.defines(self.scene) {
            let small = self.job.arguments.file.is_none() && ["resx", "resy"].contains(&&*name);
            let value = if small { SIDE } else { &value };
            command.args(["-D", &format!("{name}={value}")]);
        }
        if let Some(variant) = &self.job.arguments.variant {
            command.args(["--variant", variant]);
        }
        let output = command.stdin(Stdio::null()).output().context("cannot run this program")?;
        let said = String::from_utf8_lossy(&output.stderr);
        ensure!(
            output.status.success(),
            "the memory of {} cannot be measured: {said}",
            method.name()
        );
        let stats: serde_json::Value = serde_json::from_str(&fs::read_to_string(&stats)?)?;
        Ok(stats["render_memory_bytes"].as_f64())
    }
}

/// Where the measurements of a scene are.
fn path(folder: &Path) -> PathBuf {
    folder.join("memory.json")
}

/// The measurements that a scene's folder holds; none where it holds none.
pub fn read(folder: &Path) -> Vec<Growth> {
    let text = fs::read_to_string(path(folder)).ok();
    text.and_then(|text| serde_json::from_str(&text).ok()).unwrap_or_default()
}
