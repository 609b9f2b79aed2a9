//! The stability suite: extreme scenes whose answer is known, in one table that an installed program runs
//! by itself (`vpt selftest`) and that `tests/stability` runs too.
//!
//! Every case states a closed form, or a sum in f64, and is judged by Student's t-test over independent
//! seeds ([`judge`]): a right engine fails any reading of the whole table with a probability of at most
//! [`judge::FAMILY_LEVEL`]. A reading so noisy that a stated fault could hide in it fails too. Every render
//! must also be finite, drop nothing, and end within a bounded number of segments per walk.
//!
//! Scenes are [`crate::analytic`] worlds where the engine alone is asked, Mitsuba's where both are.

mod beams;
mod bench;
mod case;
mod closed_forms;
mod hosted;
pub mod judge;
mod media;
mod scale;
mod sums;
mod surfaces;
mod trial;
mod worlds;

pub use bench::{Bench, SelftestError};
pub use case::{Case, Verdict};
pub use trial::Reading;

use std::sync::mpsc;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A case that takes longer hangs.
const PATIENCE: Duration = Duration::from_secs(120);

/// All cases, most basic first.
pub fn table() -> Vec<Case> {
    [sums::CASES, media::CASES, scale::CASES, beams::CASES, surfaces::CASES, &hosted::cases()]
        .concat()
}

/// Runs one case, and gives it up if it hangs; its thread then stays behind.
pub fn run(case: &Case, bench: &Arc<Bench>) -> Result<Verdict, SelftestError> {
    let (sender, receiver) = mpsc::channel();
    let (run, bench) = (case.run, bench.clone());
    let clock = Instant::now();
    std::thread::spawn(move || {
        let mut trial = trial::Trial::new(&bench);
        let result = run(&mut trial).map(|()| trial.into_readings());
        // Whoever has given up waiting does not listen.
        let _ = sender.send(result);
    });
    let readings = match receiver.recv_timeout(PATIENCE) {
        Ok(result) => result?,
        Err(mpsc::RecvTimeoutError::Timeout) => return Err(SelftestError::Hangs(case.name)),
        Err(mpsc::RecvTimeoutError::Disconnected) => {
            return Err(SelftestError::Panicked(case.name))
        }
    };
    let seconds = clock.elapsed().as_secs_f64();
    Ok(Verdict { name: case.name, claim: case.claim, readings, seconds })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_unique() {
        let mut names: Vec<_> = table().iter().map(|case| case.name).collect();
        let count = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), count);
    }
}
