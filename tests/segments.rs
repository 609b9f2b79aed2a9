//! Photons' segments as photon beams, and walks as functions of their numbers, in both hosts.
//!
//! The tests of Mitsuba run in `scalar_rgb` and, where a usable libLLVM is installed, once more in
//! `llvm_ad_rgb`, by a process of its own: Mitsuba starts in one variant.

#[path = "support/llvm.rs"]
mod llvm;

use glam::{DVec3, Vec3};
use statistics::t_test::{effort, Estimate};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::{LazyLock, Mutex, PoisonError};
use vpt::analytic::{
    Camera, Contents, Disclosure, Fog, Lamp, Material, Profile, Projection, Shape, Surface, World,
};
use vpt::host::session::{SceneFile, Session};
use vpt::math::uniform::{self, Purpose};
use vpt::math::{Aabb, Rgb};
use vpt::scene::*;

/// Names the variant of Mitsuba in which the tests run.
const VARIANT: &str = "VPT_SEGMENTS_VARIANT";
const LIMITS: PathLimits = PathLimits { max_depth: 6, rr_depth: 100, hide_emitters: false };
/// Walks per batch.
const WALKS: usize = 4096;
/// Where the seed stands among a batch's numbers.
const SEEDS: std::ops::Range<usize> = EMIT_SEED * WALKS..(EMIT_SEED + 1) * WALKS;

/// Uniform numbers of a batch of walks: of its emission, and of each step.
fn numbers_of(batch: u64) -> (Vec<f32>, impl FnMut(usize) -> Vec<f32>) {
    let mut rng = uniform::stream(1, Purpose::Photons, 0, batch);
    let mut emission = Vec::new();
    uniform::fill(&mut rng, &mut emission, EMIT_DIMENSIONS * WALKS);
    let next = move |lanes| {
        let mut numbers = Vec::new();
        uniform::fill(&mut rng, &mut numbers, PHOTON_STEP_DIMENSIONS * lanes);
        numbers
    };
    (emission, next)
}

/// Shows all segments of a batch of walks, step by step.
fn walk(scene: &dyn Scene, batch: u64, mut look: impl FnMut(&PhotonVertices)) {
    let (emission, mut next) = numbers_of(batch);
    let mut vertices =
        PhotonVertices { segments: Some(PhotonSegments::default()), ..PhotonVertices::default() };
    let mut photons = scene.emit(WALKS, &emission, LIMITS.into()).expect("walks start");
    while photons.lanes() > 0 {
        photons.step(1, &next(photons.lanes()), &mut vertices).expect("walks advance");
        look(&vertices);
    }
}

fn segments(vertices: &PhotonVertices) -> &PhotonSegments {
    vertices.segments.as_ref().expect("segments were asked for")
}

fn array(value: Rgb) -> [f64; 3] {
    [value.r, value.g, value.b].map(f64::from)
}

fn mean(value: [f64; 3]) -> f64 {
    value.iter().sum::<f64>() / 3.0
}

fn product(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| a[i] * b[i])
}

#[track_caller]
fn assert_close(what: &str, value: [f64; 3], expected: [f64; 3], tolerance: f64) {
    for (value, expected) in value.into_iter().zip(expected) {
        let error = (value - expected).abs();
        assert!(error <= tolerance * expected.abs(), "{what}: {value} instead of {expected}");
    }
}

// ---- Segments and vertices ------------------------------------------------------------------------

/// What the end of a walk's last segment says of the next one's start.
#[derive(Clone, Copy)]
struct Sequel {
    position: Vec3,
    flux: [f64; 3],
    density: [f64; 3],
}

