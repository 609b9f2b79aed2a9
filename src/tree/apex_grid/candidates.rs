//! Beams whose lines may make a pair, found by their slopes alone and kept until there are enough to judge.

use super::{ApexGrid, LANES};

/// Places of beams that wait for their exact test, up to so many.
pub(super) struct Candidates<const WAITING: usize> {
    places: [u32; WAITING],
    count: usize,
}

impl<const WAITING: usize> Candidates<WAITING> {
    pub fn none() -> Self {
        Candidates { places: [0; WAITING], count: 0 }
    }

    /// Hands those that wait to `judge`.
    #[inline]
    pub fn flush(&mut self, judge: &mut impl FnMut(&[u32])) {
        judge(&self.places[..self.count]);
        self.count = 0;
    }

    /// Adds the beams of these columns of a row whose lines `touches` has a bit for, and lets `judge` take them whenever
    /// there are many.
    #[inline]
    pub fn add(
        &mut self,
        grid: &ApexGrid,
        row: usize,
        columns: [usize; 2],
        touches: impl Fn([&[f32; LANES]; 2]) -> u32,
        judge: &mut impl FnMut(&[u32]),
    ) {
        let mut first = grid.starts[row * grid.cells[0] + columns[0]] as usize;
        let end = grid.starts[row * grid.cells[0] + columns[1] + 1] as usize;
        while first < end {
            let left = LANES.min(end - first);
            let touched = touches(grid.slopes_from(first)) & ((1 << left) - 1);
            let lanes = &SET_LANES[touched as usize % SET_LANES.len()];
            let free = &mut self.places[self.count..self.count + LANES];
            for (place, lane) in free.iter_mut().zip(lanes) {
                *place = first as u32 + lane;
            }
            self.count += touched.count_ones() as usize;
            if self.count > WAITING - LANES {
                self.flush(judge);
            }
            first += LANES;
        }
    }
}

impl ApexGrid {
    #[inline]
    fn slopes_from(&self, first: usize) -> [&[f32; LANES]; 2] {
        let lanes = |axis: usize| self.slopes[axis][first..].first_chunk();
        [0, 1].map(|axis| lanes(axis).expect("slopes are followed by as many zeros"))
    }
}

/// For each set of lanes, those in it, in order, before the others' zeros.
static SET_LANES: [[u32; LANES]; 1 << LANES] = {
    let mut sets = [[0; LANES]; 1 << LANES];
    let mut set = 0;
    while set < sets.len() {
        let (mut lane, mut count) = (0, 0);
        while lane < LANES {
            if set >> lane & 1 == 1 {
                sets[set][count] = lane as u32;
                count += 1;
            }
            lane += 1;
        }
        set += 1;
    }
    sets
};
