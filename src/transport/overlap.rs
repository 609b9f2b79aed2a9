//! Gathering beside tracing, for hosts that one thread alone may drive: while the walks take their next step, other threads
//! let the photons of the last ones look for receivers.

use super::deposits::Sink;
use super::gathering::{per_task, Gathering};
use super::numbers::Numbers;
use super::pairs::Gathered;
use super::photon_beam::PhotonBeams;
use super::walks::Walks;
use crate::crew::Crew;
use crate::scene::work;
use crate::scene::{PhotonVertices, SceneResult};
use rand_pcg::Pcg64Mcg;
use std::collections::VecDeque;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

/// Steps whose photons may still be looking; bounds memory.
const STEPS_IN_FLIGHT: usize = 3;

/// Photon beams of one task. They look one by one, and gain nothing by being many.
const BEAMS_PER_TASK: usize = 4096;

/// The photons of one step, and what each task found.
struct Step<S> {
    vertices: PhotonVertices,
    beams: PhotonBeams,
    found: Vec<Mutex<Option<Gathered<S>>>>,
    /// Tasks that are not done.
    left: AtomicUsize,
}

/// What one task is for: lanes or photon beams of a step.
enum Share {
    Lanes(Range<usize>),
    Beams(Range<usize>),
}

/// Counts a task as done when it ends, by a panic too: who waits must not wait for ever.
struct Done<'a>(&'a AtomicUsize);

impl Drop for Done<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Release);
    }
}

/// Traces walks to their ends; what is gathered is in the order of the steps, whichever thread did it.
pub fn while_tracing<S: Sink>(
    gathering: &Gathering,
    walks: Walks,
    numbers: &mut impl Numbers,
    tables: &mut Pcg64Mcg,
    sink: &(impl Fn() -> S + Sync),
) -> SceneResult<Gathered<S>> {
    let mut total = Gathered::new(sink());
    let mut in_flight = VecDeque::new();
    let mut used = Vec::new();
    work::with_crew(gathering.target.scene, |crew| {
        let counters = walks.trace(numbers, |vertices, _| {
            let beams = gathering.photon_beams(vertices, tables)?;
            total.counters.photon_table_samples += beams.table_samples;
            let empty = used.pop().unwrap_or_else(|| vertices.like());
            let step = start(gathering, crew, std::mem::replace(vertices, empty), beams, sink);
            in_flight.push_back(step);
            if in_flight.len() > STEPS_IN_FLIGHT {
                let oldest = in_flight.pop_front().expect("some are in flight");
                used.extend(finish(gathering, crew, oldest, &mut total)?);
            }
            Ok(())
        })?;
        total.counters.add(&counters);
        for step in in_flight.drain(..) {
            finish(gathering, crew, step, &mut total)?;
        }
        Ok(total)
    })
}

/// Spawns the tasks of a step.
fn start<'scope, S: Sink + 'scope>(
    gathering: &'scope Gathering,
    crew: &dyn Crew<'scope>,
    vertices: PhotonVertices,
    beams: PhotonBeams,
    sink: &'scope (impl Fn() -> S + Sync),
) -> Arc<Step<S>> {
    let lanes = vertices.event.len();
    let lanes = shares(lanes, per_task(lanes)).map(Share::Lanes);
    let beams_of_tasks = shares(beams.beams.len(), BEAMS_PER_TASK).map(Share::Beams);
    let shares: Vec<Share> = lanes.chain(beams_of_tasks).collect();
    let found = shares.iter().map(|_| Mutex::new(None)).collect();
    let step = Arc::new(Step { vertices, beams, found, left: AtomicUsize::new(shares.len()) });
    for (number, share) in shares.into_iter().enumerate() {
        let step = Arc::clone(&step);
        crew.spawn(Box::new(move || {
            let _done = Done(&step.left);
            let mut out = Gathered::new(sink());
            match share {
                Share::Lanes(lanes) => gathering.lanes(&step.vertices, lanes, &mut out),
                Share::Beams(range) => gathering.beams(&step.beams, range, &mut out),
            }
            *step.found[number].lock().expect("no task panicked") = Some(out);
        }));
    }
    step
}

fn shares(count: usize, own: usize) -> impl Iterator<Item = Range<usize>> {
    (0..count).step_by(own).map(move |first| first..count.min(first + own))
}

/// Waits for a step, doing tasks meanwhile, adds what it found, and gives its arrays back for another.
fn finish<S: Sink>(
    gathering: &Gathering,
    crew: &dyn Crew,
    step: Arc<Step<S>>,
    total: &mut Gathered<S>,
) -> SceneResult<Option<PhotonVertices>> {
    crew.work_until_none(&step.left);
    for found in &step.found {
        let found = found.lock().expect("no task panicked").take();
        total.append(found.expect("every task is done"));
    }
    total.resolve(gathering.target.scene)?;
    Ok(Arc::into_inner(step).map(|step| step.vertices))
}
