//! Jitters that complement one another, as one sample of the picture.

use super::FilmSums;

/// Jitters of a round where their wavelengths divide the spectrum among them.
const OF_WAVELENGTHS: u32 = 4;

/// The films of successive jitters that begin at a multiple of their number, added up. Errors are estimated from the spread of
/// samples that are alike and independent; single jitters are not where each has wavelengths of its own. [Shared wavelengths]
#[derive(Debug)]
pub struct Round {
    length: u32,
    jitters: u32,
    picture: FilmSums,
    bias: Vec<f64>,
}

impl Round {
    /// Of one jitter, or of several where they share the spectrum.
    pub fn new(shares_spectrum: bool) -> Self {
        let length = if shares_spectrum { OF_WAVELENGTHS } else { 1 };
        let picture = FilmSums { values: Vec::new() };
        Round { length, jitters: 0, picture, bias: Vec::new() }
    }

    /// Adds the film of a jitter's picture and the bias of its pixels, and hands out those of the round if it ends with this jitter.
    /// A round that was begun elsewhere is left out.
    pub fn add(
        &mut self,
        jitter: u64,
        picture: FilmSums,
        bias: Vec<f64>,
    ) -> Option<(FilmSums, Vec<f64>)> {
        let place = (jitter % u64::from(self.length)) as u32;
        if place == 0 {
            (self.picture, self.bias, self.jitters) = (picture, bias, 1);
        } else if place == self.jitters {
            add(&mut self.picture.values, &picture.values);
            add(&mut self.bias, &bias);
            self.jitters += 1;
        } else {
            self.jitters = 0;
        }
        let is_over = self.jitters == self.length;
        is_over.then(|| {
            self.jitters = 0;
            let values = std::mem::take(&mut self.picture.values);
            (FilmSums { values }, std::mem::take(&mut self.bias))
        })
    }
}

fn add(sums: &mut [f64], values: &[f64]) {
    sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn film(value: f64) -> FilmSums {
        FilmSums { values: vec![value, 1.0] }
    }

    /// What a round hands out for jitter after jitter, each of which is as bright as its number.
    fn handed_out(round: &mut Round, jitters: std::ops::Range<u64>) -> Vec<[f64; 3]> {
        jitters
            .filter_map(|jitter| round.add(jitter, film(jitter as f64), vec![0.5]))
            .map(|(picture, bias)| [picture.values[0], picture.values[1], bias[0]])
            .collect()
    }

    #[test]
    fn a_jitter_is_a_round_where_colours_are_channels() {
        let all = handed_out(&mut Round::new(false), 3..5);
        assert_eq!(all, [[3.0, 1.0, 0.5], [4.0, 1.0, 0.5]]);
    }

    #[test]
    fn four_jitters_are_a_round_where_they_share_the_spectrum() {
        let all = handed_out(&mut Round::new(true), 0..9);
        assert_eq!(all, [[0.0 + 1.0 + 2.0 + 3.0, 4.0, 2.0], [4.0 + 5.0 + 6.0 + 7.0, 4.0, 2.0]]);
    }

    #[test]
    fn a_round_begun_elsewhere_is_left_out() {
        let all = handed_out(&mut Round::new(true), 2..8);
        assert_eq!(all, [[4.0 + 5.0 + 6.0 + 7.0, 4.0, 2.0]]);
        let mut round = Round::new(true);
        assert!(handed_out(&mut round, 4..7).is_empty());
        assert!(handed_out(&mut round, 9..12).is_empty());
    }
}
