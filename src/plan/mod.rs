//! What a scene calls for, decided once: the plan drives the render, and `vpt inspect` shows it.

mod evidence;
mod finding;

pub use finding::Finding;

use crate::effect::{Effect, Effects};
use crate::scene::{lobes, Extinction, Medium, PathLimits, PathRules, Phase, SceneDescription};
use evidence::Evidence;
use serde::Serialize;

/// Which families may get Metropolis chains.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Steering {
    /// None.
    Never,
    /// Both, where they have receivers.
    Always,
    /// Those of which little is visible, as a probe measures.
    Measured,
}

/// Receivers that look for lamps by themselves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Connections {
    pub visible_points: bool,
    pub view_beams: bool,
    /// Of the lamps, for each receiver.
    pub samples: u32,
}

impl Connections {
    pub const NONE: Self = Connections { visible_points: false, view_beams: false, samples: 1 };

    pub fn any(self) -> bool {
        self.visible_points || self.view_beams
    }

    /// Whether the same receivers look for lamps, however often.
    pub fn are_made_like(self, other: Connections) -> bool {
        Connections { samples: other.samples, ..self } == other
    }
}

/// What a plan depends on besides the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wishes {
    pub limits: PathLimits,
    /// Effects that are simulated though the scene does not call for them.
    pub forced: Effects,
    pub steering: Steering,
    /// Which receivers find by themselves what comes straight from a lamp. \[Connection\]
    pub connections: Connections,
    /// Whether view rays go on in the sharp directions of glossy surfaces. [Glossy chain]
    pub glossy_chains: bool,
}

impl From<PathLimits> for Wishes {
    fn from(limits: PathLimits) -> Self {
        Wishes {
            limits,
            forced: Effects::NONE,
            steering: Steering::Never,
            connections: Connections::NONE,
            glossy_chains: false,
        }
    }
}

/// What is simulated of a scene.
#[derive(Debug, Clone)]
pub struct Plan {
    pub rules: PathRules,
    /// Which receivers find by themselves what comes straight from a lamp, and photons leave it out. \[Connection\]
    pub connections: Connections,
    /// Which families may get chains.
    pub steering: Steering,
    /// The scene's media as they are treated: where an effect is forced on, what would make the work
    /// unnecessary is not made use of.
    pub media: Vec<Medium>,
    /// One for each effect, in the order of [`Effect::ALL`].
    pub findings: Vec<Finding>,
    forced: Effects,
}

impl Plan {
    pub fn new(scene: &SceneDescription, wishes: Wishes) -> Self {
        let Wishes { limits, steering, glossy_chains, .. } = wishes;
        let forced = forceable(wishes);
        let evidence = Evidence::new(scene, wishes);
        let findings: Vec<Finding> =
            Effect::ALL.into_iter().map(|effect| evidence.judge(effect, forced)).collect();
        let effects = findings.iter().filter(|finding| finding.on).map(|f| f.effect).collect();
        Plan {
            rules: PathRules {
                limits,
                effects,
                glossy_chains: glossy_chains && scene.surfaces.iter().any(|s| s.has(lobes::GLOSSY)),
            },
            connections: wishes.connections,
            steering: match steering {
                Steering::Measured if forced.has(Effect::MetropolisMedium) => Steering::Always,
                given => given,
            },
            media: treated_all(scene, forced),
            findings,
            forced,
        }
    }

    /// The same where these receivers look for lamps.
    pub fn connecting(&self, connections: Connections) -> Plan {
        Plan { connections, ..self.clone() }
    }

    /// Takes the media's constants from the scene as it is tuned; what is simulated was decided for all light.
    pub fn retune(&mut self, scene: &SceneDescription) {
        self.media = treated_all(scene, self.forced);
    }

    pub fn simulates(&self, effect: Effect) -> bool {
        self.rules.simulates(effect)
    }

    /// Whether an effect is simulated because the user wants it so.
    pub fn is_forced(&self, effect: Effect) -> bool {
        self.forced.has(effect)
    }

    pub fn limits(&self) -> PathLimits {
        self.rules.limits
    }
}

/// Chains are a matter of the method: where it has none, none are forced on it.
fn forceable(wishes: Wishes) -> Effects {
    match wishes.steering {
        Steering::Never => {
            wishes.forced.without(Effect::MetropolisSurface).without(Effect::MetropolisMedium)
        }
        Steering::Always | Steering::Measured => wishes.forced,
    }
}

fn treated_all(scene: &SceneDescription, forced: Effects) -> Vec<Medium> {
    scene.media.iter().map(|medium| treated(medium, forced)).collect()
}

fn treated(medium: &Medium, forced: Effects) -> Medium {
    let mut medium = medium.clone();
    if forced.has(Effect::TransmittanceTables) && medium.attenuates() {
        if let Extinction::Constant(_) = medium.extinction {
            medium.extinction = Extinction::Varying { feature_size: f32::INFINITY };
        }
    }
    if forced.has(Effect::ColouredExtinction) {
        medium.grey = false;
    }
    if forced.has(Effect::AnisotropicPhase) {
        medium.phase = Phase::Opaque;
    }
    medium
}
