//! Places along view beams, drawn where light that is scattered there is seen.

use super::view::{BeamRecord, ViewPaths};
use crate::math::Rgb;
use crate::scene::{Extinction, Medium};
use glam::Vec3;

/// A distance [length] along a beam, and its density [1/length].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeamSample {
    pub t: f32,
    pub density: f32,
}

/// Draws a distance by the free flights of one channel, chosen by the first number, and weighs it as if any channel might
/// have drawn it. None where nothing along the beam takes light away, and so nothing scatters.
// [Connection]
pub fn draw(
    paths: &ViewPaths,
    media: &[Medium],
    beam: &BeamRecord,
    numbers: [f32; 2],
) -> Option<BeamSample> {
    let length = beam.segment.length;
    let channel = (3.0 * numbers[0]) as usize;
    match media[beam.medium as usize].extinction {
        Extinction::Constant(sigma_t) => {
            let whole = sigma_t * length;
            let channel = attenuated(whole, channel)?;
            let depth = depth(Vec3::from(whole)[channel], numbers[1]);
            let t = (depth / Vec3::from(sigma_t)[channel]).min(length);
            at(t, sigma_t * t, sigma_t, whole)
        }
        Extinction::Varying { .. } => {
            let whole = paths.tables.depth_at(beam.table, length).0;
            let channel = attenuated(whole, channel)?;
            let depth = depth(Vec3::from(whole)[channel], numbers[1]);
            let t = paths.tables.distance_to(beam.table, channel, depth).min(length);
            let (ahead, sigma_t) = paths.tables.depth_at(beam.table, t);
            at(t, ahead, sigma_t, whole)
        }
    }
}

/// The channel, or the next one whose light is taken away anywhere.
fn attenuated(whole: Rgb, channel: usize) -> Option<usize> {
    (0..3).map(|step| (channel + step) % 3).find(|&channel| Vec3::from(whole)[channel] > 0.0)
}

/// Optical depth of a free flight that ends before `whole`, by a uniform number.
fn depth(whole: f32, number: f32) -> f32 {
    -(number * (-whole).exp_m1()).ln_1p()
}

/// The mean of the densities of all channels that may be drawn, weighted by how often they are.
fn at(t: f32, ahead: Rgb, sigma_t: Rgb, whole: Rgb) -> Option<BeamSample> {
    let [ahead, sigma_t, whole_of] =
        [ahead, sigma_t, whole].map(|color| Vec3::from(color).to_array());
    let density_of = |chosen: usize| {
        let channel = attenuated(whole, chosen)?;
        Some(sigma_t[channel] * (-ahead[channel]).exp() / -(-whole_of[channel]).exp_m1())
    };
    let density = (0..3).filter_map(density_of).sum::<f32>() / 3.0;
    (density > 0.0).then_some(BeamSample { t, density })
}
