//! Metropolis chains against closed forms, on the pure-Rust host.
//!
//! A point lamp of intensity `I` [W/sr] hangs at height 1 over squares of matt paper in the plane z = 0,
//! and nothing else is there. The camera looks straight down on them with parallel rays. A walk is
//! visible if and only if it lands on the paper: pixels are so small that each photon has a visible point
//! within its radius. So the visible share is the solid angle of the paper over `4 pi`, and the picture
//! has a closed form in spite of the kernel: a photon at `y` adds to the mean of the picture in
//! proportion to the share of its disk that lies on paper.

use glam::DVec3;
use statistics::quadrature::integrate;
use statistics::t_test::Estimate;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f64::consts::PI;
use vpt::analytic::{
    Camera, Contents, Disclosure, Lamp, Material, Projection, Shape, Surface, World, FILM_CHANNELS,
};
use vpt::density::radius::Radii;
use vpt::markov::{ChainCounts, ChainShooter, Mode};
use vpt::math::Rgb;
use vpt::method::{self, Method, Outcome, Parameters, Preset, Shooting, Silent};
use vpt::plan::{Plan, Steering, Wishes};
use vpt::scene::{PathLimits, Scene, VACUUM};
use vpt::transport::photon::Family;
use vpt::transport::receivers::Receivers;
use vpt::transport::target::{Particles, Target};
use vpt::transport::view;

const PIXELS: u32 = 16;
const INTENSITY: f32 = 3.0;
const REFLECTANCE: f32 = 0.5;

/// Squares of paper of one size, and a film that their bounding box fills.
struct Paper {
    centers: Vec<f64>,
    half: f64,
}

impl Paper {
    /// One square that is seen by the given share of all walks.
    fn of_share(share: f64) -> Self {
        let (mut low, mut high) = (0.0, 10.0);
        for _ in 0..100 {
            let half = 0.5 * (low + high);
            if (Paper { centers: vec![0.0], half }).visible_share() < share {
                low = half;
            } else {
                high = half;
            }
        }
        Paper { centers: vec![0.0], half: low }
    }

    /// Two squares, one under the lamp and one 1.5 to the side.
    fn apart(half: f64) -> Self {
        Paper { centers: vec![0.0, 1.5], half }
    }

    /// Irradiance [W/m²] per intensity at distance `x`, `y` from under the lamp.
    fn irradiance(x: f64, y: f64) -> f64 {
        (1.0 + x * x + y * y).powf(-1.5)
    }

    /// Integral of a function over one square.
    fn over(&self, square: usize, f: impl Fn(f64, f64) -> f64) -> f64 {
        let (center, half) = (self.centers[square], self.half);
        integrate(center - half, center + half, 4, |x| integrate(-half, half, 4, |y| f(x, y)))
    }

    /// The irradiance of a lamp of intensity 1, integrated, is the solid angle.
    fn visible_share(&self) -> f64 {
        let angle = |square| self.over(square, Paper::irradiance);
        (0..self.centers.len()).map(angle).sum::<f64>() / (4.0 * PI)
    }

    fn radius(&self) -> f64 {
        // Pixels are at most 2 · half · width of the film over PIXELS wide; their diagonal fits.
        1.5 * self.film_width() / f64::from(PIXELS)
    }

    fn film_width(&self) -> f64 {
        self.centers[self.centers.len() - 1] - self.centers[0] + 2.0 * self.half
    }

    /// Power of light [W] that leaves a square per projected solid angle of the camera, as the density
    /// estimate has it: the integral of the estimated radiance over the square.
    fn radiance_integral(&self, square: usize) -> f64 {
        self.radiance_integral_under(square, self.radius())
    }

    /// The same under disks of another radius.
    fn radiance_integral_under(&self, square: usize, radius: f64) -> f64 {
        let (center, half) = (self.centers[square], self.half);
        let covered = |x: f64, y: f64| disk_in_square(x - center, y, half, radius);
        let incident = self.over(square, |x, y| Paper::irradiance(x, y) * covered(x, y));
        f64::from(INTENSITY * REFLECTANCE) / PI * incident
    }

