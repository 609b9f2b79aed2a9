//! Connections: what comes straight from lamps is looked for from visible points and view beams, and photons leave it
//! out. \[Connection\]

use super::beam_sample::{self, BeamSample, NUMBERS};
use super::counters::Counters;
use super::deposits::{Deposit, Sink};
use super::numbers::draw;
use super::pairs::{Gathered, LampSample, Pairs};
use super::photon::Family;
use super::view::{ViewBeam, ViewPaths};
use crate::density::radius::Radii;
use crate::effect::Effect;
use crate::math::uniform::{self, Purpose};
use crate::math::Rgb;
use crate::plan::{Connections, Plan};
use crate::scene::work;
use crate::scene::*;
use glam::Vec3;
use rand_pcg::Pcg64Mcg;
use std::ops::Range;

/// Samples of lamps of one task.
const PER_TASK: usize = 4096;
/// Receivers of each kind that are asked whether they find a lamp, and the share of finds from which on connections pay.
const PROBES: usize = 4096;
const FOUND_SHARE: f64 = 0.002;

/// Adds to what the ray paths of one jitter see directly what lamps light up for them.
pub fn connect(
    scene: &dyn Scene,
    plan: &Plan,
    seed: u64,
    jitter: u64,
    paths: &mut ViewPaths,
) -> SceneResult<()> {
    let stream = |purpose, batch: Batch| uniform::stream(seed, purpose, jitter, batch.number);
    let connector = Connector::new(scene, plan, paths, plan.connections.samples);
    let mut parts = Vec::new();
    if plan.connections.visible_points && plan.simulates(Effect::SurfaceGathering) {
        parts.extend(
            scene.batching().run_all(connector.samples_of(paths.points.len()), |batch| {
                connector.points(range(batch), &mut stream(Purpose::LampsOfPoints, batch))
            })?,
        );
    }
    if plan.connections.view_beams {
        parts.extend(
            scene.batching().run_all(connector.samples_of(paths.beams.len()), |batch| {
                connector.beams(range(batch), &mut stream(Purpose::LampsOfBeams, batch))
            })?,
        );
    }
    paths.connected = vec![Rgb::ZERO; paths.film.len()];
    if paths.places() > paths.film.len() {
        paths.connected_by_place = vec![Rgb::ZERO; paths.places()];
    }
    for (found, counters) in parts {
        for (place, radiance) in found.0 {
            let pixel = paths.pixel_of(place);
            paths.connected[pixel] += radiance;
            if let Some(apart) = paths.connected_by_place.get_mut(place as usize) {
                *apart += radiance;
            }
        }
        paths.counters.add(&counters);
    }
    Ok(())
}

/// Which connections are likely to pay. Where glass sends the light, they would cost and find nothing. Along view beams they
/// are made if all lamps are infinitely far away: near a lamp its light rises by the inverse square of the distance, and
/// photons, who bring it as it is, have less noise. The numbers drawn for the choice are used for nothing else, so that it
/// does not bias what is chosen.
pub fn worthwhile(
    scene: &dyn Scene,
    plan: &Plan,
    seed: u64,
    paths: &ViewPaths,
) -> SceneResult<Connections> {
    let mut rng = uniform::stream(seed, Purpose::LampProbe, 0, 0);
    let connector = Connector::new(scene, plan, paths, 1);
    let sampled = |count: usize| -> Vec<usize> {
        (0..count).step_by(count.div_ceil(PROBES).max(1)).collect()
    };
    let mut connections = Connections { samples: plan.connections.samples, ..Connections::NONE };
    if plan.simulates(Effect::SurfaceGathering) {
        let places = connector.at_points(&sampled(paths.points.len()));
        connections.visible_points = connector.lamps(&places, |lane| lane, &mut rng)?.are_found();
    }
    if connector.lamps_near.is_empty() {
        let beams = sampled(paths.beams.len());
        let drawn = connector.draw(beams.into_iter().enumerate(), &mut rng);
        connections.view_beams = connector.lamps_on_beams(&drawn, &mut rng)?.are_found();
    }
    Ok(connections)
}

