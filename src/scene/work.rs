//! Work that is shared among the threads that a scene lends.

use super::Scene;
use crate::crew::{Crew, Task};

/// Runs `body` with the threads that a scene lends.
pub fn with_crew<'scope, R>(scene: &dyn Scene, body: impl FnOnce(&dyn Crew<'scope>) -> R) -> R {
    let (mut body, mut result) = (Some(body), None);
    scene.with_crew(&mut |crew| result = body.take().map(|body| body(crew)));
    result.expect("a scene runs the body once")
}

/// Runs `task` on each of the items, on the threads that a scene lends, and returns when all are done.
pub fn for_each<T: Send>(scene: &dyn Scene, mut items: Vec<T>, task: impl Fn(T) + Sync) {
    let task = &task;
    // What is one task is sooner done than handed over.
    if items.len() < 2 {
        return items.drain(..).for_each(task);
    }
    with_crew(scene, |crew| {
        items.drain(..).for_each(|item| crew.spawn(Box::new(move || task(item))))
    });
}

/// Runs both on the threads that a scene lends, and returns when both are done.
pub fn join<A: Send, B: Send>(
    scene: &dyn Scene,
    a: impl FnOnce() -> A + Send,
    b: impl FnOnce() -> B + Send,
) -> (A, B) {
    let (mut of_a, mut of_b) = (None, None);
    let tasks: Vec<Task> = vec![Box::new(|| of_a = Some(a())), Box::new(|| of_b = Some(b()))];
    for_each(scene, tasks, |task| task());
    (of_a.expect("every task is done"), of_b.expect("every task is done"))
}

/// As [`for_each`] where that is worth it; a little is sooner done here than handed over.
pub fn for_each_if<T: Send>(
    is_worth_it: bool,
    scene: &dyn Scene,
    items: Vec<T>,
    task: impl Fn(T) + Sync,
) {
    if is_worth_it {
        for_each(scene, items, task);
    } else {
        items.into_iter().for_each(task);
    }
}

/// Cuts planes of so many lanes into tasks; each has the same lanes of all planes.
pub fn cut(planes: &mut [f32], lanes: usize, per_task: usize) -> Vec<Vec<&mut [f32]>> {
    let mut tasks = Vec::new();
    tasks.resize_with(lanes.div_ceil(per_task), Vec::new);
    for plane in planes.chunks_exact_mut(lanes.max(1)) {
        let parts = tasks.iter_mut().zip(plane.chunks_mut(per_task));
        parts.for_each(|(task, part)| task.push(part));
    }
    tasks
}
