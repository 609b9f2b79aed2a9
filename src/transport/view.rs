//! Ray paths: what the camera sees through delta lobes and medium boundaries, kept as view beams and
//! visible points until the next jitter. [Collin 2013 §5.1]

use crate::effect::Effect;
use crate::math::uniform::{self, Purpose};
use crate::math::{Octahedral, Rgb, Segment};
use crate::medium::{transmittance, TransmittanceTables, NO_TABLE};
use crate::plan::Plan;
use crate::scene::*;
use crate::transport::cone::DirectionCone;
use crate::transport::counters::Counters;
use crate::transport::deposits::PixelSums;
use crate::transport::extent::{visible_length, OPAQUE_DEPTH};
use crate::transport::numbers::draw;
use crate::transport::photon::{Family, PerFamily};
use crate::transport::tabulate::{tabulate, Crossing};
use crate::tree::heap_bytes;
use glam::Vec3;
use rand::Rng;
use rand_pcg::Pcg64Mcg;
use std::ops::Range;

/// Segments after which a ray path that never ends is given up (and counted).
const MAX_SEGMENTS: usize = 4096;

/// One view beam: a segment of a ray path inside a medium. The segment is in [`ViewPaths::beam_segments`], or in the structure
/// that takes it over.
#[derive(Debug, Clone, Copy)]
pub struct BeamRecord {
    /// Weight from the start of the segment to the film (dimensionless).
    pub throughput: Rgb,
    /// Of [`ViewPaths::places`], the one that belongs to its pixel.
    pub pixel: u32,
    pub medium: u32,
    /// Transmittance table, or [`NO_TABLE`] where the extinction is constant.
    pub table: u32,
    /// Scattering events between the film and the segment.
    pub depth: u32,
}

/// A view beam with its segment.
#[derive(Debug, Clone, Copy)]
pub struct ViewBeam<'a> {
    pub record: &'a BeamRecord,
    pub segment: &'a Segment,
}

/// One visible point: where a ray path meets a smooth lobe. Its place is in [`ViewPaths::point_positions`], or in the tree that
/// takes them over.
#[derive(Debug, Clone, Copy)]
pub struct PointRecord {
    /// As the shape is oriented.
    pub geometric_normal: Octahedral,
    /// Shading normal on the viewer's side.
    pub normal: Octahedral,
    /// Weight from the point to the film, transmittances and a Lambertian lobe included [1, or 1/sr with the lobe].
    pub weight: Rgb,
    pub pixel: u32,
    lobe: PackedLobe,
}

/// How a visible point reflects.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Lobe {
    /// Lambertian; the weight holds it.
    Lambertian,
    /// Ask [`Scene::eval_bsdf`] for the point with this index.
    Stored(u32),
}

/// The number of a stored point or, with the highest bit set, the depth of a Lambertian one.
#[derive(Debug, Clone, Copy)]
struct PackedLobe(u32);

impl PackedLobe {
    const LAMBERTIAN: u32 = 1 << 31;

    fn lambertian(depth: u32) -> Self {
        PackedLobe(Self::LAMBERTIAN | depth)
    }
}

impl PointRecord {
    #[inline]
    pub fn lobe(&self) -> Lobe {
        match self.lobe.0 {
            lambertian if lambertian & PackedLobe::LAMBERTIAN != 0 => Lobe::Lambertian,
            stored => Lobe::Stored(stored),
        }
    }
}

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
    layered: bool,
    /// Directions of the beams.
    pub beam_cone: DirectionCone,
    /// What was done for them.
    pub counters: Counters,
    stored: Vec<StoredPoint>,
    /// Of each stored point.
    stored_depths: Vec<u32>,
}

#[derive(Debug, Clone, Copy)]
struct StoredPoint {
    origin: Vec3,
    direction: Vec3,
    skips_emitters: bool,
}

/// Emission that rays saw directly, where on the film.
#[derive(Debug, Default)]
pub struct EmissionSamples {
    /// The pixel of each ray, its film position (x, y) and what it saw.
    pub pixels: Vec<u32>,
    pub film: Vec<[f32; 2]>,
    pub radiance: Vec<Rgb>,
    pub counters: Counters,
}

/// Traces rays that look for emission alone through these places on the film, such as have lamps behind them if nothing is in
/// the way.
pub fn trace_aimed(
    scene: &dyn Scene,
    plan: &Plan,
    seed: u64,
    places: u32,
) -> SceneResult<EmissionSamples> {
    let (mut numbers, mut found) = (Vec::new(), Vec::new());
    let lanes = places as usize;
    uniform::fill(
        &mut uniform::stream(seed, Purpose::AimedRays, 0, 0),
        &mut numbers,
        AIM_DIMENSIONS * lanes,
    );
    scene.aim(lanes, &numbers, &mut found)?;
    let SceneDescription { film_size, film_offset, .. } = *scene.description();
    let aimed = (0..lanes).filter_map(|lane| {
        let place = [found[lane], found[lanes + lane]];
        let [x, y] = [0, 1].map(|axis: usize| place[axis] - film_offset[axis] as f32);
        let is_on_film = x >= 0.0 && y >= 0.0 && x < film_size[0] as f32 && y < film_size[1] as f32;
        is_on_film.then(|| (y as u32 * film_size[0] + x as u32, place))
    });
    let (pixels, places): (Vec<u32>, Vec<[f32; 2]>) = aimed.unzip();
    let stream = |purpose, batch| uniform::stream(seed, of_emission(purpose), u64::MAX, batch);
    emission_rays(scene, plan, stream, &pixels, Some(&places))
}

