//! What a render keeps of itself while it runs: a part with the passes done, which is whole whenever the program ends.

use super::progress::Display;
use super::target::Target;
use anyhow::{Context, Result};
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use vpt::part::{Difference, Part, PartFileError, PartView, PassRanges};

/// Where and how often a render keeps what it has.
#[derive(Debug)]
pub struct Checkpoint {
    pub target: Target,
    pub every: Duration,
    /// Whether to go on where the file ends.
    pub resume: bool,
}

/// A checkpoint that a render cannot go on with.
#[derive(Debug, thiserror::Error)]
pub enum CheckpointError {
    #[error(transparent)]
    File(#[from] PartFileError),
    #[error(
        "the checkpoint \"{}\" is of another picture: {}; render that one, or name another checkpoint", .path.display(),
        told(.differences)
    )]
    OtherPicture { path: PathBuf, differences: Vec<Difference> },
    #[error(
        "the checkpoint \"{}\" holds the passes {held}, but those asked for begin at {first}; it must hold passes from there on",
        .path.display()
    )]
    OtherPasses { path: PathBuf, held: PassRanges, first: u32 },
    #[error(
        "the checkpoint \"{}\" holds {held} passes, more than the {asked} asked for; ask for as many with --passes, or name another \
         checkpoint",
        .path.display()
    )]
    TooManyPasses { path: PathBuf, held: u32, asked: u32 },
}

fn told(differences: &[Difference]) -> String {
    let one =
        |d: &Difference| format!("{} is {} there and {} here", d.what, d.values[0], d.values[1]);
    differences.iter().map(one).collect::<Vec<_>>().join("; ")
}

impl Checkpoint {
    pub fn path(&self) -> &Path {
        self.target.path()
    }

    /// What an earlier render left; none where it left nothing.
    pub fn read(&self) -> Result<Option<Part>, CheckpointError> {
        match self.resume && self.path().exists() {
            true => Ok(Some(Part::read(self.path())?)),
            false => Ok(None),
        }
    }

    /// Checks that the passes are the first of those asked for.
    pub fn check_passes(&self, part: &Part, first: u32, asked: u32) -> Result<(), CheckpointError> {
        let (path, held) = (self.path().to_owned(), part.passes.clone());
        match held.single() {
            Some(range) if range.start == first && held.count() > asked => {
                Err(CheckpointError::TooManyPasses { path, held: held.count(), asked })
            }
            Some(range) if range.start == first => Ok(()),
            None if held.is_empty() => Ok(()),
            _ => Err(CheckpointError::OtherPasses { path, held, first }),
        }
    }
}

/// Keeps a render's checkpoint up to date. What goes wrong with it is told once, and is no reason to stop.
pub struct Keeper<'a> {
    checkpoint: &'a Checkpoint,
    display: Display,
    /// When the last one was written, or tried.
    last: Instant,
    kept_passes: u32,
    is_failing: bool,
}

impl<'a> Keeper<'a> {
    /// Of a checkpoint that holds so many passes already.
    pub fn new(checkpoint: &'a Checkpoint, kept_passes: u32, display: Display) -> Self {
        Keeper { checkpoint, display, last: Instant::now(), kept_passes, is_failing: false }
    }

    /// Whether the time between checkpoints is over, and there is something new to keep.
    pub fn is_due(&self, passes: u32) -> bool {
        passes > self.kept_passes && self.last.elapsed() >= self.checkpoint.every
    }

    /// Writes the checkpoint, if it is behind.
    pub fn keep(&mut self, part: &PartView) {
        if part.gathered.passes <= self.kept_passes {
            return;
        }
        let path = self.checkpoint.path().display();
        match replace(self.checkpoint.path(), part) {
            Ok(()) => {
                self.kept_passes = part.gathered.passes;
                if std::mem::take(&mut self.is_failing) {
                    self.display.warn(&format!("note: the checkpoint \"{path}\" is written again"));
                }
            }
            Err(error) if !self.is_failing => {
                self.is_failing = true;
                self.display.warn(&format!(
                    "warning: cannot write the checkpoint \"{path}\"; the render goes on and will try again: {error:#}"
                ));
            }
            Err(_) => {}
        }
        self.last = Instant::now();
    }
}

/// Writes aside, and moves the file to its place once it is on the disk: at any moment one whole file is there. The name aside is
/// always the same, so that renders that were killed leave at most one of them.
fn replace(path: &Path, part: &PartView) -> Result<()> {
    let mut name = std::ffi::OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(".new");
    let aside = path.with_file_name(name);
    let written = write_synced(&aside, part).and_then(|()| Ok(fs::rename(&aside, path)?));
    if written.is_err() {
        // What cannot be written may be in the way of what comes next.
        let _ = fs::remove_file(&aside);
    }
    written?;
    sync_folder(path)
}

fn write_synced(path: &Path, part: &PartView) -> Result<()> {
    let file = File::create(path)?;
    part.write(&file)?;
    Ok(file.sync_all()?)
}

/// So that the move survives a power cut; elsewhere than on Unix a folder cannot be opened for that.
fn sync_folder(path: &Path) -> Result<()> {
    if !cfg!(unix) {
        return Ok(());
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let folder = folder.unwrap_or(Path::new("."));
    File::open(folder)?.sync_all().context("cannot bring the folder to the disk")
}
