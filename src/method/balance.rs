//! How the time of a pass is shared out among the kinds of samples that a picture is made of, by what each costs and how noisy
//! it is; and which receivers look for lamps by themselves. Costs are counted, not timed: the same scene gets the same samples
//! on every machine. [Shares of a pass]

use super::Counters;
use crate::plan::Connections;
use crate::transport::counters::SEGMENTS_PER_USUAL_WALK;
use crate::transport::photon::{Family, PerFamily};

/// What tracing a pixel's ray path costs with its share of trees and film, in segments of photons' walks; measured on two
/// cores, see docs/PERFORMANCE.md. The same for a ray that looks for emission alone and a sample of the lamps.
const SEGMENTS_PER_RAY_PATH: f64 = 12.0;
const SEGMENTS_PER_EMISSION_RAY: f64 = 6.0;
const SEGMENTS_PER_CONNECTION: f64 = 1.0;
/// What all samples may cost over what ray paths do. Pictures need some ray paths, whatever is noisy, and radii shrink from
/// pass to pass.
const RATIO: [f64; 2] = [0.5, 4.0];
/// Photons per pixel that a pilot takes, and bounds of what it may lead to.
const PILOT: f64 = 0.5;
/// Where photons are dearer than usual, pilots have the fewer of them, but at least so many.
const FEWEST_OF_PILOT: u64 = 1 << 8;
const PHOTONS_PER_PIXEL: [f64; 2] = [0.125, 32.0];
const FEWEST_PHOTONS: u64 = 1 << 12;
/// Bounds of the samples of lamps for each receiver, and how many a trial takes.
const SAMPLES_OF_LAMPS: [f64; 2] = [1.0, 256.0];
pub const TRIAL_SAMPLES_OF_LAMPS: u32 = 4;
/// Bounds of the further rays for emission, per pixel of the film.
const EMISSION_RAYS: [f64; 2] = [0.5, 4.0];
/// Photons blur what lamps light, connections do not: these give way where that saves more than so much.
const WORTH_BLUR: f64 = 2.0;

/// Photons of a pilot pass, which is thrown away, if they cost no more than usual.
pub fn pilot(pixels: u64) -> u64 {
    ((PILOT * pixels as f64) as u64).max(FEWEST_PHOTONS)
}

/// So many photons, or those of them that cost what usual ones would. Before passes begin nobody is to wait longer where
/// photons are dear: as beams, where thousands overlap each receiver.
pub fn affordable(photons: u64, probe: &Counters) -> u64 {
    let dearness = (probe.cost_of_walk() / SEGMENTS_PER_USUAL_WALK).max(1.0);
    ((photons as f64 / dearness) as u64).max(FEWEST_OF_PILOT.min(photons))
}

/// A kind of sample: the variance that one of them for each pixel leaves, relative to brightness, and its cost in segments.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Kind {
    pub variance: f64,
    pub cost: f64,
}

impl Kind {
    /// A ray path.
    pub fn ray_path(variance: f64) -> Self {
        Kind { variance, cost: SEGMENTS_PER_RAY_PATH }
    }

    /// Rays that look for emission, in a share of the pixels.
    pub fn emission_ray(variance: f64, share: f64) -> Self {
        Kind { variance, cost: SEGMENTS_PER_EMISSION_RAY * share }
    }

    /// A sample of the lamps for each of a pixel's receivers.
    pub fn lamp_sample(variance: f64, receivers: f64) -> Self {
        Kind { variance, cost: SEGMENTS_PER_CONNECTION * receivers }
    }

    /// A photon, which costs what those of a pilot did.
    pub fn photon(variance: f64, pilot: &Counters) -> Self {
        Kind { variance, cost: pilot.cost_of_walk() }
    }

    fn and(self, other: Kind) -> Self {
        Kind { variance: self.variance + other.variance, cost: self.cost + other.cost }
    }

    /// So many of them.
    fn times(self, count: f64) -> Self {
        Kind { variance: self.variance / count, cost: self.cost * count }
    }
}

/// A kind of sample of which a pass takes a given number, or as many as are best within bounds.
#[derive(Debug, Clone, Copy)]
struct Wanted {
    kind: Kind,
    given: Option<f64>,
    bounds: [f64; 2],
}

