//! The renderer's own threads, lent to the engine.

use crate::crew::{Crew, Task};
use std::any::Any;
use std::ffi::c_void;
use std::marker::PhantomData;
use std::panic::{catch_unwind, resume_unwind, AssertUnwindSafe};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// [`super::abi::VptHost::spawn`]
pub type Spawn = unsafe extern "C" fn(
    context: *mut c_void,
    task: unsafe extern "C" fn(*mut c_void),
    payload: *mut c_void,
) -> i32;
/// [`super::abi::VptHost::work_until`]
pub type WorkUntil = unsafe extern "C" fn(
    context: *mut c_void,
    is_done: unsafe extern "C" fn(*mut c_void) -> u32,
    payload: *mut c_void,
) -> i32;

/// The callbacks by which a renderer lends its threads.
#[derive(Clone, Copy)]
pub struct Lender {
    pub context: *mut c_void,
    pub spawn: Spawn,
    pub work_until: WorkUntil,
}

impl Lender {
    /// Lends the threads to `body`, and returns when all tasks are done. A panic of `body` or of a task goes on here.
    ///
    /// # Safety
    /// The callbacks must keep the promises of [`super::abi`].
    pub unsafe fn lend<'scope>(self, body: &mut dyn FnMut(&dyn Crew<'scope>)) {
        let crew = HostCrew { lender: self, tally: Arc::default(), scope: PhantomData };
        let outcome = catch_unwind(AssertUnwindSafe(|| body(&crew)));
        crew.work_until_none(&crew.tally.left);
        let of_a_task = crew.tally.panic.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(panic) = outcome.err().or(of_a_task) {
            resume_unwind(panic);
        }
    }
}

/// What is left to do, and the first panic of a task.
#[derive(Default)]
struct Tally {
    left: AtomicUsize,
    panic: Mutex<Option<Box<dyn Any + Send>>>,
}

struct HostCrew<'scope> {
    lender: Lender,
    tally: Arc<Tally>,
    /// Invariant: a crew for one scope is none for a shorter one, whose borrows may end before the tasks do.
    scope: PhantomData<fn(&'scope ()) -> &'scope ()>,
}

/// A task on its way through the C ABI.
struct Errand {
    task: Task<'static>,
    tally: Arc<Tally>,
}

impl<'scope> Crew<'scope> for HostCrew<'scope> {
    fn spawn(&self, task: Task<'scope>) {
        // SAFETY: only the lifetime changes. `Lender::lend` returns when `left` is 0, so the task ends within the
        // call, which 'scope outlives.
        let task = unsafe { std::mem::transmute::<Task<'scope>, Task<'static>>(task) };
        self.tally.left.fetch_add(1, Ordering::Relaxed);
        let payload = Box::into_raw(Box::new(Errand { task, tally: self.tally.clone() })).cast();
        // SAFETY: `run` takes the payload, once.
        unsafe {
            if (self.lender.spawn)(self.lender.context, run, payload) != 0 {
                run(payload);
            }
        }
    }

    fn work_until_none(&self, left: &AtomicUsize) {
        while left.load(Ordering::Acquire) > 0 {
            let payload = std::ptr::from_ref(left).cast_mut().cast();
            // SAFETY: the payload is the counter that `is_none_left` reads, alive for the call.
            let status =
                unsafe { (self.lender.work_until)(self.lender.context, is_none_left, payload) };
            if status != 0 {
                std::thread::yield_now();
            }
        }
    }
}

/// # Safety
/// `payload` must be an [`Errand`] out of its box, which this ends.
unsafe extern "C" fn run(payload: *mut c_void) {
    // SAFETY: the caller's promise.
    let Errand { task, tally } = *unsafe { Box::from_raw(payload.cast::<Errand>()) };
    if let Err(panic) = catch_unwind(AssertUnwindSafe(task)) {
        tally.panic.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(panic);
    }
    tally.left.fetch_sub(1, Ordering::Release);
}

