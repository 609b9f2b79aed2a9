//! The estimated error against the true one: scenes of the agreement table, whose references are known to
//! 0.1 % of the image and 0.5 % of a block.
//!
//! - The number told for the whole picture is the root of the mean of squared relative errors. Its mean
//!   square over independent renders must lie within a factor of the true one's.
//! - The image of errors claims that the truth lies within `t(J - 1, 97.5 %)` times the error of a pixel in
//!   95 % of the pixels and renders, `J` being the number of jitters. Pixels of one render share photons, so
//!   the spread of the coverage is taken between renders: the claim is rejected where the mean coverage is
//!   off by more than the margin plus what four of its standard errors hide.
//! - What is predicted for later passes must be what is estimated then.

use statrs::distribution::{ContinuousCDF, StudentsT};
use std::ops::Range;
use std::path::{Path, PathBuf};
use vpt::host::session::{SceneFile, Session};
use vpt::math::brightness;
use vpt::method::{ErrorEstimate, Silent};

#[allow(dead_code)]
#[path = "support/image.rs"]
mod image;

use image::Image;

const SCENES: [&str; 6] = [
    "room_diffuse",
    "ball_rayleigh",
    "smoke_spot",
    "lamp_in_ball",
    "box_directional",
    "hidden_lamp",
];
const METHODS: [&str; 6] = ["ppt", "ppbt", "ppt_metro", "ppbt_metro", "apa", "ppb"];
const PASSES: u32 = 32;
const JITTER_EVERY: u32 = 1;
/// The estimated error over the true one, as roots of mean squares over renders.
const RATIOS: std::ops::RangeInclusive<f64> = 0.75..=1.4;
/// By how much less or more than claimed may be covered.
const MARGIN: f64 = 0.03;

/// A render judged.
struct Judged {
    estimate: ErrorEstimate,
    /// The true relative error, as `report::metrics` defines it.
    truth: f64,
    /// Share of the values whose truth lies within the 95 % interval.
    coverage: f64,
}

struct Case<'a> {
    session: &'a Session,
    scene: &'static str,
    method: &'static str,
    photons: u32,
}

impl Case<'_> {
    fn render(&self, seed: u32, passes: u32) -> Judged {
        let settings = [
            ("photons", self.photons.to_string()),
            ("jitter_every", JITTER_EVERY.to_string()),
            ("error_image", "true".to_owned()),
            // So near a lamp samples of it have no normal distribution, and an interval of two standard errors promises 95 %
            // of nothing; photons bring its light as it is.
            ("connections", if self.scene == "lamp_in_ball" { "false" } else { "auto" }.to_owned()),
        ];
        let file = SceneFile {
            path: agreement("scenes").join(format!("{}.xml", self.scene)),
            method: Some(self.method.to_owned()),
            settings: settings.map(|(name, value)| (name.to_owned(), value)).into(),
            ..SceneFile::default()
        };
        let mut scene = self.session.load(&file).unwrap();
        let stats = scene.render(0, seed, Some(passes), &mut Silent).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let picture = folder.path().join("picture.exr");
        scene.write(&picture).unwrap();
        let estimate = stats.estimated_error.expect("there were enough jitters");
        let reference =
            Image::read_exr(&agreement("references").join(format!("{}.exr", self.scene)), "");
        let [picture, error] = ["", "error."].map(|p| Image::read_exr(&picture, p).unwrap());
        judge(estimate, &picture, &error, &reference.unwrap())
    }

    fn judge(&self, seeds: u32) -> Vec<String> {
        let runs: Vec<Judged> = (0..seeds).map(|seed| self.render(seed, PASSES)).collect();
        let ratio = root_mean_square(runs.iter().map(|run| run.estimate.relative))
            / root_mean_square(runs.iter().map(|run| run.truth));
        let count = f64::from(seeds);
        let coverage = runs.iter().map(|run| run.coverage).sum::<f64>() / count;
        let variance = runs.iter().map(|run| (run.coverage - coverage).powi(2)).sum::<f64>()
            / (count * (count - 1.0));
        let hidden = 4.0 * variance.sqrt();
        println!(
            "{:16} {:10}  error {:5.2} %, estimated {:5.2} % (ratio {ratio:.2}), covered {:.1} ± {:.1} %",
            self.scene,
            self.method,
            100.0 * root_mean_square(runs.iter().map(|run| run.truth)),
            100.0 * root_mean_square(runs.iter().map(|run| run.estimate.relative)),
            100.0 * coverage,
            100.0 * variance.sqrt(),
        );
        let name = format!("{}, {}", self.scene, self.method);
        let mut faults = Vec::new();
        if !RATIOS.contains(&ratio) {
            faults.push(format!("{name}: estimated / true is {ratio:.2}"));
        }
        if (coverage - 0.95).abs() > MARGIN + hidden {
            faults.push(format!("{name}: the 95 % intervals cover {:.1} %", 100.0 * coverage));
        }
        if hidden > 0.1 {
            faults.push(format!("{name}: too few renders to tell what is covered"));
        }
        faults
    }
}