/// How many samples of each kind a pass takes, and what it then is: a variance and a cost.
struct Shares<const N: usize> {
    counts: [f64; N],
    pass: Kind,
}

/// Shares that leave the least noise for the time, beside a base that every pass has.
// [Shares of a pass]
fn share<const N: usize>(base: Kind, wanted: [Wanted; N]) -> Shares<N> {
    let given = |w: &Wanted| w.given.map(|count| w.kind.times(count));
    let base = wanted.iter().filter_map(given).fold(base, Kind::and);
    let open = || wanted.iter().filter(|w| w.given.is_none() && w.kind.cost > 0.0);
    let spread: f64 = open().map(|w| (w.kind.variance * w.kind.cost).sqrt()).sum();
    let [least, most] = RATIO;
    // Where ray paths are not noisy at all, the quotient is infinite or, of nothing at all, not a number.
    let ratio = (spread / (base.variance * base.cost).sqrt()).max(least).min(most);
    let counts = wanted.map(|w| {
        let best = || {
            let weight = (w.kind.variance / w.kind.cost).sqrt();
            if spread > 0.0 && weight.is_finite() {
                weight * ratio * base.cost / spread
            } else {
                0.0
            }
        };
        let [fewest, most] = w.bounds;
        w.given.unwrap_or_else(|| best().clamp(fewest, most))
    });
    let samples = wanted.iter().zip(counts).filter(|(w, _)| w.given.is_none());
    let pass = samples.fold(base, |sum, (w, count)| sum.and(w.kind.times(count)));
    Shares { counts, pass }
}

/// What a trial found out.
#[derive(Debug, Clone)]
pub struct Trial {
    pub ray_path: Kind,
    /// With one ray per pixel to be shared by those where it is worth it.
    pub emission_ray: Kind,
    /// What share of the pixels those are.
    pub emission_share: f64,
    pub lamp_sample: PerFamily<Kind>,
    /// Photons where no connections are made, and where all are that can be: by what family of receivers sees of them.
    pub alone: Option<PerFamily<Kind>>,
    pub beside: Option<PerFamily<Kind>>,
}

/// What the user wants.
#[derive(Debug, Clone, Copy)]
pub struct Given {
    pub photons_per_pixel: Option<f64>,
    pub lamp_samples: Option<f64>,
    /// Passes that share their ray paths.
    pub passes: f64,
}

/// What passes are to be made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Choice {
    pub connections: Connections,
    pub photons_per_pixel: f64,
    /// Per pixel of the film.
    pub emission_rays: f64,
}

impl Choice {
    /// Photons of a pass.
    pub fn photons(&self, pixels: u64) -> u64 {
        ((self.photons_per_pixel * pixels as f64) as u64).max(FEWEST_PHOTONS)
    }
}

/// The best of the ways to share the light between connections and photons that the trial tried.
pub fn choose(trial: &Trial, candidates: Connections, given: Given) -> Choice {
    let ways = || [(true, true), (true, false), (false, true), (false, false)].into_iter();
    let possible = |&(visible_points, view_beams): &(bool, bool)| {
        let within =
            visible_points <= candidates.visible_points && view_beams <= candidates.view_beams;
        let all =
            visible_points == candidates.visible_points && view_beams == candidates.view_beams;
        let any = visible_points || view_beams;
        within && (trial.alone.is_some() || all) && (trial.beside.is_some() || !any)
    };
    let mut best: Option<(f64, Choice)> = None;
    for (visible_points, view_beams) in ways().filter(possible) {
        let connections = Connections { visible_points, view_beams, samples: 1 };
        let (pass, choice) = made_of(trial, connections, given);
        // What comes first connects more.
        let worth = pass.variance * pass.cost * if best.is_some() { WORTH_BLUR } else { 1.0 };
        if best.is_none_or(|(least, _)| worth < least) {
            let own = pass.variance * pass.cost;
            best = Some((own, choice));
        }
    }
    best.expect("some way is possible").1
}