/// Checks each segment against the vertex at its end, and against the walk's next segment.
///
/// Free flight over `t` multiplies the flux by `Tr / mean(density Tr)` and a collision by `sigma_s` over
/// the same with `sigma_t`; with densities of 1 in grey media a collision leaves the albedo. Phase
/// functions that are sampled by their value leave the flux as it is.
fn assert_consistent(scene: &dyn Scene) {
    let mut sequels: Vec<Option<Sequel>> = vec![None; WALKS];
    let (mut steps, mut collisions, mut hits) = (0, 0, 0);
    walk(scene, 0, |v| {
        if steps == 0 {
            let densities = &segments(v).density;
            assert!(densities.as_slice().iter().all(|&density| density == 1.0));
        }
        steps += 1;
        let coefficients = coefficients_at_ends(scene, v);
        for lane in 0..v.event.len() {
            assert_ends_meet(v, lane);
            assert_starts_where_it_ended(v, lane, sequels[v.walk[lane] as usize]);
            let expected = flux_at_end(scene, v, lane, coefficients[lane]);
            let flux = array(v.flux.rgb(lane));
            if let Some((expected, _)) = expected {
                assert_close("flux at the end", flux, expected, 1e-3);
            }
            let collided = photon_event::kind(v.event[lane]) == photon_event::MEDIUM;
            sequels[v.walk[lane] as usize] = expected
                .filter(|_| collided)
                .map(|(_, density)| Sequel { position: v.position.get(lane), flux, density });
            collisions += usize::from(collided && expected.is_some());
            hits += usize::from(!collided && v.length[lane].is_finite());
        }
    });
    assert!(collisions > 300 && hits > 300, "{collisions} collisions and {hits} hits");
}

fn assert_ends_meet(v: &PhotonVertices, lane: usize) {
    let s = segments(v);
    let (length, reach) = (v.length[lane], s.reach[lane]);
    assert!(reach >= length, "a segment of length {length} reaches to {reach}");
    if photon_event::kind(v.event[lane]) != photon_event::MEDIUM {
        assert_eq!(reach, length, "nothing but a collision ends a segment before a surface");
    }
    if length.is_finite() {
        let end = s.origin.get(lane) + v.direction.get(lane) * length;
        let error = (end - v.position.get(lane)).length();
        assert!(error < 1e-5 * (10.0 + length), "the ends of a segment are {error} apart");
    }
    let density = array(s.density.rgb(lane));
    assert!((mean(density) - 1.0).abs() < 1e-5, "densities {density:?}");
}

/// `sigma_t` and `sigma_s` at the ends of segments in media.
fn coefficients_at_ends(scene: &dyn Scene, v: &PhotonVertices) -> Vec<Option<[Rgb; 2]>> {
    let lanes: Vec<_> = (0..v.event.len())
        .filter(|&lane| v.medium[lane] != VACUUM && v.length[lane].is_finite())
        .collect();
    let points = MediumPoints {
        medium: lanes.iter().map(|&lane| v.medium[lane]).collect(),
        position: Planes::push_all(lanes.iter().map(|&lane| v.position.get(lane))),
        direction: Planes::push_all(lanes.iter().map(|&lane| v.direction.get(lane))),
    };
    let (mut sigma_t, mut sigma_s) = (Planes::default(), Planes::default());
    scene.extinction(&points, &mut sigma_t).expect("extinction is known");
    scene.scattering(&points, &mut sigma_s).expect("scattering is known");
    let mut out = vec![None; v.event.len()];
    for (point, &lane) in lanes.iter().enumerate() {
        out[lane] = Some([sigma_t.rgb(point), sigma_s.rgb(point)]);
    }
    out
}

/// The flux that a segment should end with and the walk's densities then, where the walk has no null
/// collisions or they leave no trace.
fn flux_at_end(
    scene: &dyn Scene,
    v: &PhotonVertices,
    lane: usize,
    coefficients: Option<[Rgb; 2]>,
) -> Option<([f64; 3], [f64; 3])> {
    let s = segments(v);
    let (flux, density) = (array(s.flux.rgb(lane)), array(s.density.rgb(lane)));
    if v.medium[lane] == VACUUM {
        return Some((flux, density));
    }
    let medium = &scene.description().media[v.medium[lane] as usize];
    let ([sigma_t, sigma_s], collided) =
        (coefficients?, photon_event::kind(v.event[lane]) == photon_event::MEDIUM);
    if let (Extinction::Constant(constant), Some(scattering)) =
        (medium.extinction, medium.scattering)
    {
        assert_eq!((sigma_t, sigma_s), (constant, scattering), "what is told and what is asked");
    }
    let constant = matches!(medium.extinction, Extinction::Constant(_));
    let grey = medium.grey && density == [1.0; 3];
    if !constant && !grey {
        return None;
    }
    let (sigma_t, sigma_s) = (array(sigma_t), array(sigma_s));
    let tr = match constant {
        true => sigma_t.map(|sigma| (-sigma * f64::from(v.length[lane])).exp()),
        false => [1.0; 3],
    };
    let (value, odds) = match collided {
        true => (product(sigma_s, tr), product(sigma_t, tr)),
        false => (tr, tr),
    };
    let densities = product(density, odds);
    let norm = mean(densities);
    Some((product(flux, value).map(|x| x / norm), densities.map(|x| x / norm)))
}

