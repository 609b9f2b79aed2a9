use super::trial::{Reading, Trial};
use super::SelftestError;
use serde::Serialize;

/// One row of the table.
#[derive(Clone, Copy)]
pub struct Case {
    pub name: &'static str,
    /// What is asserted and why it must hold, in a sentence.
    pub claim: &'static str,
    pub(super) run: fn(&mut Trial) -> Result<(), SelftestError>,
}

/// What came of a case.
#[derive(Debug, Clone, Serialize)]
pub struct Verdict {
    pub name: &'static str,
    pub claim: &'static str,
    pub readings: Vec<Reading>,
    pub seconds: f64,
}

impl Verdict {
    pub fn faults(&self) -> impl Iterator<Item = &Reading> {
        self.readings.iter().filter(|reading| reading.fault.is_some())
    }

    pub fn passed(&self) -> bool {
        self.faults().next().is_none()
    }

    /// The reading that is farthest off, one with a fault before all others.
    pub fn worst(&self) -> Option<&Reading> {
        let badness = |reading: &&Reading| (reading.fault.is_some(), reading.z.abs());
        self.readings
            .iter()
            .max_by(|a, b| badness(a).partial_cmp(&badness(b)).expect("z is no NaN"))
    }
}
