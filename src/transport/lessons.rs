//! How a render learns where its photons had better leave the lamps: a few rounds of walks, each under the guide of those
//! before it. [Guided emission]

use super::counters::{Counters, SEGMENTS_PER_USUAL_WALK};
use super::deposits::{Deposit, Sink};
use super::guided::Guided;
use super::numbers::{Alive, Numbers};
use super::photon::Family;
use super::target::Target;
use crate::guide::{self, EmissionGuide, Lesson};
use crate::math::uniform::{self, Purpose};
use crate::scene::{Batch, Scene, SceneResult};
use std::ops::Range;

/// Rounds at least; the first after them that has enough lessons, counted as if all were of equal worth, is the last.
const FEWEST_ROUNDS: usize = 3;
const ENOUGH_LESSONS: f64 = 20_000.0;
/// The first round's share of all walks. Every later one has as many walks as all before it: the better the guide, the more.
const FIRST_SHARE: f64 = 1.0 / 16.0;
/// The last round may have less left of what all may cost, but not less than such a share of what those before it took.
const LEAST_SHARE: f64 = 0.25;
/// Walks in all at most; bounds memory.
const MOST_WALKS: u64 = 1 << 21;

/// What it takes to learn a guide.
#[derive(Debug, Clone, Copy)]
pub struct Course<'a> {
    pub seed: u64,
    /// Number of the first round among all that learn by this seed.
    pub first_round: u64,
    /// In all, at most; and not more than cost what so many usual ones would.
    pub walks: u64,
    /// What is known already.
    pub guide: Option<&'a EmissionGuide>,
}

/// The guide for passes at this target, none if no round sees anything, and how many rounds that took. What the walks add to the
/// picture is thrown away: a guide must not depend on what it is used for.
pub fn learn_guide(target: &Target, course: Course) -> SceneResult<(Option<EmissionGuide>, u64)> {
    let Course { seed, first_round, walks, guide } = course;
    let all = walks.min(MOST_WALKS);
    let budget = all as f64 * SEGMENTS_PER_USUAL_WALK;
    let pixels = target.receivers.paths.film.len();
    let mut teacher = Teacher {
        target,
        counters: Counters::default(),
        walks: 0,
        radiance: vec![0.0; pixels],
        seen: Vec::new(),
        drawn: Vec::new(),
        rounds: 0,
        guide: guide.cloned(),
    };
    while teacher.walks < all {
        let done = teacher.rounds;
        let of_round =
            match affordable(walks_of_round(teacher.walks, all), &teacher.counters, budget) {
                Some(walks) => walks,
                None => break,
            };
        // Half of them look where the guide would not send them: what it does not know of it would hardly ever learn.
        let even = if teacher.guide.is_some() { of_round / 2 } else { of_round };
        for (half, (walks, is_guided)) in
            [(even, false), (of_round - even, true)].into_iter().enumerate()
        {
            let guide = teacher.guide.as_ref().filter(|_| is_guided);
            let number = 2 * (first_round + done as u64) + half as u64;
            let batches = target
                .scene
                .batching()
                .run_all(walks, |batch| Round { seed, number, target, guide }.shoot(batch))?;
            teacher.count(walks, is_guided);
            teacher.remember(&batches);
        }
        teacher.rounds += 1;
        let lessons = teacher.lessons();
        let enough = guide::of_equal_worth(&lessons) >= ENOUGH_LESSONS;
        teacher.guide = guide::learn(lessons).or(teacher.guide);
        if enough && teacher.rounds >= FEWEST_ROUNDS {
            break;
        }
    }
    Ok((teacher.guide, teacher.rounds as u64))
}

/// Walks of the next round, after so many of all.
fn walks_of_round(done: u64, all: u64) -> u64 {
    let first = ((FIRST_SHARE * all as f64) as u64).max(1);
    let (next, left) = (done.max(first), all - done);
    // Less than another round as large is left: it is part of this one.
    if left < 2 * next {
        left
    } else {
        next
    }
}

/// So many walks, or as many as what is left of the budget pays for, if that is worth a round.
fn affordable(walks: u64, before: &Counters, budget: f64) -> Option<u64> {
    if before.walks == 0 {
        return Some(walks);
    }
    let left = (budget - before.cost()) / before.cost_of_walk();
    let is_worth = left >= LEAST_SHARE * before.walks as f64;
    (left >= walks as f64).then_some(walks).or(is_worth.then_some(left as u64))
}

/// What all rounds so far have seen.
struct Teacher<'a> {
    target: &'a Target<'a>,
    counters: Counters,
    walks: u64,
    /// Sum over all walks, by pixel.
    radiance: Vec<f64>,
    /// Walks that added something, with the sum of squares of what they added without their weights, by what errors are
    /// measured by.
    seen: Vec<(guide::Numbers, f64)>,
    /// How many walks were drawn by which guide, or evenly.
    drawn: Vec<(u64, Option<EmissionGuide>)>,
    rounds: usize,
    /// What leads half of the next round.
    guide: Option<EmissionGuide>,
}