fn assert_starts_where_it_ended(v: &PhotonVertices, lane: usize, sequel: Option<Sequel>) {
    let s = segments(v);
    if let Some(sequel) = sequel {
        let gap = (s.origin.get(lane) - sequel.position).length();
        assert!(gap < 1e-3, "the next segment starts at a distance of {gap}");
        assert_close("flux at the start", array(s.flux.rgb(lane)), sequel.flux, 1e-4);
        assert_close("density", array(s.density.rgb(lane)), sequel.density, 2e-3);
    }
}

/// Asking for segments changes nothing else.
fn assert_segments_are_free(scene: &dyn Scene) {
    let mut asked = Vec::new();
    walk(scene, 0, |v| asked.push((v.walk.clone(), v.position.clone(), v.flux.clone())));
    let (emission, mut next) = numbers_of(0);
    let mut photons = scene.emit(WALKS, &emission, LIMITS.into()).expect("walks start");
    let mut vertices = PhotonVertices::default();
    for (walk, position, flux) in asked {
        photons.step(1, &next(photons.lanes()), &mut vertices).expect("walks advance");
        let same = vertices.walk == walk && vertices.position == position && vertices.flux == flux;
        assert!(same, "segments change the walk");
    }
    assert_eq!(photons.lanes(), 0);
}

// ---- Short beams ----------------------------------------------------------------------------------
//
// [Short beam]: given the walk X up to a segment's start, the segment gets beyond t with probability
// mean(density Tr(t)). If t is chosen by X alone (here a share of the distance to the surface), then
//     E[ 1{beyond t} Tr_i(t) / mean(density Tr(t)) - Tr_i(t) | X ] = 0   for each channel i,
// and the sum over any segments that X chooses has mean 0, too. It is judged by its values in independent
// sets of walks, in units of the mean sum of the second term over all sets. Segments of light that was
// scattered count apart from others: in coloured media their densities differ more.

/// Share of the distance to the surface at which coverage is measured.
const SHARE: f32 = 0.25;
const SETS: u64 = 32;
/// Points of the midpoint rule for the optical depth in varying media, whose kinks it resolves.
const QUADRATURE: usize = 16;
const QUADRATURE_BIAS: f64 = 2e-4;

/// Sums over segments of a set of walks, per channel.
#[derive(Clone, Copy, Default)]
struct Coverage {
    covered: [f64; 3],
    transmitted: [f64; 3],
}

fn assert_coverage(name: &str, scene: &dyn Scene, batches_per_set: u64) {
    let mut sets = vec![[Coverage::default(); 2]; SETS as usize];
    let batches_per_set = batches_per_set * effort();
    for batch in 0..SETS * batches_per_set {
        let set = &mut sets[(batch / batches_per_set) as usize];
        walk(scene, batch, |v| {
            for (lane, tr) in transmittances(scene, v) {
                let s = segments(v);
                let odds = mean(product(array(s.density.rgb(lane)), tr));
                let sums = &mut set[usize::from(v.depth[lane] > 0)];
                let beyond = v.length[lane] > SHARE * s.reach[lane];
                for (channel, tr) in tr.into_iter().enumerate() {
                    sums.covered[channel] += if beyond { tr / odds } else { 0.0 };
                    sums.transmitted[channel] += tr;
                }
            }
        });
    }
    for (class, kind) in ["unscattered", "scattered"].iter().enumerate() {
        for channel in 0..3 {
            let total: f64 = sets.iter().map(|set| set[class].transmitted[channel]).sum();
            let unit = total / SETS as f64;
            let values: Vec<f64> = sets
                .iter()
                .map(|set| {
                    1.0 + (set[class].covered[channel] - set[class].transmitted[channel]) / unit
                })
                .collect();
            let name = format!("{name}, {kind} light, channel {channel}");
            Estimate::of(&values).assert_equals(&name, 1.0, QUADRATURE_BIAS);
        }
    }
}

