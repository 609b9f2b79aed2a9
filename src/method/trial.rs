//! A trial before the first pass: samples of each kind are drawn twice, and how far the two differ says how noisy they are. All of
//! them are thrown away, so that what is chosen by them does not depend on what it is chosen for.

use super::balance::{self, Kind, TRIAL_SAMPLES_OF_LAMPS};
use super::ground::Ground;
use super::{Counters, RenderError};
use crate::math::Rgb;
use crate::plan::Connections;
use crate::transport::connect;
use crate::transport::deposits::PixelSums;
use crate::transport::photon::{Family, PerFamily};
use crate::transport::view::{self, ViewPaths};

/// Numbers of the trial's draws, from the other end than jitters; those of lessons in emission are the very last.
const DRAWS: u64 = u64::MAX - (1 << 16);

/// Side of the squares of pixels over which brightness is averaged.
const BLOCK: usize = 16;

/// Brightness by pixel.
type Picture = Vec<f64>;

/// What lamps light, by the family of the receivers that looked for them, and emission that is seen directly.
struct Seen {
    connected: PerFamily<Picture>,
    emission: Picture,
}

/// Ray paths of the first jitter and of another one, and what they saw.
pub struct Trial {
    /// Of the film, in pixels.
    width: usize,
    /// Which connections were tried.
    pub candidates: Connections,
    first: Seen,
    /// Connections at the same ray paths once more.
    again: PerFamily<Picture>,
    other: Seen,
}

/// Two pilot passes of photons, which each shot as many.
pub struct Pilots {
    pub sums: [PixelSums; 2],
    pub counters: Counters,
}

impl Trial {
    /// Looks for lamps from the first jitter's ray paths and from another's. Returns these, with layers apart, for pilots: the
    /// scene keeps points of the paths that were traced last.
    pub fn new(
        ground: &Ground,
        candidates: Connections,
        mut paths: ViewPaths,
    ) -> Result<(Self, ViewPaths), RenderError> {
        let candidates = Connections { samples: TRIAL_SAMPLES_OF_LAMPS, ..candidates };
        let plan = ground.plan.connecting(candidates);
        let look = |number: u64, paths: &mut ViewPaths| -> Result<Seen, RenderError> {
            if candidates.any() {
                connect::connect(ground.scene, &plan, ground.seed, DRAWS - number, paths)?;
            }
            Ok(Seen::on(paths))
        };
        paths.keep_layers_apart();
        let again = look(0, &mut paths)?.connected;
        let first = look(1, &mut paths)?;
        let mut others = view::trace(ground.scene, &plan, ground.seed, DRAWS)?;
        others.keep_layers_apart();
        let other = look(2, &mut others)?;
        let width = ground.scene.description().film_size[0] as usize;
        let trial = Trial { width, candidates, first, again, other };
        Ok((trial, others))
    }

    /// What is worth knowing of it and of pilots without connections and with them. Emission that has rays of its own in a
    /// share of the pixels adds nothing to the noise of ray paths.
    pub fn judge(
        &self,
        alone: Option<&Pilots>,
        beside: Option<&Pilots>,
        emission_share: Option<f64>,
    ) -> balance::Trial {
        let scales = self.scales(alone, beside);
        let alone = alone.filter(|pilots| self.are_seen(pilots, beside));
        let variance = |a: &Picture, b: &Picture| halved_squares(&scales, a, b);
        let samples = f64::from(TRIAL_SAMPLES_OF_LAMPS);
        let of_samples = PerFamily::from_fn(|family| {
            variance(&self.first.connected[family], &self.again[family])
        });
        let both = |seen: &PerFamily<Picture>| sum(&seen.surface, &seen.medium);
        let between = variance(&both(&self.first.connected), &both(&self.other.connected));
        let of_paths = (between - of_samples.surface - of_samples.medium).max(0.0);
        let of_emission = variance(&self.first.emission, &self.other.emission);
        let photons = |pilots: &Pilots| {
            let per_pixel = pilots.counters.walks as f64 / 2.0 / scales.len() as f64;
            PerFamily::from_fn(|family| {
                let [a, b] = [0, 1].map(|which: usize| layer(&pilots.sums[which], family));
                Kind::photon(per_pixel * variance(&a, &b), &pilots.counters)
            })
        };
        let emission_share_or_none = emission_share.unwrap_or(0.0);
        balance::Trial {
            ray_path: Kind::ray_path(match emission_share {
                Some(_) => of_paths,
                None => of_paths + of_emission,
            }),
            emission_ray: match emission_share {
                Some(share) => Kind::emission_ray(of_emission, share),
                None => Kind::default(),
            },
            emission_share: emission_share_or_none,
            lamp_sample: PerFamily::from_fn(|family| {
                Kind::lamp_sample(samples * of_samples[family], 1.0)
            }),
            alone: alone.map(photons),
            beside: beside.map(photons),
        }
    }

