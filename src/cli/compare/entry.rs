//! Those that take part, in this process or in one of their own.

use super::contestants::{Contestant, Preparation};
use super::entrant::Entrant;
use super::error::CompareError;
use super::meaning::{Ground, Meaning};
use super::protocol::Order;
use super::remote::Remote;
use anyhow::Result;
use vpt::host::session::SceneFile;
use vpt::method::Parameters;

/// Share of the time that one render of Mitsuba's should take, at least and at most so many seconds.
const SLICE: f64 = 0.01;
const SLICE_BOUNDS: [f64; 2] = [0.05, 2.0];

/// Mitsuba's integrators that light passes through media as if they were not there.
const BLIND_TO_MEDIA: [&str; 4] = ["path", "ptracer", "direct", "depth"];

/// One that takes part.
#[derive(Debug)]
pub struct Entry {
    pub entrant: Entrant,
    pub meaning: Meaning,
    /// Where it renders in a process of its own.
    elsewhere: Option<Order>,
}

impl Entry {
    /// Finds out what a name means. One that renders in another variant, or with parameters of its own, is tried in a process of
    /// its own.
    pub fn find(
        entrant: &Entrant,
        file: &SceneFile,
        ground: &Ground,
        scene: &Parameters,
    ) -> Result<Self> {
        let meaning = Meaning::find(&entrant.integrator, ground.session, scene)?;
        if !entrant.settings.is_empty() && !matches!(meaning, Meaning::Ours(_)) {
            return Err(CompareError::SettingsOfMitsubas(entrant.integrator.clone()).into());
        }
        let apart = entrant.variant != ground.session.variant() || !entrant.settings.is_empty();
        let elsewhere = apart.then(|| Order::new(entrant, file, ground.sensor));
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
