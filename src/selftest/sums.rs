//! Radii and accumulators over a million passes.

use super::case::Case;
use super::trial::Trial;
use super::SelftestError;
use crate::density::radius::{KernelDimensions, Radii, RadiusSequence, Schedule};
use crate::film::{ExactSums, FilmSums};
use crate::scene::Scene;
use crate::transport::deposits::PixelSums;
use statrs::function::gamma::ln_gamma;

pub const CASES: &[Case] = &[
    Case {
        name: "radius_updates",
        claim: "after 1e6 updates the squared radius is R² Γ(n+1+α) / (Γ(1+α) Γ(n+2)), within 1e-6",
        run: radius_updates,
    },
    Case {
        name: "pixel_sums",
        claim: "1e6 passes of deposits from 1e-8 to 1e8 add up to the exact sum (in integers), within 1e-9",
        run: pixel_sums,
    },
    Case {
        name: "film_sums",
        claim: "1e6 jitters of the same picture leave its mean where it was, within 1e-9",
        run: film_sums,
    },
];

const PASSES: u32 = 1_000_000;

/// [Collin 2013 (8)]: the product of `(k + alpha) / (k + 1)` over `k = 1 .. n`. `ln Γ` at 1e6 is about 1e7 and
/// off by some 1e-9.
fn radius_updates(trial: &mut Trial) -> Result<(), SelftestError> {
    let (alpha, n) = (f64::from(0.7f32), f64::from(PASSES));
    let shrink = (ln_gamma(n + 1.0 + alpha) - ln_gamma(1.0 + alpha) - ln_gamma(n + 2.0)).exp();
    let initial = Radii { surface: 0.5, medium: 0.25 };
    for (name, schedule, kernels, roots) in [
        ("points", Schedule::Matched, KernelDimensions::POINTS, [2.0, 2.0]),
        ("beams", Schedule::Matched, KernelDimensions::BEAMS, [2.0, 1.0]),
        ("paper", Schedule::Paper, KernelDimensions::POINTS, [2.0, 3.0]),
    ] {
        let mut radii = RadiusSequence::new(initial, 0.7, schedule, kernels);
        (0..PASSES).for_each(|_| radii.advance());
        let last = radii.current();
        let expected = roots.map(|root: f64| shrink.powf(1.0 / root));
        trial.number(&format!("{name} surface"), last.surface.into(), 0.5 * expected[0], 1e-6);
        trial.number(&format!("{name} medium"), last.medium.into(), 0.25 * expected[1], 1e-6);
    }
    Ok(())
}

/// Deposits are whole multiples of 2^-30, so that integers hold their sum exactly.
fn pixel_sums(trial: &mut Trial) -> Result<(), SelftestError> {
    let unit = 2f64.powi(-30);
    let deposits = [12i64, 123_456_789, 1 << 44, 100_000_000 << 30];
    for deposit in deposits {
        let mut sums = PixelSums::new(2);
        sums.add_to(1, [100_000_000.0; 4], 1.0, 1);
        let mut part = PixelSums::new(2);
        for pass in 1..=PASSES {
            part.add_to(1, [deposit as f64 * unit; 4], 1.0, 1);
            if pass % 1000 == 0 {
                sums.drain(&mut part, 1.0);
            }
        }
        let exact = (100_000_000i128 << 30) + i128::from(deposit) * i128::from(PASSES);
        let what = format!("deposits of {:.1e}", deposit as f64 * unit);
        trial.number(&what, sums.radiance(1)[2], exact as f64 * unit, 1e-9);
    }
    Ok(())
}

/// The film of a jitter is added with its passes as weight; values that binary fractions do not hold.
fn film_sums(trial: &mut Trial) -> Result<(), SelftestError> {
    let world = super::worlds::HalfSpace::new(crate::math::Rgb::ONE, 0.5, 1.0).contents();
    let world = crate::analytic::World::new(world);
    let description = world.description();
    let mut jitter = FilmSums::new(description);
    let mut film = ExactSums::new(jitter.values.len());
    let channels = description.film_channels as usize;
    for pixel in jitter.values.chunks_exact_mut(channels) {
        pixel.fill(0.1);
        pixel[0] = 1e-8 / 3.0;
    }
    (0..PASSES).for_each(|_| film.add(&world, &jitter));
    let film = film.rounded();
    let pixel = &film.values[..channels];
    let weight = pixel[channels - 1];
    trial.number("dark pixel", pixel[0] / weight, 1e-7 / 3.0, 1e-9);
    trial.number("weights", weight, 0.1 * f64::from(PASSES), 1e-9);
    Ok(())
}
