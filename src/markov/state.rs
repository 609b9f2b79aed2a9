//! What a chain is in.

use super::recorded::PrimarySample;
use crate::transport::deposits::Deposit;

/// A visible walk and what it adds to the picture.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct State {
    pub sample: PrimarySample,
    pub deposits: Vec<Deposit>,
}

impl State {
    /// Keeps its memory.
    pub fn copy_from(&mut self, other: &State) {
        self.sample.clone_from(&other.sample);
        self.deposits.clone_from(&other.deposits);
    }
}
