//! Connections: what comes straight from lamps is looked for from visible points and view beams, and photons leave it
//! out. \[Connection\]

use super::beam_sample::{self, BeamSample, NUMBERS};
use super::counters::Counters;
use super::deposits::{Deposit, Sink};
use super::pairs::{Gathered, LampSample, Pairs};
use super::photon::Family;
use super::view::{ViewBeam, ViewPaths};
use crate::density::radius::Radii;
use crate::effect::Effect;
use crate::math::uniform::{self, Purpose};
use crate::math::Rgb;
use crate::plan::{Connections, Plan};
use crate::scene::*;
use glam::Vec3;
use rand_pcg::Pcg64Mcg;
use std::ops::Range;

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
        let lanes = 0..places.medium.len();
        connections.visible_points = are_found(&connector.lamps(&places, lanes, &mut rng)?);
    }
    if connector.lamps_near.is_empty() {
        let beams = sampled(paths.beams.len());
        let drawn = connector.draw(beams.into_iter().enumerate(), &mut rng);
        connections.view_beams = are_found(&connector.lamps_on_beams(&drawn, &mut rng)?);
    }
    Ok(connections)
}

/// Whether a good share of the samples is lit, and none by a lamp that cannot be sampled from where it is seen.
fn are_found(sampled: &[LampSample]) -> bool {
    if sampled.iter().any(|lamp| !lamp.irradiance.is_finite()) {
        return false;
    }
    let found = sampled.iter().filter(|lamp| !lamp.irradiance.is_zero()).count();
    found as f64 > FOUND_SHARE * sampled.len() as f64
}

fn range(batch: Batch) -> Range<usize> {
    batch.first as usize..batch.first as usize + batch.lanes
}

/// A uniform number of one of several strata.
fn stratified(stratum: usize, strata: usize, number: f32) -> f32 {
    ((stratum as f32 + number) / strata as f32).min(uniform::BELOW_ONE)
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
        let lamps = self.lamps(&self.at_points(&indices), samples, rng)?;
        let mut out = Gathered::new(Found::default());
        for (&index, lamp) in indices.iter().zip(lamps) {
            self.pairs.lamp_on_point(lamp, &self.pairs.paths.points[index], &mut out);
        }
        self.resolve(out, indices.len())
    }

    fn beams(&self, samples: Range<usize>, rng: &mut Pcg64Mcg) -> SceneResult<(Found, Counters)> {
        let drawn = self.draw(samples.map(|sample| (sample, self.receiver_of(sample))), rng);
        let lamps = self.lamps_on_beams(&drawn, rng)?;
        let mut out = Gathered::new(Found::default());
        for (Drawn { beam, place, .. }, lamp) in drawn.iter().zip(lamps) {
            self.pairs.lamp_on_beam(lamp, *beam, place.t, place.density, &mut out);
        }
        self.resolve(out, drawn.len())
    }

    fn at_points(&self, indices: &[usize]) -> Places {
        let paths = self.pairs.paths;
        let normal = |&index: &usize| paths.points[index].geometric_normal.into();
        Places {
            medium: indices.iter().map(|&index| paths.point_media[index]).collect(),
            position: Planes::push_all(indices.iter().map(|&index| paths.point_positions[index])),
            normal: Planes::push_all(indices.iter().map(normal)),
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

    fn lamps_on_beams(&self, drawn: &[Drawn], rng: &mut Pcg64Mcg) -> SceneResult<Vec<LampSample>> {
        let position = drawn.iter().map(|drawn| drawn.beam.segment.at(drawn.place.t));
        let places = Places {
            medium: drawn.iter().map(|drawn| drawn.beam.record.medium).collect(),
            position: Planes::push_all(position),
            normal: Planes::push_all(drawn.iter().map(|_| Vec3::ZERO)),
        };
        self.lamps(&places, drawn.iter().map(|drawn| drawn.sample), rng)
    }

    /// A sample of the lamps for each place, by its number: those of one receiver are spread over the lamps.
    fn lamps(
        &self,
        places: &Places,
        samples: impl Iterator<Item = usize>,
        rng: &mut Pcg64Mcg,
    ) -> SceneResult<Vec<LampSample>> {
        let lanes = places.medium.len();
        if lanes == 0 {
            return Ok(Vec::new());
        }
        let density = self.glossy_chains.then(Vec::new);
        let (mut numbers, mut light) = (Vec::new(), LampLight { density, ..LampLight::default() });
        uniform::fill(rng, &mut numbers, LAMP_DIMENSIONS * lanes);
        for (sample, number) in samples.zip(&mut numbers[..lanes]) {
            *number = stratified(sample % self.samples, self.samples, *number);
        }
        self.scene.lamp_light(places, &numbers, &mut light)?;
        let of_lane = |lane| LampSample {
            direction: light.direction.get(lane),
            irradiance: light.irradiance.rgb(lane) / self.samples as f32,
            density: light.density.as_ref().map_or(0.0, |density| density[lane]),
        };
        Ok((0..lanes).map(of_lane).collect())
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
