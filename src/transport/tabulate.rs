//! Transmittance tables along segments that cross varying media. [Collin 2013 §5.3]

use super::extent::{far, OPAQUE_DEPTH};
use crate::math::{Rgb, Segment};
use crate::medium::{TableStep, TransmittanceTables, NO_TABLE};
use crate::scene::*;
use rand::Rng;
use rand_pcg::Pcg64Mcg;

/// Transmittance tables: points per step, and steps per beam at most.
const SAMPLES_PER_STEP: usize = 2;
const MAX_STEPS: usize = 512;
/// Points at which extinction is asked for in one call, so that they stay in a cache.
const SAMPLES_AT_ONCE: usize = 1 << 16;
/// A step of more optical depth than this is divided into so many, so many times at most.
const STEEP_DEPTH: f32 = 0.25;
const STEPS_WITHIN_STEP: usize = 8;
const MOST_LEVELS: u32 = 6;

/// A way through a medium.
#[derive(Debug, Clone, Copy)]
pub struct Crossing {
    pub segment: Segment,
    /// Index of the medium; not [`VACUUM`].
    pub medium: u32,
}

/// Adds a table to `tables` for each crossing of a varying medium; returns its index by crossing,
/// [`NO_TABLE`] where there is none, and the number of points at which extinction was asked for.
pub fn tabulate(
    scene: &dyn Scene,
    media: &[Medium],
    crossings: &[Crossing],
    rng: &mut Pcg64Mcg,
    tables: &mut TransmittanceTables,
) -> SceneResult<(Vec<u32>, u64)> {
    let mut indices = vec![NO_TABLE; crossings.len()];
    let far = far(&scene.description().bounds);
    let mut plans: Vec<_> = (0..crossings.len())
        .filter_map(|index| TablePlan::new(index, &crossings[index], media, far))
        .collect();
    let roots = plans.len();
    let (mut measured, mut samples) = (0, 0);
    while measured < plans.len() {
        let newest = &mut plans[measured..];
        samples += newest.iter().map(TablePlan::samples).sum::<usize>();
        let finer = measure(scene, newest, crossings, rng)?;
        let first = measured;
        measured = plans.len();
        for (plan, step, finer) in finer {
            plans[first + plan].finer[step] = Some(plans.len());
            plans.push(finer);
        }
    }
    for plan in 0..roots {
        indices[plans[plan].crossing] = push(&plans, plan, tables);
    }
    Ok((indices, samples as u64))
}

/// Fills in the depths of plans, and returns which step of which of them takes a finer table.
fn measure(
    scene: &dyn Scene,
    plans: &mut [TablePlan],
    crossings: &[Crossing],
    rng: &mut Pcg64Mcg,
) -> SceneResult<Vec<(usize, usize, TablePlan)>> {
    let (mut points, mut sigma_t) = (MediumPoints::default(), Planes::default());
    let mut finer = Vec::new();
    let mut first = 0;
    while first < plans.len() {
        let count = at_once(&plans[first..]);
        let (chunk, mut sample) = (&mut plans[first..first + count], 0);
        table_points(chunk, crossings, rng, &mut points);
        scene.extinction(&points, &mut sigma_t)?;
        for (index, plan) in (first..).zip(chunk) {
            plan.fill_in(&sigma_t, sample);
            sample += plan.samples();
            finer.extend(plan.divide().into_iter().map(|(step, finer)| (index, step, finer)));
        }
        first += count;
    }
    Ok(finer)
}

/// How many of these plans are measured together.
fn at_once(plans: &[TablePlan]) -> usize {
    let mut samples = 0;
    let fits = plans.iter().take_while(|plan| {
        samples += plan.samples();
        samples <= SAMPLES_AT_ONCE
    });
    fits.count().max(1)
}

/// Adds a plan's table behind those of its steps; returns its index.
fn push(plans: &[TablePlan], plan: usize, tables: &mut TransmittanceTables) -> u32 {
    let plan = &plans[plan];
    let step = |(&depth, finer): (&Rgb, &Option<usize>)| match finer {
        None => TableStep { depth, finer: NO_TABLE },
        Some(finer) => {
            let finer = push(plans, *finer, tables);
            TableStep { depth: tables.depth(finer), finer }
        }
    };
    let steps: Vec<_> = plan.depths.iter().zip(&plan.finer).map(step).collect();
    tables.push(plan.start, plan.spacing, &steps)
}

