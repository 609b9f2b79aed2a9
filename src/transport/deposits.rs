//! What photons add to pixels, in an order that does not depend on the number of threads.

use super::photon::Family;
use crate::math::Rgb;
use crate::scene::work;
use crate::scene::Scene;
use rayon::prelude::*;

/// Pixels are added up in this many independent shares, so that the order of additions within a pixel
/// does not depend on the number of threads.
const SHARES: usize = 32;
/// Fewer deposits than this are added up sooner than other threads wake up.
const ADDED_ALONE: usize = 8192;
/// More deposits than this are taken over as they lie; fewer are sooner copied.
const COPIED: usize = 8192;

/// What one photon adds to one sum: radiance times the number of emitted walks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deposit {
    /// The receiver's place in [`PixelSums`].
    pub pixel: u32,
    pub radiance: Rgb,
    /// What the deposit says of the kernel's bias, in the unit of the radiance, as a mean over channels.
    // [Bias of a kernel]
    pub bias: f32,
}

impl Deposit {
    /// The same several times.
    pub fn times(self, count: f32) -> Self {
        Deposit { radiance: self.radiance * count, bias: self.bias * count, ..self }
    }

    /// Red, green, blue and bias, as sums hold them.
    pub fn values(&self) -> [f64; 4] {
        let Rgb { r, g, b } = self.radiance;
        [r, g, b, self.bias].map(f64::from)
    }
}

/// Where the deposits of walks go.
pub trait Sink: Send {
    /// Takes what `walk` (an index within its batch) adds.
    fn push(&mut self, walk: u32, family: Family, deposit: Deposit);

    /// Takes over what another sink holds, behind its own.
    fn append(&mut self, other: Self);
}

/// Deposits in the order of their photons, by share of the pixels.
#[derive(Debug)]
pub struct Deposits {
    /// What was taken over from others, in its order, and the newest.
    taken: Vec<Shares>,
    newest: Shares,
    places: usize,
    /// Places of a share, as a power of two: to shift is sooner done than to divide.
    share_bits: u32,
}

type Shares = Vec<Vec<Deposit>>;

fn count(shares: &Shares) -> usize {
    shares.iter().map(Vec::len).sum()
}

impl Deposits {
    /// For so many sums.
    pub fn new(places: usize) -> Self {
        Deposits {
            taken: Vec::new(),
            newest: vec![Vec::new(); SHARES],
            places,
            share_bits: places.div_ceil(SHARES).max(1).next_power_of_two().trailing_zeros(),
        }
    }

    /// Sums that deposits may name.
    pub fn places(&self) -> usize {
        self.places
    }

    pub fn push(&mut self, deposit: Deposit) {
        self.newest[deposit.pixel as usize >> self.share_bits].push(deposit);
    }

    pub fn append(&mut self, mut other: Deposits) {
        if other.count() > COPIED {
            self.taken.push(std::mem::replace(&mut self.newest, vec![Vec::new(); SHARES]));
            self.taken.append(&mut other.taken);
            self.taken.push(other.newest);
            return;
        }
        for theirs in other.taken.iter_mut().chain([&mut other.newest]) {
            for (mine, theirs) in self.newest.iter_mut().zip(theirs) {
                mine.append(theirs);
            }
        }
    }

    pub fn count(&self) -> usize {
        self.taken.iter().chain([&self.newest]).map(count).sum()
    }

    /// Those of one share, in their order.
    fn of_share(&self, share: usize) -> impl Iterator<Item = &Deposit> {
        self.taken.iter().chain([&self.newest]).flat_map(move |shares| &shares[share])
    }
}

/// Sums per pixel of radiance and of its bias, in f64: f32 sums stop moving. Layers are kept apart where that is asked for.
#[derive(Debug, Clone, Default)]
pub struct PixelSums {
    /// One place per pixel or, with layers, one for its surfaces and, behind all of those, one for its media.
    sums: Vec<[f64; 4]>,
    pixels: usize,
    /// Deposits added, by place; empty without layers.
    counts: Vec<u64>,
}

