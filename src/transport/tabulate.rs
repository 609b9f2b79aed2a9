//! Transmittance tables along segments that cross varying media. [Collin 2013 §5.3]

use crate::math::{Rgb, Segment};
use crate::medium::{TransmittanceTables, NO_TABLE};
use crate::scene::*;
use rand::Rng;
use rand_pcg::Pcg64Mcg;

/// Transmittance tables: points per step, and steps per beam at most.
const SAMPLES_PER_STEP: usize = 2;
const MAX_STEPS: usize = 512;

/// A way through a medium.
#[derive(Debug, Clone, Copy)]
pub struct Crossing {
    pub segment: Segment,
    /// Index of the medium; not [`VACUUM`].
    pub medium: u32,
}

/// Adds a table to `tables` for each crossing of a varying medium; returns its index by crossing,
/// [`NO_TABLE`] where there is none.
pub fn tabulate(
    scene: &dyn Scene,
    crossings: &[Crossing],
    rng: &mut Pcg64Mcg,
    tables: &mut TransmittanceTables,
) -> SceneResult<Vec<u32>> {
    let mut indices = vec![NO_TABLE; crossings.len()];
    let media = &scene.description().media;
    let plans: Vec<_> = (0..crossings.len())
        .filter_map(|index| TablePlan::new(index, &crossings[index], media))
        .collect();
    if plans.is_empty() {
        return Ok(indices);
    }
    let mut sigma_t = Planes::default();
    scene.extinction(&table_points(&plans, crossings, rng), &mut sigma_t)?;
    let mut first = 0;
    for plan in &plans {
        let scale = plan.spacing / SAMPLES_PER_STEP as f32;
        let depths: Vec<Rgb> = (0..plan.steps)
            .map(|step| {
                let start = first + step * SAMPLES_PER_STEP;
                (start..start + SAMPLES_PER_STEP)
                    .fold(Rgb::ZERO, |sum, point| sum + sigma_t.rgb(point) * scale)
            })
            .collect();
        first += plan.steps * SAMPLES_PER_STEP;
        indices[plan.crossing] = tables.push(plan.start, plan.spacing, &depths);
    }
    Ok(indices)
}

/// Stratified points along each planned table: the sum over them is an unbiased optical depth.
fn table_points(plans: &[TablePlan], crossings: &[Crossing], rng: &mut Pcg64Mcg) -> MediumPoints {
    let total: usize = plans.iter().map(|plan| plan.steps * SAMPLES_PER_STEP).sum();
    let mut points = MediumPoints::default();
    points.position.resize(total);
    points.direction.resize(total);
    for plan in plans {
        let Crossing { segment, medium } = crossings[plan.crossing];
        let spacing = plan.spacing / SAMPLES_PER_STEP as f32;
        for sample in 0..plan.steps * SAMPLES_PER_STEP {
            let t = plan.start + (sample as f32 + rng.random::<f32>()) * spacing;
            let index = points.medium.len();
            points.position.set(index, segment.at(t));
            points.direction.set(index, segment.direction);
            points.medium.push(medium);
        }
    }
    points
}

/// Where along a crossing the extinction is to be tabulated.
struct TablePlan {
    crossing: usize,
    start: f32,
    spacing: f32,
    steps: usize,
}

impl TablePlan {
    /// None where the extinction is constant or the segment misses the medium's bounds.
    fn new(index: usize, crossing: &Crossing, media: &[Medium]) -> Option<Self> {
        let medium = &media[crossing.medium as usize];
        let Extinction::Varying { feature_size } = medium.extinction else { return None };
        let Segment { origin, direction, length } = crossing.segment;
        let (start, end) = medium.bounds.clip(origin, direction)?;
        let extent = end.min(length) - start;
        if !(extent > 0.0 && extent.is_finite()) {
            return None;
        }
        let steps = ((extent / feature_size).ceil() as usize).clamp(1, MAX_STEPS);
        Some(TablePlan { crossing: index, start, spacing: extent / steps as f32, steps })
    }
}
