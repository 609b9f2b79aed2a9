//! What a name means, once the scene was loaded, and where it competes.

use super::contestants::{Contestant, Ours, Own, Preparation};
use super::error::CompareError;
use super::own::Stream;
use anyhow::{Context, Result};
use vpt::host::session::{LoadedScene, Session};
use vpt::method::{Method, Parameters};
use vpt::scene::PathLimits;

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
        // Nobody reads an estimated error or layers here, and they would cost the methods unlike amounts of time.
        let parameters = Parameters {
            method,
            shooting,
            estimate_error: false,
            layers: false,
            target_error: 0.0,
            timeout: None,
            ..scene.clone()
        };
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
