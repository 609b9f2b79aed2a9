//! Walks whose emission may be guided.

use super::numbers::{Alive, Numbers, Uniform};
use crate::guide::{EmissionGuide, GUIDED_DIMENSIONS};
use crate::math::uniform;
use crate::scene::work;
use crate::scene::Scene;
use rand::Rng;
use rand_pcg::Pcg64Mcg;
use std::ops::Range;

/// Walks that one task emits.
const PER_TASK: usize = 4096;

/// Independent numbers, those of the emission with the density of a guide if there is one.
pub struct Guided<'a> {
    rest: Uniform,
    guide: Option<&'a EmissionGuide>,
    /// Of the walks of the batch.
    weights: Vec<f32>,
}

impl<'a> Guided<'a> {
    pub fn new(rng: Pcg64Mcg, guide: Option<&'a EmissionGuide>) -> Self {
        Guided { rest: Uniform(rng), guide, weights: Vec::new() }
    }
}

impl Numbers for Guided<'_> {
    const KNOWS_WALKS: bool = false;

    fn emission(&mut self, scene: &dyn Scene, walks: usize, out: &mut Vec<f32>) {
        self.rest.emission(scene, walks, out);
        let Some(guide) = self.guide else { return };
        self.weights.resize(walks, 1.0);
        let guided = &mut out[..GUIDED_DIMENSIONS * walks];
        let parts =
            work::cut(guided, walks, PER_TASK).into_iter().zip(self.weights.chunks_mut(PER_TASK));
        let tasks = parts.map(|(planes, weights)| {
            let rng = uniform::split_off(&mut self.rest.0, weights.len() * GUIDED_DIMENSIONS);
            Warp { guide, rng, planes, weights }
        });
        work::for_each(scene, tasks.collect(), Warp::run);
    }

    fn steps(&mut self, scene: &dyn Scene, steps: Range<usize>, alive: Alive, out: &mut Vec<f32>) {
        self.rest.steps(scene, steps, alive, out);
    }

    fn weights(&self) -> Option<&[f32]> {
        self.guide.map(|_| self.weights.as_slice())
    }
}

/// Walks next to each other whose emission one task guides.
struct Warp<'a> {
    guide: &'a EmissionGuide,
    rng: Pcg64Mcg,
    /// Of the numbers that are guided, those of these walks.
    planes: Vec<&'a mut [f32]>,
    weights: &'a mut [f32],
}

impl Warp<'_> {
    fn run(mut self) {
        for (walk, weight) in self.weights.iter_mut().enumerate() {
            let (numbers, density) = self.guide.warp(self.rng.random());
            self.planes.iter_mut().zip(numbers).for_each(|(plane, number)| plane[walk] = number);
            *weight = 1.0 / density;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::analytic::{Camera, Contents, Disclosure, Projection, World};
    use crate::guide::{learn, Lesson};
    use crate::scene::EMIT_DIMENSIONS;
    use glam::DVec3;
    use rand::SeedableRng;

    /// Whichever threads emit, walks are those that one thread would have emitted one after another: first all numbers, then
    /// five more for each walk.
    #[test]
    fn tasks_emit_what_one_thread_would() {
        let projection = Projection::Orthographic { width: 1.0 };
        let camera = Camera::new(DVec3::ZERO, DVec3::Z, [1, 1], projection);
        let world = World::new(Contents {
            camera,
            surfaces: Vec::new(),
            fogs: Vec::new(),
            lamps: Vec::new(),
            disclosure: Disclosure::default(),
        });
        let lesson = |number| Lesson { numbers: [number; GUIDED_DIMENSIONS], worth: 1.0 };
        let guide = learn([0.1, 0.12, 0.7].map(lesson).to_vec()).expect("there are lessons");
        let (walks, rng) = (2 * PER_TASK + 3, Pcg64Mcg::seed_from_u64(5));
        let (mut guided, mut numbers) = (Guided::new(rng.clone(), Some(&guide)), Vec::new());
        guided.emission(&world, walks, &mut numbers);

        let (mut stream, mut expected) = (rng, Vec::new());
        uniform::fill(&mut stream, &mut expected, EMIT_DIMENSIONS * walks);
        for walk in 0..walks {
            let (places, density) = guide.warp(stream.random());
            for (axis, place) in places.into_iter().enumerate() {
                expected[axis * walks + walk] = place;
            }
            assert_eq!(guided.weights[walk], 1.0 / density);
        }
        assert_eq!(numbers, expected);
    }
}
