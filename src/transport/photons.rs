//! Photon walks: shot in batches, deposited into the receivers that they pass, and forgotten. Memory
//! does not depend on how many are shot. [Collin 2013 §5.2]

use crate::density::kernel;
use crate::density::radius::Radii;
use crate::math::{uniform, Rgb};
use crate::medium::phase;
use crate::method::Counters;
use crate::scene::*;
use crate::transport::receivers::Receivers;
use crate::transport::view::Lobe;
use glam::Vec3;
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

/// Deposits that a round of batches may hold before they are added up; bounds memory.
const DEPOSITS_PER_ROUND: usize = 1 << 20;
/// Batches per round at most.
const BATCHES_PER_ROUND: usize = 64;
/// Vertices per task of a gather, and tasks after which pairs are handed to the scene.
const VERTICES_PER_TASK: usize = 1024;
const TASKS_PER_HANDOVER: usize = 8;
/// Pixels are added up in this many independent shares, so that the order of additions within a pixel
/// does not depend on the number of threads.
const SHARES: usize = 32;
/// Cosine between the geometric normals of photon and point above which they lie on one surface.
const SAME_SURFACE: f32 = 0.5;
/// Height of a photon over the point's plane, in radii, up to which they lie on one surface.
const SAME_HEIGHT: f32 = 0.5;

/// What one photon adds to one pixel: radiance times the number of emitted walks.
#[derive(Debug, Clone, Copy)]
struct Deposit {
    pixel: u32,
    radiance: Rgb,
}

/// Deposits in the order of their photons, by share of the pixels.
#[derive(Debug)]
struct Deposits {
    shares: Vec<Vec<Deposit>>,
    pixels_per_share: usize,
}

impl Deposits {
    fn new(pixels: usize) -> Self {
        Deposits {
            shares: (0..SHARES).map(|_| Vec::new()).collect(),
            pixels_per_share: pixels.div_ceil(SHARES).max(1),
        }
    }

    fn push(&mut self, pixel: u32, radiance: Rgb) {
        self.shares[pixel as usize / self.pixels_per_share].push(Deposit { pixel, radiance });
    }

    fn append(&mut self, other: &mut Deposits) {
        for (mine, theirs) in self.shares.iter_mut().zip(&mut other.shares) {
            mine.append(theirs);
        }
    }

    fn len(&self) -> usize {
        self.shares.iter().map(Vec::len).sum()
    }
}

/// Radiance sums per pixel, in f64: f32 sums stop moving.
#[derive(Debug, Clone)]
pub struct PixelSums {
    sums: Vec<[f64; 3]>,
}

impl PixelSums {
    pub fn new(pixels: usize) -> Self {
        PixelSums { sums: vec![[0.0; 3]; pixels] }
    }

    pub fn get(&self, pixel: usize) -> [f64; 3] {
        self.sums[pixel]
    }

    pub fn clear(&mut self) {
        self.sums.fill([0.0; 3]);
    }

    /// Adds batches in their order, each pixel by one task.
    fn add(&mut self, batches: &[Deposits], scale: f64) {
        let Some(first) = batches.first() else { return };
        self.sums.par_chunks_mut(first.pixels_per_share).enumerate().for_each(|(share, sums)| {
            let start = share * first.pixels_per_share;
            for deposit in batches.iter().flat_map(|batch| &batch.shares[share]) {
                let sum = &mut sums[deposit.pixel as usize - start];
                sum[0] += f64::from(deposit.radiance.r) * scale;
                sum[1] += f64::from(deposit.radiance.g) * scale;
                sum[2] += f64::from(deposit.radiance.b) * scale;
            }
        });
    }
}

/// Shoots the uniform photons of one pass after another.
#[derive(Debug)]
pub struct PhotonShooter {
    seed: u64,
    limits: PathLimits,
    batches_per_round: usize,
}

impl PhotonShooter {
    pub fn new(seed: u64, limits: PathLimits) -> Self {
        PhotonShooter { seed, limits, batches_per_round: 4 }
    }

