//! A picture that is shown as it is rendered.

use super::job::RenderJob;
use super::progress::Display;
use super::tev::{ImageInfo, Viewer};
use anyhow::Result;
use std::ops::ControlFlow;
use vpt::host::session::LoadedScene;
use vpt::method::{FilmSoFar, Observer, Progress};

/// An observer, and a viewer that gets the picture after each pass for which it has time.
pub struct Live<O> {
    observer: O,
    viewer: Option<Viewer>,
    display: Display,
    pixels: usize,
}

impl<O> Live<O> {
    /// Connects with the viewer that the job names.
    pub fn open(
        job: &RenderJob,
        scene: &LoadedScene,
        display: &Display,
        observer: O,
    ) -> Result<Self> {
        let [width, height] = scene.film_size(job.sensor);
        let open = |address| {
            let name = job.picture.path().display().to_string();
            let herald = display.clone();
            Viewer::open(address, ImageInfo { name, width, height }, move |line| herald.warn(line))
        };
        let viewer = job.viewer.as_ref().map(open).transpose()?;
        let pixels = width as usize * height as usize;
        Ok(Live { observer, viewer, display: display.clone(), pixels })
    }

    pub fn observer(&self) -> &O {
        &self.observer
    }

    /// Shows the picture that was written, and lets the viewer go.
    pub fn conclude(self, picture: impl FnOnce() -> Result<Vec<[f32; 3]>>) -> Result<()> {
        let Some(viewer) = self.viewer else { return Ok(()) };
        viewer.show(picture()?);
        if let Err(sentence) = viewer.close() {
            self.display.warn(&format!("warning: {sentence}"));
        }
        Ok(())
    }

    fn show(&mut self, film: &dyn FilmSoFar) {
        let Some(viewer) = self.viewer.as_ref().filter(|viewer| viewer.is_ready()) else { return };
        match film.film() {
            Ok(film) => viewer.show(film.means(film.values.len() / self.pixels.max(1))),
            Err(error) => {
                self.display.warn(&format!("warning: there is no picture to show so far: {error}"));
                self.viewer = None;
            }
        }
    }
}

impl<O: Observer> Observer for Live<O> {
    fn progress(&mut self, progress: &Progress, film: &dyn FilmSoFar) -> ControlFlow<()> {
        let flow = self.observer.progress(progress, film);
        if progress.passes_done > 0 {
            self.show(film);
        }
        flow
    }
}
