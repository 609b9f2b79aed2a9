//! The photons of one pass, all of them kept: what photon maps are made of.

use super::cone::DirectionCone;
use super::counters::Counters;
use super::numbers::Uniform;
use super::photon::{self, Event, MediumPhoton, PerFamily, SurfacePhoton};
use super::photon_beam::PhotonBeams;
use super::target::Particles;
use super::walks::Walks;
use crate::math::uniform::{self, Purpose};
use crate::plan::Plan;
use crate::scene::{Batch, PhotonVertices, Scene, SceneResult};

/// Photons of one pass. Where media hold beams, the points in them are the ends of those that may be nearly
/// parallel to view beams.
#[derive(Debug, Default)]
pub struct StoredPhotons {
    pub particles: Particles,
    pub on_surfaces: Vec<SurfacePhoton>,
    pub in_media: Vec<MediumPhoton>,
    pub beams: PhotonBeams,
}

/// Which photons are to be stored.
#[derive(Clone, Copy)]
pub struct Storage<'a> {
    pub scene: &'a dyn Scene,
    pub plan: &'a Plan,
    pub particles: Particles,
    /// The families that any receiver is there for.
    pub wanted: PerFamily<bool>,
    /// Directions of view beams.
    pub cone: DirectionCone,
    pub seed: u64,
}

impl Storage<'_> {
    /// Shoots the walks of one pass.
    pub fn shoot(&self, pass: u64, walks: u64) -> SceneResult<(StoredPhotons, Counters)> {
        if !self.wanted.surface && !self.wanted.medium {
            return Ok((StoredPhotons::default(), Counters::default()));
        }
        let batching = self.scene.batching();
        let parts = batching.run_all(walks, |batch| self.shoot_batch(pass, batch))?;
        let mut counters = Counters::default();
        let mut stored = StoredPhotons { particles: self.particles, ..StoredPhotons::default() };
        for (part, counts) in parts {
            stored.append(part);
            counters.add(&counts);
        }
        counters.uniform_walks = counters.walks;
        Ok((stored, counters))
    }

    fn shoot_batch(&self, pass: u64, batch: Batch) -> SceneResult<(StoredPhotons, Counters)> {
        let stream = |purpose| uniform::stream(self.seed, purpose, pass, batch.number);
        let mut numbers = Uniform(stream(Purpose::Photons));
        let mut tables = stream(Purpose::PhotonTables);
        let mut stored = StoredPhotons::default();
        let with_segments = matches!(self.particles, Particles::Beams(_)) && self.wanted.medium;
        let Storage { scene, plan, .. } = *self;
        let walks = Walks { scene, plan, count: batch.lanes, with_segments };
        let counters = walks.trace(&mut numbers, |vertices, counters| {
            if let (Particles::Beams(kind), true) = (self.particles, self.wanted.medium) {
                let beams = PhotonBeams::of_vertices(kind, scene, plan, vertices, &mut tables)?;
                counters.photon_table_samples += beams.table_samples;
                stored.beams.append(beams);
            }
            self.keep(vertices, &mut stored, counters);
            Ok(())
        })?;
        Ok((stored, counters))
    }

    fn keep(&self, v: &PhotonVertices, stored: &mut StoredPhotons, counters: &mut Counters) {
        for lane in 0..v.event.len() {
            match photon::event(v, lane, self.plan, &mut counters.dropped_photons) {
                Event::Surface(photon) if self.wanted.surface => stored.on_surfaces.push(photon),
                Event::Medium(photon) if self.wanted.medium && self.keeps(&photon) => {
                    stored.in_media.push(photon);
                }
                Event::Surface(_) | Event::Medium(_) | Event::Nothing => {}
            }
        }
    }
}

impl Storage<'_> {
    fn keeps(&self, photon: &MediumPhoton) -> bool {
        self.particles == Particles::Points || self.cone.may_be_parallel(photon.direction)
    }
}

impl StoredPhotons {
    fn append(&mut self, mut other: StoredPhotons) {
        self.on_surfaces.append(&mut other.on_surfaces);
        self.in_media.append(&mut other.in_media);
        self.beams.append(other.beams);
    }
}
