//! Vectors of many lanes.

use super::work;
use super::Scene;
use crate::math::Rgb;

/// Lanes of one task.
const PER_TASK: usize = 4096;

/// Three planes of `f32`, one value per lane and component.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Planes {
    lanes: usize,
    values: Vec<f32>,
}

impl Planes {
    /// Sets the number of lanes; contents are unspecified afterwards.
    pub fn resize(&mut self, lanes: usize) {
        self.lanes = lanes;
        self.values.resize(3 * lanes, 0.0);
    }

    pub fn lanes(&self) -> usize {
        self.lanes
    }

    pub fn get(&self, lane: usize) -> glam::Vec3 {
        let n = self.lanes;
        glam::Vec3::new(self.values[lane], self.values[n + lane], self.values[2 * n + lane])
    }

    pub fn set(&mut self, lane: usize, value: glam::Vec3) {
        let n = self.lanes;
        self.values[lane] = value.x;
        self.values[n + lane] = value.y;
        self.values[2 * n + lane] = value.z;
    }

    pub fn rgb(&self, lane: usize) -> Rgb {
        Rgb::from(self.get(lane))
    }

    pub fn set_rgb(&mut self, lane: usize, value: Rgb) {
        self.set(lane, value.into());
    }

    /// The three planes, one after another.
    pub(super) fn planes_mut(&mut self) -> impl Iterator<Item = &mut [f32]> {
        self.values.chunks_exact_mut(self.lanes.max(1))
    }

    /// All lanes, to be handed out in parts.
    pub fn rows(&mut self) -> PlaneRows<'_> {
        let lanes = self.lanes;
        let (x, rest) = self.values.split_at_mut(lanes);
        let (y, z) = rest.split_at_mut(lanes);
        PlaneRows([x, y, z])
    }

    pub fn push_all(values: impl ExactSizeIterator<Item = glam::Vec3>) -> Self {
        let mut planes = Planes::default();
        planes.resize(values.len());
        for (lane, value) in values.enumerate() {
            planes.set(lane, value);
        }
        planes
    }

    /// The same from a value for each lane, in tasks for the threads that the scene lends.
    pub fn of_lanes(
        scene: &dyn Scene,
        lanes: usize,
        value: impl Fn(usize) -> glam::Vec3 + Sync,
    ) -> Self {
        let mut planes = Planes::default();
        planes.resize(lanes);
        let parts = work::cut(&mut planes.values, lanes, PER_TASK);
        let tasks = (0..).step_by(PER_TASK).zip(parts).collect();
        work::for_each(scene, tasks, |(first, parts)| {
            let mut rows = PlaneRows(parts.try_into().expect("three planes"));
            (first..lanes).take(PER_TASK).for_each(|lane| rows.set(lane - first, value(lane)));
        });
        planes
    }

    /// Keeps the lanes named, which ascend.
    pub fn keep(&mut self, lanes: &[u32]) {
        let (before, after) = (self.lanes, lanes.len());
        for component in 0..3 {
            for (to, &from) in lanes.iter().enumerate() {
                self.values[component * after + to] =
                    self.values[component * before + from as usize];
            }
        }
        self.lanes = after;
        self.values.truncate(3 * after);
    }

    pub fn as_slice(&self) -> &[f32] {
        &self.values
    }

    pub fn as_mut_slice(&mut self) -> &mut [f32] {
        &mut self.values
    }
}

/// Some lanes of [`Planes`], for whoever fills them in.
pub struct PlaneRows<'a>([&'a mut [f32]; 3]);

impl<'a> PlaneRows<'a> {
    /// Takes the first `lanes` of them out.
    pub fn split_off(&mut self, lanes: usize) -> PlaneRows<'a> {
        PlaneRows(self.0.each_mut().map(|row| {
            let (first, rest) = std::mem::take(row).split_at_mut(lanes);
            *row = rest;
            first
        }))
    }

    pub fn set(&mut self, lane: usize, value: glam::Vec3) {
        for (row, value) in self.0.iter_mut().zip(value.to_array()) {
            row[lane] = value;
        }
    }
}
