//! Transmittance tables along segments that cross varying media. [Collin 2013 §5.3]

use crate::math::{Aabb, Rgb, Segment};
use crate::medium::{TransmittanceTables, NO_TABLE};
use crate::scene::*;
use rand::Rng;
use rand_pcg::Pcg64Mcg;

/// Transmittance tables: points per step, and steps per beam at most.
const SAMPLES_PER_STEP: usize = 2;
const MAX_STEPS: usize = 512;
/// A segment that meets nothing in an unbounded medium is followed for this many scene diagonals.
const FAR_DIAGONALS: f32 = 1e4;

/// A way through a medium.
#[derive(Debug, Clone, Copy)]
pub struct Crossing {
    pub segment: Segment,
    /// Index of the medium; not [`VACUUM`].
    pub medium: u32,
}

/// Distance that no segment needs to go beyond where a scene has these bounds; infinite where it has none.
pub fn far(bounds: &Aabb) -> f32 {
    if bounds.is_empty() {
        f32::INFINITY
    } else {
        FAR_DIAGONALS * bounds.diagonal().max(f32::MIN_POSITIVE)
    }
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
    let plans: Vec<_> = (0..crossings.len())
        .filter_map(|index| TablePlan::new(index, &crossings[index], media, far))
        .collect();
    if plans.is_empty() {
        return Ok((indices, 0));
    }
    let mut sigma_t = Planes::default();
    let points = table_points(&plans, crossings, rng);
    scene.extinction(&points, &mut sigma_t)?;
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
    Ok((indices, points.medium.len() as u64))
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
            // What does not change along the segment is the same everywhere on it.
            let offset = if plan.varies { rng.random() } else { 0.5 };
            let t = plan.start + (sample as f32 + offset) * spacing;
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
    /// Whether the extinction changes along the crossing.
    varies: bool,
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
        let (spacing, varies) = (extent / steps as f32, feature_size.is_finite());
        Some(TablePlan { crossing: index, start, spacing, steps, varies })
    }
}