fn judge(estimate: ErrorEstimate, picture: &Image, error: &Image, reference: &Image) -> Judged {
    let t = StudentsT::new(0.0, 1.0, f64::from(estimate.jitters - 1)).unwrap().inverse_cdf(0.975);
    let value = |index: usize| f64::from(reference.pixels[index / 3][index % 3]);
    let floor = (0.1 * brightness((0..3 * reference.pixels.len()).map(value))).powi(2);
    let (mut squares, mut covered) = (0.0, 0);
    let count = 3 * reference.pixels.len();
    for (pixel, truth) in reference.pixels.iter().enumerate() {
        for (channel, &truth) in truth.iter().enumerate() {
            let off = f64::from(picture.pixels[pixel][channel]) - f64::from(truth);
            squares += off * off / (f64::from(truth).powi(2) + floor);
            covered += usize::from(off.abs() <= t * f64::from(error.pixels[pixel][channel]));
        }
    }
    let truth = (squares / count as f64).sqrt();
    Judged { estimate, truth, coverage: covered as f64 / count as f64 }
}

fn root_mean_square(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    (values.map(|value| value * value).sum::<f64>() / count).sqrt()
}

fn agreement(folder: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/agreement").join(folder)
}

/// Few photons make noise prevail, many the bias of the automatic radii.
fn check(methods: &[&'static str], photons: &[u32], seeds: u32) {
    let session = Session::start(Some("scalar_rgb"), None, 0).unwrap();
    let mut faults = Vec::new();
    for scene in SCENES {
        for &method in methods {
            for &photons in photons {
                faults.extend(Case { session: &session, scene, method, photons }.judge(seeds));
            }
        }
    }
    assert!(faults.is_empty(), "\n{}", faults.join("\n"));
    predicts(&session);
}

/// From 32 passes to 128: what was foretold is what is found, in the mean over seeds. Photons are
/// so many that noise does not pass for the level of dark pixels, to which bias is compared. Early renders are more, for
/// their bias is told less well: 0.044 to 0.050 with three seeds, and factors of 2.3 to 3.9.
fn predicts(session: &Session) {
    for (scene, photons) in [("room_diffuse", 20_000), ("smoke_spot", 4000)] {
        let case = Case { session, scene, method: "ppt", photons };
        let mean = |passes: u32, seeds: Range<u32>| {
            let estimates: Vec<ErrorEstimate> =
                seeds.map(|seed| case.render(seed, passes).estimate).collect();
            let rms = |of: fn(&ErrorEstimate) -> f64| root_mean_square(estimates.iter().map(of));
            let (relative, noise, bias) = (rms(|e| e.relative), rms(|e| e.noise), rms(|e| e.bias));
            ErrorEstimate { relative, noise, bias, ..estimates[0] }
        };
        let (early, late) = (mean(32, 1..10), mean(128, 10..13));
        let factor = early.passes_factor(late.relative).unwrap();
        assert!((2.5..6.5).contains(&factor), "{scene}: {factor} instead of 4");
    }
}

#[test]
fn estimates_cover_the_truth_as_often_as_they_claim() {
    check(&["ppt"], &[4000], 6);
}

#[test]
#[ignore = "long: just calibration"]
fn estimates_of_all_methods_cover_the_truth_as_often_as_they_claim() {
    check(&METHODS, &[4000, 40_000], 12);
}