    fn world(&self) -> World {
        let middle = 0.5 * (self.centers[0] + self.centers[self.centers.len() - 1]);
        let projection = Projection::Orthographic { width: self.film_width() };
        let sheet = |&x: &f64| {
            let center = DVec3::new(x, 0.0, 0.0);
            let (half_u, half_v) = (self.half * DVec3::X, self.half * DVec3::Y);
            let reflectance = Rgb::splat(REFLECTANCE);
            Surface::new(
                Shape::Rectangle { center, half_u, half_v },
                Material::Lambertian { reflectance },
            )
        };
        World::new(Contents {
            camera: Camera::new(
                DVec3::new(middle, 0.0, 2.0),
                -DVec3::Z,
                [PIXELS, (f64::from(PIXELS) * 2.0 * self.half / self.film_width()).round() as u32],
                projection,
            ),
            surfaces: self.centers.iter().map(sheet).collect(),
            fogs: vec![],
            lamps: vec![Lamp::Point {
                position: DVec3::Z,
                intensity: Rgb::splat(INTENSITY),
                medium: VACUUM,
            }],
            disclosure: Disclosure::Full,
        })
    }
}

/// Share of a disk around `(x, y)` that lies in the square of the given half width around the origin.
fn disk_in_square(x: f64, y: f64, half: f64, radius: f64) -> f64 {
    let chord = |u: f64| {
        let reach = (radius * radius - u * u).max(0.0).sqrt();
        ((y + reach).min(half) - (y - reach).max(-half)).max(0.0)
    };
    let (low, high) = ((x - radius).max(-half), (x + radius).min(half));
    // The half circle's ends are steep: substitute the angle.
    let angle = |u: f64| ((u - x) / radius).clamp(-1.0, 1.0).asin();
    integrate(angle(low), angle(high), 4, |a| chord(radius * a.sin()) * radius * a.cos())
        / (PI * radius * radius)
}

fn parameters(paper: &Paper, photons: u64, seed: u64) -> Parameters {
    Parameters {
        method: Method::PptMetro,
        shooting: Some(Shooting::Metropolis),
        passes: 4,
        photons,
        jitter_every: 2,
        surface_radius: paper.radius() as f32,
        // The radius must not change: the closed form is for one.
        alpha: 1.0 - f32::EPSILON,
        seed,
        ..Preset::Paper.parameters()
    }
}

fn render(paper: &Paper, parameters: &Parameters) -> Outcome {
    method::render(&paper.world(), parameters, &mut Silent).expect("the scene renders")
}

/// Integral over columns of the film of the radiance that they show [W/sr].
fn integral(paper: &Paper, outcome: &Outcome, columns: std::ops::Range<usize>) -> f64 {
    let pixel = (paper.film_width() / f64::from(PIXELS)).powi(2);
    let pixels = outcome.film.values.chunks_exact(FILM_CHANNELS).enumerate();
    pixels
        .filter(|(index, _)| columns.contains(&(index % PIXELS as usize)))
        .map(|(_, sums)| sums[0] / sums[4] * pixel)
        .sum()
}

const ALL: std::ops::Range<usize> = 0..PIXELS as usize;

/// The picture and the visible share that the counters give, against their closed forms.
#[track_caller]
fn assert_normalised(share: f64, photons: u64, seeds: u64, notices: f64) {
    let paper = Paper::of_share(share);
    let outcomes: Vec<Outcome> =
        (0..seeds).map(|seed| render(&paper, &parameters(&paper, photons, seed))).collect();
    let values = |f: &dyn Fn(&Outcome) -> f64| outcomes.iter().map(f).collect::<Vec<f64>>();
    let pictures = Estimate::of(&values(&|outcome| integral(&paper, outcome, ALL)));
    let name = format!("share {share}: picture");
    pictures.assert_noticing(notices, &name, paper.radiance_integral(0), 1e-4);
    let shares = Estimate::of(&values(&|outcome| outcome.stats.shooting.surface.visible_share));
    let name = format!("share {share}: visible share");
    shares.assert_noticing(notices, &name, share, 1e-4);
}

#[test]
fn normalised_where_a_tenth_is_visible() {
    assert_normalised(1e-1, 12_000, 32, 0.03);
}

#[test]
fn normalised_where_a_hundredth_is_visible() {
    assert_normalised(1e-2, 28_000, 32, 0.06);
}

#[test]
fn normalised_where_a_thousandth_is_visible() {
    assert_normalised(1e-3, 150_000, 32, 0.1);
}

#[test]
fn normalised_where_a_ten_thousandth_is_visible() {
    assert_normalised(1e-4, 700_000, 16, 0.25);
}

#[test]
#[ignore = "long: just markov"]
fn normalised_where_a_hundred_thousandth_is_visible() {
    assert_normalised(1e-5, 5_000_000, 16, 0.25);
}

