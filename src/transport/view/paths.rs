//! All ray paths of a jitter.

use super::records::{BeamRecord, Lobe, PackedLobe, PointRecord, StoredPoint, ViewBeam};
use crate::effect::Effect;
use crate::math::{Rgb, Segment};
use crate::medium::{transmittance, TransmittanceTables, NO_TABLE};
use crate::plan::Plan;
use crate::scene::*;
use crate::transport::cone::DirectionCone;
use crate::transport::counters::Counters;
use crate::transport::deposits::PixelSums;
use crate::transport::photon::{Family, PerFamily};
use crate::tree::heap_bytes;
use glam::Vec3;

/// All ray paths of one jitter: one per pixel.
#[derive(Debug, Default)]
pub struct ViewPaths {
    pub beams: Vec<BeamRecord>,
    pub points: Vec<PointRecord>,
    pub tables: TransmittanceTables,
    /// Of each beam, and where each point is; empty once trees hold them.
    pub beam_segments: Vec<Segment>,
    pub point_positions: Vec<Vec3>,
    /// Distance travelled from the eye to the middle of each beam and to each point \[length\], and the medium on the
    /// viewer's side of each point; empty in passes.
    pub beam_distances: Vec<f32>,
    pub point_distances: Vec<f32>,
    pub point_media: Vec<u32>,
    /// Film position (x, y), directly seen radiance and alpha of each path.
    pub film: Vec<[f32; 2]>,
    pub emission: Vec<Rgb>,
    pub alpha: Vec<f32>,
    /// What connections found for each path; empty where none are made.
    pub connected: Vec<Rgb>,
    /// The same for each place, where layers are kept apart.
    pub connected_by_place: Vec<Rgb>,
    /// Whether what surfaces and media receive is kept apart.
    pub(super) layered: bool,
    /// Directions of the beams.
    pub beam_cone: DirectionCone,
    /// What was done for them.
    pub counters: Counters,
    pub(super) stored: Vec<StoredPoint>,
    /// Of each stored point.
    pub(super) stored_depths: Vec<u32>,
}

impl AsRef<ViewPaths> for ViewPaths {
    fn as_ref(&self) -> &ViewPaths {
        self
    }
}

impl ViewPaths {
    /// Keeps what view beams receive apart from what visible points do, in places behind those of all pixels.
    pub fn keep_layers_apart(&mut self) {
        let pixels = self.film.len() as u32;
        self.layered = true;
        self.beams.iter_mut().for_each(|beam| beam.pixel += pixels);
    }

    /// Sums that receivers add to: one per pixel, or two where layers are kept apart.
    pub fn places(&self) -> usize {
        self.film.len() * if self.layered { 2 } else { 1 }
    }

    /// The pixel that a place belongs to.
    pub fn pixel_of(&self, place: u32) -> usize {
        let (place, pixels) = (place as usize, self.film.len());
        if place < pixels {
            place
        } else {
            place - pixels
        }
    }

    /// Sums for all places.
    pub fn new_sums(&self) -> PixelSums {
        if self.layered {
            PixelSums::layered(self.film.len())
        } else {
            PixelSums::new(self.film.len())
        }
    }

    /// What connections found for a path on its surface or in its media, where layers are kept apart.
    pub fn connected_of(&self, family: Family, pixel: usize) -> Rgb {
        let place = match family {
            Family::Surface => pixel,
            Family::Medium => self.film.len() + pixel,
        };
        self.connected_by_place.get(place).copied().unwrap_or(Rgb::ZERO)
    }

    /// Frees what no pass needs: distances and media of points, and room to grow.
    pub fn shrink_for_passes(&mut self) {
        self.beam_distances = Vec::new();
        self.point_distances = Vec::new();
        self.point_media = Vec::new();
        self.beams.shrink_to_fit();
        self.beam_segments.shrink_to_fit();
        self.points.shrink_to_fit();
        self.point_positions.shrink_to_fit();
        self.stored_depths.shrink_to_fit();
    }

    /// Puts these beams first, in this order.
    pub fn move_beams_first(&mut self, order: &[u32]) {
        self.beams = in_order(&self.beams, order);
        self.beam_segments = in_order(&self.beam_segments, order);
    }

    /// Puts beams into this order of their indices, those that it leaves out last; their segments are with who ordered them.
    pub fn sort_beams(&mut self, order: &[u32]) {
        self.beams = in_order(&self.beams, order);
        self.beam_segments = Vec::new();
    }

