//! Pairs of photon and receiver whose scattering only the scene can evaluate, collected into batches.

use super::counters::Counters;
use super::deposits::{Deposit, Sink};
use super::photon::Family;
use crate::math::Rgb;
use crate::scene::*;
use glam::Vec3;

/// A pair's contribution before the factors that are asked for.
#[derive(Debug, Clone, Copy)]
pub struct Pending {
    pub walk: u32,
    pub pixel: u32,
    pub weighted: Rgb,
    /// The share of the contribution that is added to the bias of the pixel.
    pub bias_share: f32,
}

/// A pair in a medium: light travels along `photon`, is scattered at `position`, and leaves against `view`.
#[derive(Debug, Clone, Copy)]
pub struct MediumPair {
    pub medium: u32,
    pub position: Vec3,
    pub photon: Vec3,
    pub view: Vec3,
    /// Whether the phase function and the scattering coefficient are still owed.
    pub owes_phase: bool,
    pub owes_scattering: bool,
}

/// A pair on a surface: the number of a stored visible point, the photon's direction, and how densely the light of its lamp
/// lies in directions, as in [`PhotonVertices`].
#[derive(Debug, Clone, Copy)]
pub struct SurfacePair {
    pub point: u32,
    pub photon: Vec3,
    pub lamp_density: f32,
}

/// Pairs that wait for an answer.
#[derive(Debug, Default)]
pub struct Asked {
    medium: Vec<(MediumPair, Pending)>,
    surface: Vec<(SurfacePair, Pending)>,
}

impl Asked {
    pub fn medium(&mut self, pair: MediumPair, pending: Pending) {
        self.medium.push((pair, pending));
    }

    pub fn surface(&mut self, pair: SurfacePair, pending: Pending) {
        self.surface.push((pair, pending));
    }

    pub fn count(&self) -> usize {
        self.medium.len() + self.surface.len()
    }

    pub fn append(&mut self, mut other: Asked) {
        self.medium.append(&mut other.medium);
        self.surface.append(&mut other.surface);
    }

    /// Asks the scene and turns the answers into deposits.
    pub fn resolve(
        mut self,
        scene: &dyn Scene,
        sink: &mut impl Sink,
        counters: &mut Counters,
    ) -> SceneResult<()> {
        self.ask_phase(scene)?;
        self.ask_scattering(scene)?;
        self.ask_bsdf(scene)?;
        for (_, pending) in &self.medium {
            keep(sink, counters, Family::Medium, *pending);
        }
        for (_, pending) in &self.surface {
            keep(sink, counters, Family::Surface, *pending);
        }
        Ok(())
    }

    fn ask_phase(&mut self, scene: &dyn Scene) -> SceneResult<()> {
        let mut asked: Vec<_> = self.medium.iter_mut().filter(|(p, _)| p.owes_phase).collect();
        if asked.is_empty() {
            return Ok(());
        }
        let pairs = PhasePairs {
            medium: asked.iter().map(|(pair, _)| pair.medium).collect(),
            position: Planes::push_all(asked.iter().map(|(pair, _)| pair.position)),
            photon_direction: Planes::push_all(asked.iter().map(|(pair, _)| pair.photon)),
            view_direction: Planes::push_all(asked.iter().map(|(pair, _)| pair.view)),
        };
        let mut values = Planes::default();
        scene.eval_phase(&pairs, &mut values)?;
        weigh(asked.iter_mut().map(|(_, pending)| pending), &values);
        Ok(())
    }

    fn ask_scattering(&mut self, scene: &dyn Scene) -> SceneResult<()> {
        let mut asked: Vec<_> = self.medium.iter_mut().filter(|(p, _)| p.owes_scattering).collect();
        if asked.is_empty() {
            return Ok(());
        }
        let points = MediumPoints {
            medium: asked.iter().map(|(pair, _)| pair.medium).collect(),
            position: Planes::push_all(asked.iter().map(|(pair, _)| pair.position)),
            direction: Planes::push_all(asked.iter().map(|(pair, _)| pair.photon)),
        };
        let mut values = Planes::default();
        scene.scattering(&points, &mut values)?;
        // Walks do not collide where a grid is negative, so nothing scatters there either.
        for lane in 0..values.lanes() {
            values.set_rgb(lane, values.rgb(lane).not_negative());
        }
        weigh(asked.iter_mut().map(|(_, pending)| pending), &values);
        Ok(())
    }

    fn ask_bsdf(&mut self, scene: &dyn Scene) -> SceneResult<()> {
        if self.surface.is_empty() {
            return Ok(());
        }
        let pairs = SurfacePairs {
            point: self.surface.iter().map(|(pair, _)| pair.point).collect(),
            photon_direction: Planes::push_all(self.surface.iter().map(|(pair, _)| pair.photon)),
            lamp_density: self.surface.iter().map(|(pair, _)| pair.lamp_density).collect(),
        };
        let mut values = Planes::default();
        scene.eval_bsdf(&pairs, &mut values)?;
        weigh(self.surface.iter_mut().map(|(_, pending)| pending), &values);
        Ok(())
    }
}

fn weigh<'a>(pending: impl Iterator<Item = &'a mut Pending>, values: &Planes) {
    for (lane, pending) in pending.enumerate() {
        pending.weighted *= values.rgb(lane);
    }
}

/// Hands a finished contribution on, if it is one.
pub fn keep(sink: &mut impl Sink, counters: &mut Counters, family: Family, pending: Pending) {
    let radiance = pending.weighted;
    if radiance.is_zero() {
        return;
    }
    if !radiance.is_finite() {
        counters.dropped_deposits += 1;
        return;
    }
    match family {
        Family::Surface => counters.surface_deposits += 1,
        Family::Medium => counters.medium_deposits += 1,
    }
    let bias = radiance.mean() * pending.bias_share;
    sink.push(pending.walk, family, Deposit { pixel: pending.pixel, radiance, bias });
}
