use super::{learn, of_equal_worth, EmissionGuide, Lesson, Numbers, GUIDED_DIMENSIONS};
use rand::{rngs::StdRng, Rng, SeedableRng};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// What a walk adds: 1 in a small ball around a place that is nowhere near the cuts of halves, of volume 8 pi^2 / 15 r^5.
const PLACE: Numbers = [0.3, 0.71, 0.55, 0.5, 0.12];
const RADIUS: f64 = 0.12;

fn added(numbers: &Numbers) -> f64 {
    let squared = |(x, place): (&f32, &f32)| f64::from(x - place).powi(2);
    let distance: f64 = numbers.iter().zip(&PLACE).map(squared).sum();
    f64::from(u8::from(distance < RADIUS * RADIUS))
}

fn uniform(rng: &mut StdRng) -> [f64; GUIDED_DIMENSIONS] {
    rng.random()
}

/// A guide learnt as a render learns: by rounds, each under the guide of the one before.
fn taught(rng: &mut StdRng) -> EmissionGuide {
    let mut guides: Vec<EmissionGuide> = Vec::new();
    let mut seen: Vec<Numbers> = Vec::new();
    for _ in 0..6 {
        for _ in 0..20_000 {
            let even = uniform(rng);
            let numbers = guides.last().map_or(even.map(|x| x as f32), |guide| guide.warp(even).0);
            seen.extend((added(&numbers) > 0.0).then_some(numbers));
        }
        let lesson = |&numbers: &Numbers| {
            let sum: f64 = guides.iter().map(|guide| f64::from(guide.density(&numbers))).sum();
            Lesson { numbers, worth: added(&numbers) / (1.0 + sum) }
        };
        let lessons = seen.iter().map(lesson).collect();
        guides.push(learn(lessons).expect("some were seen"));
    }
    guides.pop().expect("six rounds")
}

/// The second moment of `added / density` is the integral of `1 / density` over the ball, here by numbers that are spread evenly
/// over it: rare numbers of large weight would hide from numbers of the guide's own. Of even numbers it is the ball's volume.
fn second_moment(guide: &EmissionGuide, rng: &mut StdRng) -> f64 {
    let samples = 20_000;
    let mut sum = 0.0;
    let mut inside = 0;
    while inside < samples {
        let around: [f64; GUIDED_DIMENSIONS] = rng.random();
        let place = |axis: usize| PLACE[axis] + ((2.0 * around[axis] - 1.0) * RADIUS) as f32;
        let numbers = std::array::from_fn(place);
        if added(&numbers) > 0.0 {
            inside += 1;
            sum += 1.0 / f64::from(guide.density(&numbers));
        }
    }
    sum / f64::from(samples) * volume()
}

fn volume() -> f64 {
    8.0 * std::f64::consts::PI.powi(2) / 15.0 * RADIUS.powi(5)
}

/// The mean of `added / density` over the guide's numbers is the ball's volume, as it is over even numbers, and its second moment
/// is a small part of theirs.
#[test]
fn guided_means_are_those_of_even_numbers_with_less_variance() {
    let mut rng = StdRng::seed_from_u64(1);
    let guide = taught(&mut rng);
    let second = second_moment(&guide, &mut rng);
    assert!(second < 0.1 * volume(), "{} of that of even numbers", second / volume());
    let samples = 400_000;
    let mut sum = 0.0;
    for _ in 0..samples {
        let (numbers, density) = guide.warp(uniform(&mut rng));
        sum += added(&numbers) / f64::from(density);
    }
    let mean = sum / f64::from(samples);
    let z = (mean - volume()) / ((second - volume() * volume()) / f64::from(samples)).sqrt();
    assert!(z.abs() < 3.9, "mean {mean}, volume {}, z {z}", volume());
}

/// The shares of warped numbers in the eight slices of each axis are those that the density gives to even ones, by chi-square
/// with Bonferroni's correction; and the density's mean over even numbers is 1.
#[test]
fn numbers_are_drawn_with_the_density_that_is_told() {
    let mut rng = StdRng::seed_from_u64(2);
    let guide = taught(&mut rng);
    let samples = 400_000;
    let mut drawn = [[0.0; 8]; GUIDED_DIMENSIONS];
    let mut expected = [[0.0; 8]; GUIDED_DIMENSIONS];
    let mut variances = [[0.0; 8]; GUIDED_DIMENSIONS];
    let mut whole = 0.0;
    for _ in 0..samples {
        let (numbers, told) = guide.warp(uniform(&mut rng));
        assert!(numbers.iter().all(|number| (0.0..1.0).contains(number)), "{numbers:?}");
        assert_eq!(guide.density(&numbers), told, "at {numbers:?}");
        let even = uniform(&mut rng).map(|x| x as f32);
        let density = f64::from(guide.density(&even));
        whole += density / f64::from(samples);
        for axis in 0..GUIDED_DIMENSIONS {
            drawn[axis][(numbers[axis] * 8.0) as usize] += 1.0;
            expected[axis][(even[axis].min(0.999) * 8.0) as usize] += density;
            variances[axis][(even[axis].min(0.999) * 8.0) as usize] += density * density;
        }
    }
    assert!((whole - 1.0).abs() < 0.05, "the density integrates to {whole}");
    let limit = ChiSquared::new(8.0).unwrap().inverse_cdf(1.0 - 1e-3 / GUIDED_DIMENSIONS as f64);
    for axis in 0..GUIDED_DIMENSIONS {
        let terms = (0..8).map(|slice| {
            let difference: f64 = drawn[axis][slice] - expected[axis][slice];
            difference * difference / (drawn[axis][slice] + variances[axis][slice])
        });
        let chi_square: f64 = terms.sum();
        assert!(chi_square < limit, "axis {axis}: {chi_square} of {limit}");
    }
}

/// Numbers that nothing was seen from are drawn all the same: at least one in five is even.
#[test]
fn nothing_is_left_out() {
    let mut rng = StdRng::seed_from_u64(3);
    let guide = taught(&mut rng);
    let least = (0..10_000).map(|_| guide.density(&uniform(&mut rng).map(|x| x as f32)));
    let least = least.fold(f32::INFINITY, f32::min);
    assert!(least >= 0.19, "a density of {least}");
}

/// Lessons that are spread evenly teach nothing: chance alone must not cut the cube.
#[test]
fn even_lessons_give_an_almost_even_guide() {
    let mut rng = StdRng::seed_from_u64(4);
    let lesson = |_| Lesson { numbers: uniform(&mut rng).map(|x| x as f32), worth: 1.0 };
    let lessons: Vec<Lesson> = (0..5000).map(lesson).collect();
    assert_eq!(of_equal_worth(&lessons), 5000.0);
    let guide = learn(lessons).expect("there are lessons");
    let mut squares = 0.0;
    for _ in 0..20_000 {
        let density = f64::from(guide.density(&uniform(&mut rng).map(|x| x as f32)));
        squares += density * density / 20_000.0;
    }
    assert!(squares < 1.02, "a second moment of {squares} with {} boxes", guide.leaves());
}

#[test]
fn no_lessons_give_no_guide() {
    assert!(learn(Vec::new()).is_none());
    assert!(learn(vec![Lesson { numbers: PLACE, worth: 0.0 }]).is_none());
}