fn range(batch: Batch) -> Range<usize> {
    batch.first as usize..batch.first as usize + batch.lanes
}

/// A uniform number of one of several strata.
fn stratified(stratum: usize, strata: usize, number: f32) -> f32 {
    ((stratum as f32 + number) / strata as f32).min(uniform::BELOW_ONE)
}

/// Samples of the lamps, each of so many for its receiver.
struct Lamps {
    light: LampLight,
    samples: f32,
}

impl Lamps {
    fn at(&self, lane: usize) -> LampSample {
        LampSample {
            direction: self.light.direction.get(lane),
            irradiance: self.light.irradiance.rgb(lane) / self.samples,
            density: self.light.density.as_ref().map_or(0.0, |density| density[lane]),
        }
    }

    /// Whether a good share of the samples is lit, and none by a lamp that cannot be sampled from where it is seen.
    fn are_found(&self) -> bool {
        let lanes = self.light.irradiance.lanes();
        let irradiances = (0..lanes).map(|lane| self.at(lane).irradiance);
        if irradiances.clone().any(|irradiance| !irradiance.is_finite()) {
            return false;
        }
        let found = irradiances.filter(|irradiance| !irradiance.is_zero()).count();
        found as f64 > FOUND_SHARE * lanes as f64
    }
}

/// A place that is drawn on a view beam.
struct Drawn<'a> {
    /// Number of the sample.
    sample: usize,
    beam: ViewBeam<'a>,
    place: BeamSample,
}

struct Connector<'a> {
    scene: &'a dyn Scene,
    pairs: Pairs<'a>,
    /// Lamps that are not infinitely far away.
    lamps_near: Vec<Place>,
    /// Of the lamps, for each receiver.
    samples: usize,
    glossy_chains: bool,
}

impl<'a> Connector<'a> {
    fn new(scene: &'a dyn Scene, plan: &'a Plan, paths: &'a ViewPaths, samples: u32) -> Self {
        let pairs = Pairs::new(plan, paths, Radii::default());
        let lamps_near =
            scene.description().emitters.iter().filter_map(|lamp| lamp.place).collect();
        let glossy_chains = plan.rules.glossy_chains;
        Connector { scene, pairs, lamps_near, samples: samples as usize, glossy_chains }
    }

    fn samples_of(&self, receivers: usize) -> u64 {
        (receivers * self.samples) as u64
    }

    fn receiver_of(&self, sample: usize) -> usize {
        sample / self.samples
    }

    fn points(&self, samples: Range<usize>, rng: &mut Pcg64Mcg) -> SceneResult<(Found, Counters)> {
        let indices: Vec<usize> = samples.clone().map(|sample| self.receiver_of(sample)).collect();
        let lamps = self.lamps(&self.at_points(&indices), |lane| samples.start + lane, rng)?;
        self.gather(indices.len(), |lane, out| {
            let point = &self.pairs.paths.points[indices[lane]];
            self.pairs.lamp_on_point(lamps.at(lane), point, out);
        })
    }

    fn beams(&self, samples: Range<usize>, rng: &mut Pcg64Mcg) -> SceneResult<(Found, Counters)> {
        let drawn = self.draw(samples.map(|sample| (sample, self.receiver_of(sample))), rng);
        let lamps = self.lamps_on_beams(&drawn, rng)?;
        self.gather(drawn.len(), |lane, out| {
            let Drawn { beam, place, .. } = drawn[lane];
            self.pairs.lamp_on_beam(lamps.at(lane), beam, place.t, place.density, out);
        })
    }

    fn at_points(&self, indices: &[usize]) -> Places {
        let (paths, lanes) = (self.pairs.paths, indices.len());
        let normal = |lane: usize| paths.points[indices[lane]].geometric_normal.into();
        Places {
            medium: indices.iter().map(|&index| paths.point_media[index]).collect(),
            position: Planes::of_lanes(self.scene, lanes, |lane| {
                paths.point_positions[indices[lane]]
            }),
            normal: Planes::of_lanes(self.scene, lanes, normal),
        }
    }