    /// Emits `walks` walks and adds the pass's radiance to `sums`.
    pub fn shoot(
        &mut self,
        scene: &dyn Scene,
        receivers: &Receivers,
        radii: Radii,
        pass: u64,
        walks: u64,
        sums: &mut PixelSums,
    ) -> SceneResult<Counters> {
        let Batching { lanes, concurrent } = scene.batching();
        let lanes = (lanes as u64).min(walks);
        let (seed, limits) = (self.seed, self.limits);
        let run = |batch: u64| -> SceneResult<(Deposits, Counters)> {
            let count = lanes.min(walks - batch * lanes) as usize;
            let rng = uniform::stream(seed, uniform::Purpose::Photons, pass, batch);
            Batch::new(scene, receivers, radii, limits).shoot(count, rng)
        };
        let mut counters = Counters::default();
        let (mut next, end) = (0, walks.div_ceil(lanes));
        while next < end {
            let results: Vec<(Deposits, Counters)> = if concurrent {
                let round = next..end.min(next + self.batches_per_round as u64);
                round.into_par_iter().map(run).collect::<SceneResult<_>>()?
            } else {
                vec![run(next)?]
            };
            next += results.len() as u64;
            let (deposits, counts): (Vec<_>, Vec<_>) = results.into_iter().unzip();
            counts.iter().for_each(|count| counters.add(count));
            // [Collin 2013 (2), (3)]: the sum over photons divided by the number of emitted walks.
            sums.add(&deposits, 1.0 / walks as f64);
            self.plan_round(&deposits);
        }
        Ok(counters)
    }

    /// Sizes the next round by what the last one held.
    fn plan_round(&mut self, deposits: &[Deposits]) {
        let total: usize = deposits.iter().map(Deposits::len).sum();
        let per_batch = total.div_ceil(deposits.len().max(1)).max(1);
        self.batches_per_round = (DEPOSITS_PER_ROUND / per_batch).clamp(1, BATCHES_PER_ROUND);
    }
}

/// One batch of walks, from the lamps to the last deposit.
struct Batch<'a> {
    scene: &'a dyn Scene,
    receivers: &'a Receivers,
    gather: Gather<'a>,
    limits: PathLimits,
}

impl<'a> Batch<'a> {
    fn new(
        scene: &'a dyn Scene,
        receivers: &'a Receivers,
        radii: Radii,
        limits: PathLimits,
    ) -> Self {
        let gather = Gather { receivers, media: &scene.description().media, radii, limits };
        Batch { scene, receivers, gather, limits }
    }

    fn shoot(&self, walks: usize, mut rng: Pcg64Mcg) -> SceneResult<(Deposits, Counters)> {
        let mut deposits = Deposits::new(self.receivers.pixels());
        let mut counters = Counters { walks: walks as u64, ..Counters::default() };
        let (mut numbers, mut vertices) = (Vec::new(), PhotonVertices::default());
        uniform::fill(&mut rng, &mut numbers, EMIT_DIMENSIONS * walks);
        let mut photons = self.scene.emit(walks, &numbers, self.limits)?;
        while photons.lanes() > 0 {
            let lanes = photons.lanes();
            uniform::fill(&mut rng, &mut numbers, PHOTON_STEP_DIMENSIONS * lanes);
            photons.step(&numbers, &mut vertices)?;
            self.deposit(&vertices, &mut deposits, &mut counters)?;
        }
        Ok((deposits, counters))
    }

