//! The photons of one pass, all of them kept: what photon maps are made of.

use super::counters::Counters;
use super::gather::Particles;
use super::numbers::{Numbers, Uniform};
use super::photon::{self, Event, MediumPhoton, SurfacePhoton};
use super::photon_beam::PhotonBeams;
use crate::math::uniform::{self, Purpose};
use crate::scene::*;
use rayon::prelude::*;

/// Photons of one pass. Media hold points or beams, never both.
#[derive(Debug, Default)]
pub struct StoredPhotons {
    pub on_surfaces: Vec<SurfacePhoton>,
    pub in_media: Vec<MediumPhoton>,
    pub beams: PhotonBeams,
}

/// Which photons are to be stored.
#[derive(Clone, Copy)]
pub struct Storage<'a> {
    pub scene: &'a dyn Scene,
    pub particles: Particles,
    pub limits: PathLimits,
    pub seed: u64,
}

impl Storage<'_> {
    /// Shoots the walks of one pass.
    pub fn shoot(&self, pass: u64, walks: u64) -> SceneResult<(StoredPhotons, Counters)> {
        let Batching { lanes, concurrent } = self.scene.batching();
        let lanes = (lanes as u64).min(walks);
        let run = |batch: u64| {
            let count = lanes.min(walks - batch * lanes) as usize;
            self.shoot_batch(pass, batch, count)
        };
        let batches = walks.div_ceil(lanes);
        let parts: Vec<_> = if concurrent {
            (0..batches).into_par_iter().map(run).collect::<SceneResult<_>>()?
        } else {
            (0..batches).map(run).collect::<SceneResult<_>>()?
        };
        let (mut stored, mut counters) = (StoredPhotons::default(), Counters::default());
        for (part, counts) in parts {
            stored.append(part);
            counters.add(&counts);
        }
        Ok((stored, counters))
    }

    fn shoot_batch(
        &self,
        pass: u64,
        batch: u64,
        walks: usize,
    ) -> SceneResult<(StoredPhotons, Counters)> {
        let stream = |purpose| uniform::stream(self.seed, purpose, pass, batch);
        let mut numbers = Uniform(stream(Purpose::Photons));
        let mut tables = stream(Purpose::PhotonTables);
        let (mut stored, mut planes) = (StoredPhotons::default(), Vec::new());
        let mut counters =
            Counters { walks: walks as u64, uniform_walks: walks as u64, ..Counters::default() };
        let segments = matches!(self.particles, Particles::Beams(_)).then(Default::default);
        let mut vertices = PhotonVertices { segments, ..PhotonVertices::default() };
        numbers.emission(walks, &mut planes);
        let mut photons = self.scene.emit(walks, &planes, self.limits)?;
        for step in 0.. {
            let lanes = photons.lanes();
            if lanes == 0 {
                break;
            }
            numbers.step(step, &[], lanes, &mut planes);
            photons.step(&planes, &mut vertices)?;
            counters.segments += lanes as u64;
            if let Particles::Beams(kind) = self.particles {
                let beams = PhotonBeams::of_vertices(kind, self.scene, &vertices, &mut tables)?;
                stored.beams.append(beams);
            }
            self.keep(&vertices, &mut stored, &mut counters);
        }
        Ok((stored, counters))
    }

    fn keep(&self, v: &PhotonVertices, stored: &mut StoredPhotons, counters: &mut Counters) {
        for lane in 0..v.event.len() {
            if photon::ended_invalid(v, lane) {
                counters.dropped_photons += 1;
            }
            match photon::event(v, lane) {
                Event::Nothing => {}
                Event::Invalid => counters.dropped_photons += 1,
                Event::Surface(photon) => stored.on_surfaces.push(photon),
                Event::Medium(photon) if self.particles == Particles::Points => {
                    stored.in_media.push(photon);
                }
                Event::Medium(_) => {}
            }
        }
    }
}

impl StoredPhotons {
    fn append(&mut self, mut other: StoredPhotons) {
        self.on_surfaces.append(&mut other.on_surfaces);
        self.in_media.append(&mut other.in_media);
        self.beams.append(other.beams);
    }
}
