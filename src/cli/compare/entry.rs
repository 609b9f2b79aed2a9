//! What the names of a comparison mean, once the scene was loaded.

use super::contestants::{Contestant, Ours, Own, Preparation};
use super::entrant::Entrant;
use super::job::CompareError;
use super::own::Stream;
use super::protocol::Order;
use super::remote::Remote;
use anyhow::{Context, Result};
use vpt::host::session::{LoadedScene, SceneFile, Session};
use vpt::method::{Method, Parameters};
use vpt::scene::PathLimits;

/// Share of the time that one render of Mitsuba's should take, at least and at most so many seconds.
const SLICE: f64 = 0.01;
const SLICE_BOUNDS: [f64; 2] = [0.05, 2.0];

/// Mitsuba's integrators that light passes through media as if they were not there.
const BLIND_TO_MEDIA: [&str; 4] = ["path", "ptracer", "direct", "depth"];

/// Where contestants compete.
#[derive(Clone, Copy)]
pub struct Ground<'a> {
    pub session: &'a Session,
    pub scene: &'a LoadedScene<'a>,
    pub sensor: usize,
    /// Width and height in pixels.
    pub size: [u32; 2],
}

/// What a name means.
#[derive(Debug, Clone)]
pub enum Meaning {
    /// A method of vpt takes the scene's parameters.
    Ours(Parameters),
    /// One of Mitsuba's integrators takes the scene's limits.
    Own { integrator: String, limits: PathLimits },
}

/// One that takes part.
#[derive(Debug)]
pub struct Entry {
    pub entrant: Entrant,
    pub meaning: Meaning,
    /// Where it renders in a process of its own.
    elsewhere: Option<Order>,
}

impl Meaning {
    /// Finds out what a name means; refuses what cannot render.
    pub fn find(name: &str, session: &Session, scene: &Parameters) -> Result<Self> {
        let Ok(method) = name.parse::<Method>() else {
            if name == "vpt" || !session.knows_integrator(name) {
                return Err(CompareError::unknown_method(name).into());
            }
            let usable = session.integrator(name, scene.limits);
            usable.with_context(|| {
                format!("Mitsuba's integrator \"{name}\" cannot be compared; leave it out")
            })?;
            return Ok(Meaning::Own { integrator: name.to_owned(), limits: scene.limits });
        };
        // The scene may say how photons are shot for its own method; others shoot as their names have it.
        let shooting = scene.shooting.filter(|_| scene.method == method);
        let parameters = Parameters { method, shooting, timeout: None, ..scene.clone() };
        parameters.validate()?;
        Ok(Meaning::Ours(parameters))
    }

    pub fn name(&self) -> &str {
        match self {
            Meaning::Ours(parameters) => parameters.method.name(),
            Meaning::Own { integrator, .. } => integrator,
        }
    }

    /// Lends the scene to a method of vpt; None for Mitsuba's integrators.
    pub fn prepare<'a>(&self, ground: &Ground<'a>, seed: u32) -> Result<Option<Preparation<'a>>> {
        let Meaning::Ours(parameters) = self else { return Ok(None) };
        let parameters = Parameters { seed: seed.into(), ..parameters.clone() };
        Preparation::new(ground.scene, ground.sensor, parameters).map(Some)
    }

    /// A render in this process. `preparation` is what [`Meaning::prepare`] gave; `slice` are the seconds of one
    /// small render of Mitsuba's.
    pub fn contestant<'a>(
        &self,
        ground: &Ground<'a>,
        preparation: Option<&'a Preparation<'a>>,
        seed: u32,
        slice: f64,
    ) -> Result<Box<dyn Contestant + 'a>> {
        match (self, preparation) {
            (_, Some(preparation)) => Ok(Box::new(Ours::new(preparation, ground.size))),
            (Meaning::Own { integrator, limits }, None) => {
                let integrator = ground.session.integrator(integrator, *limits)?;
                let stream = Stream::new(ground.scene, integrator, ground.sensor, seed, slice);
                Ok(Box::new(Own::new(stream, ground.size)))
            }
            (Meaning::Ours(_), None) => unreachable!("vpt's methods are prepared"),
        }
    }
}

impl Entry {
    /// Finds out what a name means. One that renders in another variant is tried in a process of its own.
    pub fn find(
        entrant: &Entrant,
        file: &SceneFile,
        ground: &Ground,
        scene: &Parameters,
    ) -> Result<Self> {
        let meaning = Meaning::find(&entrant.integrator, ground.session, scene)?;
        let elsewhere = (entrant.variant != ground.session.variant())
            .then(|| Order::new(entrant, file, ground.sensor));
        if let Some(order) = &elsewhere {
            drop(Remote::start(order)?);
        }
        Ok(Entry { entrant: entrant.clone(), meaning, elsewhere })
    }

    pub fn ours(&self) -> bool {
        matches!(self.meaning, Meaning::Ours(_))
    }

    /// Why its picture is not that of the scene.
    pub fn flaw(&self, has_media: bool) -> Option<String> {
        let blind = has_media && BLIND_TO_MEDIA.contains(&self.entrant.integrator.as_str());
        blind.then(|| "it does not see the scene's media, so its error never vanishes".to_owned())
    }

    /// Lends it the scene, where it needs that in this process.
    pub fn prepare<'a>(&self, ground: &Ground<'a>, seed: u32) -> Result<Option<Preparation<'a>>> {
        match self.elsewhere {
            Some(_) => Ok(None),
            None => self.meaning.prepare(ground, seed),
        }
    }

    /// The contestant for `budget` seconds, and the seconds that its preparation took.
    pub fn contestant<'a>(
        &self,
        ground: &Ground<'a>,
        preparation: Option<&'a Preparation<'a>>,
        seed: u32,
        budget: f64,
    ) -> Result<(Box<dyn Contestant + 'a>, f64)> {
        let slice = slice(budget);
        if let Some(order) = &self.elsewhere {
            let remote = Remote::start(&Order { seed, slice, ..order.clone() })?;
            let spent = remote.preparation();
            return Ok((Box::new(remote), spent));
        }
        let contestant = self.meaning.contestant(ground, preparation, seed, slice)?;
        Ok((contestant, preparation.map_or(0.0, |preparation| preparation.seconds)))
    }
}

/// Seconds of one small render of Mitsuba's, for a contestant that has `budget` seconds.
pub fn slice(budget: f64) -> f64 {
    let [least, most] = SLICE_BOUNDS;
    (SLICE * budget).clamp(least, most)
}
