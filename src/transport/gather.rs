//! A batch of walks, from the lamps to the last deposit: photons look for their receivers.

use super::counters::Counters;
use super::deposits::Sink;
use super::numbers::Numbers;
use super::pairs::{Gathered, Pairs};
use super::photon::{self, Event, MediumPhoton};
use super::photon_beam::{BeamKind, PhotonBeams};
use super::receivers::Receivers;
use super::walks::Walks;
use crate::density::radius::Radii;
use crate::plan::Plan;
use crate::scene::*;
use crate::transport::photon::PerFamily;
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

/// Vertices per task of a gather, and tasks after which pairs are handed to the scene.
const VERTICES_PER_TASK: usize = 1024;
const TASKS_PER_HANDOVER: usize = 8;

/// What a photon is while it crosses a medium.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Particles {
    #[default]
    Points,
    Beams(BeamKind),
}

/// What the photons of one pass are shot at, and how they are seen.
#[derive(Clone, Copy)]
pub struct Target<'a> {
    pub scene: &'a dyn Scene,
    pub receivers: &'a Receivers,
    pub particles: Particles,
    pub radii: Radii,
    pub plan: &'a Plan,
}

impl Target<'_> {
    /// The families that any receiver is there for.
    pub fn wanted(&self) -> PerFamily<bool> {
        self.receivers.paths.wanted(self.plan)
    }

    /// Shoots one batch of walks and gathers what those of the wanted families add. `tables` is the
    /// stream of numbers for transmittance tables along photon beams.
    pub fn shoot<S: Sink, N: Numbers>(
        &self,
        walks: usize,
        numbers: &mut N,
        tables: &mut Pcg64Mcg,
        wanted: PerFamily<bool>,
        sink: impl Fn() -> S + Sync,
    ) -> SceneResult<(S, Counters)> {
        let mut total = sink();
        let beams = matches!(self.particles, Particles::Beams(_)) && wanted.medium;
        let Target { scene, plan, .. } = *self;
        let walks = Walks { scene, plan, count: walks, with_segments: beams };
        let counters = walks.trace(numbers, |vertices, counters| {
            let (part, counts) = self.gather(vertices, tables, wanted, &sink)?;
            total.append(part);
            counters.add(&counts);
            Ok(())
        })?;
        Ok((total, counters))
    }

    /// What the vertices of one step add.
    fn gather<S: Sink>(
        &self,
        vertices: &PhotonVertices,
        tables: &mut Pcg64Mcg,
        wanted: PerFamily<bool>,
        sink: &(impl Fn() -> S + Sync),
    ) -> SceneResult<(S, Counters)> {
        let beams = match self.particles {
            Particles::Beams(kind) if wanted.medium => {
                PhotonBeams::of_vertices(kind, self.scene, self.plan, vertices, tables)?
            }
            _ => PhotonBeams::default(),
        };
        let pairs = Pairs::new(self.plan, &self.receivers.paths, self.radii);
        let query = Query { target: self, pairs, wanted, beams: &beams };
        let lanes = vertices.event.len();
        let points = (0..lanes).step_by(VERTICES_PER_TASK).map(Task::Vertices);
        let lines = (0..beams.beams.len()).step_by(VERTICES_PER_TASK).map(Task::Beams);
        let tasks: Vec<Task> = points.chain(lines).collect();
        let mut total = sink();
        let mut counters =
            Counters { photon_table_samples: beams.table_samples, ..Counters::default() };
        for group in tasks.chunks(TASKS_PER_HANDOVER) {
            let parts: Vec<Gathered<S>> =
                group.par_iter().map(|task| query.run(*task, vertices, sink())).collect();
            // One batch of questions for the whole group.
            let mut merged = Gathered::new(sink());
            parts.into_iter().for_each(|part| merged.append(part));
            let (part, counts) = merged.resolve(self.scene)?;
            total.append(part);
            counters.add(&counts);
        }
        Ok((total, counters))
    }
}

/// A share of a step's queries, named by its first vertex or beam.
#[derive(Clone, Copy)]
enum Task {
    Vertices(usize),
    Beams(usize),
}

struct Query<'a> {
    target: &'a Target<'a>,
    pairs: Pairs<'a>,
    wanted: PerFamily<bool>,
    beams: &'a PhotonBeams,
}

impl Query<'_> {
    fn run<S: Sink>(&self, task: Task, v: &PhotonVertices, sink: S) -> Gathered<S> {
        let mut out = Gathered::new(sink);
        let range = |first: usize, count: usize| first..count.min(first + VERTICES_PER_TASK);
        match task {
            Task::Vertices(first) => {
                for lane in range(first, v.event.len()) {
                    self.vertex(v, lane, &mut out);
                }
            }
            Task::Beams(first) => {
                for beam in &self.beams.beams[range(first, self.beams.beams.len())] {
                    out.counters.medium_photons += 1;
                    let tree = self.target.receivers.beam_tree();
                    tree.query_segment(
                        &beam.segment,
                        self.pairs.radii.medium,
                        |index, approach| {
                            let view = &self.pairs.paths.beams[index as usize];
                            self.pairs.beam_on_beam(
                                beam,
                                &self.beams.tables,
                                view,
                                &approach,
                                &mut out,
                            );
                        },
                    );
                }
            }
        }
        out
    }

    fn vertex<S: Sink>(&self, v: &PhotonVertices, lane: usize, out: &mut Gathered<S>) {
        let paths = self.pairs.paths;
        match photon::event(v, lane, self.target.plan, &mut out.counters.dropped_photons) {
            Event::Medium(p) if self.wanted.medium => self.collision(&p, out),
            Event::Surface(p) if self.wanted.surface => {
                out.counters.surface_photons += 1;
                self.target.receivers.point_tree.query(
                    p.position,
                    self.pairs.radii.surface,
                    |index, d2| {
                        self.pairs.photon_on_point(&p, &paths.points[index as usize], d2, out);
                    },
                );
            }
            _ => {}
        }
    }

    /// A photon point, or the end of a photon beam.
    fn collision<S: Sink>(&self, p: &MediumPhoton, out: &mut Gathered<S>) {
        let Target { receivers, particles, radii, .. } = self.target;
        let paths = self.pairs.paths;
        let are_points = *particles == Particles::Points;
        if !are_points && !paths.beam_cone.may_be_parallel(p.direction) {
            return;
        }
        out.counters.medium_photons += 1;
        receivers.beams_around(p.position, radii.medium, |index, t, d2| {
            let beam = &paths.beams[index as usize];
            if are_points {
                self.pairs.point_on_beam(p, beam, t, d2, out);
            } else {
                self.pairs.parallel_on_beam(p, beam, t, d2, out);
            }
        });
    }
}
