//! What in a scene calls for an effect.

use super::{Finding, Steering, Wishes};
use crate::effect::{Effect, Effects};
use crate::scene::{
    lobes, Extinction, Medium, PathLimits, Phase, SceneDescription, SurfaceFacts, UNBOUNDED_DEPTH,
};

/// A verdict with its reason and the names that it rests on.
type Verdict = (bool, String, Vec<String>);

/// The facts of a scene by which effects are judged.
pub(super) struct Evidence<'a> {
    scene: &'a SceneDescription,
    limits: PathLimits,
    steering: Steering,
    glossy_chains: bool,
}

impl<'a> Evidence<'a> {
    pub fn new(scene: &'a SceneDescription, wishes: Wishes) -> Self {
        let Wishes { limits, steering, glossy_chains, .. } = wishes;
        Evidence { scene, limits, steering, glossy_chains }
    }

    pub fn judge(&self, effect: Effect, forced: Effects) -> Finding {
        let (needed, reason, names) = match effect {
            Effect::SurfaceGathering | Effect::VisiblePoints => self.smooth_surfaces(),
            Effect::ViewBeams => self.scattering_media(),
            Effect::MediumSampling => {
                self.media("attenuating", "absorbs or scatters", Medium::attenuates)
            }
            Effect::MultipleScattering => self.scattering_again(),
            Effect::TransmittanceTables => {
                self.media("varying", "varies in space or direction", is_varying)
            }
            Effect::ColouredExtinction => {
                self.media("coloured", "has coloured extinction", |medium| {
                    medium.attenuates() && !medium.grey
                })
            }
            Effect::AnisotropicPhase => self.directional_phases(),
            Effect::SpecularChains => self.specular_surfaces(),
            Effect::RefractionIntoMedia => self.refraction(),
            Effect::DirectEmission => {
                self.visible_emitters("emitters that rays meet", "no ray meets an emitter", |_| {
                    true
                })
            }
            Effect::Environment => {
                self.visible_emitters("skies", "there is no sky", |is_sky| is_sky)
            }
            Effect::DepthOfField => self.aperture(),
            Effect::MetropolisSurface => self.chains(self.smooth_surfaces()),
            Effect::MetropolisMedium => self.chains(self.scattering_media()),
        };
        let forced = forced.has(effect) && !needed;
        Finding { effect, on: needed || forced, forced, reason, names }
    }

    /// None where light can reach the eye by way of a scattering; else the reason.
    fn no_scattering(&self) -> Option<Verdict> {
        let depth = self.limits.max_depth;
        (depth < 2).then(|| off(format!("max_depth {depth} ends paths before light is scattered")))
    }

    fn smooth_surfaces(&self) -> Verdict {
        self.no_scattering().unwrap_or_else(|| {
            self.surfaces("smooth lobes", "no surface has a smooth lobe", |s| s.has(lobes::SMOOTH))
        })
    }

    fn scattering_media(&self) -> Verdict {
        self.no_scattering()
            .unwrap_or_else(|| self.media("scattering", "scatters", Medium::scatters))
    }

    fn scattering_again(&self) -> Verdict {
        match self.limits.max_depth {
            0..=2 => off(format!("max_depth {} allows one scattering", self.limits.max_depth)),
            UNBOUNDED_DEPTH => on("max_depth is unbounded"),
            depth => on(&format!("max_depth is {depth}")),
        }
    }

    fn directional_phases(&self) -> Verdict {
        let (scatters, reason, names) = self.scattering_media();
        if !scatters {
            return (scatters, reason, names);
        }
        self.media("anisotropic", "scatters by direction", |medium| {
            medium.scatters() && medium.phase != Phase::Isotropic
        })
    }

    fn specular_surfaces(&self) -> Verdict {
        let delta = lobes::DELTA_REFLECTION | lobes::DELTA_TRANSMISSION | lobes::NULL;
        if self.glossy_chains {
            return self.surfaces(
                "delta, null or glossy lobes",
                "no surface has a delta, null or glossy lobe",
                |s| s.has(delta | lobes::GLOSSY),
            );
        }
        self.surfaces("delta or null lobes", "no surface has a delta or null lobe", |s| {
            s.has(delta)
        })
    }

    fn refraction(&self) -> Verdict {
        let (scatters, reason, names) = self.scattering_media();
        if !scatters {
            return (scatters, reason, names);
        }
        let glossy = if self.glossy_chains { lobes::GLOSSY_TRANSMISSION } else { 0 };
        self.surfaces("refracting", "no surface refracts", |s| {
            s.has(lobes::DELTA_TRANSMISSION | glossy)
        })
    }

    fn visible_emitters(&self, found: &str, missing: &str, keep: impl Fn(bool) -> bool) -> Verdict {
        let seen = self.scene.emitters.iter().filter(|e| e.is_visible && keep(e.is_environment));
        let names: Vec<_> = seen.map(|emitter| emitter.name.clone()).collect();
        if names.is_empty() {
            return off(missing.to_owned());
        }
        let shows = lobes::DELTA_REFLECTION | lobes::DELTA_TRANSMISSION;
        if self.limits.hide_emitters && !self.scene.surfaces.iter().any(|s| s.has(shows)) {
            return off("hide_emitters, and no delta lobe shows emitters elsewhere".to_owned());
        }
        (true, found.to_owned(), names)
    }

    fn aperture(&self) -> Verdict {
        let sensor = &self.scene.sensor;
        match sensor.has_aperture {
            true => (true, "the sensor has an aperture".to_owned(), vec![sensor.name.clone()]),
            false => off("the sensor has no aperture".to_owned()),
        }
    }

    /// `gathered` is the verdict on what the family's photons are shot at.
    fn chains(&self, gathered: Verdict) -> Verdict {
        match (self.steering, gathered) {
            (_, (false, reason, _)) => off(reason),
            (Steering::Never, _) => off("the method shoots uniformly".to_owned()),
            (Steering::Always, _) => on("the method shoots by chains"),
            (Steering::Measured, _) => on("where few of the photons are seen, as a probe measures"),
        }
    }

    fn surfaces(
        &self,
        found: &str,
        missing: &str,
        keep: impl Fn(&SurfaceFacts) -> bool,
    ) -> Verdict {
        let names: Vec<_> =
            self.scene.surfaces.iter().filter(|s| keep(s)).map(|s| s.name.clone()).collect();
        match names.is_empty() {
            true => off(missing.to_owned()),
            false => (true, format!("surfaces: {found}"), names),
        }
    }

    fn media(&self, found: &str, missing: &str, keep: impl Fn(&Medium) -> bool) -> Verdict {
        let names: Vec<_> =
            self.scene.media.iter().filter(|m| keep(m)).map(|m| m.name.clone()).collect();
        match names.is_empty() {
            true => off(format!("no medium {missing}")),
            false => (true, format!("media: {found}"), names),
        }
    }
}

fn is_varying(medium: &Medium) -> bool {
    matches!(medium.extinction, Extinction::Varying { .. })
}

fn on(reason: &str) -> Verdict {
    (true, reason.to_owned(), Vec::new())
}

fn off(reason: String) -> Verdict {
    (false, reason, Vec::new())
}
