//! Photon maps of one pass, and view beams and visible points that ask them. [Jensen 2001] [Jarosz 2008]
//! [Jarosz 2011]

use super::counters::Counters;
use super::deposits::{Deposit, PixelSums, Sink};
use super::pairs::{Gathered, Pairs};
use super::photon::Family;
use super::store::StoredPhotons;
use super::target::Particles;
use super::view::ViewBeam;
use crate::scene::{Scene, SceneResult};
use crate::tree::{PhotonBeams, PhotonDisks, ViewPointTree};
use rayon::prelude::*;

/// Receivers per task, and tasks after which pairs are handed to the scene.
const RECEIVERS_PER_TASK: usize = 1024;
const TASKS_PER_HANDOVER: usize = 64;

/// Photons and the structures over them.
pub struct PhotonMap {
    stored: StoredPhotons,
    on_surfaces: ViewPointTree,
    in_media: PhotonDisks,
    beams: PhotonBeams,
}

impl PhotonMap {
    pub fn build(stored: StoredPhotons) -> Self {
        let on_surfaces: Vec<_> = stored.on_surfaces.iter().map(|photon| photon.position).collect();
        let in_media: Vec<_> = stored.in_media.iter().map(|photon| photon.position).collect();
        let beams: Vec<_> = stored.beams.beams.iter().map(|beam| beam.segment).collect();
        let (on_surfaces, (in_media, beams)) = rayon::join(
            || ViewPointTree::build(&on_surfaces),
            || rayon::join(|| PhotonDisks::build(&in_media), || PhotonBeams::build(&beams)),
        );
        PhotonMap { stored, on_surfaces, in_media, beams }
    }

    /// What all receivers see, divided by the number of emitted walks, added to `sums`.
    pub fn estimate(
        &self,
        scene: &dyn Scene,
        pairs: &Pairs,
        walks: u64,
        sums: &mut PixelSums,
    ) -> SceneResult<Counters> {
        let mut counters = Counters {
            surface_photons: self.stored.on_surfaces.len() as u64,
            medium_photons: (self.stored.in_media.len() + self.stored.beams.beams.len()) as u64,
            ..Counters::default()
        };
        let starts = |count: usize| (0..count).step_by(RECEIVERS_PER_TASK);
        let points = starts(pairs.paths.points.len()).map(|first| (Family::Surface, first));
        let beams = starts(pairs.paths.beams.len()).map(|first| (Family::Medium, first));
        let tasks: Vec<_> = points.chain(beams).collect();
        for group in tasks.chunks(TASKS_PER_HANDOVER) {
            let parts: Vec<_> = group
                .par_iter()
                .map(|&(family, first)| self.gather(pairs, family, first))
                .collect();
            let mut merged = Gathered::new(PixelRuns::default());
            parts.into_iter().for_each(|part| merged.append(part));
            merged.resolve(scene)?;
            counters.add(&merged.counters);
            for Run { place, values, deposits } in merged.sink.runs {
                sums.add_to(place as usize, values, 1.0 / walks as f64, deposits);
            }
        }
        Ok(counters)
    }

    fn gather(&self, pairs: &Pairs, family: Family, first: usize) -> Gathered<PixelRuns> {
        let mut out = Gathered::new(PixelRuns::default());
        let range = |count: usize| first..count.min(first + RECEIVERS_PER_TASK);
        match family {
            Family::Surface => {
                let places = range(pairs.paths.points.len());
                let positions = &pairs.paths.point_positions[places.clone()];
                for (point, &position) in pairs.paths.points[places].iter().zip(positions) {
                    self.on_surfaces.query(position, pairs.radii.surface, |index, d2| {
                        let photon = &self.stored.on_surfaces[index as usize];
                        pairs.photon_on_point(photon, point, position, d2, &mut out);
                    });
                }
            }
            Family::Medium => {
                for beam in range(pairs.paths.beams.len()) {
                    self.along(pairs.paths.view_beam(beam), pairs, &mut out);
                }
            }
        }
        out
    }

    /// The photons or photon beams along one view beam.
    fn along(&self, beam: ViewBeam, pairs: &Pairs, out: &mut Gathered<PixelRuns>) {
        let StoredPhotons { particles, in_media, beams, .. } = &self.stored;
        self.in_media.query(beam.segment, pairs.radii.medium, |index, t, d2| {
            let photon = &in_media[index as usize];
            match particles {
                Particles::Points => pairs.point_on_beam(photon, beam, t, d2, out),
                Particles::Beams(_) => pairs.parallel_on_beam(photon, beam, t, d2, out),
            }
        });
        self.beams.query(beam.segment, pairs.radii.medium, |index, approach| {
            let photon = &beams.beams[index as usize];
            pairs.beam_on_beam(photon, &beams.tables, beam, &approach, out);
        });
    }
}

/// Sums of deposits that follow one another on one place.
#[derive(Default)]
struct PixelRuns {
    runs: Vec<Run>,
}

struct Run {
    place: u32,
    values: [f64; 4],
    deposits: u64,
}

impl Sink for PixelRuns {
    fn push(&mut self, _: u32, _: Family, deposit: Deposit) {
        let place = deposit.pixel;
        if self.runs.last().is_none_or(|run| run.place != place) {
            self.runs.push(Run { place, values: [0.0; 4], deposits: 0 });
        }
        if let Some(run) = self.runs.last_mut() {
            for (sum, value) in run.values.iter_mut().zip(deposit.values()) {
                *sum += value;
            }
            run.deposits += 1;
        }
    }

    fn append(&mut self, mut other: Self) {
        self.runs.append(&mut other.runs);
    }
}