impl Teacher<'_> {
    /// Walks are counted before they are remembered.
    fn count(&mut self, walks: u64, is_guided: bool) {
        self.walks += walks;
        self.drawn.push((walks, self.guide.clone().filter(|_| is_guided)));
    }

    fn remember(&mut self, batches: &[Emitted]) {
        let paths = &self.target.receivers.paths;
        let pixel_of = |place: u32| paths.pixel_of(place);
        for &(_, place, radiance) in batches.iter().flat_map(|batch| &batch.deposits.0) {
            self.radiance[pixel_of(place)] += f64::from(radiance);
        }
        let scales = self.scales();
        for batch in batches {
            self.counters.add(&batch.counters);
            let mut squares = vec![0.0; batch.numbers.len()];
            for &(walk, place, radiance) in &batch.deposits.0 {
                let unweighted = f64::from(radiance / batch.weights[walk as usize]);
                squares[walk as usize] += (unweighted / scales[pixel_of(place)]).powi(2);
            }
            let all = batch.numbers.iter().copied().zip(squares);
            self.seen.extend(all.filter(|(_, square)| *square > 0.0 && square.is_finite()));
        }
    }

    /// By pixel, what an error is measured by: half the pixel's own radiance, half the picture's.
    fn scales(&self) -> Vec<f64> {
        let mut scales: Vec<f64> =
            self.radiance.iter().map(|radiance| radiance / self.walks as f64).collect();
        for (own, &connected) in scales.iter_mut().zip(&self.target.receivers.paths.connected) {
            *own += f64::from(connected.mean());
        }
        let whole = scales.iter().sum::<f64>() / scales.len() as f64;
        scales.iter_mut().for_each(|own| *own += whole);
        scales
    }

    /// Every walk might have been drawn by any guide so far, or evenly. [Veach 1997]
    fn lessons(&self) -> Vec<Lesson> {
        let lesson = |&(numbers, square): &(guide::Numbers, f64)| {
            let density = |guide: &EmissionGuide| f64::from(guide.density(&numbers));
            let expected = |(walks, guide): &(u64, Option<EmissionGuide>)| {
                *walks as f64 * guide.as_ref().map_or(1.0, density)
            };
            let sum: f64 = self.drawn.iter().map(expected).sum();
            Lesson { numbers, worth: square / sum }
        };
        self.seen.iter().map(lesson).collect()
    }
}

/// One round of walks.
struct Round<'a> {
    seed: u64,
    number: u64,
    target: &'a Target<'a>,
    guide: Option<&'a EmissionGuide>,
}

impl Round<'_> {
    fn shoot(&self, batch: Batch) -> SceneResult<Emitted> {
        let stream = |purpose| uniform::stream(self.seed, purpose, self.number, batch.number);
        let numbers = Guided::new(stream(Purpose::Lessons), self.guide);
        let mut tables = stream(Purpose::LessonTables);
        let mut remembered = Remembered { numbers, emitted: Vec::new(), weights: Vec::new() };
        let wanted = self.target.wanted();
        let (deposits, counters) = self.target.shoot(
            batch.lanes,
            &mut remembered,
            &mut tables,
            wanted,
            Deposited::default,
        )?;
        let Remembered { emitted: numbers, weights, .. } = remembered;
        Ok(Emitted { numbers, weights, deposits, counters })
    }
}

/// What the walks of a batch were emitted with, and what they added.
struct Emitted {
    numbers: Vec<guide::Numbers>,
    weights: Vec<f32>,
    deposits: Deposited,
    counters: Counters,
}

/// Walk, pixel, and mean of the radiance's channels.
#[derive(Default)]
struct Deposited(Vec<(u32, u32, f32)>);

impl Sink for Deposited {
    fn push(&mut self, walk: u32, _: Family, deposit: Deposit) {
        self.0.push((walk, deposit.pixel, deposit.radiance.mean()));
    }

    fn append(&mut self, mut other: Self) {
        self.0.append(&mut other.0);
    }
}

/// Remembers what walks were emitted with.
struct Remembered<N> {
    numbers: N,
    emitted: Vec<guide::Numbers>,
    weights: Vec<f32>,
}

impl<N: Numbers> Numbers for Remembered<N> {
    const KNOWS_WALKS: bool = N::KNOWS_WALKS;

    fn emission(&mut self, scene: &dyn Scene, walks: usize, out: &mut Vec<f32>) {
        self.numbers.emission(scene, walks, out);
        let of_walk = |walk| std::array::from_fn(|axis| out[axis * walks + walk]);
        self.emitted.extend((0..walks).map(of_walk));
        match self.numbers.weights() {
            Some(weights) => self.weights.extend(weights),
            None => self.weights.resize(walks, 1.0),
        }
    }

    fn steps(&mut self, scene: &dyn Scene, steps: Range<usize>, alive: Alive, out: &mut Vec<f32>) {
        self.numbers.steps(scene, steps, alive, out);
    }

    fn used(&mut self, alive: &mut Vec<u32>, planes: &mut Vec<f32>) {
        self.numbers.used(alive, planes);
    }

    fn weights(&self) -> Option<&[f32]> {
        self.numbers.weights()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whoever asks for few walks does not get more, and the last round, which has the best guide, is a good part of all.
    #[test]
    fn rounds_take_all_walks_and_no_more() {
        for all in (1..100).chain([374, 7500, 120_000, MOST_WALKS]) {
            let (mut done, mut rounds) = (0, Vec::new());
            while done < all {
                rounds.push(walks_of_round(done, all));
                done += rounds[rounds.len() - 1];
            }
            assert_eq!(done, all, "{rounds:?}");
            assert!(rounds.iter().all(|&walks| walks > 0), "{rounds:?}");
            let last = rounds[rounds.len() - 1];
            assert!(3 * last >= all && rounds.len() <= 6, "{rounds:?} of {all}");
        }
    }

    /// Dear walks are fewer, and a round of next to none is left out; cheap ones are not more.
    #[test]
    fn rounds_stay_within_their_budget() {
        let before = |segments| Counters { walks: 100, segments, ..Counters::default() };
        assert_eq!(affordable(100, &Counters::default(), 1.0), Some(100));
        assert_eq!(affordable(100, &before(400), 1600.0), Some(100));
        assert_eq!(affordable(100, &before(400), 600.0), Some(50));
        assert_eq!(affordable(100, &before(400), 480.0), None);
        assert_eq!(affordable(100, &before(4000), 1600.0), None);
    }
}
