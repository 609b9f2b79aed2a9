//! The memory that one contestant holds among others in one process.

use crate::cli::memory;

/// Estimates it from the resident memory around its steps.
#[derive(Debug, Default)]
pub struct Meter {
    /// Held between steps [bytes]; it may give back more than it took.
    held: i64,
    most: Option<u64>,
}

impl Meter {
    /// Makes a step.
    pub fn around<T>(&mut self, step: impl FnOnce() -> T) -> T {
        memory::forget_peak();
        let before = memory::resident();
        let done = step();
        if let (Some(before), Some(after), Some(peak)) =
            (before, memory::resident(), memory::peak())
        {
            let most = (self.held + peak as i64 - before as i64).max(0) as u64;
            self.most = self.most.max(Some(most));
            self.held += after as i64 - before as i64;
        }
        done
    }

    /// The most that was held [bytes]; None where the system does not tell.
    pub fn most(&self) -> Option<u64> {
        self.most
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_that_is_kept_counts_in_later_steps() {
        let mut meter = Meter::default();
        let kept = meter.around(|| std::hint::black_box(vec![1u8; 64 << 20]));
        meter.around(|| std::hint::black_box(vec![1u8; 64 << 20]).len());
        drop(kept);
        // None on other systems than Linux.
        assert!(meter.most().is_none_or(|most| most >= 100 << 20), "{meter:?}");
    }
}