    fn deposit(
        &self,
        vertices: &PhotonVertices,
        deposits: &mut Deposits,
        counters: &mut Counters,
    ) -> SceneResult<()> {
        let lanes = vertices.event.len();
        let tasks: Vec<_> = (0..lanes)
            .step_by(VERTICES_PER_TASK)
            .map(|a| a..lanes.min(a + VERTICES_PER_TASK))
            .collect();
        for group in tasks.chunks(TASKS_PER_HANDOVER) {
            let gathered: Vec<Gathered> =
                group.par_iter().map(|range| self.gather.run(vertices, range.clone())).collect();
            let mut asked = Asked::default();
            for mut part in gathered {
                deposits.append(&mut part.deposits);
                counters.add(&part.counters);
                asked.append(part.asked);
            }
            asked.resolve(self.scene, deposits, counters)?;
        }
        Ok(())
    }
}

/// What a range of photon vertices gave.
struct Gathered {
    deposits: Deposits,
    asked: Asked,
    counters: Counters,
}

/// Finds the receivers of photons and evaluates what the engine can by itself.
struct Gather<'a> {
    receivers: &'a Receivers,
    media: &'a [Medium],
    radii: Radii,
    limits: PathLimits,
}

impl Gather<'_> {
    fn run(&self, v: &PhotonVertices, range: std::ops::Range<usize>) -> Gathered {
        let mut out = Gathered {
            deposits: Deposits::new(self.receivers.pixels()),
            asked: Asked::default(),
            counters: Counters::default(),
        };
        for lane in range {
            if v.event[lane] & photon_event::INVALID != 0 {
                out.counters.dropped_photons += 1;
            }
            let event = v.event[lane] & !photon_event::INVALID;
            if event == photon_event::NONE {
                continue;
            }
            if !v.flux.rgb(lane).is_finite() || !v.position.get(lane).is_finite() {
                out.counters.dropped_photons += 1;
            } else if event == photon_event::MEDIUM {
                self.medium(v, lane, &mut out);
            } else {
                self.surface(v, lane, &mut out);
            }
        }
        out
    }

    fn within_depth(&self, view: u32, photon: u32) -> bool {
        // Scattering here counts once, and a path keeps fewer than `max_depth` scattering events.
        view.saturating_add(photon).saturating_add(2) <= self.limits.max_depth
    }

    // [Collin 2013 (4)], with the albedo in place of sigma_s: photons are stored per collision.
    fn medium(&self, v: &PhotonVertices, lane: usize, out: &mut Gathered) {
        out.counters.medium_photons += 1;
        let (position, direction) = (v.position.get(lane), v.direction.get(lane));
        let (medium, depth) = (v.medium[lane], v.depth[lane]);
        let flux = v.flux.rgb(lane) * kernel::disk(self.radii.medium);
        let phase = self.media[medium as usize].phase;
        let paths = &self.receivers.paths;
        self.receivers.beam_tree.query(position, self.radii.medium, |index, t, _| {
            let beam = &paths.beams[index as usize];
            if beam.medium != medium || !self.within_depth(beam.depth, depth) {
                return;
            }
            let tr = paths.beam_transmittance(beam, self.media, t);
            let weighted = beam.throughput * tr * flux;
            let cosine = -direction.dot(beam.segment.direction);
            match phase {
                Phase::Isotropic => out.keep(beam.pixel, weighted * phase::ISOTROPIC, true),
                Phase::HenyeyGreenstein { g } => {
                    out.keep(beam.pixel, weighted * phase::henyey_greenstein(g, cosine), true);
                }
                Phase::Opaque => {
                    let view = beam.segment.direction;
                    out.asked.phase(medium, position, direction, view, beam.pixel, weighted);
                }
            }
        });
    }

    // [Collin 2013 (5)], without the cosine: the density of photons on a surface holds it.
    fn surface(&self, v: &PhotonVertices, lane: usize, out: &mut Gathered) {
        out.counters.surface_photons += 1;
        let (position, direction) = (v.position.get(lane), v.direction.get(lane));
        let (normal, depth) = (v.geometric_normal.get(lane), v.depth[lane]);
        let flux = v.flux.rgb(lane) * kernel::disk(self.radii.surface);
        let points = &self.receivers.paths.points;
        self.receivers.point_tree.query(position, self.radii.surface, |index, _| {
            let point = &points[index as usize];
            let height = (position - point.position).dot(point.geometric_normal).abs();
            if normal.dot(point.geometric_normal) < SAME_SURFACE
                || height > SAME_HEIGHT * self.radii.surface
                || !self.within_depth(point.depth, depth)
            {
                return;
            }
            let weighted = point.throughput * flux;
            match point.lobe {
                Lobe::Lambertian(_) if direction.dot(point.normal) >= 0.0 => {}
                Lobe::Lambertian(reflectance) => {
                    out.keep(
                        point.pixel,
                        weighted * reflectance * std::f32::consts::FRAC_1_PI,
                        false,
                    );
                }
                Lobe::Stored(stored) => out.asked.bsdf(stored, direction, point.pixel, weighted),
            }
        });
    }
}

