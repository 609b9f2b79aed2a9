//! The parameters of the paper's measurements.

use super::scenes::PaperScene;
use crate::cli::compare::PerPass;
use std::time::Duration;
use vpt::method::Method;

/// Share of the photons kept from pass to pass, for all methods. [Collin 2013 §6]
pub const ALPHA: f32 = 0.7;

/// A row of the paper's Table 2. A walk here gives photons to surfaces and media alike, while the paper shoots either
/// kind apart: the table's number of volume photons or photon beams is the number of walks per pass, and the surface
/// photons, which the paper also counts, are those of the same walks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Width and height in pixels.
    pub resolution: [u32; 2],
    pub per_pass: PerPass,
    /// Rendering time of every method.
    pub time: Duration,
}

impl Row {
    /// [Collin 2013 Table 2]; it has rows before columns.
    pub fn paper(scene: PaperScene) -> Self {
        let row = |resolution, photons, beams, hours: u64| {
            let time = Duration::from_secs(3600 * hours);
            Row { resolution, per_pass: PerPass { photons, beams }, time }
        };
        match scene {
            PaperScene::DragonSmokes => row([768, 768], 50_000, 5_000, 1),
            PaperScene::BreakfastHall => row([1920, 1080], 100_000, 10_000, 10),
            PaperScene::Kitchen => row([1280, 720], 100_000, 10_000, 10),
        }
    }

    /// The paper's row at a resolution for two cores and minutes. Photons stay as they are: a pass of them takes a
    /// fraction of a second.
    pub fn small(scene: PaperScene) -> Self {
        let part = match scene {
            PaperScene::DragonSmokes => 4,
            PaperScene::BreakfastHall => 6,
            PaperScene::Kitchen => 4,
        };
        let paper = Row::paper(scene);
        Row { resolution: paper.resolution.map(|side| side / part), ..paper }
    }
}

/// Seconds for a reference, and for each method and seed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Times {
    pub reference: f64,
    pub method: f64,
}

impl Times {
    /// A quarter of the budget for the reference, the rest divided equally.
    pub fn within(budget: Duration, seeds: u32) -> Self {
        let budget = budget.as_secs_f64();
        let runs = Method::ALL.len() as f64 * f64::from(seeds);
        Times { reference: 0.25 * budget, method: 0.75 * budget / runs }
    }

    /// What the paper took for each method, and four times as much for the reference.
    pub fn paper(row: &Row) -> Self {
        let method = row.time.as_secs_f64();
        Times { reference: 4.0 * method, method }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn budget_is_used_up() {
        let times = Times::within(Duration::from_secs(600), 3);
        assert!((times.reference + 18.0 * times.method - 600.0).abs() < 1e-9);
    }

    #[test]
    fn small_pictures_keep_their_shape() {
        for scene in PaperScene::ALL {
            let ([w, h], [x, y]) = (Row::paper(scene).resolution, Row::small(scene).resolution);
            assert_eq!(w * y, h * x);
        }
    }
}
