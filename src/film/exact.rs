//! Sums that come out the same however their terms are grouped.

use super::FilmSums;
use crate::scene::{work, Scene};

/// Values that a task adds.
const PER_TASK: usize = 1 << 16;

/// A film's sums over jitters, each value with what rounding left of it: as many bits as two f64 hold. Jitters are f32, so
/// sums of those that differ by less than 2^70 or so are exact, and the same bits whether they were added one by one or part
/// by part. Where they differ by more, what is lost lies some 50 bits below what a film takes.
#[derive(Debug, Clone, PartialEq)]
pub struct ExactSums {
    /// Rounded to nearest, and the rest.
    pairs: Vec<[f64; 2]>,
}

impl ExactSums {
    /// Zeros, as many as the film has values.
    pub fn new(values: usize) -> Self {
        ExactSums { pairs: vec![[0.0; 2]; values] }
    }

    pub fn from_pairs(pairs: Vec<[f64; 2]>) -> Self {
        ExactSums { pairs }
    }

    pub fn pairs(&self) -> &[[f64; 2]] {
        &self.pairs
    }

    /// Adds the film of a jitter.
    pub fn add(&mut self, scene: &dyn Scene, film: &FilmSums) {
        assert_eq!(self.pairs.len(), film.values.len());
        let values = film.values.chunks(PER_TASK);
        let tasks = self.pairs.chunks_mut(PER_TASK).zip(values).collect();
        work::for_each(scene, tasks, |(pairs, values)| {
            pairs.iter_mut().zip(values).for_each(|(pair, &value)| *pair = plus(*pair, value));
        });
    }

    /// Adds the sums of other jitters.
    pub fn merge(&mut self, other: &ExactSums) {
        assert_eq!(self.pairs.len(), other.pairs.len());
        let pairs = self.pairs.iter_mut().zip(&other.pairs);
        pairs.for_each(|(pair, &[sum, rest])| *pair = plus(plus(*pair, sum), rest));
    }

    pub fn rounded(&self) -> FilmSums {
        FilmSums { values: self.pairs.iter().map(|&[sum, _]| sum).collect() }
    }
}

/// A sum in two parts, plus a value.
// [Dekker 1971]
fn plus([sum, rest]: [f64; 2], value: f64) -> [f64; 2] {
    let [sum, error] = two_sum(sum, value);
    if !sum.is_finite() {
        return [sum, 0.0];
    }
    let [rest, lost] = two_sum(rest, error);
    let [sum, error] = two_sum(sum, rest);
    two_sum(sum, error + lost)
}

/// The rounded sum, and what rounding took away, exactly.
// [Knuth 1969, TwoSum]
fn two_sum(a: f64, b: f64) -> [f64; 2] {
    let sum = a + b;
    let of_b = sum - a;
    [sum, (a - (sum - of_b)) + (b - of_b)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analytic::World;
    use proptest::prelude::*;

    fn sum_of(values: &[f32]) -> ExactSums {
        let (scene, mut sums) = (World::empty([1, 1]), ExactSums::new(1));
        let film = |value: &f32| FilmSums { values: vec![f64::from(*value)] };
        values.iter().for_each(|value| sums.add(&scene, &film(value)));
        sums
    }

    /// f32 of both signs over 60 octaves.
    fn value() -> impl Strategy<Value = f32> {
        (-1.0f32..1.0, -40..20i32).prop_map(|(mantissa, exponent)| mantissa * 2f32.powi(exponent))
    }

    proptest! {
        /// Terms between 2^-63 (the last bit of the smallest) and 2^20 times 200 span 91 bits, below the 104 that are exact.
        #[test]
        fn groups_do_not_matter(
            values in prop::collection::vec((value(), 0..5usize), 1..200),
        ) {
            let whole = sum_of(&values.iter().map(|(value, _)| *value).collect::<Vec<_>>());
            let mut merged = ExactSums::new(1);
            for group in (0..5).rev() {
                let of_group = values.iter().filter(|(_, g)| *g == group).map(|(value, _)| *value);
                merged.merge(&sum_of(&of_group.collect::<Vec<_>>()));
            }
            prop_assert_eq!(merged, whole);
        }
    }

    /// In plain f64 the thousand small terms vanish beside the large one; in which order they come must not matter.
    #[test]
    fn small_terms_survive_beside_large_ones() {
        let small = 2f32.powi(-60);
        let mut values = vec![1.0];
        values.extend([small; 1000]);
        values.push(-1.0);
        assert_eq!(sum_of(&values).rounded().values, [1000.0 * f64::from(small)]);
    }

    #[test]
    fn what_is_not_finite_stays_so() {
        assert_eq!(sum_of(&[f32::INFINITY, 1.0]).rounded().values, [f64::INFINITY]);
        assert!(sum_of(&[f32::NAN, 1.0]).rounded().values[0].is_nan());
    }
}
