//! A logarithmic axis with labels at 1, 2 and 5 of every decade, or at finer steps where it spans little.

use plotters::coord::ranged1d::{DefaultFormatting, KeyPointHint, Ranged};
use std::ops::Range;

/// Fewer labels than this ask for finer steps.
const FEW: usize = 4;
/// More labels than this ask for coarser ones.
const MANY: usize = 12;

/// Steps within a decade, from coarse to fine.
const STEPS: [&[f64]; 4] = [
    &[1.0],
    &[1.0, 2.0, 5.0],
    &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0],
    &[
        1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6, 1.7, 1.8, 1.9, 2.0, 2.2, 2.4, 2.6, 2.8, 3.0, 3.2, 3.4,
        3.6, 3.8, 4.0, 4.2, 4.4, 4.6, 4.8, 5.0, 5.5, 6.0, 6.5, 7.0, 7.5, 8.0, 8.5, 9.0, 9.5,
    ],
];

/// The axis over a range of values above 0.
#[derive(Debug, Clone)]
pub struct LogAxis {
    range: Range<f64>,
}

impl LogAxis {
    pub fn new(range: Range<f64>) -> Self {
        LogAxis { range }
    }

    /// The values that have a label.
    fn labels(&self) -> Vec<f64> {
        let choices = STEPS.map(|steps| self.multiples(steps));
        let fine = choices.iter().find(|labels| (FEW..=MANY).contains(&labels.len()));
        // Between two choices there may be a gap; many decades have a label each.
        let enough = || choices.iter().find(|labels| labels.len() >= FEW);
        fine.or_else(enough).unwrap_or(&choices[STEPS.len() - 1]).clone()
    }

    fn multiples(&self, steps: &[f64]) -> Vec<f64> {
        let decades =
            self.range.start.log10().floor() as i32..=self.range.end.log10().floor() as i32;
        let values = decades.flat_map(|k| steps.iter().map(move |step| step * 10f64.powi(k)));
        values.filter(|value| self.range.contains(value)).collect()
    }
}

impl Ranged for LogAxis {
    type FormatOption = DefaultFormatting;
    type ValueType = f64;

    fn map(&self, value: &f64, (first, last): (i32, i32)) -> i32 {
        let Range { start, end } = self.range;
        let share = (value / start).ln() / (end / start).ln();
        first + (share * f64::from(last - first)).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _: Hint) -> Vec<f64> {
        self.labels()
    }

    fn range(&self) -> Range<f64> {
        self.range.clone()
    }
}

/// `0.002`, `20`, `1.5`, `3e-6`.
pub fn label(value: f64) -> String {
    if !(1e-4..1e5).contains(&value) {
        return format!("{value:.1e}").replace(".0e", "e");
    }
    // Two digits, and no zeros after them.
    let digits = (1.0 - value.log10().floor()).max(0.0) as usize;
    let text = format!("{value:.digits$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_span_has_a_few_labels() {
        for (start, factor) in
            [(0.9, 1.5), (0.3, 2.0), (4.0, 4.0), (0.2, 30.0), (1e-3, 1e3), (1e-5, 1e9)]
        {
            let labels = LogAxis::new(start..start * factor).labels();
            assert!((3..=16).contains(&labels.len()), "{start} {factor}: {labels:?}");
            assert!(labels.windows(2).all(|pair| pair[0] < pair[1]));
        }
        assert_eq!(LogAxis::new(0.9..11.0).labels(), [1.0, 2.0, 5.0, 10.0]);
    }

    #[test]
    fn equal_factors_are_equally_long() {
        let axis = LogAxis::new(1.0..100.0);
        assert_eq!([1.0, 10.0, 100.0].map(|value| axis.map(&value, (500, 100))), [500, 300, 100]);
    }

    #[test]
    fn labels_are_plain_in_the_middle() {
        for (value, text) in [
            (0.002, "0.002"),
            (20.0, "20"),
            (1.5, "1.5"),
            (0.15, "0.15"),
            (3e-6, "3e-6"),
            (1.5e5, "1.5e5"),
        ] {
            assert_eq!(label(value), text);
        }
    }
}