/// Each of two islands that no small mutation connects must keep its share of the light. Under the lamp
/// it is brighter, so that a population which forgets one of them shows.
#[test]
fn both_of_two_disjoint_regions_are_kept() {
    let paper = Paper::apart(0.1);
    let island = (2.0 * paper.half / paper.film_width() * f64::from(PIXELS)).round() as usize;
    let columns = [0..island, PIXELS as usize - island..PIXELS as usize];
    let outcomes: Vec<Outcome> =
        (0..64).map(|seed| render(&paper, &parameters(&paper, 100_000, seed))).collect();
    for (square, columns) in columns.into_iter().enumerate() {
        let values: Vec<f64> =
            outcomes.iter().map(|outcome| integral(&paper, outcome, columns.clone())).collect();
        let expected = paper.radiance_integral(square);
        let name = format!("island {square}");
        Estimate::of(&values).assert_noticing(0.15, &name, expected, 1e-3);
    }
}

/// New view rays in every pass see another part of the paper, since the disks of the visible points leave
/// gaps: chains go on with the few per cent of their states lost that do not make them start anew. What that
/// costs in bias must not be seen. A photon adds to as many pixels as have their point within the radius,
/// over the jitters one per pixel area of its disk, so the closed form holds for the smaller radius, too.
#[test]
fn chains_that_live_on_through_jitters_keep_the_light() {
    let paper = Paper::of_share(0.05);
    let radius = 0.8 * paper.film_width() / f64::from(PIXELS);
    let outcomes: Vec<Outcome> = (0..24)
        .map(|seed| Parameters {
            passes: 32,
            jitter_every: 1,
            surface_radius: radius as f32,
            ..parameters(&paper, 20_000, seed)
        })
        .map(|parameters| render(&paper, &parameters))
        .collect();
    let counts = outcomes.iter().map(|outcome| outcome.stats.shooting.surface.counts);
    let sum = |f: fn(&ChainCounts) -> u64| counts.clone().map(|c| f(&c)).sum::<u64>() as f64;
    let lost = sum(|c| c.lost_states) / sum(|c| c.renewed_walks);
    let restarts = sum(|c| c.restarts) / (31 * outcomes.len()) as f64;
    println!("{:.2} % of the states lost, {restarts:.2} of the jitters began anew", 100.0 * lost);
    assert!(lost > 0.01 && restarts < 0.2, "{lost} lost, {restarts} restarts: nothing is tested");
    let values: Vec<f64> = outcomes.iter().map(|outcome| integral(&paper, outcome, ALL)).collect();
    let expected = paper.radiance_integral_under(0, radius);
    Estimate::of(&values).assert_noticing(0.02, "jittered chains", expected, 1e-4);
}

/// From eight chains to more than a pass has photons for.
#[test]
fn result_does_not_depend_on_the_number_of_chains() {
    let paper = Paper::of_share(0.03);
    for chains in [8, 64, 512, 4096] {
        let values: Vec<f64> = (0..24)
            .map(|seed| Parameters { chains, ..parameters(&paper, 20_000, seed) })
            .map(|parameters| integral(&paper, &render(&paper, &parameters), ALL))
            .collect();
        let name = format!("{chains} chains");
        let expected = paper.radiance_integral(0);
        Estimate::of(&values).assert_noticing(0.06, &name, expected, 1e-4);
    }
}

#[test]
fn result_does_not_depend_on_the_number_of_threads() {
    let paper = Paper::of_share(0.03);
    let render_with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| render(&paper, &parameters(&paper, 20_000, 5)).film)
    };
    let one = render_with(1);
    assert_eq!(one, render_with(2));
    assert_eq!(one, render_with(8));
}

