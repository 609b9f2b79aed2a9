//! How many photons a pass gets where none are given: as many as are worth the ray paths that are traced for it.
//!
//! A pass costs what its ray paths cost, however many photons there are, and noise comes from both. Half of the time for either
//! is at most a factor of the square root of 2 from the best, whatever the noise; photons get a little more, since ray paths
//! serve no other purpose where they see neither edges nor lamps. Costs are counted, not timed: the same scene gets the same
//! photons on every machine.

use super::Counters;

/// What tracing a pixel's ray path costs with its share of trees and film, and connections from it, in segments of photons'
/// walks; measured on two cores, see docs/PERFORMANCE.md.
const SEGMENTS_PER_RAY_PATH: f64 = 12.0;
const SEGMENTS_PER_CONNECTION: f64 = 4.0;
/// The same for a deposit.
const SEGMENTS_PER_DEPOSIT: f64 = 1.0 / 3.0;
/// What photons may cost over what ray paths do.
const RATIO: f64 = 1.5;
/// Photons per pixel that a pilot takes, and bounds of what it may lead to.
const PILOT: f64 = 0.125;
const PER_PIXEL: [f64; 2] = [0.25, 32.0];
const FEWEST: u64 = 1 << 12;

/// Photons of a pilot pass, which is thrown away.
pub fn pilot(pixels: u64) -> u64 {
    ((PILOT * pixels as f64) as u64).max(FEWEST)
}

/// Photons per pass, by what those of the pilot cost; a pixel's receivers make so many `connections`.
pub fn photons(pixels: u64, connections: u32, pilot: &Counters) -> u64 {
    let deposits = (pilot.surface_deposits + pilot.medium_deposits) as f64;
    let spent = pilot.segments as f64 + SEGMENTS_PER_DEPOSIT * deposits;
    let per_photon = spent / pilot.walks.max(1) as f64;
    let ray_path = SEGMENTS_PER_RAY_PATH + SEGMENTS_PER_CONNECTION * f64::from(connections);
    let per_pixel = RATIO * ray_path / per_photon.max(1.0);
    let [least, most] = PER_PIXEL;
    ((per_pixel.clamp(least, most) * pixels as f64) as u64).max(FEWEST)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dear_photons_are_fewer() {
        let pilot = |segments, medium_deposits| Counters {
            walks: 1000,
            segments,
            medium_deposits,
            ..Counters::default()
        };
        let cheap = photons(100_000, 0, &pilot(2_000, 0));
        let dear = photons(100_000, 0, &pilot(6_000, 24_000));
        // 1.5 * 12 segments per pixel over 2 and over 6 + 24 / 3 per photon.
        assert_eq!(cheap, 900_000);
        assert_eq!(dear, 128_571);
        assert!(photons(100_000, 1, &pilot(2_000, 0)) > cheap);
        assert_eq!(photons(100, 0, &pilot(2_000, 0)), FEWEST);
    }
}