    /// Beams by their indices, as long as their segments are here.
    pub fn view_beam(&self, index: usize) -> ViewBeam<'_> {
        ViewBeam { record: &self.beams[index], segment: &self.beam_segments[index] }
    }

    /// Scattering events between the film and a visible point.
    #[inline]
    pub fn depth(&self, point: &PointRecord) -> u32 {
        match point.lobe() {
            Lobe::Lambertian => point.lobe.0 & !PackedLobe::LAMBERTIAN,
            Lobe::Stored(index) => self.stored_depths[index as usize],
        }
    }

    /// Bytes of the beams and of what belongs to them.
    pub fn beam_bytes(&self) -> usize {
        heap_bytes(&self.beams)
            + heap_bytes(&self.beam_segments)
            + heap_bytes(&self.beam_distances)
            + self.tables.memory_bytes()
    }

    /// Bytes of the points and of what belongs to them.
    pub fn point_bytes(&self) -> usize {
        heap_bytes(&self.points)
            + heap_bytes(&self.point_positions)
            + heap_bytes(&self.point_distances)
            + heap_bytes(&self.point_media)
            + heap_bytes(&self.stored)
            + heap_bytes(&self.stored_depths)
    }

    pub(super) fn append(&mut self, mut other: ViewPaths) {
        let tables = self.tables.append(other.tables);
        for beam in &mut other.beams {
            if beam.table != NO_TABLE {
                beam.table += tables;
            }
        }
        for point in &mut other.points {
            if let Lobe::Stored(index) = point.lobe() {
                point.lobe = PackedLobe(index + self.stored.len() as u32);
            }
        }
        self.beams.append(&mut other.beams);
        self.beam_segments.append(&mut other.beam_segments);
        self.points.append(&mut other.points);
        self.point_positions.append(&mut other.point_positions);
        self.beam_distances.append(&mut other.beam_distances);
        self.point_distances.append(&mut other.point_distances);
        self.point_media.append(&mut other.point_media);
        self.film.append(&mut other.film);
        self.emission.append(&mut other.emission);
        self.alpha.append(&mut other.alpha);
        self.stored.append(&mut other.stored);
        self.stored_depths.append(&mut other.stored_depths);
        self.counters.add(&other.counters);
    }

    /// The families whose photons can be seen, and those whose photons look for receivers anyhow.
    pub fn wanted(&self, plan: &Plan) -> PerFamily<bool> {
        let wanted = |effect, receivers: usize| {
            plan.simulates(effect) && (receivers > 0 || plan.is_forced(effect))
        };
        PerFamily {
            surface: wanted(Effect::SurfaceGathering, self.points.len()),
            medium: wanted(Effect::ViewBeams, self.beams.len()),
        }
    }

    pub(super) fn store_points(
        &mut self,
        scene: &dyn Scene,
        glossy_chains: bool,
    ) -> SceneResult<()> {
        if self.stored.is_empty() {
            return Ok(());
        }
        let points = std::mem::take(&mut self.stored);
        scene.store_points(&PointSegments {
            glossy_chains,
            origin: Planes::push_all(points.iter().map(|p| p.origin)),
            direction: Planes::push_all(points.iter().map(|p| p.direction)),
            skips_emitters: points.iter().map(|p| p.skips_emitters.into()).collect(),
        })
    }

    /// Transmittance from the start of a beam to distance `t` along it.
    pub fn beam_transmittance(&self, beam: &BeamRecord, media: &[Medium], t: f32) -> Rgb {
        match media[beam.medium as usize].extinction {
            Extinction::Constant(sigma_t) => transmittance(sigma_t, t),
            Extinction::Varying { .. } if beam.table == NO_TABLE => Rgb::ONE,
            Extinction::Varying { .. } => self.tables.transmittance(beam.table, t),
        }
    }
}

/// Values in this order of their indices, those that it leaves out last.
pub fn in_order<T: Copy>(values: &[T], order: &[u32]) -> Vec<T> {
    let named = || order.iter().map(|&index| index as usize);
    if order.len() == values.len() {
        return named().map(|index| values[index]).collect();
    }
    let mut is_named = vec![false; values.len()];
    named().for_each(|index| is_named[index] = true);
    let unnamed = (0..values.len()).filter(|&index| !is_named[index]);
    named().chain(unnamed).map(|index| values[index]).collect()
}
