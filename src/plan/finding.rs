use crate::effect::Effect;
use serde::Serialize;

/// Whether an effect is simulated, and why.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    pub effect: Effect,
    pub on: bool,
    /// On because the user wants it so, not because the scene calls for it.
    pub forced: bool,
    /// What decided, in words; the names follow it.
    pub reason: String,
    /// The objects of the scene that decided.
    pub names: Vec<String>,
}
