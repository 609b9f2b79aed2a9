//! How wide a pixel is at a distance: the scale from which radii are chosen where none is given.

use crate::density::radius::Radii;
use crate::math::Segment;
use crate::scene::*;
use crate::transport::view::ViewPaths;

/// Pairs of neighbouring pixels that are probed.
const PROBES: usize = 256;
/// First radii in pixel footprints: a disk of some 8 pixels on surfaces, a cylinder of some 16 in
/// media, where photons are sparser.
const SURFACE_PIXELS: f32 = 1.6;
const MEDIUM_PIXELS: f32 = 2.25;
/// Radius in roundings of a coordinate at which a disk holds as many lattice points as its area says, within 2 %.
const RESOLVED_ROUNDINGS: f32 = 8.0;
/// What a radius falls back on where the camera sees no receiver: this share of the scene's diagonal.
const FALLBACK_SHARE: f32 = 1e-3;

/// Median spacing of neighbouring pixels' rays as a linear function of distance.
#[derive(Debug, Clone, Copy)]
struct Footprint {
    at_eye: f32,
    per_distance: f32,
}

impl Footprint {
    fn at(&self, distance: f32) -> f32 {
        self.at_eye + self.per_distance * distance
    }
}

/// The first pass's radii from the median footprint of what is seen.
pub fn automatic_radii(scene: &dyn Scene, paths: &ViewPaths) -> SceneResult<Radii> {
    let footprint = probe(scene)?;
    let fallback = FALLBACK_SHARE * scene.description().bounds.diagonal();
    let radius = |distances: &[f32], pixels: f32| match median(distances) {
        Some(distance) if distance.is_finite() => pixels * footprint.at(distance),
        _ => fallback,
    };
    Ok(Radii {
        surface: radius(&paths.point_distances, SURFACE_PIXELS),
        medium: radius(&paths.beam_distances, MEDIUM_PIXELS),
    })
}

/// The smallest radii within which half of the receivers tell places apart. Coordinates are multiples of a
/// rounding, on which photons and receivers coincide: a narrower kernel counts lattice points instead of an
/// area, and the picture becomes brighter without bound as it shrinks.
pub fn resolvable_radii(paths: &ViewPaths) -> Radii {
    let rounding = |place: glam::Vec3| f32::EPSILON * place.abs().max_element();
    let of_beam = |beam: &Segment| rounding(beam.origin).min(rounding(beam.at(beam.length)));
    let of_points: Vec<f32> = paths.point_positions.iter().map(|&place| rounding(place)).collect();
    let of_beams: Vec<f32> = paths.beam_segments.iter().map(of_beam).collect();
    let radius = |roundings: &[f32]| RESOLVED_ROUNDINGS * median(roundings).unwrap_or(0.0);
    Radii { surface: radius(&of_points), medium: radius(&of_beams) }
}

/// Traces rays through pairs of neighbouring pixels, the lens sampled at its centre.
fn probe(scene: &dyn Scene) -> SceneResult<Footprint> {
    let description = scene.description();
    let [width, height] = description.film_size.map(|n| n as usize);
    let lanes = 2 * PROBES.min(width * height);
    let mut film = vec![0.0; 2 * lanes];
    for lane in 0..lanes {
        let pixel = (lane / 2) * (width * height) / (lanes / 2);
        let (x, y) = (pixel % width + lane % 2, pixel / width);
        film[lane] = x as f32 + description.film_offset[0] as f32 + 0.5;
        film[lanes + lane] = y as f32 + description.film_offset[1] as f32 + 0.5;
    }
    let numbers = vec![0.5; VIEW_RAY_DIMENSIONS * lanes];
    let limits = PathLimits { max_depth: 1, rr_depth: 1, hide_emitters: false };
    let request = ViewRayRequest { lanes, film: &film, numbers: &numbers, rules: limits.into() };
    let mut walk = scene.view_rays(&request, &mut Planes::default())?;
    let mut v = ViewVertices::default();
    walk.step(1, &vec![0.5; VIEW_STEP_DIMENSIONS * lanes], &mut v)?;
    let spacing = |planes: &Planes| -> Vec<f32> {
        (0..lanes / 2).map(|i| (planes.get(2 * i + 1) - planes.get(2 * i)).length()).collect()
    };
    Ok(Footprint {
        at_eye: median(&spacing(&v.origin)).unwrap_or(0.0),
        per_distance: median(&spacing(&v.direction)).unwrap_or(0.0),
    })
}

fn median(values: &[f32]) -> Option<f32> {
    let mut sorted: Vec<f32> = values.iter().copied().filter(|v| v.is_finite()).collect();
    if sorted.is_empty() {
        return None;
    }
    let middle = sorted.len() / 2;
    Some(*sorted.select_nth_unstable_by(middle, f32::total_cmp).1)
}