impl Gathered {
    fn keep(&mut self, pixel: u32, radiance: Rgb, in_medium: bool) {
        keep(&mut self.deposits, &mut self.counters, pixel, radiance, in_medium);
    }
}

fn keep(
    deposits: &mut Deposits,
    counters: &mut Counters,
    pixel: u32,
    radiance: Rgb,
    in_medium: bool,
) {
    if !radiance.is_finite() {
        counters.dropped_deposits += 1;
        return;
    }
    if in_medium {
        counters.medium_deposits += 1;
    } else {
        counters.surface_deposits += 1;
    }
    deposits.push(pixel, radiance);
}

/// Pairs whose scattering function only the scene can evaluate.
#[derive(Default)]
struct Asked {
    phases: Vec<AskedPhase>,
    bsdfs: Vec<AskedBsdf>,
}

struct AskedPhase {
    medium: u32,
    position: Vec3,
    photon: Vec3,
    view: Vec3,
    pixel: u32,
    weighted: Rgb,
}

struct AskedBsdf {
    point: u32,
    photon: Vec3,
    pixel: u32,
    weighted: Rgb,
}

impl Asked {
    fn phase(
        &mut self,
        medium: u32,
        position: Vec3,
        photon: Vec3,
        view: Vec3,
        pixel: u32,
        weighted: Rgb,
    ) {
        self.phases.push(AskedPhase { medium, position, photon, view, pixel, weighted });
    }

    fn bsdf(&mut self, point: u32, photon: Vec3, pixel: u32, weighted: Rgb) {
        self.bsdfs.push(AskedBsdf { point, photon, pixel, weighted });
    }

    fn append(&mut self, mut other: Asked) {
        self.phases.append(&mut other.phases);
        self.bsdfs.append(&mut other.bsdfs);
    }

    /// Asks the scene and turns the answers into deposits.
    fn resolve(
        self,
        scene: &dyn Scene,
        deposits: &mut Deposits,
        counters: &mut Counters,
    ) -> SceneResult<()> {
        let mut values = Planes::default();
        if !self.phases.is_empty() {
            let pairs = PhasePairs {
                medium: self.phases.iter().map(|p| p.medium).collect(),
                position: Planes::push_all(self.phases.iter().map(|p| p.position)),
                photon_direction: Planes::push_all(self.phases.iter().map(|p| p.photon)),
                view_direction: Planes::push_all(self.phases.iter().map(|p| p.view)),
            };
            scene.eval_phase(&pairs, &mut values)?;
            for (lane, pair) in self.phases.iter().enumerate() {
                keep(deposits, counters, pair.pixel, pair.weighted * values.rgb(lane), true);
            }
        }
        if !self.bsdfs.is_empty() {
            let pairs = SurfacePairs {
                point: self.bsdfs.iter().map(|p| p.point).collect(),
                photon_direction: Planes::push_all(self.bsdfs.iter().map(|p| p.photon)),
            };
            scene.eval_bsdf(&pairs, &mut values)?;
            for (lane, pair) in self.bsdfs.iter().enumerate() {
                keep(deposits, counters, pair.pixel, pair.weighted * values.rgb(lane), false);
            }
        }
        Ok(())
    }
}