/// A pass in which these receivers look for lamps by themselves, and photons carry the rest.
fn made_of(trial: &Trial, connections: Connections, given: Given) -> (Kind, Choice) {
    let connects =
        PerFamily { surface: connections.visible_points, medium: connections.view_beams };
    let (mut lamp_sample, mut photon) = (Kind::default(), Kind::default());
    for family in Family::ALL {
        if connects[family] {
            lamp_sample = lamp_sample.and(trial.lamp_sample[family]);
        }
        let of = if connects[family] { &trial.beside } else { &trial.alone };
        let of = of.as_ref().or(trial.beside.as_ref()).or(trial.alone.as_ref());
        let Kind { variance, cost } = of.expect("photons were tried")[family];
        photon = Kind { variance: photon.variance + variance, cost: photon.cost.max(cost) };
    }
    let wanted = |kind, given, bounds| Wanted { kind, given, bounds };
    let shares = share(
        trial.ray_path,
        [
            wanted(lamp_sample, given.lamp_samples, SAMPLES_OF_LAMPS),
            wanted(photon.times(given.passes), given.photons_per_pixel, PHOTONS_PER_PIXEL),
            // A ray path's own ray is the first.
            wanted(trial.emission_ray, None, [1.0, f64::INFINITY]),
        ],
    );
    let [samples, photons_per_pixel, emission_rays] = shares.counts;
    let [fewest, most] = EMISSION_RAYS;
    let choice = Choice {
        connections: Connections { samples: samples.round() as u32, ..connections },
        photons_per_pixel,
        emission_rays: ((emission_rays - 1.0) * trial.emission_share).clamp(fewest, most),
    };
    (shares.pass, choice)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn open(variance: f64, cost: f64) -> Wanted {
        Wanted { kind: Kind { variance, cost }, given: None, bounds: [0.0, f64::INFINITY] }
    }

    fn product(pass: Kind) -> f64 {
        pass.variance * pass.cost
    }

    /// By the inequality of Cauchy and Schwarz no shares leave less noise for the time than (sum of sqrt(variance cost))².
    #[test]
    fn shares_are_the_best() {
        let base = Kind { variance: 0.5, cost: 12.0 };
        let wanted = [open(2.0, 1.0), open(0.7, 6.0)];
        let Shares { counts, pass } = share(base, wanted);
        let best = (6.0f64.sqrt() + 2.0f64.sqrt() + 4.2f64.sqrt()).powi(2);
        assert!((product(pass) - best).abs() < 1e-9 * best, "{} instead of {best}", product(pass));
        for (which, factor) in [(0, 0.8), (0, 1.25), (1, 0.8), (1, 1.25)] {
            let mut other = counts;
            other[which] *= factor;
            let made = wanted.iter().zip(other).fold(base, |sum, (w, n)| sum.and(w.kind.times(n)));
            assert!(product(made) > product(pass), "{other:?} is better than {counts:?}");
        }
    }

    /// Ray paths without noise would never get another turn, and ones with nothing but noise no samples: both have bounds.
    #[test]
    fn ray_paths_and_samples_keep_a_share() {
        let wanted = [open(2.0, 1.0), open(0.5, 4.0)];
        let spent = |variance| {
            let shares = share(Kind { variance, cost: 12.0 }, wanted);
            (shares.counts[0] + 4.0 * shares.counts[1]) / 12.0
        };
        assert!((spent(0.0) - RATIO[1]).abs() < 1e-9);
        assert!((spent(1e9) - RATIO[0]).abs() < 1e-9);
        // As much for either kind: sqrt(2 * 1) = sqrt(0.5 * 4).
        let counts = share(Kind { variance: 0.0, cost: 12.0 }, wanted).counts;
        assert!((counts[0] - 4.0 * counts[1]).abs() < 1e-9, "{counts:?}");
    }

    #[test]
    fn given_numbers_stay() {
        let given = Wanted { given: Some(3.0), ..open(0.3, 1.0) };
        let Shares { counts, pass } =
            share(Kind { variance: 0.05, cost: 12.0 }, [given, open(1.0, 1.0)]);
        assert_eq!(counts[0], 3.0);
        let base: f64 = (0.05 + 0.3 / 3.0) * 15.0;
        assert!((product(pass) - (base.sqrt() + 1.0).powi(2)).abs() < 1e-9);
    }

    #[test]
    fn without_any_noise_samples_are_the_fewest() {
        let nothing = Wanted { bounds: [1.0, 9.0], ..open(0.0, 0.0) };
        assert_eq!(share(Kind::ray_path(0.0), [nothing]).counts, [1.0]);
    }

    const BOTH: Connections = Connections { visible_points: true, view_beams: true, samples: 4 };
    const OPEN: Given = Given { photons_per_pixel: None, lamp_samples: None, passes: 1.0 };

    /// A trial in which photons are as noisy with connections beside them and without, by family.
    fn trial(lamp_sample: [f64; 2], alone: [f64; 2], beside: [f64; 2]) -> Trial {
        let photon = |variances: [f64; 2]| PerFamily {
            surface: Kind { variance: variances[0], cost: 4.0 },
            medium: Kind { variance: variances[1], cost: 4.0 },
        };
        Trial {
            ray_path: Kind::ray_path(1e-3),
            emission_ray: Kind::default(),
            emission_share: 0.0,
            lamp_sample: PerFamily {
                surface: Kind::lamp_sample(lamp_sample[0], 1.0),
                medium: Kind::lamp_sample(lamp_sample[1], 1.0),
            },
            alone: Some(photon(alone)),
            beside: Some(photon(beside)),
        }
    }

    #[test]
    fn families_connect_where_that_leaves_less_noise() {
        let chosen = |trial: &Trial| {
            let Connections { visible_points, view_beams, .. } =
                choose(trial, BOTH, OPEN).connections;
            [visible_points, view_beams]
        };
        assert_eq!(chosen(&trial([0.01, 0.01], [1.0, 1.0], [0.01, 0.01])), [true, true]);
        assert_eq!(chosen(&trial([0.01, 5.0], [1.0, 0.1], [0.01, 0.1])), [true, false]);
        assert_eq!(chosen(&trial([5.0, 5.0], [0.1, 0.1], [0.1, 0.1])), [false, false]);
        // Photons blur: as good is not good enough.
        assert_eq!(chosen(&trial([0.2, 0.2], [0.4, 0.4], [0.2, 0.2])), [true, true]);
    }

    /// What the user wants is what is tried.
    #[test]
    fn wishes_are_granted() {
        let forced = Trial { alone: None, ..trial([9.0, 9.0], [0.1, 0.1], [0.1, 0.1]) };
        assert!(choose(&forced, BOTH, OPEN).connections.are_made_like(BOTH));
        let refused = Trial { beside: None, ..trial([0.0, 0.0], [9.0, 9.0], [9.0, 9.0]) };
        assert!(!choose(&refused, Connections::NONE, OPEN).connections.any());
        let given = Given { photons_per_pixel: Some(7.0), lamp_samples: Some(3.0), passes: 1.0 };
        let choice = choose(&forced, BOTH, given);
        assert_eq!((choice.connections.samples, choice.photons_per_pixel), (3, 7.0));
    }

    /// A pilot costs what usual walks do, cheap photons are not more, and some are left however dear they are.
    #[test]
    fn pilots_cost_no_more_than_usual() {
        let probe = |segments, medium_deposits| Counters {
            walks: 100,
            segments,
            medium_deposits,
            ..Counters::default()
        };
        assert_eq!(affordable(12_800, &probe(300, 0)), 12_800);
        assert_eq!(affordable(12_800, &probe(800, 0)), 12_800);
        // 6 segments and 78 deposits, three of which cost a segment: 32 segments instead of 8.
        assert_eq!(affordable(12_800, &probe(600, 7_800)), 3_200);
        assert_eq!(affordable(12_800, &probe(600, 30_000_000)), FEWEST_OF_PILOT);
        assert_eq!(affordable(40, &probe(600, 30_000_000)), 40);
    }

    #[test]
    fn dear_photons_are_fewer() {
        let pilot = |segments, medium_deposits| Counters {
            walks: 1000,
            segments,
            medium_deposits,
            ..Counters::default()
        };
        assert_eq!(Kind::photon(1.0, &pilot(2_000, 0)).cost, 2.0);
        assert_eq!(Kind::photon(1.0, &pilot(6_000, 24_000)).cost, 14.0);
    }
}
