//! Gathering beside tracing, for hosts that one thread alone may drive: while the walks take their next step, other threads
//! let the photons of the last ones look for receivers.

use super::deposits::Sink;
use super::gather::Gathering;
use super::numbers::Numbers;
use super::pairs::Gathered;
use super::photon_beam::PhotonBeams;
use super::walks::Walks;
use crate::scene::{PhotonVertices, SceneResult};
use rand_pcg::Pcg64Mcg;
use std::collections::VecDeque;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

/// Vertices or photon beams per task.
const PER_TASK: usize = 4096;
/// Steps whose photons may still be looking; bounds memory.
const STEPS_IN_FLIGHT: usize = 3;

/// The photons of one step, and what each task found.
struct Step<S> {
    vertices: PhotonVertices,
    beams: PhotonBeams,
    found: Vec<Mutex<Option<Gathered<S>>>>,
    /// Tasks that are not done.
    left: AtomicUsize,
}

/// A task: lanes or photon beams of a step.
#[derive(Clone)]
enum Task {
    Lanes(Range<usize>),
    Beams(Range<usize>),
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
    rayon::in_place_scope(|scope| {
        let counters = walks.trace(numbers, |vertices, _| {
            let beams = gathering.photon_beams(vertices, tables)?;
            total.counters.photon_table_samples += beams.table_samples;
            let empty = used.pop().unwrap_or_else(|| vertices.like());
            let step = start(gathering, scope, std::mem::replace(vertices, empty), beams, sink);
            in_flight.push_back(step);
            if in_flight.len() > STEPS_IN_FLIGHT {
                let oldest = in_flight.pop_front().expect("some are in flight");
                used.extend(finish(gathering, oldest, &mut total)?);
            }
            Ok(())
        })?;
        total.counters.add(&counters);
        for step in in_flight.drain(..) {
            finish(gathering, step, &mut total)?;
        }
        Ok(total)
    })
}

/// Spawns the tasks of a step.
fn start<'scope, S: Sink + 'scope>(
    gathering: &'scope Gathering,
    scope: &rayon::Scope<'scope>,
    vertices: PhotonVertices,
    beams: PhotonBeams,
    sink: &'scope (impl Fn() -> S + Sync),
) -> Arc<Step<S>> {
    let lanes = tasks(vertices.event.len()).map(Task::Lanes);
    let tasks: Vec<Task> = lanes.chain(tasks(beams.beams.len()).map(Task::Beams)).collect();
    let found = tasks.iter().map(|_| Mutex::new(None)).collect();
    let step = Arc::new(Step { vertices, beams, found, left: AtomicUsize::new(tasks.len()) });
    for (number, task) in tasks.into_iter().enumerate() {
        let step = Arc::clone(&step);
        scope.spawn(move |_| {
            let mut out = Gathered::new(sink());
            match task {
                Task::Lanes(lanes) => gathering.lanes(&step.vertices, lanes, &mut out),
                Task::Beams(range) => gathering.beams(&step.beams, range, &mut out),
            }
            *step.found[number].lock().expect("no task panicked") = Some(out);
            step.left.fetch_sub(1, Ordering::Release);
        });
    }
    step
}

fn tasks(count: usize) -> impl Iterator<Item = Range<usize>> {
    (0..count).step_by(PER_TASK).map(move |first| first..count.min(first + PER_TASK))
}

/// Waits for a step, doing tasks meanwhile, adds what it found, and gives its arrays back for another.
fn finish<S: Sink>(
    gathering: &Gathering,
    step: Arc<Step<S>>,
    total: &mut Gathered<S>,
) -> SceneResult<Option<PhotonVertices>> {
    while step.left.load(Ordering::Acquire) > 0 {
        if rayon::yield_now() != Some(rayon::Yield::Executed) {
            std::thread::yield_now();
        }
    }
    for found in &step.found {
        let found = found.lock().expect("no task panicked").take();
        total.append(found.expect("every task is done"));
    }
    total.resolve(gathering.target.scene)?;
    Ok(Arc::into_inner(step).map(|step| step.vertices))
}
