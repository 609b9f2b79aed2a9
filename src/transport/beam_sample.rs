//! Places along view beams, drawn where light that is scattered there is seen.

use super::view::{ViewBeam, ViewPaths};
use crate::math::{Rgb, Segment};
use crate::scene::{Extinction, Medium, Place};
use glam::Vec3;

/// A distance [length] along a beam, and its density [1/length].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeamSample {
    pub t: f32,
    pub density: f32,
}

/// The least angle under which a beam may pass a lamp, as seen from its start: what is nearer is drawn as if it were not.
const LEAST_ANGLE: f64 = 1e-4;

/// Numbers that a sample takes.
pub const NUMBERS: usize = 3;

/// Draws a distance by free flights of light or, with lamps nearby, half of the time evenly over the angles under which one of
/// them sees the beam, and weighs it as if either might have drawn it. None where nothing along the beam takes light away,
/// and so nothing scatters.
// [Connection] [Kulla 2012]
pub fn draw(
    paths: &ViewPaths,
    media: &[Medium],
    lamps: &[Place],
    beam: ViewBeam,
    [choice, channel, number]: [f32; NUMBERS],
) -> Option<BeamSample> {
    let flights = Flights::of(paths, media, beam)?;
    let Some(last) = lamps.len().checked_sub(1) else {
        return flights.at(flights.draw(channel, number));
    };
    // The half that is chosen has the other half of the choice's digits left to choose a lamp by.
    let by_angle = choice < 0.5;
    let lamp = lamps[(((2.0 * choice) % 1.0 * lamps.len() as f32) as usize).min(last)];
    let angles = Angles::of(beam.segment, lamp);
    let t = if by_angle { angles.draw(number) } else { flights.draw(channel, number) };
    let by_flight = flights.at(t)?.density;
    let density = 0.5 * (by_flight + angles.density(t));
    Some(BeamSample { t, density })
}

/// Free flights of light along a beam, of three channels alike.
struct Flights<'a> {
    paths: &'a ViewPaths,
    beam: ViewBeam<'a>,
    extinction: &'a Extinction,
    /// Optical depth of the whole beam.
    whole: Rgb,
}

impl<'a> Flights<'a> {
    fn of(paths: &'a ViewPaths, media: &'a [Medium], beam: ViewBeam<'a>) -> Option<Self> {
        let extinction = &media[beam.record.medium as usize].extinction;
        let length = beam.segment.length;
        let whole = match extinction {
            Extinction::Constant(sigma_t) => *sigma_t * length,
            Extinction::Varying { .. } => paths.tables.depth_at(beam.record.table, length).0,
        };
        attenuated(whole, 0)?;
        Some(Flights { paths, beam, extinction, whole })
    }

    /// A distance by the flights of one channel.
    fn draw(&self, channel: f32, number: f32) -> f32 {
        let channel = attenuated(self.whole, (3.0 * channel) as usize).expect("one is attenuated");
        let depth = depth(Vec3::from(self.whole)[channel], number);
        let t = match self.extinction {
            Extinction::Constant(sigma_t) => depth / Vec3::from(*sigma_t)[channel],
            Extinction::Varying { .. } => {
                self.paths.tables.distance_to(self.beam.record.table, channel, depth)
            }
        };
        t.min(self.beam.segment.length)
    }

    /// A distance with the density of its being drawn.
    fn at(&self, t: f32) -> Option<BeamSample> {
        let (ahead, sigma_t) = match self.extinction {
            Extinction::Constant(sigma_t) => (*sigma_t * t, *sigma_t),
            Extinction::Varying { .. } => self.paths.tables.depth_at(self.beam.record.table, t),
        };
        at(t, ahead, sigma_t, self.whole)
    }
}

/// The angles under which a lamp sees a beam. In double precision: beams may be very long.
struct Angles {
    /// Where along the beam the lamp is nearest, and how near; no nearer than it is large.
    nearest: f64,
    distance: f64,
    first: f64,
    last: f64,
    length: f64,
}

impl Angles {
    fn of(segment: &Segment, lamp: Place) -> Self {
        let to_lamp = (lamp.centre - segment.origin).as_dvec3();
        let nearest = to_lamp.dot(segment.direction.as_dvec3());
        let beside = (to_lamp - nearest * segment.direction.as_dvec3()).length();
        let least =
            f64::from(lamp.radius).max(LEAST_ANGLE * to_lamp.length()).max(f64::MIN_POSITIVE);
        let (distance, length) = (beside.max(least), f64::from(segment.length));
        let angle = |t: f64| ((t - nearest) / distance).atan();
        Angles { nearest, distance, first: angle(0.0), last: angle(length), length }
    }

    fn draw(&self, number: f32) -> f32 {
        let angle = self.first + f64::from(number) * (self.last - self.first);
        (self.nearest + self.distance * angle.tan()).clamp(0.0, self.length) as f32
    }

    // [Kulla 2012 (4)]
    fn density(&self, t: f32) -> f32 {
        let from_nearest = f64::from(t) - self.nearest;
        let angles = (self.last - self.first).max(f64::MIN_POSITIVE);
        let squared = self.distance * self.distance + from_nearest * from_nearest;
        (self.distance / (angles * squared)) as f32
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
