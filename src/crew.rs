//! Threads that do the engine's tasks beside the one that drives a scene.

use rayon::Yield;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Something to be done once, on whichever thread.
pub type Task<'scope> = Box<dyn FnOnce() + Send + 'scope>;

/// Threads, for as long as [`crate::scene::Scene::with_crew`] lends them; tasks may borrow what outlives that call.
pub trait Crew<'scope> {
    /// Has a task done, sooner or later, before the crew is given back.
    fn spawn(&self, task: Task<'scope>);
    /// Does tasks until `left`, which they count down, is 0.
    fn work_until_none(&self, left: &AtomicUsize);
}

impl<'scope> Crew<'scope> for rayon::Scope<'scope> {
    fn spawn(&self, task: Task<'scope>) {
        rayon::Scope::spawn(self, move |_| task());
    }

    fn work_until_none(&self, left: &AtomicUsize) {
        while left.load(Ordering::Acquire) > 0 {
            if rayon::yield_now() != Some(Yield::Executed) {
                std::thread::yield_now();
            }
        }
    }
}

/// Lends the threads of rayon's pool.
pub fn of_rayon<'scope>(body: &mut dyn FnMut(&dyn Crew<'scope>)) {
    rayon::in_place_scope(|scope| body(scope));
}