impl PixelSums {
    pub fn new(pixels: usize) -> Self {
        PixelSums { sums: vec![[0.0; 4]; pixels], pixels, counts: Vec::new() }
    }

    /// With surfaces and media apart, and deposits counted.
    pub fn layered(pixels: usize) -> Self {
        PixelSums { sums: vec![[0.0; 4]; 2 * pixels], pixels, counts: vec![0; 2 * pixels] }
    }

    /// Pixels.
    pub fn len(&self) -> usize {
        self.pixels
    }

    pub fn is_empty(&self) -> bool {
        self.pixels == 0
    }

    /// Sums that deposits may name.
    pub fn places(&self) -> usize {
        self.sums.len()
    }

    pub fn radiance(&self, pixel: usize) -> [f64; 3] {
        let [r, g, b, _] = self.total(pixel);
        [r, g, b]
    }

    /// What receivers of one family got, of a pixel whose layers are kept apart.
    pub fn radiance_of(&self, family: Family, pixel: usize) -> [f64; 3] {
        let [r, g, b, _] = match family {
            Family::Surface => self.sums[pixel],
            Family::Medium => self.sums[self.pixels + pixel],
        };
        [r, g, b]
    }

    pub fn bias(&self, pixel: usize) -> f64 {
        self.total(pixel)[3]
    }

    /// Deposits on a pixel; 0 where none are counted. What a chain's state adds as it stays counts once.
    pub fn deposits(&self, pixel: usize) -> u64 {
        let places = [pixel, self.pixels + pixel];
        places.iter().filter_map(|&place| self.counts.get(place)).sum()
    }

    fn total(&self, pixel: usize) -> [f64; 4] {
        let mut total = self.sums[pixel];
        if let Some(further) = self.sums.get(self.pixels + pixel) {
            total.iter_mut().zip(further).for_each(|(sum, value)| *sum += value);
        }
        total
    }

    pub fn clear(&mut self) {
        self.sums.fill([0.0; 4]);
        self.counts.fill(0);
    }

    /// Adds the [`Deposit::values`] of so many deposits to one place.
    pub fn add_to(&mut self, place: usize, values: [f64; 4], scale: f64, deposits: u64) {
        for (sum, value) in self.sums[place].iter_mut().zip(values) {
            *sum += value * scale;
        }
        if let Some(count) = self.counts.get_mut(place) {
            *count += deposits;
        }
    }

    /// Adds batches in their order, each pixel by one task. The scene lends the threads that do it.
    pub fn add(&mut self, scene: &dyn Scene, batches: &[Deposits], scale: f64) {
        let Some(first) = batches.first() else { return };
        let pixels = 1 << first.share_bits;
        let add = |(share, sums): (usize, &mut [[f64; 4]])| {
            let start = share * pixels;
            for deposit in batches.iter().flat_map(|batch| batch.of_share(share)) {
                let sum = &mut sums[deposit.pixel as usize - start];
                for (sum, value) in sum.iter_mut().zip(deposit.values()) {
                    *sum += value * scale;
                }
            }
        };
        let is_worth_it = batches.iter().map(Deposits::count).sum::<usize>() >= ADDED_ALONE;
        let shares = self.sums.chunks_mut(pixels).enumerate().collect();
        work::for_each_if(is_worth_it, scene, shares, add);
        let counts = self.counts.chunks_mut(pixels).enumerate().collect();
        work::for_each(scene, counts, |(share, counts): (usize, &mut [u64])| {
            for deposit in batches.iter().flat_map(|batch| batch.of_share(share)) {
                counts[deposit.pixel as usize - share * pixels] += 1;
            }
        });
    }

    /// Adds other sums, scaled, and sets them to zero.
    pub fn drain(&mut self, other: &mut PixelSums, scale: f64) {
        self.sums.par_iter_mut().zip(&mut other.sums).for_each(|(mine, theirs)| {
            for (mine, theirs) in mine.iter_mut().zip(theirs) {
                *mine += std::mem::take(theirs) * scale;
            }
        });
        for (mine, theirs) in self.counts.iter_mut().zip(&mut other.counts) {
            *mine += std::mem::take(theirs);
        }
    }
}
