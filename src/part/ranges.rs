//! Which passes of a picture a part holds.

use serde::{Deserialize, Serialize};
use std::fmt;
use std::ops::Range;

/// Ranges of passes in their order, none of which touch.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct PassRanges(Vec<Range<u32>>);

impl PassRanges {
    /// Of one range; an empty one holds nothing.
    pub fn of(range: Range<u32>) -> Self {
        PassRanges(Some(range).filter(|range| !range.is_empty()).into_iter().collect())
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Number of passes.
    pub fn count(&self) -> u32 {
        self.0.iter().map(|range| range.end - range.start).sum()
    }

    /// The range, where there is but one.
    pub fn single(&self) -> Option<Range<u32>> {
        match self.0.as_slice() {
            [range] => Some(range.clone()),
            _ => None,
        }
    }

    /// First passes that both hold.
    pub fn overlap(&self, other: &PassRanges) -> Option<Range<u32>> {
        let pairs = self.0.iter().flat_map(|mine| other.0.iter().map(move |theirs| (mine, theirs)));
        let common = pairs.map(|(a, b)| a.start.max(b.start)..a.end.min(b.end));
        common.filter(|range| !range.is_empty()).min_by_key(|range| range.start)
    }

    /// Both together; they must not overlap.
    pub fn union(&self, other: &PassRanges) -> PassRanges {
        let mut all: Vec<Range<u32>> = self.0.iter().chain(&other.0).cloned().collect();
        all.sort_by_key(|range| range.start);
        let mut joined: Vec<Range<u32>> = Vec::new();
        for range in all {
            match joined.last_mut() {
                Some(last) if last.end == range.start => last.end = range.end,
                _ => joined.push(range),
            }
        }
        PassRanges(joined)
    }

    /// Passes from 0 to the last one that are not there.
    pub fn missing(&self) -> PassRanges {
        let ends = std::iter::once(0).chain(self.0.iter().map(|range| range.end));
        let gaps = ends.zip(&self.0).map(|(end, next)| end..next.start);
        PassRanges(gaps.filter(|gap| !gap.is_empty()).collect())
    }

    /// The first pass of all.
    pub fn start(&self) -> u32 {
        self.0.first().map_or(0, |range| range.start)
    }

    /// Whether the ranges are in order, none of them empty.
    pub(super) fn is_sound(&self) -> bool {
        self.0.iter().all(|range| !range.is_empty())
            && self.0.windows(2).all(|pair| pair[0].end < pair[1].start)
    }
}

/// `0..8, 16..24`
impl fmt::Display for PassRanges {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let ranges: Vec<_> = self.0.iter().map(|r| format!("{}..{}", r.start, r.end)).collect();
        f.write_str(&ranges.join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn ranges_join_where_they_touch() {
        let union = PassRanges::of(8..16).union(&PassRanges::of(24..32));
        assert_eq!(union.to_string(), "8..16, 24..32");
        assert_eq!(union.missing().to_string(), "0..8, 16..24");
        assert_eq!((union.count(), union.single(), union.start()), (16, None, 8));
        let whole = union.union(&union.missing());
        assert_eq!(whole.single(), Some(0..32));
        assert!(whole.missing().is_empty());
        assert_eq!(whole.overlap(&PassRanges::of(30..40)), Some(30..32));
        assert_eq!(whole.overlap(&PassRanges::of(32..40)), None);
        assert!(PassRanges::of(5..5).is_empty());
    }

    proptest! {
        /// Against sets of numbers.
        #[test]
        fn ranges_are_sets_of_passes(held in prop::collection::vec(any::<bool>(), 1..60)) {
            let singles = (0..).zip(&held).filter(|(_, held)| **held);
            let ranges = singles.fold(PassRanges::default(), |all, (pass, _)| {
                all.union(&PassRanges::of(pass..pass + 1))
            });
            prop_assert!(ranges.is_sound());
            prop_assert_eq!(ranges.count() as usize, held.iter().filter(|held| **held).count());
            for (pass, &held) in (0..).zip(&held) {
                let one = PassRanges::of(pass..pass + 1);
                prop_assert_eq!(ranges.overlap(&one).is_some(), held);
            }
            let whole = ranges.union(&ranges.missing());
            prop_assert!(whole.is_empty() || whole.single().is_some_and(|range| range.start == 0));
        }
    }
}