/// Lanes in media before a surface, and the transmittance up to [`SHARE`] of the way there.
fn transmittances(scene: &dyn Scene, v: &PhotonVertices) -> Vec<(usize, [f64; 3])> {
    let s = segments(v);
    let lanes: Vec<_> = (0..v.event.len())
        .filter(|&lane| v.medium[lane] != VACUUM && s.reach[lane].is_finite())
        .collect();
    let constant = |lane: usize| match scene.description().media[v.medium[lane] as usize].extinction
    {
        Extinction::Constant(sigma_t) => Some(sigma_t),
        Extinction::Varying { .. } => None,
    };
    let asked: Vec<_> = lanes.iter().copied().filter(|&lane| constant(lane).is_none()).collect();
    let each = |f: &dyn Fn(usize, usize) -> Vec3| {
        let points = asked.iter().flat_map(|&lane| (0..QUADRATURE).map(move |i| f(lane, i)));
        Planes::push_all(points.collect::<Vec<_>>().into_iter())
    };
    let step = |lane: usize| SHARE * s.reach[lane] / QUADRATURE as f32;
    let points = MediumPoints {
        medium: asked.iter().flat_map(|&lane| [v.medium[lane]; QUADRATURE]).collect(),
        position: each(&|lane, i| {
            s.origin.get(lane) + v.direction.get(lane) * (step(lane) * (i as f32 + 0.5))
        }),
        direction: each(&|lane, _| v.direction.get(lane)),
    };
    let mut sigma_t = Planes::default();
    scene.extinction(&points, &mut sigma_t).expect("extinction is known");
    let mut first = 0;
    let depth = |lane: usize| {
        if let Some(sigma_t) = constant(lane) {
            return sigma_t * (SHARE * s.reach[lane]);
        }
        let range = first..first + QUADRATURE;
        first = range.end;
        range.fold(Rgb::ZERO, |sum, point| sum + sigma_t.rgb(point)) * step(lane)
    };
    let depths: Vec<Rgb> = lanes.iter().copied().map(depth).collect();
    lanes.into_iter().zip(depths.into_iter().map(|tau| array(tau).map(|x| (-x).exp()))).collect()
}

// ---- Numbers --------------------------------------------------------------------------------------

/// Where the walks of a batch end their second segment, which crosses the medium.
fn second_ends(scene: &dyn Scene, emission: &[f32], numbers: &[Vec<f32>; 2]) -> Vec<(u32, Vec3)> {
    let mut ends = vec![(photon_event::NONE, Vec3::ZERO); WALKS];
    let mut photons = scene.emit(WALKS, emission, LIMITS.into()).expect("walks start");
    let mut v = PhotonVertices::default();
    for numbers in numbers {
        let numbers: Vec<f32> = numbers
            .chunks_exact(numbers.len() / PHOTON_STEP_DIMENSIONS)
            .flat_map(|plane| plane[..photons.lanes()].to_vec())
            .collect();
        photons.step(1, &numbers, &mut v).expect("walks advance");
    }
    for lane in 0..v.event.len() {
        let crosses = v.medium[lane] != VACUUM;
        ends[v.walk[lane] as usize] = if crosses {
            (photon_event::kind(v.event[lane]), v.position.get(lane))
        } else {
            (photon_event::NONE, Vec3::ZERO)
        };
    }
    ends
}

/// Share of walks that end elsewhere.
fn moved(a: &[(u32, Vec3)], b: &[(u32, Vec3)]) -> f64 {
    let far = a.iter().zip(b).filter(|(a, b)| a.0 != b.0 || a.1.distance(b.1) > 1e-2).count();
    far as f64 / a.len() as f64
}

/// In a medium with null collisions, walks move little under small mutations of a step's own numbers and
/// elsewhere under another seed.
fn assert_continuous(scene: &dyn Scene) {
    let (mut emission, mut next) = numbers_of(0);
    let numbers = [next(WALKS), next(WALKS)];
    let ends = second_ends(scene, &emission, &numbers);
    let mutated = numbers.clone().map(|mut step| {
        for number in &mut step[..2 * WALKS] {
            *number = (*number + 1e-5).fract();
        }
        step
    });
    let by_mutation = moved(&ends, &second_ends(scene, &emission, &mutated));
    for seed in &mut emission[SEEDS] {
        *seed = (*seed + 0.5).fract();
    }
    let by_seed = moved(&ends, &second_ends(scene, &emission, &numbers));
    println!("{by_mutation:.5} of walks moved by a mutation, {by_seed:.3} by the seed");
    assert!(by_mutation < 1e-3, "a small mutation moves {by_mutation} of all walks");
    assert!(by_seed > 0.1, "another seed moves {by_seed} of all walks");
}

