//! Turbulence from hashed lattices: the same numbers on every machine, for sums, products and floors alone make them.

/// A number in [-1, 1) for a lattice point.
fn lattice(point: [i32; 3], seed: u32) -> f32 {
    let mut hash = seed.wrapping_mul(0x9e37_79b9);
    for coordinate in point {
        hash = (hash ^ coordinate as u32).wrapping_mul(0x85eb_ca6b);
        hash = (hash ^ (hash >> 15)).wrapping_mul(0xc2b2_ae35);
        hash ^= hash >> 13;
    }
    (hash >> 8) as f32 / (1 << 23) as f32 - 1.0
}

/// Lattice values, interpolated smoothly to second order. [Perlin 2002]
fn value(p: [f32; 3], seed: u32) -> f32 {
    let cell = p.map(|x| x.floor());
    let fade = |t: f32| t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let share = [0, 1, 2].map(|k| fade(p[k] - cell[k]));
    let mut sum = 0.0;
    for corner in 0..8 {
        let step = [corner & 1, (corner >> 1) & 1, (corner >> 2) & 1];
        let weight = |k: usize| if step[k] == 1 { share[k] } else { 1.0 - share[k] };
        let point = [0, 1, 2].map(|k| cell[k] as i32 + step[k]);
        sum += weight(0) * weight(1) * weight(2) * lattice(point, seed);
    }
    sum
}

/// Octaves of noise, each twice as fine and half as strong; within [-2, 2].
pub fn fractal(p: [f32; 3], octaves: u32, seed: u32) -> f32 {
    let octave = |k: u32| {
        let scale = (1u32 << k) as f32;
        value(p.map(|x| x * scale), seed.wrapping_add(k)) / scale
    };
    (0..octaves).map(octave).sum()
}

/// A point carried along by noise, as smoke is by the wind: each coordinate by up to about `reach`.
pub fn carried(p: [f32; 3], reach: f32, seed: u32) -> [f32; 3] {
    [0, 1, 2].map(|k| p[k] + reach * fractal(p, 3, seed.wrapping_add(101 * (k as u32 + 1))))
}

/// 0 below `low`, 1 above `high`, smooth between.
pub fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_smooth_and_has_no_mean() {
        let at = |k: u32| fractal([0.37 * k as f32, 0.71 * k as f32, -0.53 * k as f32], 4, 7);
        let mean = (0..4000).map(at).sum::<f32>() / 4000.0;
        assert!(mean.abs() < 0.05, "{mean}");
        let (a, b) = (fractal([0.999_9, 2.0, 3.0], 1, 7), fractal([1.000_1, 2.0, 3.0], 1, 7));
        assert!((a - b).abs() < 1e-3, "{a} {b}");
        assert_ne!(fractal([0.5; 3], 4, 7), fractal([0.5; 3], 4, 8));
    }
}
