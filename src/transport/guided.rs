//! Walks whose emission may be guided.

use super::numbers::{Numbers, Uniform};
use crate::guide::EmissionGuide;
use rand::Rng;
use rand_pcg::Pcg64Mcg;
use std::ops::Range;

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

    fn emission(&mut self, walks: usize, out: &mut Vec<f32>) {
        self.rest.emission(walks, out);
        let Some(guide) = self.guide else { return };
        self.weights.clear();
        for walk in 0..walks {
            let (numbers, density) = guide.warp(self.rest.0.random());
            for (axis, number) in numbers.into_iter().enumerate() {
                out[axis * walks + walk] = number;
            }
            self.weights.push(1.0 / density);
        }
    }

    fn steps(&mut self, steps: Range<usize>, alive: &[u32], lanes: usize, out: &mut Vec<f32>) {
        self.rest.steps(steps, alive, lanes, out);
    }

    fn weights(&self) -> Option<&[f32]> {
        self.guide.map(|_| self.weights.as_slice())
    }
}
