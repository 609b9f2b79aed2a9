//! The folder that a comparison fills: checked before the work, written while it goes on and after it. Every file is
//! written aside and renamed, so that whoever looks, and whoever goes on later, sees whole files.

use crate::cli::target::Target;
use anyhow::Context;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use vpt::report::csv;
use vpt::report::display::png;
use vpt::report::html::{self, Pictures};
use vpt::report::picture::Picture;
use vpt::report::plot::Chart;
use vpt::report::results::{Comparison, Metric};
use vpt::report::summary::summarize;

/// Everything that was measured.
const RESULTS: &str = "results.json";

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

    /// What an earlier comparison left here; None where there is nothing that can be read.
    pub fn load(&self) -> Option<Comparison> {
        let text = fs::read_to_string(self.path.join(RESULTS)).ok()?;
        serde_json::from_str(&text).ok()
    }

    /// Writes what was measured so far.
    pub fn save(&self, comparison: &Comparison) -> anyhow::Result<()> {
        self.write(RESULTS, json(comparison)?.as_bytes())
    }

    /// Writes a picture; its name is relative to the folder.
    pub fn save_picture(&self, name: &str, picture: &Picture) -> anyhow::Result<()> {
        let path = self.path.join(name);
        fs::create_dir_all(parent(&path))
            .with_context(|| format!("cannot make \"{}\"", parent(&path).display()))?;
        Target::check(path)?.replace(|aside| Ok(picture.write_exr(aside)?))
    }

    /// Removes the pictures that an earlier run of a method left.
    pub fn forget_pictures(&self, method: &str, seed: u32) -> anyhow::Result<()> {
        let folder = self.path.join("images").join(method);
        let Ok(files) = fs::read_dir(&folder) else { return Ok(()) };
        let (one, many) = (format!("seed{seed}.exr"), format!("seed{seed}-"));
        for file in files {
            let path = file?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            if name == one || (name.starts_with(&many) && name.ends_with(".exr")) {
                fs::remove_file(&path)
                    .with_context(|| format!("cannot remove \"{}\"", path.display()))?;
            }
        }
        Ok(())
    }

    /// Writes the report and everything that belongs to it.
    pub fn fill(&self, comparison: &Comparison, pictures: &Pictures) -> anyhow::Result<()> {
        self.save(comparison)?;
        let mut table = Vec::new();
        csv::write(comparison, &mut table)?;
        self.write("results.csv", &table)?;
        for metric in Metric::ALL {
            let chart = Chart::new(comparison, metric);
            self.write(&format!("{}.svg", metric.name()), chart.svg()?.as_bytes())?;
            self.write(&format!("{}.png", metric.name()), &png(&chart.png()?))?;
        }
        self.save_picture("images/reference.exr", &pictures.reference)?;
        for (method, picture) in comparison.methods.iter().zip(&pictures.methods) {
            if let Some(picture) = picture {
                self.save_picture(&format!("images/{}.exr", method.name), picture)?;
            }
        }
        self.write("report.html", html::report(comparison, pictures)?.as_bytes())
    }

    fn write(&self, name: &str, bytes: &[u8]) -> anyhow::Result<()> {
        Target::check(self.path.join(name))?.replace(|aside| Ok(fs::write(aside, bytes)?))
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