/// The number that chooses a lobe is still uniform where a flight has ended: of those that belong to
/// collisions, mean and second moment are 1/2 and 1/3, with variances of 1/12 and 4/45 per collision.
fn assert_lobes_are_independent(scene: &dyn Scene) {
    let (mut count, mut sum, mut squares) = (0.0, 0.0, 0.0);
    for batch in 0..32 * effort() {
        let (emission, mut next) = numbers_of(batch);
        let mut photons = scene.emit(WALKS, &emission, LIMITS.into()).expect("walks start");
        let mut v = PhotonVertices::default();
        while photons.lanes() > 0 {
            let lanes = photons.lanes();
            let numbers = next(lanes);
            photons.step(1, &numbers, &mut v).expect("walks advance");
            for lane in
                (0..lanes).filter(|&lane| photon_event::kind(v.event[lane]) == photon_event::MEDIUM)
            {
                let lobe = f64::from(numbers[lanes + lane]);
                count += 1.0;
                sum += lobe;
                squares += lobe * lobe;
            }
        }
    }
    let z = |moment: f64, variance: f64| moment * f64::sqrt(count / variance);
    let (first, second) =
        (z(sum / count - 0.5, 1.0 / 12.0), z(squares / count - 1.0 / 3.0, 4.0 / 45.0));
    println!("lobe numbers of {count} collisions: z = {first:.2} and {second:.2}");
    assert!(count > 1e4 && first.abs() < 4.5 && second.abs() < 4.5);
}

// ---- The analytic host ----------------------------------------------------------------------------

/// A ball of fog under a sky, with a matt ball inside and one of another fog beside it.
fn balls_of_fog(profile: Profile) -> World {
    let sphere = |center, radius| Shape::Sphere { center, radius, inward: false };
    let matt = Material::Lambertian { reflectance: Rgb::splat(0.5) };
    let bounds = Aabb { min: Vec3::splat(-1.0), max: Vec3::ONE };
    let coloured = Rgb::new(0.4, 1.0, 3.0);
    let albedo = Rgb::new(0.9, 0.8, 0.95);
    let forward = Phase::HenyeyGreenstein { g: 0.5 };
    World::new(Contents {
        camera: Camera::new(
            -3.0 * DVec3::Z,
            DVec3::Z,
            [2, 2],
            Projection::Orthographic { width: 1.0 },
        ),
        surfaces: vec![
            Surface::new(sphere(DVec3::ZERO, 1.0), Material::Null).between(VACUUM, 0),
            Surface::new(sphere(-0.5 * DVec3::X, 0.3), matt).between(0, VACUUM),
            Surface::new(sphere(0.4 * DVec3::X, 0.4), Material::Null).between(0, 1),
        ],
        fogs: vec![
            Fog { bounds, profile, ..Fog::uniform(coloured, albedo, forward) },
            Fog { bounds, ..Fog::uniform(Rgb::ONE, albedo, Phase::Isotropic) },
        ],
        lamps: vec![Lamp::Sky { radiance: Rgb::new(1.0, 2.0, 3.0) }],
        disclosure: Disclosure::Full,
    })
}

#[test]
fn analytic_segments_fit_their_vertices() {
    let world = balls_of_fog(Profile::Uniform);
    assert_consistent(&world);
    assert_segments_are_free(&world);
}

#[test]
fn analytic_short_beams_cover_the_transmittance() {
    assert_coverage("uniform fog", &balls_of_fog(Profile::Uniform), 8);
    let varying = balls_of_fog(Profile::Exponential { scale_height: 1.0 });
    assert_coverage("atmosphere", &varying, 8);
}

#[test]
fn analytic_media_are_described() {
    let world = balls_of_fog(Profile::Uniform);
    let media = &world.description().media;
    assert_eq!((media[0].grey, media[1].grey), (false, true));
    assert_eq!(media[1].scattering, Some(Rgb::new(0.9, 0.8, 0.95)));
    let varying = balls_of_fog(Profile::Exponential { scale_height: 1.0 });
    assert_eq!(varying.description().media[0].scattering, None);
}

// ---- Mitsuba --------------------------------------------------------------------------------------

fn variant() -> String {
    std::env::var(VARIANT).unwrap_or_else(|_| "scalar_rgb".to_owned())
}