/// Stratified points along each planned table: the sum over them is an unbiased optical depth.
fn table_points(
    plans: &[TablePlan],
    crossings: &[Crossing],
    rng: &mut Pcg64Mcg,
    points: &mut MediumPoints,
) {
    let total: usize = plans.iter().map(TablePlan::samples).sum();
    points.position.resize(total);
    points.direction.resize(total);
    points.medium.clear();
    for plan in plans {
        let Crossing { segment, medium } = crossings[plan.crossing];
        let spacing = plan.spacing / SAMPLES_PER_STEP as f32;
        for sample in 0..plan.samples() {
            // What does not change along the segment is the same everywhere on it.
            let offset = if plan.varies { rng.random() } else { 0.5 };
            let t = plan.start + (sample as f32 + offset) * spacing;
            let index = points.medium.len();
            points.position.set(index, segment.at(t));
            points.direction.set(index, segment.direction);
            points.medium.push(medium);
        }
    }
}

/// Where along a crossing the extinction is to be tabulated.
struct TablePlan {
    crossing: usize,
    start: f32,
    spacing: f32,
    steps: usize,
    /// Whether the extinction changes along the crossing.
    varies: bool,
    /// How often steps were divided on the way here, and the depth of what lies before.
    level: u32,
    ahead: Rgb,
    /// Of every step: its depth, and the plan that divides it.
    depths: Vec<Rgb>,
    finer: Vec<Option<usize>>,
}

impl TablePlan {
    /// None where the extinction is constant or the segment misses the medium's bounds. No table is longer
    /// than `far`.
    fn new(index: usize, crossing: &Crossing, media: &[Medium], far: f32) -> Option<Self> {
        let medium = &media[crossing.medium as usize];
        let Extinction::Varying { feature_size } = medium.extinction else { return None };
        let Segment { origin, direction, length } = crossing.segment;
        let (start, end) = medium.bounds.clip(origin, direction)?;
        let extent = (end.min(length) - start).min(far);
        if !(extent > 0.0 && extent.is_finite()) {
            return None;
        }
        let steps = ((extent / feature_size).ceil() as usize).clamp(1, MAX_STEPS);
        Some(TablePlan {
            crossing: index,
            start,
            spacing: extent / steps as f32,
            steps,
            varies: feature_size.is_finite(),
            level: 0,
            ahead: Rgb::ZERO,
            depths: Vec::new(),
            finer: vec![None; steps],
        })
    }

    /// Takes the depths of all steps from the extinction at the plan's samples, which begin at `first`.
    fn fill_in(&mut self, sigma_t: &Planes, first: usize) {
        let scale = self.spacing / SAMPLES_PER_STEP as f32;
        let depth_of = |step: usize| {
            let start = first + step * SAMPLES_PER_STEP;
            (start..start + SAMPLES_PER_STEP)
                .fold(Rgb::ZERO, |sum, point| sum + sigma_t.rgb(point).not_negative() * scale)
        };
        self.depths = (0..self.steps).map(depth_of).collect();
    }

    /// Points at which extinction is asked for.
    fn samples(&self) -> usize {
        self.steps * SAMPLES_PER_STEP
    }

    /// Plans for the steps across which transmittance changes too much for a straight line: where dense smoke begins
    /// within a step, all of the step's depth would lie before what is lit. Behind what is opaque nothing is seen.
    fn divide(&self) -> Vec<(usize, TablePlan)> {
        let (mut ahead, mut finer) = (self.ahead, Vec::new());
        if !self.varies {
            return finer;
        }
        for (step, &depth) in self.depths.iter().enumerate() {
            if ahead.min_component() > OPAQUE_DEPTH || self.level == MOST_LEVELS {
                break;
            }
            if depth.max_component() > STEEP_DEPTH {
                finer.push((step, self.finer_plan(step, ahead)));
            }
            ahead += depth;
        }
        finer
    }

    fn finer_plan(&self, step: usize, ahead: Rgb) -> TablePlan {
        TablePlan {
            crossing: self.crossing,
            start: self.start + step as f32 * self.spacing,
            spacing: self.spacing / STEPS_WITHIN_STEP as f32,
            steps: STEPS_WITHIN_STEP,
            varies: true,
            level: self.level + 1,
            ahead,
            depths: Vec::new(),
            finer: vec![None; STEPS_WITHIN_STEP],
        }
    }
}
