//! Transmittance tables along segments that cross varying media. [Collin 2013 §5.3]

use super::extent::{far, OPAQUE_DEPTH};
use super::numbers::draw;
use crate::math::{Rgb, Segment};
use crate::medium::{TableStep, TransmittanceTables, NO_TABLE};
use crate::scene::work;
use crate::scene::*;
use rand_pcg::Pcg64Mcg;

/// Transmittance tables: points per step, and steps per beam at most.
const SAMPLES_PER_STEP: usize = 2;
const MAX_STEPS: usize = 512;
/// Points at which extinction is asked for in one call, so that they stay in a cache, and of one task.
const SAMPLES_AT_ONCE: usize = 1 << 16;
const SAMPLES_PER_TASK: usize = 1 << 13;
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
    let (mut numbers, mut finer) = (Vec::new(), Vec::new());
    let mut first = 0;
    for group in groups(plans, SAMPLES_AT_ONCE) {
        let chunk = &mut plans[first..first + group.plans];
        draw(rng, scene, &mut numbers, group.numbers);
        table_points(scene, chunk, crossings, &numbers, &mut points);
        scene.extinction(&points, &mut sigma_t)?;
        fill_in(scene, chunk, &sigma_t);
        for (index, plan) in (first..).zip(chunk) {
            let divided = std::mem::take(&mut plan.divided);
            finer.extend(divided.into_iter().map(|(step, finer)| (index, step, finer)));
        }
        first += group.plans;
    }
    Ok(finer)
}

/// Plans next to each other, and what they take together.
#[derive(Clone, Copy, Default)]
struct Group {
    plans: usize,
    samples: usize,
    numbers: usize,
}

/// Groups of plans, one after another, that have no more samples together than `most`, or are a single plan.
fn groups(plans: &[TablePlan], most: usize) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    for plan in plans {
        let samples = plan.samples();
        if groups.last().is_none_or(|group| group.samples + samples > most) {
            groups.push(Group::default());
        }
        let group = groups.last_mut().expect("the first plan has begun a group");
        group.plans += 1;
        group.samples += samples;
        group.numbers += plan.numbers();
    }
    groups
}

/// Fills in the depths of plans and divides them, task by task.
fn fill_in(scene: &dyn Scene, plans: &mut [TablePlan], sigma_t: &Planes) {
    let (mut tasks, mut rest, mut first) = (Vec::new(), plans, 0);
    for group in groups(rest, SAMPLES_PER_TASK) {
        let (plans, behind) = rest.split_at_mut(group.plans);
        tasks.push((first, plans));
        (first, rest) = (first + group.samples, behind);
    }
    work::for_each(scene, tasks, |(mut sample, plans)| {
        for plan in plans {
            plan.fill_in(sigma_t, sample);
            sample += plan.samples();
        }
    });
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

/// Stratified points along each planned table, from its numbers: the sum over them is an unbiased optical depth.
fn table_points(
    scene: &dyn Scene,
    plans: &[TablePlan],
    crossings: &[Crossing],
    numbers: &[f32],
    points: &mut MediumPoints,
) {
    let groups = groups(plans, SAMPLES_PER_TASK);
    let samples = groups.iter().map(|group| group.samples).sum();
    points.position.resize(samples);
    points.direction.resize(samples);
    points.medium.resize(samples, VACUUM);
    let (mut tasks, mut rest, mut numbers) = (Vec::new(), plans, numbers);
    let (mut position, mut direction) = (points.position.rows(), points.direction.rows());
    let mut medium = &mut points.medium[..];
    for Group { plans, samples, numbers: own } in groups {
        let (plans, behind) = rest.split_at(plans);
        let (own, numbers_behind) = numbers.split_at(own);
        let (own_medium, medium_behind) = medium.split_at_mut(samples);
        let out = (position.split_off(samples), direction.split_off(samples), own_medium);
        tasks.push((plans, own, out));
        (rest, numbers, medium) = (behind, numbers_behind, medium_behind);
    }
    work::for_each(scene, tasks, |(plans, numbers, (mut position, mut direction, medium))| {
        let (mut numbers, mut index) = (numbers.iter(), 0);
        for plan in plans {
            let Crossing { segment, medium: crossed } = crossings[plan.crossing];
            let spacing = plan.spacing / SAMPLES_PER_STEP as f32;
            for sample in 0..plan.samples() {
                // What does not change along the segment is the same everywhere on it.
                let number = if plan.varies { numbers.next() } else { None };
                let t = plan.start + (sample as f32 + number.unwrap_or(&0.5)) * spacing;
                position.set(index, segment.at(t));
                direction.set(index, segment.direction);
                medium[index] = crossed;
                index += 1;
            }
        }
    });
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
    /// The plans that divide steps, until they have a place of their own.
    divided: Vec<(usize, TablePlan)>,
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
            divided: Vec::new(),
        })
    }

    /// Takes the depths of all steps from the extinction at the plan's samples, which begin at `first`, and divides them where
    /// they are steep.
    fn fill_in(&mut self, sigma_t: &Planes, first: usize) {
        let scale = self.spacing / SAMPLES_PER_STEP as f32;
        let depth_of = |step: usize| {
            let start = first + step * SAMPLES_PER_STEP;
            (start..start + SAMPLES_PER_STEP)
                .fold(Rgb::ZERO, |sum, point| sum + sigma_t.rgb(point).not_negative() * scale)
        };
        self.depths = (0..self.steps).map(depth_of).collect();
        self.divided = self.divide();
    }

    /// Points at which extinction is asked for.
    fn samples(&self) -> usize {
        self.steps * SAMPLES_PER_STEP
    }

    /// Random numbers that they take.
    fn numbers(&self) -> usize {
        if self.varies {
            self.samples()
        } else {
            0
        }
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
            divided: Vec::new(),
        }
    }
}