/// Traces rays through these pixels that look for emission alone.
pub fn trace_emission(
    scene: &dyn Scene,
    plan: &Plan,
    seed: u64,
    jitter: u64,
    pixels: &[u32],
) -> SceneResult<EmissionSamples> {
    let stream = |purpose, batch| uniform::stream(seed, of_emission(purpose), jitter, batch);
    emission_rays(scene, plan, stream, pixels, None)
}

/// The purpose of a ray path's stream where it looks for emission alone.
fn of_emission(purpose: Purpose) -> Purpose {
    match purpose {
        Purpose::Aperture => Purpose::EmissionAperture,
        Purpose::ViewTables => Purpose::EmissionTables,
        _ => Purpose::EmissionRays,
    }
}

/// At these places, or anywhere in their pixels.
fn emission_rays(
    scene: &dyn Scene,
    plan: &Plan,
    stream: impl Fn(Purpose, u64) -> Pcg64Mcg + Sync,
    pixels: &[u32],
    places: Option<&[[f32; 2]]>,
) -> SceneResult<EmissionSamples> {
    let traced = scene.batching().run_all(pixels.len() as u64, |batch| {
        let lanes = batch.first as usize..batch.first as usize + batch.lanes;
        let of_batch = |purpose| stream(purpose, batch.number);
        let mut tracer = Tracer::new(scene, plan, pixels[lanes.clone()].to_vec(), of_batch);
        tracer.places = places.map(|places| places[lanes].to_vec());
        let ViewPaths { film, emission, counters, .. } = tracer.trace()?;
        Ok((film, emission, counters))
    })?;
    let mut samples = EmissionSamples { pixels: pixels.to_vec(), ..EmissionSamples::default() };
    for (mut film, mut radiance, counters) in traced {
        samples.film.append(&mut film);
        samples.radiance.append(&mut radiance);
        samples.counters.emission_queries += counters.emission_queries;
        samples.counters.view_table_samples += counters.view_table_samples;
        samples.counters.dropped_view_rays += counters.dropped_view_rays;
    }
    Ok(samples)
}

/// Traces one ray path per pixel, jittered within it, and tells the scene which points to keep.
pub fn trace(scene: &dyn Scene, plan: &Plan, seed: u64, jitter: u64) -> SceneResult<ViewPaths> {
    let [width, height] = scene.description().film_size;
    let pixels = u64::from(width) * u64::from(height);
    let traced = scene.batching().run_all(pixels, |batch| {
        let stream = |purpose| uniform::stream(seed, purpose, jitter, batch.number);
        let first = batch.first as u32;
        let pixels = (first..first + batch.lanes as u32).collect();
        Tracer::new(scene, plan, pixels, stream).trace()
    })?;
    let mut paths = ViewPaths::default();
    for batch in traced {
        paths.append(batch);
    }
    paths.beam_cone = DirectionCone::around(paths.beam_segments.iter().map(|beam| beam.direction));
    paths.counters.view_rays = paths.film.len() as u64;
    paths.counters.view_beams = paths.beams.len() as u64;
    paths.counters.visible_points = paths.points.len() as u64;
    paths.store_points(scene, plan.rules.glossy_chains)?;
    Ok(paths)
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

    /// Puts points into this order of their indices, those that it leaves out last; their positions are with who ordered them.
    pub fn sort_points(&mut self, order: &[u32]) {
        self.points = sorted(&self.points, &completed(order, self.points.len()));
        self.point_positions = Vec::new();
    }

    /// Puts these beams first, in this order.
    pub fn move_beams_first(&mut self, order: &[u32]) {
        let order = &completed(order, self.beams.len());
        self.beams = sorted(&self.beams, order);
        self.beam_segments = sorted(&self.beam_segments, order);
    }

    /// Puts beams into this order of their indices, those that it leaves out last; their segments are with who ordered them.
    pub fn sort_beams(&mut self, order: &[u32]) {
        self.beams = sorted(&self.beams, &completed(order, self.beams.len()));
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

    fn append(&mut self, mut other: ViewPaths) {
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

    fn store_points(&mut self, scene: &dyn Scene, glossy_chains: bool) -> SceneResult<()> {
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

/// An order of all indices that begins with a given one.
fn completed(order: &[u32], count: usize) -> Vec<u32> {
    let mut is_named = vec![false; count];
    order.iter().for_each(|&index| is_named[index as usize] = true);
    let unnamed = (0..count as u32).filter(|&index| !is_named[index as usize]);
    order.iter().copied().chain(unnamed).collect()
}

fn sorted<T: Copy>(values: &[T], order: &[u32]) -> Vec<T> {
    order.iter().map(|&index| values[index as usize]).collect()
}

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
struct Tracer<'a> {
    scene: &'a dyn Scene,
    plan: &'a Plan,
    pixels: Vec<u32>,
    /// Where on the film each goes; somewhere in its pixel if that is not given.
    places: Option<Vec<[f32; 2]>>,
    /// Streams for rays, for places on the aperture, and for tables: what is not simulated draws nothing, and
    /// leaves the others as they are.
    rng: Pcg64Mcg,
    aperture: Pcg64Mcg,
    table_rng: Pcg64Mcg,
    paths: Vec<Path>,
    out: ViewPaths,
}

impl<'a> Tracer<'a> {
    fn new(
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

    fn trace(mut self) -> SceneResult<ViewPaths> {
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
