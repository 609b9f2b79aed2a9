//! Deposits kept by walk, for as long as a chain may have to repeat them.

use crate::transport::deposits::{Deposit, Sink};
use crate::transport::photon::{Family, PerFamily};
use crate::transport::splat::Splat;

/// Deposits of the families that have chains, by walk; those of the others are splatted.
pub struct Trails {
    has_chains: PerFamily<bool>,
    trails: PerFamily<Vec<(u32, Deposit)>>,
    splat: Splat,
}

impl Trails {
    pub fn new(has_chains: PerFamily<bool>, places: usize) -> Self {
        Trails { has_chains, trails: PerFamily::default(), splat: Splat::new(places) }
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

    /// The deposits of families without chains.
    pub fn into_splat(self) -> Splat {
        self.splat
    }
}

impl Sink for Trails {
    fn push(&mut self, walk: u32, family: Family, deposit: Deposit) {
        if self.has_chains[family] {
            self.trails[family].push((walk, deposit));
        } else {
            self.splat.push(walk, family, deposit);
        }
    }

    fn append(&mut self, mut other: Self) {
        self.splat.append(other.splat);
        for family in Family::ALL {
            self.trails[family].append(&mut other.trails[family]);
        }
    }
}
