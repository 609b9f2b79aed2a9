//! How a render learns where its photons had better leave the lamps: a few rounds of walks, each under the guide of those
//! before it. [Guided emission]

use super::deposits::{Deposit, Sink};
use super::gather::Target;
use super::guided::Guided;
use super::numbers::Numbers;
use super::photon::Family;
use crate::guide::{self, EmissionGuide, Lesson};
use crate::math::uniform::{self, Purpose};
use crate::scene::{Batch, SceneResult};
use std::ops::Range;

/// Rounds at least and at most; between them, the first that has enough lessons, counted as if all were of equal worth, is the
/// last. Where few photons are seen, the first rounds may see none.
const ROUNDS: [usize; 2] = [4, 10];
const ENOUGH_LESSONS: f64 = 2000.0;
/// Walks of a round, per pixel and in all.
const WALKS_PER_PIXEL: f64 = 0.5;
const WALKS: [u64; 2] = [1 << 14, 1 << 16];
/// And of the walks of the pass that asks at most so many times as many: where walks are dear, few are asked for.
const PASSES_PER_ROUND: u64 = 2;

/// The guide for a pass at this target; none if no round sees anything. What the walks add to the picture is thrown away: a guide
/// must not depend on what it is used for.
pub fn learn_guide(
    target: &Target,
    seed: u64,
    walks_per_pass: u64,
) -> SceneResult<Option<EmissionGuide>> {
    let pixels = target.receivers.paths.film.len();
    let [fewest, most] = WALKS;
    let per_round = ((WALKS_PER_PIXEL * pixels as f64) as u64)
        .clamp(fewest, most)
        .min(PASSES_PER_ROUND * walks_per_pass);
    let mut teacher = Teacher {
        target,
        walks: 0,
        radiance: vec![0.0; pixels],
        seen: Vec::new(),
        guides: Vec::new(),
    };
    for round in 0..ROUNDS[1] {
        let batches = target.scene.batching().run_all(per_round, |batch| {
            Round { seed, number: round as u64, target, guide: teacher.guides.last() }.shoot(batch)
        })?;
        teacher.remember(per_round, &batches);
        let lessons = teacher.lessons(round + 1);
        let enough = guide::of_equal_worth(&lessons) >= ENOUGH_LESSONS;
        teacher.guides.extend(guide::learn(lessons));
        if enough && round + 1 >= ROUNDS[0] {
            break;
        }
    }
    Ok(teacher.guides.pop())
}

/// What all rounds so far have seen.
struct Teacher<'a> {
    target: &'a Target<'a>,
    walks: u64,
    /// Sum over all walks, by pixel.
    radiance: Vec<f64>,
    /// Walks that added something, with the sum of squares of what they added without their weights, by what errors are
    /// measured by.
    seen: Vec<(guide::Numbers, f64)>,
    /// By round, from the first on that follows one in which something was seen.
    guides: Vec<EmissionGuide>,
}

impl Teacher<'_> {
    fn remember(&mut self, walks: u64, batches: &[Emitted]) {
        self.walks += walks;
        let paths = &self.target.receivers.paths;
        let pixel_of = |place: u32| paths.pixel_of(place);
        for &(_, place, radiance) in batches.iter().flat_map(|batch| &batch.deposits.0) {
            self.radiance[pixel_of(place)] += f64::from(radiance);
        }
        let scales = self.scales();
        for batch in batches {
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

    /// Every walk might have been drawn in any of the rounds so far. Each guide has led one; those before there was one were
    /// even. [Veach 1997]
    fn lessons(&self, rounds: usize) -> Vec<Lesson> {
        let even = (rounds - self.guides.len()) as f64;
        let lesson = |&(numbers, square): &(guide::Numbers, f64)| {
            let sum: f64 = self.guides.iter().map(|guide| f64::from(guide.density(&numbers))).sum();
            Lesson { numbers, worth: square / (even + sum) }
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
        let (deposits, _) = self.target.shoot(
            batch.lanes,
            &mut remembered,
            &mut tables,
            wanted,
            Deposited::default,
        )?;
        let Remembered { emitted: numbers, weights, .. } = remembered;
        Ok(Emitted { numbers, weights, deposits })
    }
}

/// What the walks of a batch were emitted with, and what they added.
struct Emitted {
    numbers: Vec<guide::Numbers>,
    weights: Vec<f32>,
    deposits: Deposited,
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

    fn emission(&mut self, walks: usize, out: &mut Vec<f32>) {
        self.numbers.emission(walks, out);
        let of_walk = |walk| std::array::from_fn(|axis| out[axis * walks + walk]);
        self.emitted.extend((0..walks).map(of_walk));
        match self.numbers.weights() {
            Some(weights) => self.weights.extend(weights),
            None => self.weights.resize(walks, 1.0),
        }
    }

    fn steps(&mut self, steps: Range<usize>, alive: &[u32], lanes: usize, out: &mut Vec<f32>) {
        self.numbers.steps(steps, alive, lanes, out);
    }

    fn weights(&self) -> Option<&[f32]> {
        self.numbers.weights()
    }
}
