//! How far paths go.

use super::UNBOUNDED_DEPTH;
use crate::effect::{Effect, Effects};

/// Termination rules, with `volpath`'s meaning.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct PathLimits {
    /// [`UNBOUNDED_DEPTH`] or the number of path segments between lamp and eye that may not be exceeded.
    #[serde(serialize_with = "serialize_max_depth")]
    pub max_depth: u32,
    /// Depth from which Russian roulette ends walks.
    pub rr_depth: u32,
    pub hide_emitters: bool,
}

impl PathLimits {
    /// Probability with which Russian roulette lets a path go on that carries `weight` of what it started with. \[Roulette\]
    pub fn survival(weight: f32, depth: u32) -> f32 {
        weight.min(1.0 - 2.0 / (depth as f32 + 40.0))
    }
}

/// As the XML has it: -1 is unbounded.
fn serialize_max_depth<S: serde::Serializer>(
    depth: &u32,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    serializer.serialize_i64(if *depth == UNBOUNDED_DEPTH { -1 } else { i64::from(*depth) })
}

/// How far paths go, and what is simulated along them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PathRules {
    pub limits: PathLimits,
    /// What is not in here may be left out: the scene does not call for it.
    pub effects: Effects,
    /// Whether view rays go on in directions that a surface without delta lobes samples with a density above 1 per solid
    /// angle; its visible points leave those out, but for the light of lamps that is denser still. [Glossy chain]
    pub glossy_chains: bool,
}

impl PathRules {
    pub fn simulates(&self, effect: Effect) -> bool {
        self.effects.has(effect)
    }
}

/// Everything is simulated.
impl From<PathLimits> for PathRules {
    fn from(limits: PathLimits) -> Self {
        PathRules { limits, effects: Effects::ALL, glossy_chains: false }
    }
}
