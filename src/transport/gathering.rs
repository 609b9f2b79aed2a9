//! Photons look for their receivers.

use super::counters::Counters;
use super::deposits::Sink;
use super::numbers::Numbers;
use super::pairs::{Gathered, Pairs};
use super::photon::{self, Event, MediumPhoton, PerFamily, SurfacePhoton};
use super::photon_beam::PhotonBeams;
use super::receivers::Receivers;
use super::target::{Particles, Target};
use super::walks::Walks;
use crate::scene::*;
use rand_pcg::Pcg64Mcg;
use std::ops::Range;

/// Vertices of one task at least, and tasks that a step of many is cut into: the more photons look together, the sooner
/// neighbours find what others have found.
const PER_TASK: usize = 4096;
const TASKS: usize = 8;
/// Pairs that may wait for the scene; bounds memory.
const ASKED_AT_ONCE: usize = 1 << 14;

/// How many of a step's vertices one task takes.
pub fn per_task(of_step: usize) -> usize {
    of_step.div_ceil(TASKS).max(PER_TASK)
}

/// How photons of a batch look for receivers.
pub(super) struct Gathering<'a> {
    pub target: &'a Target<'a>,
    pub pairs: Pairs<'a>,
    pub wanted: PerFamily<bool>,
}

/// Photons that look for receivers together.
#[derive(Default)]
struct Looking {
    collisions: Vec<MediumPhoton>,
    landings: Vec<SurfacePhoton>,
}

impl Looking {
    fn count(&self) -> usize {
        self.collisions.len() + self.landings.len()
    }
}

impl Gathering<'_> {
    /// Gathers in this thread whenever enough photons have come together; other threads have batches of their own.
    pub fn step_by_step<S: Sink>(
        &self,
        walks: Walks,
        numbers: &mut impl Numbers,
        tables: &mut Pcg64Mcg,
        sink: S,
    ) -> SceneResult<Gathered<S>> {
        let (mut out, mut looking) = (Gathered::new(sink), Looking::default());
        let counters = walks.trace(numbers, |vertices, _| {
            let beams = self.photon_beams(vertices, tables)?;
            out.counters.photon_table_samples += beams.table_samples;
            self.collect(vertices, 0..vertices.event.len(), &mut looking, &mut out.counters);
            if looking.count() >= PER_TASK {
                self.look(std::mem::take(&mut looking), &mut out);
            }
            self.beams(&beams, 0..beams.beams.len(), &mut out);
            if out.asked.count() > ASKED_AT_ONCE {
                out.resolve(self.target.scene)?;
            }
            Ok(())
        })?;
        self.look(looking, &mut out);
        out.resolve(self.target.scene)?;
        out.counters.add(&counters);
        Ok(out)
    }

    /// The beams of a step's photons, where photons are beams.
    pub fn photon_beams(
        &self,
        vertices: &PhotonVertices,
        tables: &mut Pcg64Mcg,
    ) -> SceneResult<PhotonBeams> {
        let Target { scene, plan, particles, .. } = *self.target;
        match particles {
            Particles::Beams(kind) if self.wanted.medium => {
                PhotonBeams::of_vertices(kind, scene, plan, vertices, tables)
            }
            _ => Ok(PhotonBeams::default()),
        }
    }

    /// What the ends of these lanes' segments add.
    pub fn lanes<S: Sink>(&self, v: &PhotonVertices, lanes: Range<usize>, out: &mut Gathered<S>) {
        let mut looking = Looking::default();
        self.collect(v, lanes, &mut looking, &mut out.counters);
        self.look(looking, out);
    }

    /// Adds those of these lanes' photons that may find anything.
    fn collect(
        &self,
        v: &PhotonVertices,
        lanes: Range<usize>,
        looking: &mut Looking,
        counters: &mut Counters,
    ) {
        let Receivers { point_tree: points, .. } = self.target.receivers;
        for lane in lanes {
            match photon::event(v, lane, self.target.plan, &mut counters.dropped_photons) {
                Event::Medium(p) if self.asks(&p) => {
                    counters.medium_photons += 1;
                    looking.collisions.push(p);
                }
                Event::Surface(p) if self.wanted.surface => {
                    counters.surface_photons += 1;
                    if points.may_find(p.position, self.pairs.radii.surface) {
                        looking.landings.push(p);
                    }
                }
                _ => {}
            }
        }
    }

    fn look<S: Sink>(&self, photons: Looking, out: &mut Gathered<S>) {
        self.collisions(&photons.collisions, out);
        self.landings(&photons.landings, out);
    }

    /// What these photon beams add.
    pub fn beams<S: Sink>(&self, own: &PhotonBeams, range: Range<usize>, out: &mut Gathered<S>) {
        for beam in &own.beams[range] {
            out.counters.medium_photons += 1;
            let (receivers, radius) = (self.target.receivers, self.pairs.radii.medium);
            receivers.beams_along(&beam.segment, radius, |index, approach| {
                let view = receivers.view_beam(index);
                self.pairs.beam_on_beam(beam, &own.tables, view, &approach, out);
            });
        }
    }

    fn landings<S: Sink>(&self, photons: &[SurfacePhoton], out: &mut Gathered<S>) {
        let (receivers, radius) = (self.target.receivers, self.pairs.radii.surface);
        receivers.points_around_each(photons.iter(), radius, |photon, index, position, d2| {
            let point = &self.pairs.paths.points[index as usize];
            self.pairs.photon_on_point(photon, point, position, d2, out);
        });
    }

    /// Whether a collision looks for beams: as a point always, as the end of a beam where that may run along one of them.
    fn asks(&self, p: &MediumPhoton) -> bool {
        let is_point = self.target.particles == Particles::Points;
        self.wanted.medium && (is_point || self.pairs.paths.beam_cone.may_be_parallel(p.direction))
    }

    /// Photon points, or the ends of photon beams.
    fn collisions<S: Sink>(&self, photons: &[MediumPhoton], out: &mut Gathered<S>) {
        let Target { receivers, particles, radii, .. } = self.target;
        let are_points = *particles == Particles::Points;
        receivers.beams_around_each(photons.iter(), radii.medium, |photon, index, t, d2| {
            let beam = receivers.view_beam(index);
            if are_points {
                self.pairs.point_on_beam(photon, beam, t, d2, out);
            } else {
                self.pairs.parallel_on_beam(photon, beam, t, d2, out);
            }
        });
    }
}
