//! How a batch of ray paths is traced.

use super::records::{BeamRecord, PackedLobe, PointRecord, StoredPoint};
use super::ViewPaths;
use crate::effect::Effect;
use crate::math::uniform::{self, Purpose};
use crate::math::{Rgb, Segment};
use crate::medium::NO_TABLE;
use crate::plan::Plan;
use crate::scene::*;
use crate::transport::extent::{visible_length, OPAQUE_DEPTH};
use crate::transport::numbers::draw;
use crate::transport::tabulate::{tabulate, Crossing};
use glam::Vec3;
use rand::Rng;
use rand_pcg::Pcg64Mcg;
use std::ops::Range;

/// Segments after which a ray path that never ends is given up (and counted).
const MAX_SEGMENTS: usize = 4096;

/// One path of a batch in flight.
#[derive(Clone, Copy)]
struct Path {
    throughput: Rgb,
    depth: u32,
    /// Share of the pixel that nothing has covered yet.
    clear: f32,
    distance: f32,
    /// Normal on the viewer's side of the surface that scattered the path into its newest segment, or 0.
    scattered_at: Vec3,
    refracted: bool,
    alive: bool,
}

/// Traces a batch of rays through given pixels.
pub(super) struct Tracer<'a> {
    scene: &'a dyn Scene,
    plan: &'a Plan,
    pixels: Vec<u32>,
    /// Where on the film each goes; somewhere in its pixel if that is not given.
    pub places: Option<Vec<[f32; 2]>>,
    /// Streams for rays, for places on the aperture, and for tables: what is not simulated draws nothing, and
    /// leaves the others as they are.
    rng: Pcg64Mcg,
    aperture: Pcg64Mcg,
    table_rng: Pcg64Mcg,
    paths: Vec<Path>,
    out: ViewPaths,
}

impl<'a> Tracer<'a> {
    pub fn new(
        scene: &'a dyn Scene,
        plan: &'a Plan,
        pixels: Vec<u32>,
        stream: impl Fn(Purpose) -> Pcg64Mcg,
    ) -> Self {
        let lanes = pixels.len();
        let path = Path {
            throughput: Rgb::ONE,
            depth: 0,
            clear: 1.0,
            distance: 0.0,
            scattered_at: Vec3::ZERO,
            refracted: false,
            alive: true,
        };
        let out = ViewPaths {
            emission: vec![Rgb::ZERO; lanes],
            alpha: vec![0.0; lanes],
            ..ViewPaths::default()
        };
        Tracer {
            scene,
            plan,
            pixels,
            places: None,
            rng: stream(Purpose::ViewRays),
            aperture: stream(Purpose::Aperture),
            table_rng: stream(Purpose::ViewTables),
            paths: vec![path; lanes],
            out,
        }
    }

    pub fn trace(mut self) -> SceneResult<ViewPaths> {
        let lanes = self.paths.len();
        let film = self.film_positions();
        let mut numbers = self.ray_numbers();
        let rules = self.plan.rules;
        let request = ViewRayRequest { lanes, film: &film, numbers: &numbers, rules };
        let mut importance = Planes::default();
        let mut walk = self.scene.view_rays(&request, &mut importance)?;
        for (lane, path) in self.paths.iter_mut().enumerate() {
            path.throughput = importance.rgb(lane);
        }
        if walk.lanes() == 0 {
            self.paths.iter_mut().for_each(|path| path.alive = false);
        }
        let (batching, mut vertices, mut done) =
            (self.scene.batching(), ViewVertices::default(), 0);
        while self.alive() > 0 && walk.lanes() > 0 && done < MAX_SEGMENTS {
            let lanes = walk.lanes();
            let steps = batching.steps(lanes);
            let count = steps * VIEW_STEP_DIMENSIONS * lanes;
            draw(&mut self.rng, self.scene, &mut numbers, count);
            walk.step(steps, &numbers, &mut vertices)?;
            for step in 0..steps {
                self.add_step(step * lanes..(step + 1) * lanes, done + step == 0, &vertices)?;
            }
            done += steps;
        }
        self.out.counters.dropped_view_rays += self.alive();
        Ok(self.out)
    }

    fn alive(&self) -> u64 {
        self.paths.iter().filter(|path| path.alive).count() as u64
    }

    /// [`VIEW_RAY_DIMENSIONS`] planes; the two of the aperture hold its middle where there is none.
    fn ray_numbers(&mut self) -> Vec<f32> {
        let (lanes, mut numbers, mut aperture) = (self.paths.len(), Vec::new(), Vec::new());
        draw(&mut self.rng, self.scene, &mut numbers, VIEW_RAY_DIMENSIONS * lanes);
        if self.plan.simulates(Effect::DepthOfField) {
            uniform::fill(&mut self.aperture, &mut aperture, 2 * lanes);
            self.out.counters.aperture_samples += lanes as u64;
        } else {
            aperture.resize(2 * lanes, 0.5);
        }
        numbers[..2 * lanes].copy_from_slice(&aperture);
        numbers
    }