    /// One place for each of these samples, given with the index of its beam, but where light cannot be scattered.
    fn draw(
        &self,
        samples: impl Iterator<Item = (usize, usize)>,
        rng: &mut Pcg64Mcg,
    ) -> Vec<Drawn<'_>> {
        let paths = self.pairs.paths;
        let mut drawn = Vec::new();
        for (sample, index) in samples {
            let beam = paths.view_beam(index);
            let numbers: [f32; NUMBERS] = std::array::from_fn(|_| uniform::next(rng));
            let place = beam_sample::draw(paths, self.pairs.media, &self.lamps_near, beam, numbers);
            drawn.extend(place.map(|place| Drawn { sample, beam, place }));
        }
        drawn
    }

    fn lamps_on_beams(&self, drawn: &[Drawn], rng: &mut Pcg64Mcg) -> SceneResult<Lamps> {
        let position = |lane: usize| drawn[lane].beam.segment.at(drawn[lane].place.t);
        let places = Places {
            medium: drawn.iter().map(|drawn| drawn.beam.record.medium).collect(),
            position: Planes::of_lanes(self.scene, drawn.len(), position),
            normal: Planes::of_lanes(self.scene, drawn.len(), |_| Vec3::ZERO),
        };
        self.lamps(&places, |lane| drawn[lane].sample, rng)
    }

    /// A sample of the lamps for each place, by its number: those of one receiver are spread over the lamps.
    fn lamps(
        &self,
        places: &Places,
        sample_of: impl Fn(usize) -> usize + Sync,
        rng: &mut Pcg64Mcg,
    ) -> SceneResult<Lamps> {
        let lanes = places.medium.len();
        let density = self.glossy_chains.then(Vec::new);
        let (mut numbers, mut light) = (Vec::new(), LampLight { density, ..LampLight::default() });
        if lanes > 0 {
            draw(rng, self.scene, &mut numbers, LAMP_DIMENSIONS * lanes);
            let parts = (0..).step_by(PER_TASK).zip(numbers[..lanes].chunks_mut(PER_TASK));
            work::for_each(self.scene, parts.collect(), |(first, numbers)| {
                for (lane, number) in (first..).zip(numbers) {
                    *number = stratified(sample_of(lane) % self.samples, self.samples, *number);
                }
            });
            self.scene.lamp_light(places, &numbers, &mut light)?;
        }
        Ok(Lamps { light, samples: self.samples as f32 })
    }

    /// Adds lane by lane, in tasks, and then what the scene has to be asked for.
    fn gather(
        &self,
        lanes: usize,
        add: impl Fn(usize, &mut Gathered<Found>) + Sync,
    ) -> SceneResult<(Found, Counters)> {
        let starts = (0..lanes).step_by(PER_TASK);
        let mut parts: Vec<_> = starts.map(|_| Gathered::new(Found::default())).collect();
        let tasks = (0..).step_by(PER_TASK).zip(&mut parts).collect();
        work::for_each(self.scene, tasks, |(first, out)| {
            (first..lanes.min(first + PER_TASK)).for_each(|lane| add(lane, out));
        });
        let mut all = Gathered::new(Found::default());
        parts.into_iter().for_each(|part| all.append(part));
        self.resolve(all, lanes)
    }

    /// What was found, and what of the counters is not about photons.
    fn resolve(&self, mut found: Gathered<Found>, places: usize) -> SceneResult<(Found, Counters)> {
        found.resolve(self.scene)?;
        let Counters { dropped_deposits, directional_pairs, .. } = found.counters;
        let connections = places as u64;
        let counters =
            Counters { connections, dropped_deposits, directional_pairs, ..Counters::default() };
        Ok((found.sink, counters))
    }
}

/// Radiance by place.
#[derive(Default)]
struct Found(Vec<(u32, Rgb)>);

impl Sink for Found {
    fn push(&mut self, _: u32, _: Family, deposit: Deposit) {
        self.0.push((deposit.pixel, deposit.radiance));
    }

    fn append(&mut self, mut other: Self) {
        self.0.append(&mut other.0);
    }
}