/// # Safety
/// `payload` must be a counter.
unsafe extern "C" fn is_none_left(payload: *mut c_void) -> u32 {
    // SAFETY: the caller's promise.
    let left = unsafe { &*payload.cast::<AtomicUsize>() };
    (left.load(Ordering::Acquire) == 0).into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::{channel, Receiver, Sender};

    type Job = (unsafe extern "C" fn(*mut c_void), usize);

    /// A renderer with one thread, which does what is sent.
    struct Renderer {
        jobs: Mutex<Sender<Job>>,
        refuses: bool,
    }

    unsafe extern "C" fn spawn(
        context: *mut c_void,
        task: unsafe extern "C" fn(*mut c_void),
        payload: *mut c_void,
    ) -> i32 {
        // SAFETY: `with_renderer` gave its renderer as the context.
        let renderer = unsafe { &*context.cast::<Renderer>() };
        if renderer.refuses {
            return 1;
        }
        renderer.jobs.lock().unwrap().send((task, payload as usize)).unwrap();
        0
    }

    unsafe extern "C" fn work_until(
        _: *mut c_void,
        is_done: unsafe extern "C" fn(*mut c_void) -> u32,
        payload: *mut c_void,
    ) -> i32 {
        // SAFETY: the engine's own pair of function and payload.
        while unsafe { is_done(payload) } == 0 {
            std::thread::yield_now();
        }
        0
    }

    fn with_renderer(refuses: bool, body: impl FnOnce(Lender)) {
        let (jobs, inbox): (_, Receiver<Job>) = channel();
        std::thread::scope(|threads| {
            threads.spawn(move || {
                for (task, payload) in inbox {
                    // SAFETY: the pair came through `spawn`.
                    unsafe { task(payload as *mut c_void) };
                }
            });
            let renderer = Renderer { jobs: Mutex::new(jobs), refuses };
            let context = std::ptr::from_ref(&renderer).cast_mut().cast();
            body(Lender { context, spawn, work_until });
        });
    }

    /// Squares numbers in tasks that borrow them; the sum is known: n (n + 1) (2 n + 1) / 6.
    fn sum_of_squares(lender: Lender) -> usize {
        let numbers: Vec<usize> = (1..=100).collect();
        let squares = AtomicUsize::new(0);
        // SAFETY: the callbacks of `with_renderer` keep the ABI's promises.
        unsafe {
            lender.lend(&mut |crew| {
                for &number in &numbers {
                    let squares = &squares;
                    crew.spawn(Box::new(move || {
                        squares.fetch_add(number * number, Ordering::Relaxed);
                    }));
                }
            });
        }
        squares.into_inner()
    }

    #[test]
    fn all_tasks_are_done_when_the_threads_are_given_back() {
        with_renderer(false, |lender| assert_eq!(sum_of_squares(lender), 338_350));
    }

    #[test]
    fn tasks_that_a_renderer_refuses_are_done_by_the_caller() {
        with_renderer(true, |lender| assert_eq!(sum_of_squares(lender), 338_350));
    }

    #[test]
    fn a_panic_of_a_task_reaches_the_caller_after_the_other_tasks() {
        with_renderer(false, |lender| {
            let done = AtomicUsize::new(0);
            // SAFETY: the callbacks of `with_renderer` keep the ABI's promises.
            let outcome = catch_unwind(AssertUnwindSafe(|| unsafe {
                lender.lend(&mut |crew| {
                    crew.spawn(Box::new(|| panic!("of a task")));
                    crew.spawn(Box::new(|| {
                        done.fetch_add(1, Ordering::Relaxed);
                    }));
                });
            }));
            let panic = outcome.expect_err("the task's panic");
            assert_eq!(panic.downcast_ref::<&str>(), Some(&"of a task"));
            assert_eq!(done.into_inner(), 1);
        });
    }
}