/// Runs a check on a scene of Mitsuba. One at a time: Mitsuba's state is global.
fn in_mitsuba(path: PathBuf, defines: &[(String, String)], check: impl FnOnce(&dyn Scene)) {
    static SESSION: LazyLock<Mutex<Session>> = LazyLock::new(|| {
        Mutex::new(Session::start(Some(&variant()), None, 0).expect("Mitsuba starts"))
    });
    let session = SESSION.lock().unwrap_or_else(PoisonError::into_inner);
    let file = SceneFile { path, defines: defines.to_vec(), ..SceneFile::default() };
    let loaded = session.load(&file).expect("the scene is loaded");
    check(loaded.lend(0).expect("the scene is lent").scene());
}

fn test_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests")
}

fn in_agreement_scene(name: &str, check: impl FnOnce(&dyn Scene)) {
    in_mitsuba(test_folder().join(format!("agreement/scenes/{name}.xml")), &[], check);
}

/// A grid of 4 x 4 x 4 voxels, as thick at their densest as in the analytic fog, mostly thinner.
fn in_coloured_grid(check: impl FnOnce(&dyn Scene)) {
    let words = [1, 4, 4, 4, 3].map(i32::to_le_bytes);
    let bounds = [0f32, 0.0, 0.0, 1.0, 1.0, 1.0].map(f32::to_le_bytes);
    let voxels = (0..64).flat_map(|voxel| {
        let thickness = ((voxel * 37) % 64) as f32 / 63.0;
        [0.4, 1.0, 3.0].map(|sigma_t| (sigma_t * (0.1 + 0.9 * thickness)).to_le_bytes())
    });
    let mut bytes = b"VOL\x03".to_vec();
    bytes.extend(words.into_iter().chain(bounds).chain(voxels).flatten());
    let folder = tempfile::tempdir().expect("there is room for a folder");
    let path = folder.path().join("stained.vol");
    std::fs::write(&path, bytes).expect("there is room for a grid");
    let defines = [("grid".to_owned(), path.to_str().expect("UTF-8").to_owned())];
    in_mitsuba(test_folder().join("segments/coloured_grid.xml"), &defines, check);
}

#[test]
fn mitsuba_segments_fit_their_vertices() {
    for scene in ["extinction_box", "ball_rayleigh", "smoke_spot"] {
        in_agreement_scene(scene, |scene| {
            assert_consistent(scene);
            assert_segments_are_free(scene);
        });
    }
}

#[test]
fn mitsuba_short_beams_cover_the_transmittance_of_dye() {
    in_agreement_scene("extinction_box", |scene| assert_coverage("dye", scene, 32));
}

#[test]
fn mitsuba_short_beams_cover_the_transmittance_of_smoke() {
    in_agreement_scene("smoke_spot", |scene| assert_coverage("smoke", scene, 16));
}

#[test]
fn mitsuba_short_beams_cover_the_transmittance_of_stained_smoke() {
    in_coloured_grid(|scene| assert_coverage("stained smoke", scene, 8));
}

#[test]
fn mitsuba_walks_are_continuous_in_their_numbers() {
    in_coloured_grid(assert_continuous);
}

#[test]
fn mitsuba_lobes_do_not_depend_on_free_flights() {
    in_coloured_grid(assert_lobes_are_independent);
}

#[test]
fn mitsuba_media_are_described() {
    let first = |scene: &dyn Scene| {
        let medium = &scene.description().media[0];
        (medium.grey, medium.scattering)
    };
    let cases = [
        ("ball_rayleigh", (true, Some(Rgb::splat(1.2) * Rgb::new(0.6, 0.8, 0.97)))),
        ("extinction_box", (false, Some(Rgb::new(0.5, 1.0, 2.0) * Rgb::new(0.8, 0.9, 0.7)))),
        ("smoke_spot", (true, None)),
        ("albedo_grid", (true, None)),
        ("fibres_sggx", (true, None)),
    ];
    for (name, expected) in cases {
        in_agreement_scene(name, |scene| assert_eq!(first(scene), expected, "{name}"));
    }
    in_coloured_grid(|scene| assert_eq!(first(scene), (false, None)));
}

#[test]
fn the_same_in_llvm_ad_rgb() {
    if std::env::var_os(VARIANT).is_some() {
        return;
    }
    let Some(llvm) = llvm::llvm_or_skip("the_same_in_llvm_ad_rgb") else { return };
    let status = Command::new(std::env::current_exe().expect("this test has a path"))
        .args(["mitsuba_", "--skip=of_dye", "--skip=of_smoke", "--test-threads=1"])
        .env(VARIANT, "llvm_ad_rgb")
        .env("DRJIT_LIBLLVM_PATH", llvm)
        .status();
    assert!(status.expect("this test runs again").success());
}
