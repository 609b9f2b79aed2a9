//! Transmittance tables along the view segments that cross varying media. [Collin 2013 §5.3]

use crate::math::{Aabb, Rgb};
use crate::medium::{TransmittanceTables, NO_TABLE};
use crate::scene::*;
use rand::Rng;
use rand_pcg::Pcg64Mcg;

/// Transmittance tables: points per step, and steps per beam at most.
const SAMPLES_PER_STEP: usize = 2;
const MAX_STEPS: usize = 512;

/// Adds a table to `tables` for each segment that crosses a varying medium; returns its index by lane,
/// [`NO_TABLE`] elsewhere.
pub fn tabulate(
    scene: &dyn Scene,
    v: &ViewVertices,
    alive: impl Fn(usize) -> bool,
    rng: &mut Pcg64Mcg,
    tables: &mut TransmittanceTables,
) -> SceneResult<Vec<u32>> {
    let mut indices = vec![NO_TABLE; v.flags.len()];
    let media = &scene.description().media;
    let mut plans = Vec::new();
    for lane in 0..v.flags.len() {
        if !alive(lane) || v.medium[lane] == VACUUM {
            continue;
        }
        let medium = &media[v.medium[lane] as usize];
        if let Extinction::Varying { feature_size } = medium.extinction {
            plans.extend(TablePlan::new(lane, feature_size, &medium.bounds, v));
        }
    }
    if plans.is_empty() {
        return Ok(indices);
    }
    let mut sigma_t = Planes::default();
    scene.extinction(&table_points(&plans, v, rng), &mut sigma_t)?;
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
        indices[plan.lane] = tables.push(plan.start, plan.spacing, &depths);
    }
    Ok(indices)
}

/// Stratified points along each planned table: the sum over them is an unbiased optical depth.
fn table_points(plans: &[TablePlan], v: &ViewVertices, rng: &mut Pcg64Mcg) -> MediumPoints {
    let total: usize = plans.iter().map(|plan| plan.steps * SAMPLES_PER_STEP).sum();
    let mut points = MediumPoints::default();
    points.position.resize(total);
    points.direction.resize(total);
    for plan in plans {
        let (origin, direction) = (v.origin.get(plan.lane), v.direction.get(plan.lane));
        let spacing = plan.spacing / SAMPLES_PER_STEP as f32;
        for sample in 0..plan.steps * SAMPLES_PER_STEP {
            let t = plan.start + (sample as f32 + rng.random::<f32>()) * spacing;
            let index = points.medium.len();
            points.position.set(index, origin + direction * t);
            points.direction.set(index, direction);
            points.medium.push(v.medium[plan.lane]);
        }
    }
    points
}

/// Where along a lane's segment the extinction is to be tabulated.
struct TablePlan {
    lane: usize,
    start: f32,
    spacing: f32,
    steps: usize,
}

impl TablePlan {
    /// None where the segment misses the medium's bounds.
    fn new(lane: usize, feature_size: f32, bounds: &Aabb, v: &ViewVertices) -> Option<Self> {
        let (start, end) = bounds.clip(v.origin.get(lane), v.direction.get(lane))?;
        let end = end.min(v.length[lane]);
        let extent = end - start;
        if !(extent > 0.0 && extent.is_finite()) {
            return None;
        }
        let steps = ((extent / feature_size).ceil() as usize).clamp(1, MAX_STEPS);
        Some(TablePlan { lane, start, spacing: extent / steps as f32, steps })
    }
}
