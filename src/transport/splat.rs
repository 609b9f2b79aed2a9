//! Deposits that are added to pixels at once, and which walks they came from.

use super::deposits::{Deposit, Deposits, Sink};
use super::photon::{Family, PerFamily};

/// Deposits by share of the pixels, and which walks were seen.
pub struct Splat {
    pub deposits: Deposits,
    /// A walk and family for each vertex or beam that added something; neighbours are not repeated.
    seen: Vec<(u32, Family)>,
}

impl Splat {
    pub fn new(places: usize) -> Self {
        Splat { deposits: Deposits::new(places), seen: Vec::new() }
    }

    /// The number of walks that added something, by family.
    pub fn visible_walks(&self) -> PerFamily<u64> {
        let walks = self.seen.iter().map(|&(walk, _)| walk as usize + 1).max().unwrap_or(0);
        PerFamily::from_fn(|family| {
            let mut is_seen = vec![false; walks];
            for &(walk, _) in self.seen.iter().filter(|(_, of)| *of == family) {
                is_seen[walk as usize] = true;
            }
            is_seen.iter().filter(|seen| **seen).count() as u64
        })
    }
}

impl Sink for Splat {
    fn push(&mut self, walk: u32, family: Family, deposit: Deposit) {
        self.deposits.push(deposit);
        if self.seen.last() != Some(&(walk, family)) {
            self.seen.push((walk, family));
        }
    }

    fn append(&mut self, mut other: Self) {
        self.deposits.append(other.deposits);
        self.seen.append(&mut other.seen);
    }
}
