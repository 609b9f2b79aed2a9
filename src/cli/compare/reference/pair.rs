//! Two renders with independent random numbers that take turns: their mean is a reference, their differences tell how
//! good it is.

use crate::cli::compare::contestants::{Contestant, Preparation};
use crate::cli::compare::meaning::{Ground, Meaning};
use crate::cli::interrupt::Interrupt;
use anyhow::Result;
use std::time::Instant;
use vpt::density::radius::Schedule;
use vpt::method::Parameters;
use vpt::report::halves::{squared_difference, Halves};
use vpt::report::picture::Picture;

/// Seeds far from those of contestants.
pub const SEEDS: [u32; 2] = [u32::MAX, u32::MAX - 1];

/// The preparations of both halves, which a [`Pair`] borrows.
pub type Preparations<'a> = [Option<Preparation<'a>>; 2];

/// Lends the scene to both halves.
pub fn prepare<'a>(meaning: &Meaning, ground: &Ground<'a>) -> Result<Preparations<'a>> {
    let [first, second] = SEEDS.map(|seed| meaning.prepare(ground, seed));
    Ok([first?, second?])
}

/// Two renders under way.
pub struct Pair<'a> {
    halves: [Box<dyn Contestant + 'a>; 2],
    /// Wall time that both used [s].
    pub seconds: f64,
    /// The power of the work that a bias falls with; None for integrators without one.
    decay: Option<f64>,
    /// The pictures at the last two powers of two of passes, where there is a bias to estimate.
    earlier: Vec<Halves>,
}

impl<'a> Pair<'a> {
    /// `seconds` is the time that the reference shall have.
    pub fn new(
        meaning: &Meaning,
        ground: &Ground<'a>,
        preparations: &'a Preparations<'a>,
        seconds: f64,
    ) -> Result<Self> {
        let half = |index: usize| {
            let preparation = preparations[index].as_ref();
            meaning.contestant(ground, preparation, SEEDS[index], seconds / 100.0)
        };
        let spent = preparations.iter().flatten().map(|preparation| preparation.seconds).sum();
        let decay = match meaning {
            Meaning::Ours(parameters) => Some(decay(parameters)),
            Meaning::Own { .. } => None,
        };
        Ok(Pair { halves: [half(0)?, half(1)?], seconds: spent, decay, earlier: Vec::new() })
    }

    /// Goes on until it has used so many seconds, at least by a step of each half; false where the user stopped it.
    pub fn go_on(&mut self, until: f64, interrupt: &Interrupt) -> Result<bool> {
        loop {
            let clock = Instant::now();
            for half in &mut self.halves {
                half.advance()?;
            }
            self.seconds += clock.elapsed().as_secs_f64();
            if self.decay.is_some() && self.halves[0].work().is_power_of_two() {
                let now = self.show()?;
                self.earlier.truncate(1);
                self.earlier.insert(0, now);
            }
            if interrupt.requested() {
                return Ok(false);
            }
            if self.seconds >= until {
                return Ok(true);
            }
        }
    }

    /// Samples or passes of both halves.
    pub fn work(&self) -> u64 {
        self.halves.iter().map(|half| half.work()).sum()
    }

    /// The pictures so far.
    pub fn show(&mut self) -> Result<Halves> {
        let [a, b] = &mut self.halves;
        let works = [a.work() as f64, b.work() as f64];
        Ok(Halves { pictures: [a.picture()?, b.picture()?], works })
    }

    /// Whether [`Pair::bias`] has an answer.
    pub fn tells_bias(&self) -> bool {
        self.decay.is_none() || self.earlier.len() == 2
    }

    /// An upper estimate of the bias, relative to `scale`: 0 for integrators without one, None where two passes are too
    /// few to tell.
    pub fn bias(&self, now: &Halves, scale: &Picture) -> Option<f64> {
        let Some(decay) = self.decay else { return Some(0.0) };
        let [_, earlier] = self.earlier.as_slice() else { return None };
        let change = squared_difference(earlier, now, scale).bound();
        Some(bias_after(change, now.works[0] / earlier.works[0], decay))
    }
}

/// Smooth light is blurred by the squared radius, but where it ends at an edge, as it does in most pictures, by the radius:
/// on disks that falls as `n^((alpha - 1) / 2)` with the passes `n`, and so does its mean over the passes; the printed
/// schedule's cube root in media is slower still. In a ball of fog before a sky (tests/agreement/scenes/ball_rayleigh.xml)
/// the bias after three passes is told as 8 % by that and is 8 %; by the squared radius it would be told as 4 %.
fn decay(parameters: &Parameters) -> f64 {
    let disks = 0.5 * f64::from(1.0 - parameters.alpha);
    match parameters.radius_schedule {
        Schedule::Matched => disks,
        Schedule::Paper => disks * 2.0 / 3.0,
    }
}

/// What is left of a bias that fell by `change` while the work grew by `growth`.
fn bias_after(change: f64, growth: f64, decay: f64) -> f64 {
    change / (growth.powf(decay) - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bias_follows_from_its_change() {
        let bias = |passes: f64| 0.3 * passes.powf(-0.15);
        let left = bias_after(bias(16.0) - bias(40.0), 40.0 / 16.0, 0.15);
        assert!((left - bias(40.0)).abs() < 1e-12);
    }
}