    /// Adds what the segments in these slots, one step of rays, show.
    fn add_step(
        &mut self,
        slots: Range<usize>,
        is_first: bool,
        v: &ViewVertices,
    ) -> SceneResult<()> {
        let is_there = |slot: &usize| {
            v.flags[*slot] & view_flags::ABSENT == 0 && self.paths[v.ray[*slot] as usize].alive
        };
        let slots: Vec<usize> = slots.filter(is_there).collect();
        self.count_segments(slots.len() as u64, is_first);
        let tables = self.tabulate(&slots, v)?;
        for (index, slot) in slots.into_iter().enumerate() {
            self.extend(slot, tables.get(index).copied().unwrap_or(NO_TABLE), v);
        }
        Ok(())
    }

    /// Counts what is asked for at the ends of segments.
    fn count_segments(&mut self, segments: u64, are_first: bool) {
        if !are_first {
            self.out.counters.chain_segments += segments;
        }
        if self.plan.simulates(Effect::DirectEmission) {
            self.out.counters.emission_queries += segments;
        }
    }

    /// Tables along the segments in these slots; none at all where no medium calls for them.
    fn tabulate(&mut self, slots: &[usize], v: &ViewVertices) -> SceneResult<Vec<u32>> {
        if !self.plan.simulates(Effect::TransmittanceTables) {
            return Ok(Vec::new());
        }
        let crosses = |index: &usize| v.medium[slots[*index]] != VACUUM;
        let crossing_slots: Vec<usize> = (0..slots.len()).filter(crosses).collect();
        let crossing = |&index: &usize| Crossing {
            segment: Segment {
                origin: v.origin.get(slots[index]),
                direction: v.direction.get(slots[index]),
                length: v.length[slots[index]],
            },
            medium: v.medium[slots[index]],
        };
        let crossings: Vec<_> = crossing_slots.iter().map(crossing).collect();
        let (media, rng) = (&self.plan.media, &mut self.table_rng);
        let (tables, samples) = tabulate(self.scene, media, &crossings, rng, &mut self.out.tables)?;
        self.out.counters.view_table_samples += samples;
        let mut by_slot = vec![NO_TABLE; slots.len()];
        for (index, table) in crossing_slots.into_iter().zip(tables) {
            by_slot[index] = table;
        }
        Ok(by_slot)
    }

    fn film_positions(&mut self) -> Vec<f32> {
        let description = self.scene.description();
        let (width, offset) = (description.film_size[0] as usize, description.film_offset);
        let lanes = self.paths.len();
        let mut film = vec![0.0; 2 * lanes];
        for lane in 0..lanes {
            let pixel = self.pixels[lane] as usize;
            let (x, y) = ((pixel % width) as f32, (pixel / width) as f32);
            let somewhere = [
                x + offset[0] as f32 + self.rng.random::<f32>(),
                y + offset[1] as f32 + self.rng.random::<f32>(),
            ];
            let position = self.places.as_ref().map_or(somewhere, |places| places[lane]);
            film[lane] = position[0];
            film[lanes + lane] = position[1];
            self.out.film.push(position);
        }
        film
    }

    /// Adds what the path's newest segment and its end show, and decides whether it goes on.
    fn extend(&mut self, slot: usize, table: u32, v: &ViewVertices) {
        let ray = v.ray[slot] as usize;
        let mut path = self.paths[ray];
        let flags = v.flags[slot];
        let has = |bit| flags & bit != 0;
        path.refracted |= path.scattered_at.dot(v.direction.get(slot)) < 0.0;
        let tr = self.add_beam(slot, &path, table, v);
        if !tr.is_finite() || !v.weight.rgb(slot).is_finite() {
            self.out.counters.dropped_view_rays += 1;
            self.paths[ray].alive = false;
            return;
        }
        path.throughput *= tr;
        path.distance += v.length[slot];
        self.out.alpha[ray] += path.clear * (1.0 - tr.mean());
        path.clear *= tr.mean();

        if has(view_flags::EMISSION) {
            let emission = path.throughput * v.emission.rgb(slot);
            if emission.is_finite() {
                self.out.emission[ray] += emission;
            } else {
                self.out.counters.dropped_view_rays += 1;
            }
        }
        if !has(view_flags::HIT) && self.plan.simulates(Effect::Environment) {
            self.out.counters.sky_queries += 1;
        }
        if has(view_flags::VISIBLE_POINT) {
            self.add_point(slot, &path, v);
        }
        self.cover(slot, &mut path, v);
        path.alive = has(view_flags::CONTINUES);
        path.throughput *= v.weight.rgb(slot);
        if has(view_flags::SCATTERED) {
            path.depth += 1;
        }
        path.scattered_at =
            if has(view_flags::SCATTERED) { v.normal.get(slot) } else { Vec3::ZERO };
        self.roulette(&mut path);
        self.paths[ray] = path;
    }

