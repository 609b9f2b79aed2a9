//! The folder that a comparison fills: checked before the work, made and written after it.

use anyhow::Context;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use vpt::report::csv;
use vpt::report::display::png;
use vpt::report::html::{self, Pictures};
use vpt::report::plot::Chart;
use vpt::report::results::{Comparison, Metric};
use vpt::report::summary::summarize;

/// A folder that can be written.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
}

/// Why a folder cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    #[error("\"{}\" is no folder; name another, or move that file away", .0.display())]
    IsFile(PathBuf),
    #[error("the folder \"{}\" does not exist; make it first", .0.display())]
    NoParent(PathBuf),
    #[error("the folder \"{}\" is not writable; name another", .folder.display())]
    NotWritable { folder: PathBuf, source: io::Error },
}

impl Folder {
    /// Checks that the folder can be made or filled, without touching it.
    pub fn check(path: PathBuf) -> Result<Self, FolderError> {
        if path.exists() && !path.is_dir() {
            return Err(FolderError::IsFile(path));
        }
        let existing = if path.is_dir() { path.as_path() } else { parent(&path) };
        if !existing.is_dir() {
            return Err(FolderError::NoParent(existing.to_owned()));
        }
        match tempfile::tempfile_in(existing) {
            Ok(_) => Ok(Folder { path }),
            Err(source) => Err(FolderError::NotWritable { folder: existing.to_owned(), source }),
        }
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Makes the folder, if need be, and one inside it.
    pub fn make(&self) -> anyhow::Result<()> {
        let images = self.path.join("images");
        fs::create_dir_all(&images).with_context(|| format!("cannot make \"{}\"", images.display()))
    }

    /// Writes the report and everything that belongs to it.
    pub fn fill(&self, comparison: &Comparison, pictures: &Pictures) -> anyhow::Result<()> {
        self.write("results.json", json(comparison)?.as_bytes())?;
        let mut table = Vec::new();
        csv::write(comparison, &mut table)?;
        self.write("results.csv", &table)?;
        for metric in Metric::ALL {
            let chart = Chart::new(comparison, metric);
            self.write(&format!("{}.svg", metric.name()), chart.svg()?.as_bytes())?;
            self.write(&format!("{}.png", metric.name()), &png(&chart.png()?))?;
        }
        pictures.reference.write_exr(&self.path.join("images/reference.exr"))?;
        for (method, picture) in comparison.methods.iter().zip(&pictures.methods) {
            if let Some(picture) = picture {
                picture.write_exr(&self.path.join(format!("images/{}.exr", method.name)))?;
            }
        }
        self.write("report.html", html::report(comparison, pictures)?.as_bytes())
    }

    fn write(&self, name: &str, bytes: &[u8]) -> anyhow::Result<()> {
        let path = self.path.join(name);
        fs::write(&path, bytes).with_context(|| format!("cannot write \"{}\"", path.display()))
    }
}

/// What was measured, and what it comes to under `summary`.
fn json(comparison: &Comparison) -> anyhow::Result<String> {
    let mut value = serde_json::to_value(comparison)?;
    value["summary"] = serde_json::to_value(summarize(comparison))?;
    Ok(serde_json::to_string_pretty(&value)? + "\n")
}

fn parent(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}
