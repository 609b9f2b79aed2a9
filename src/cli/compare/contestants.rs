//! What is compared: renders that are advanced a little at a time, and show their picture at any time.

use super::own::{Mean, Stream};
use anyhow::Result;
use std::time::Instant;
use vpt::host::session::{LentScene, LoadedScene};
use vpt::method::{self, Parameters, Progressive};
use vpt::report::picture::Picture;
use vpt::report::results::Phase;
use vpt::scene::Scene;

/// A render that takes turns with others.
pub trait Contestant {
    /// The least step: one pass, or one small render.
    fn advance(&mut self) -> Result<()>;
    /// The picture of all steps so far.
    fn picture(&mut self) -> Result<Picture>;
    /// Passes or samples per pixel so far.
    fn work(&self) -> u64;
    /// Where the time went.
    fn phases(&self) -> Vec<Phase>;
    /// The most memory [bytes] that it held, where it measures that by itself.
    fn memory(&self) -> Option<u64> {
        None
    }
}

/// What one of vpt's methods needs before it begins. Lending the scene prepares it, so the time counts.
pub struct Preparation<'a> {
    lent: LentScene<'a>,
    parameters: Parameters,
    pub seconds: f64,
}

impl<'a> Preparation<'a> {
    pub fn new(scene: &'a LoadedScene, sensor: usize, parameters: Parameters) -> Result<Self> {
        let clock = Instant::now();
        let lent = scene.lend(sensor)?;
        Ok(Preparation { lent, parameters, seconds: clock.elapsed().as_secs_f64() })
    }
}

/// One of vpt's methods.
pub struct Ours<'a> {
    preparation: &'a Preparation<'a>,
    size: [u32; 2],
    /// None before the first step, on whose clock the render begins.
    render: Option<Box<dyn Progressive + 'a>>,
}

impl<'a> Ours<'a> {
    pub fn new(preparation: &'a Preparation<'a>, size: [u32; 2]) -> Self {
        Ours { preparation, size, render: None }
    }

    fn render(&self) -> &dyn Progressive {
        self.render.as_deref().expect("it has advanced once")
    }
}

impl Contestant for Ours<'_> {
    fn advance(&mut self) -> Result<()> {
        if self.render.is_none() {
            let Preparation { lent, parameters, .. } = self.preparation;
            self.render = Some(method::begin(lent.scene(), parameters)?);
        }
        let render = self.render.as_mut().expect("it has begun");
        Ok(render.advance()?)
    }

    fn picture(&mut self) -> Result<Picture> {
        let channels = self.preparation.lent.scene().description().film_channels as usize;
        let [width, height] = self.size.map(|n| n as usize);
        Ok(Picture { width, height, pixels: self.render().film().means(channels) })
    }

    fn work(&self) -> u64 {
        self.render.as_ref().map_or(0, |render| render.progress().passes_done.into())
    }

    fn phases(&self) -> Vec<Phase> {
        let Some(render) = &self.render else { return Vec::new() };
        let spent = render.phase_seconds();
        let phase = |name: &str, seconds| Phase { name: name.to_owned(), seconds };
        vec![
            phase("preparation", self.preparation.seconds),
            phase("view rays", spent.view),
            phase("trees", spent.trees),
            phase("photons", spent.photons),
            phase("film", spent.film),
        ]
    }
}

/// One of Mitsuba's integrators.
pub struct Own<'a> {
    stream: Stream<'a>,
    mean: Mean,
    size: [u32; 2],
}

impl<'a> Own<'a> {
    pub fn new(stream: Stream<'a>, size: [u32; 2]) -> Self {
        Own { stream, mean: Mean::new(size[0] as usize * size[1] as usize), size }
    }
}

impl Contestant for Own<'_> {
    fn advance(&mut self) -> Result<()> {
        Ok(self.stream.advance(&mut self.mean)?)
    }

    fn picture(&mut self) -> Result<Picture> {
        Ok(self.mean.picture(self.size))
    }

    fn work(&self) -> u64 {
        self.mean.weight() as u64
    }

    fn phases(&self) -> Vec<Phase> {
        Vec::new()
    }
}
