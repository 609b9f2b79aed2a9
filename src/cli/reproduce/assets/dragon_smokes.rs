//! The smoke of `dragon_smokes`.

use super::grid::Grid;
use super::noise::{carried, fractal, smoothstep};
use super::Asset;

const SEED: u32 = 5;

pub fn assets() -> Vec<(&'static str, Asset)> {
    vec![("smoke.vol", Asset::Grid(smoke()))]
}

/// Torn smoke that lies on the ground and rises in places; none at the border of its box.
fn smoke() -> Grid {
    Grid::from_fn([96, 56, 72], |[x, y, z]| {
        let p = [4.0 * x, 2.2 * y, 3.0 * z];
        let q = carried([1.5 * p[0], 1.1 * p[1], 1.5 * p[2]], 0.75, SEED);
        let height = smoothstep(1.0, 0.1, y + 0.35 * fractal([p[0], 0.0, p[2]], 2, SEED + 50));
        let torn = smoothstep(0.0, 0.8, fractal(q, 5, SEED) + 0.55 * height - 0.12);
        let wall = |share: f32| smoothstep(0.0, 0.15, share.min(1.0 - share));
        torn * (0.3 + 0.7 * height) * wall(x) * wall(z) * smoothstep(1.0, 0.8, y)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smoke_has_thick_parts_and_holes_and_ends_at_its_box() {
        let smoke = smoke();
        let share = |test: fn(&f32) -> bool| {
            smoke.values.iter().filter(|v| test(v)).count() as f32 / smoke.values.len() as f32
        };
        assert!(share(|&v| v > 0.5) > 0.02 && share(|&v| v < 0.01) > 0.3);
        let row = smoke.cells[0] as usize;
        assert!(smoke.values.chunks(row).all(|x| x[0] < 0.01 && x[row - 1] < 0.01));
        assert!(smoke.values.iter().all(|v| (0.0..=1.0).contains(v)));
    }
}