/// A state of each of many independent populations, thrown after some iterations. Uniform in primary
/// sample space means uniform in solid angle here, which the chi-square test of the places on the paper
/// checks: 16 fields with the solid angles that they have.
#[test]
fn states_are_uniform_on_the_visible_part() {
    const FIELDS: usize = 4;
    const RUNS: u64 = 1600;
    let paper = Paper::of_share(0.02);
    let mut counts = [0.0; FIELDS * FIELDS];
    for seed in 0..RUNS {
        let [x, y] = a_state_of(&paper, seed);
        let field = |x: f64| {
            (((x + paper.half) / (2.0 * paper.half) * FIELDS as f64) as usize).min(FIELDS - 1)
        };
        counts[field(y) * FIELDS + field(x)] += 1.0;
    }
    let step = 2.0 * paper.half / FIELDS as f64;
    let angle = |field: usize| {
        let corner = |i: usize| i as f64 * step - paper.half;
        let (x, y) = (corner(field % FIELDS), corner(field / FIELDS));
        integrate(x, x + step, 1, |x| integrate(y, y + step, 1, |y| Paper::irradiance(x, y)))
    };
    let all: f64 = (0..FIELDS * FIELDS).map(angle).sum();
    let chi_squared: f64 = (0..FIELDS * FIELDS)
        .map(|field| {
            let expected = RUNS as f64 * angle(field) / all;
            (counts[field] - expected).powi(2) / expected
        })
        .sum();
    let freedom = (FIELDS * FIELDS - 1) as f64;
    let limit = ChiSquared::new(freedom).unwrap().inverse_cdf(1.0 - 1e-4);
    println!("chi-square {chi_squared:.1} with {freedom} degrees of freedom, limit {limit:.1}");
    assert!(chi_squared < limit, "{counts:?}");
}

/// Where on the paper a chain's state lands: the last of the states after a pass of mutations.
fn a_state_of(paper: &Paper, seed: u64) -> [f64; 2] {
    let world = paper.world();
    let limits = PathLimits { max_depth: 2, rr_depth: 5, hide_emitters: false };
    let steering = Steering::Always;
    let plan = Plan::new(world.description(), Wishes { steering, ..limits.into() });
    let receivers = Receivers::build(&world, view::trace(&world, &plan, seed, 0).unwrap());
    let radius = paper.radius() as f32;
    let target = Target {
        scene: &world,
        receivers: &receivers,
        particles: Particles::Points,
        radii: Radii { surface: radius, medium: radius },
        plan: &plan,
    };
    let mut shooter = ChainShooter::new(seed, 8);
    let mut sums = receivers.paths.new_sums();
    shooter.shoot(&target, 0, 2000, &mut sums).unwrap();
    let population = shooter.population(Family::Surface).expect("the paper is seen");
    let state = population.states().last().expect("2000 walks, and one in 50 is visible");
    // As the lamp emits: numbers 3 and 4 are the direction's. The ray goes down to z = 0.
    let (z, azimuth) =
        (1.0 - 2.0 * f64::from(state.sample[3]), 2.0 * PI * f64::from(state.sample[4]));
    let (tangent, bitangent) = DVec3::Z.any_orthonormal_pair();
    let sine = (1.0 - z * z).sqrt();
    let direction =
        sine * azimuth.cos() * tangent + sine * azimuth.sin() * bitangent + z * DVec3::Z;
    let place = DVec3::Z - direction / direction.z;
    [place.x, place.y]
}

#[test]
fn auto_shoots_uniformly_where_much_is_visible_and_by_chains_where_little_is() {
    for (share, mode) in [(0.3, Mode::Uniform), (0.01, Mode::Metropolis)] {
        let paper = Paper::of_share(share);
        let auto = Parameters { shooting: Some(Shooting::Auto), ..parameters(&paper, 20_000, 1) };
        let outcome = render(&paper, &auto);
        assert_eq!(outcome.stats.shooting.surface.mode, mode, "share {share}");
        assert_eq!(outcome.stats.shooting.medium.mode, Mode::Off, "there is no fog");
    }
}

/// The lamp is under the paper, which is painted on the camera's side alone.
#[test]
fn nothing_visible_ends_with_a_warning_and_a_black_picture() {
    let paper = Paper::of_share(0.1);
    let mut contents = paper.world().contents().clone();
    contents.lamps = vec![Lamp::Point {
        position: DVec3::new(0.0, 0.0, 50.0),
        intensity: Rgb::splat(INTENSITY),
        medium: VACUUM,
    }];
    contents.surfaces.push(Surface::new(
        Shape::Sphere { center: DVec3::new(0.0, 0.0, 50.0), radius: 1.0, inward: true },
        Material::Lambertian { reflectance: Rgb::splat(0.5) },
    ));
    let world = World::new(contents);
    for method in Method::ALL {
        let parameters = Parameters { method, shooting: None, ..parameters(&paper, 5_000, 0) };
        let outcome = method::render(&world, &parameters, &mut Silent).expect("it renders");
        assert_eq!(integral(&paper, &outcome, ALL), 0.0, "{}", method.name());
        let warned = outcome.stats.warnings.iter().any(|warning| warning.contains("none of"));
        assert!(warned, "{}: {:?}", method.name(), outcome.stats.warnings);
    }
    assert!(!world.description().emitters.is_empty());
}
