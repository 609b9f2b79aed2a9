use crate::host::session::{HostError, LoadedScene, SceneFile, Session};
use crate::method::{Parameters, RenderError};
use std::io;
use std::path::PathBuf;
use std::sync::OnceLock;
use tempfile::TempDir;

/// Why a case has no verdict.
#[derive(Debug, thiserror::Error)]
pub enum SelftestError {
    #[error("Mitsuba: {0}")]
    Host(#[from] HostError),
    #[error(transparent)]
    Render(#[from] RenderError),
    #[error("cannot write the files of a scene: {0}; TMPDIR names where temporary files go")]
    Files(#[from] io::Error),
    #[error("the case \"{0}\" hangs: it was given up")]
    Hangs(&'static str),
    #[error("the case \"{0}\" panicked")]
    Panicked(&'static str),
}

/// Where cases find Mitsuba, which is started for the first that asks, and a folder for its scenes.
pub struct Bench {
    variant: Option<String>,
    threads: Option<usize>,
    session: OnceLock<Session>,
    folder: TempDir,
}

impl Bench {
    /// `variant` and `threads` are those of [`Session::start`].
    pub fn new(variant: Option<String>, threads: Option<usize>) -> Result<Self, SelftestError> {
        let session = OnceLock::new();
        Ok(Bench { variant, threads, session, folder: tempfile::tempdir()? })
    }

    /// Path of a file beside the scenes.
    pub(super) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(super) fn write(
        &self,
        name: &str,
        contents: impl AsRef<[u8]>,
    ) -> Result<(), SelftestError> {
        Ok(std::fs::write(self.path(name), contents)?)
    }

    /// Writes a scene and loads it, with values for its `$name` parameters.
    pub(super) fn load(
        &self,
        xml: &str,
        defines: &[(&str, String)],
    ) -> Result<LoadedScene<'_>, SelftestError> {
        let path = self.path("scene.xml");
        self.write("scene.xml", xml)?;
        let owned = |(name, value): &(&str, String)| ((*name).to_owned(), value.clone());
        let defines = defines.iter().map(owned).collect();
        let file = SceneFile { path, defines, ..SceneFile::default() };
        Ok(self.session()?.load(&file)?)
    }

    /// What one of Mitsuba's own integrators renders of a scene, without a limit to its depth.
    pub(super) fn render_with(
        &self,
        scene: &LoadedScene,
        integrator: &str,
        spp: u32,
    ) -> Result<Vec<f32>, SelftestError> {
        let integrator = self.session()?.integrator(integrator, Parameters::default().limits)?;
        Ok(scene.render_with(&integrator, 0, 0, spp)?.rgb)
    }

    /// One session per process: cases run one after the other.
    fn session(&self) -> Result<&Session, SelftestError> {
        if let Some(session) = self.session.get() {
            return Ok(session);
        }
        let session = Session::start(self.variant.as_deref(), self.threads, 0)?;
        Ok(self.session.get_or_init(|| session))
    }
}
