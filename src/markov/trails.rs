//! Deposits kept by walk, for as long as a chain may have to repeat them.

use crate::transport::deposits::{Deposit, Deposits, Sink};
use crate::transport::photon::{Family, PerFamily};

/// Deposits of the families that have chains, by walk; those of the others are splatted.
pub struct Trails {
    has_chains: PerFamily<bool>,
    trails: PerFamily<Vec<(u32, Deposit)>>,
    splat: Deposits,
    splat_seen: PerFamily<Vec<u32>>,
}

impl Trails {
    pub fn new(has_chains: PerFamily<bool>, pixels: usize) -> Self {
        let (trails, splat_seen) = (PerFamily::default(), PerFamily::default());
        Trails { has_chains, trails, splat: Deposits::new(pixels), splat_seen }
    }

    /// Takes out the walks that added something in a family with chains, ascending, each with its
    /// deposits in their order.
    pub fn take(&mut self, family: Family) -> Vec<(u32, Vec<Deposit>)> {
        let mut trail = std::mem::take(&mut self.trails[family]);
        trail.sort_by_key(|&(walk, _)| walk);
        trail
            .chunk_by(|a, b| a.0 == b.0)
            .map(|own| (own[0].0, own.iter().map(|&(_, deposit)| deposit).collect()))
            .collect()
    }

    /// The deposits of families without chains, and how many walks they came from.
    pub fn into_splat(mut self) -> (Deposits, PerFamily<u64>) {
        let seen = PerFamily::from_fn(|family| {
            let walks = &mut self.splat_seen[family];
            walks.sort_unstable();
            walks.dedup();
            walks.len() as u64
        });
        (self.splat, seen)
    }
}

impl Sink for Trails {
    fn push(&mut self, walk: u32, family: Family, deposit: Deposit) {
        if self.has_chains[family] {
            self.trails[family].push((walk, deposit));
            return;
        }
        self.splat.push(deposit);
        if self.splat_seen[family].last() != Some(&walk) {
            self.splat_seen[family].push(walk);
        }
    }

    fn append(&mut self, mut other: Self) {
        self.splat.append(other.splat);
        for family in Family::ALL {
            self.trails[family].append(&mut other.trails[family]);
            self.splat_seen[family].append(&mut other.splat_seen[family]);
        }
    }
}