    /// Records a view beam and returns the transmittance of the whole segment.
    fn add_beam(&mut self, slot: usize, path: &Path, table: u32, v: &ViewVertices) -> Rgb {
        let (medium, length) = (v.medium[slot], v.length[slot]);
        if medium == VACUUM {
            return Rgb::ONE;
        }
        let (media, bounds) = (&self.plan.media, &self.scene.description().bounds);
        let segment_length = match media[medium as usize].extinction {
            Extinction::Constant(sigma_t) if sigma_t.max_component() <= 0.0 => return Rgb::ONE,
            Extinction::Constant(sigma_t) => length.min(visible_length(sigma_t, bounds)),
            Extinction::Varying { .. } if table == NO_TABLE => return Rgb::ONE,
            Extinction::Varying { .. } => {
                length.min(self.out.tables.visible_end(table, OPAQUE_DEPTH))
            }
        };
        let beam = BeamRecord {
            throughput: path.throughput,
            pixel: self.pixels[v.ray[slot] as usize],
            medium,
            table,
            depth: path.depth,
        };
        if self.is_receiver(&beam) {
            self.out.beams.push(beam);
            self.out.beam_segments.push(Segment {
                origin: v.origin.get(slot),
                direction: v.direction.get(slot),
                length: segment_length,
            });
            self.out.beam_distances.push(path.distance + 0.5 * segment_length);
            self.out.counters.refracted_beams += u64::from(path.refracted);
        }
        self.out.beam_transmittance(&beam, &self.plan.media, length)
    }

    /// Whether photons can be seen along a beam, or are looked for anyhow.
    fn is_receiver(&self, beam: &BeamRecord) -> bool {
        let scatters = self.plan.media[beam.medium as usize].scatters();
        self.plan.simulates(Effect::ViewBeams)
            && (scatters || self.plan.is_forced(Effect::ViewBeams))
            && beam.depth.saturating_add(2) <= self.plan.limits().max_depth
    }

    fn add_point(&mut self, slot: usize, path: &Path, v: &ViewVertices) {
        let mut weight = path.throughput;
        let lobe = if v.flags[slot] & view_flags::LAMBERTIAN != 0 {
            let reflectance = v.reflectance.rgb(slot);
            if reflectance.max_component() <= 0.0 {
                return;
            }
            weight *= reflectance * std::f32::consts::FRAC_1_PI;
            PackedLobe::lambertian(path.depth)
        } else {
            self.out.stored_depths.push(path.depth);
            self.out.stored.push(StoredPoint {
                origin: v.origin.get(slot),
                direction: v.direction.get(slot),
                skips_emitters: self.plan.limits().hide_emitters && path.depth == 0,
            });
            PackedLobe(self.out.stored.len() as u32 - 1)
        };
        self.out.point_positions.push(v.position.get(slot));
        self.out.point_distances.push(path.distance);
        self.out.point_media.push(v.medium[slot]);
        self.out.points.push(PointRecord {
            geometric_normal: v.geometric_normal.get(slot).into(),
            normal: v.normal.get(slot).into(),
            weight,
            pixel: self.pixels[v.ray[slot] as usize],
            lobe,
        });
    }

    /// Alpha: a surface covers its pixel but for the weight of its null lobe; a sky covers all of it.
    fn cover(&mut self, slot: usize, path: &mut Path, v: &ViewVertices) {
        let flags = v.flags[slot];
        let passes = flags & view_flags::CONTINUES != 0 && flags & view_flags::SCATTERED == 0;
        let covered = if flags & view_flags::HIT != 0 {
            if passes {
                1.0 - v.weight.rgb(slot).mean().clamp(0.0, 1.0)
            } else {
                1.0
            }
        } else {
            let hides = self.plan.limits().hide_emitters;
            let shows_sky = self.scene.description().has_environment() && !hides;
            f32::from(u8::from(shows_sky))
        };
        self.out.alpha[v.ray[slot] as usize] += path.clear * covered;
        path.clear *= 1.0 - covered;
    }

    /// Ends long chains of delta lobes.
    fn roulette(&mut self, path: &mut Path) {
        let weight = path.throughput.max_component();
        if !path.throughput.is_finite() {
            self.out.counters.dropped_view_rays += 1;
            path.alive = false;
        } else if weight <= 0.0 {
            path.alive = false;
        } else if path.alive && path.depth > self.plan.limits().rr_depth {
            let survival = PathLimits::survival(weight, path.depth);
            path.alive = self.rng.random::<f32>() < survival;
            path.throughput = path.throughput / survival;
        }
    }
}
