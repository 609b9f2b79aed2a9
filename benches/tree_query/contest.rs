use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, BenchmarkId, Criterion, Throughput};

/// What a query found: how many pairs, and a sum over them so that none is optimised away.
#[derive(Default)]
pub struct Found {
    pairs: u64,
    sum: f32,
}

impl Found {
    #[inline]
    pub fn add(&mut self, value: f32) {
        self.pairs += 1;
        self.sum += value;
    }
}

/// Contestants that look for the same pairs; they are timed in pairs per second.
pub struct Contest<'a, P> {
    group: BenchmarkGroup<'a, WallTime>,
    photons: &'a [P],
    receivers: usize,
    /// Pairs of the photons up to each.
    pairs_before: Vec<u64>,
}

impl<'a, P> Contest<'a, P> {
    pub fn new(
        criterion: &'a mut Criterion,
        name: &str,
        photons: &'a [P],
        receivers: usize,
    ) -> Self {
        let mut group = criterion.benchmark_group(name);
        group.sample_size(10);
        Contest { group, photons, receivers, pairs_before: Vec::new() }
    }

    /// Times a loop over the very pairs that `find` accepts; the others must find as many.
    pub fn no_search(
        &mut self,
        find: impl Fn(&P, &mut Vec<u32>),
        value: impl Fn(&P, u32) -> f32 + Copy,
    ) {
        let (mut ends, mut pairs) = (vec![0], Vec::new());
        for photon in self.photons {
            find(photon, &mut pairs);
            ends.push(pairs.len());
        }
        self.pairs_before = ends.iter().map(|&end| end as u64).collect();
        self.group.throughput(Throughput::Elements(pairs.len() as u64));
        self.group.bench_function(BenchmarkId::new("no_search", self.receivers), |bencher| {
            bencher.iter(|| {
                let mut found = Found::default();
                for (photon, range) in self.photons.iter().zip(ends.windows(2)) {
                    pairs[range[0]..range[1]].iter().for_each(|&i| found.add(value(photon, i)));
                }
                found.sum
            });
        });
    }

    /// Times a query, of every photon in the first `1/share` of them.
    pub fn enter(&mut self, name: &str, share: usize, query: impl Fn(&P, &mut Found)) {
        let photons = &self.photons[..self.photons.len() / share];
        let run = || {
            let mut found = Found::default();
            photons.iter().for_each(|photon| query(photon, &mut found));
            found
        };
        let pairs = self.pairs_before[photons.len()];
        assert_eq!(run().pairs, pairs, "{name} finds other pairs");
        self.group.throughput(Throughput::Elements(pairs));
        self.group.bench_function(BenchmarkId::new(name, self.receivers), |bencher| {
            bencher.iter(|| run().sum);
        });
    }

    /// Times a query of all photons in the order of their places, as gathering has them; sorting is part of it.
    pub fn enter_sorted(
        &mut self,
        name: &str,
        place: impl Fn(&P) -> u32,
        query: impl Fn(&[P], &mut Found),
    ) where
        P: Copy,
    {
        self.group.throughput(Throughput::Elements(self.pairs_before[self.photons.len()]));
        self.group.bench_function(BenchmarkId::new(name, self.receivers), |bencher| {
            bencher.iter(|| {
                let mut order: Vec<_> =
                    self.photons.iter().map(|photon| (place(photon), *photon)).collect();
                radsort::sort_by_key(&mut order, |(place, _)| *place);
                let sorted: Vec<P> = order.into_iter().map(|(_, photon)| photon).collect();
                let mut found = Found::default();
                query(&sorted, &mut found);
                found.sum
            });
        });
    }
}