    /// Whether photons that carry everything show at least half of the light that connections and the photons beside them do. If
    /// not, those that matter were too rare to be met, and nothing is known of their noise.
    fn are_seen(&self, alone: &Pilots, beside: Option<&Pilots>) -> bool {
        let of_pilots = |pilots: &Pilots| -> f64 {
            let of_family = |family| {
                pilots.sums.iter().map(|sums| layer(sums, family).iter().sum::<f64>()).sum::<f64>()
            };
            0.5 * Family::ALL.into_iter().map(of_family).sum::<f64>()
        };
        let Some(beside) = beside else { return true };
        let connected = |family| self.first.connected[family].iter().sum::<f64>();
        let all = of_pilots(beside) + Family::ALL.into_iter().map(connected).sum::<f64>();
        of_pilots(alone) >= 0.5 * all
    }

    /// Mean brightness of the picture.
    pub fn level(&self, alone: Option<&Pilots>, beside: Option<&Pilots>) -> f32 {
        let brightness = self.brightness(alone, beside);
        (brightness.iter().sum::<f64>() / brightness.len().max(1) as f64) as f32
    }

    /// By pixel, what an error is measured by: the picture's brightness and that of what is around the pixel. Its own would not do,
    /// for where photons are rare it is made by those that are to be judged.
    fn scales(&self, alone: Option<&Pilots>, beside: Option<&Pilots>) -> Picture {
        let level = f64::from(self.level(alone, beside));
        let own = self.brightness(alone, beside);
        let columns = self.width.div_ceil(BLOCK);
        let block =
            |pixel: usize| pixel / self.width / BLOCK * columns + pixel % self.width / BLOCK;
        let blocks = own.len().div_ceil(self.width.max(1)).div_ceil(BLOCK) * columns;
        let mut means = vec![[0.0; 2]; blocks];
        for (pixel, own) in own.iter().enumerate() {
            let [sum, count] = &mut means[block(pixel)];
            (*sum, *count) = (*sum + own, *count + 1.0);
        }
        let scale = |pixel| {
            let [sum, count]: [f64; 2] = means[block(pixel)];
            level + sum / count
        };
        (0..own.len()).map(scale).collect()
    }

    fn brightness(&self, alone: Option<&Pilots>, beside: Option<&Pilots>) -> Picture {
        let mut brightness = self.first.emission.clone();
        let mut add = |picture: &Picture, share: f64| {
            brightness.iter_mut().zip(picture).for_each(|(own, added)| *own += share * added);
        };
        for family in Family::ALL {
            // Connections are not as spiky as the photons that would be in their place.
            if let Some(pilots) = beside.or(alone) {
                pilots.sums.iter().for_each(|sums| add(&layer(sums, family), 0.5));
            }
            if beside.is_some() {
                add(&self.first.connected[family], 1.0);
            }
        }
        brightness
    }
}

impl Seen {
    fn on(paths: &ViewPaths) -> Self {
        let pixels = 0..paths.film.len();
        let of = |rgb: Rgb| f64::from(rgb.mean());
        Seen {
            connected: PerFamily::from_fn(|family| {
                pixels.clone().map(|pixel| of(paths.connected_of(family, pixel))).collect()
            }),
            emission: paths.emission.iter().copied().map(of).collect(),
        }
    }
}

fn layer(sums: &PixelSums, family: Family) -> Picture {
    let mean = |pixel: usize| sums.radiance_of(family, pixel).iter().sum::<f64>() / 3.0;
    (0..sums.len()).map(mean).collect()
}

fn sum(a: &Picture, b: &Picture) -> Picture {
    a.iter().zip(b).map(|(a, b)| a + b).collect()
}

/// The variance of either of two independent pictures of the same, relative to brightness, as a mean over pixels.
fn halved_squares(scales: &Picture, a: &Picture, b: &Picture) -> f64 {
    let squared = |((a, b), scale): ((&f64, &f64), &f64)| {
        let relative = (a - b) / scale;
        if relative.is_finite() {
            0.5 * relative * relative
        } else {
            0.0
        }
    };
    a.iter().zip(b).zip(scales).map(squared).sum::<f64>() / scales.len().max(1) as f64
}
