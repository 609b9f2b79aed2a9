//! Renders a scene by a method and by Mitsuba, and judges whether they mean the same picture.

use std::path::Path;

use vpt::host::session::{LoadedScene, SceneFile, Session};
use vpt::method::{Method, Silent};
use vpt::scene::{PathLimits, UNBOUNDED_DEPTH};

use super::image::Image;
use super::scene::Scene;
use super::stats::{Comparison, Estimate, Verdict, DARK};
use super::xml::FILM;

/// As in `tests/agreement.rs`.
const IMAGE_BOUND: f64 = 0.005;
const BLOCK_BOUND: f64 = 0.02;
/// Pixels squared.
const BLOCK: usize = 4;
const BLOCKS: usize = (FILM / BLOCK) * (FILM / BLOCK);
const FALSE_ALARM: f64 = 1e-3;
/// A picture in which a larger error could hide is undecided.
const DETECTABLE_IMAGE: f64 = 0.1;
const DETECTABLE_BLOCK: f64 = 0.4;
/// Chains share walks, receivers and radii with the methods that shoot uniformly. What is theirs, the
/// normalisation, shows in the whole image: half the precision will do.
const CHAINS: f64 = 2.0;
/// By how much a block of the same photons may differ: a pair at the very edge of a kernel is in or out by
/// rounding.
const SAME: f64 = 0.02;

const SURFACE_RADIUS: f32 = 0.04;
const MEDIUM_RADIUS: f32 = 0.04;
/// Scenes that take `volpathmis` have bounded paths.
const NO_ROULETTE: u32 = 64;

/// How long is rendered before one gives up.
#[derive(Clone, Copy, PartialEq)]
pub struct Effort {
    first_seeds: u32,
    most_seeds: u32,
    spp: u32,
    passes: u32,
    /// Walks per pass.
    photons: u32,
}

impl Effort {
    pub const SHORT: Effort =
        Effort { first_seeds: 12, most_seeds: 24, spp: 128, passes: 2, photons: 6000 };
    pub const LONG: Effort = Effort { most_seeds: 192, ..Effort::SHORT };
    /// Before a disagreement is believed: means of few heavy-tailed values are not normal.
    const CERTAIN: Effort =
        Effort { first_seeds: 32, most_seeds: 64, spp: 512, passes: 4, photons: 12_000 };
    /// Of `CERTAIN`'s seeds, which are others.
    const CERTAIN_SEED: u32 = 1_000_000;
}

/// How photons leave lamps: photon maps know nothing of where photons are seen.
#[derive(Clone, Copy, PartialEq)]
enum Emission {
    Guided,
    Even,
}

/// What all scenes of a run have in common.
#[derive(Clone, Copy)]
pub struct Run {
    pub effort: Effort,
    pub levels: Levels,
}

/// The levels at which one test rejects, such that all tests of a run keep `FALSE_ALARM` together, half of
/// it for images and half for blocks (Bonferroni).
#[derive(Clone, Copy)]
pub struct Levels {
    image: f64,
    block: f64,
}

impl Levels {
    pub fn new(pictures: usize) -> Self {
        let half = 0.5 * FALSE_ALARM / (3 * pictures) as f64;
        Levels { image: half, block: half / BLOCKS as f64 }
    }
}

pub struct Judgement {
    pub method: Method,
    pub ruling: Ruling,
    /// Of the least believable colour of the image.
    pub deviation: f64,
    pub pictures: usize,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Ruling {
    Agrees,
    Undecided,
    Disagrees(String),
}

/// A picture of each side, for looking at.
pub struct Evidence {
    pub expected: Image,
    pub actual: Image,
}

impl Evidence {
    /// As EXR files.
    pub fn write(&self, folder: &Path) -> Result<(), String> {
        let difference = Image::from_fn(FILM, FILM, |x, y| {
            let i = y * FILM + x;
            [0, 1, 2].map(|c| self.actual.pixels[i][c] - self.expected.pixels[i][c])
        });
        self.expected.write_exr(&folder.join("expected.exr"))?;
        self.actual.write_exr(&folder.join("actual.exr"))?;
        difference.write_exr(&folder.join("difference.exr"))
    }
}

/// A scene on disk, with Mitsuba's pictures of it, to which methods are held.
pub struct Judge<'a> {
    session: &'a Session,
    folder: &'a Path,
    scene: &'a Scene,
    run: Run,
    expected: Vec<Image>,
}

impl<'a> Judge<'a> {
    pub fn new(
        session: &'a Session,
        folder: &'a Path,
        scene: &'a Scene,
        run: Run,
    ) -> Result<Self, String> {
        let mut judge = Judge { session, folder, scene, run, expected: Vec::new() };
        judge.expected = judge.reference(run.effort, 0)?;
        Ok(judge)
    }

    pub fn judge(&self, method: Method) -> Result<Judgement, String> {
        match method {
            Method::Apa => self.hold_to_twin(method, Method::Ppt),
            Method::Ppb => self.hold_to_twin(method, Method::Ppbt),
            Method::Ppt | Method::Ppbt | Method::PptMetro | Method::PpbtMetro => {
                self.hold_to_mitsuba(method)
            }
        }
    }

    /// Photon maps and beam hierarchies find the pairs that trees of the view find: with new view rays in
    /// every pass the pictures of one seed and of the same emission are the same.
    fn hold_to_twin(&self, method: Method, twin: Method) -> Result<Judgement, String> {
        let one = Effort { first_seeds: 1, most_seeds: 1, ..self.run.effort };
        let [actual, expected] = [method, twin]
            .map(|method| self.render(method, Emission::Even, one, 0, &self.expected));
        let [actual, expected] = [actual?, expected?].map(|p| p[0].value.block_means(BLOCK));
        let bright = expected.iter().flatten().copied().fold(0.0, f64::max);
        let pairs = || actual.iter().flatten().zip(expected.iter().flatten());
        let worst = pairs()
            .map(|(actual, expected)| (actual - expected) / expected.abs().max(DARK * bright))
            .fold(0.0, |a: f64, b: f64| if a.abs() > b.abs() { a } else { b });
        let ruling = if worst.abs() > SAME {
            let off = 100.0 * worst;
            Ruling::Disagrees(format!("a block is off {}'s by {off:.1} %", twin.name()))
        } else {
            Ruling::Agrees
        };
        Ok(Judgement { method, ruling, deviation: worst, pictures: 1 })
    }

    /// A disagreement counts if it shows again at length, with other seeds on both sides.
    fn hold_to_mitsuba(&self, method: Method) -> Result<Judgement, String> {
        let usual = self.hold(method, self.run.effort, 0, &self.expected)?;
        if !matches!(usual.ruling, Ruling::Disagrees(_)) {
            return Ok(usual);
        }
        let expected = self.reference(Effort::CERTAIN, Effort::CERTAIN_SEED)?;
        self.hold(method, Effort::CERTAIN, Effort::CERTAIN_SEED, &expected)
    }

    /// Means of all pictures.
    pub fn evidence(&self, method: Method) -> Result<Evidence, String> {
        let actual = self.render(method, Emission::Guided, self.run.effort, 0, &self.expected)?;
        Ok(Evidence {
            expected: mean(self.expected.iter()),
            actual: mean(actual.iter().map(|picture| &picture.value)),
        })
    }

    /// `volpath` is exact for grey extinction, `volpathmis` for any as long as its roulette does not begin
    /// (`docs/ARCHITECTURE.md`).
    fn reference(&self, effort: Effort, first_seed: u32) -> Result<Vec<Image>, String> {
        let grey = self.scene.media().iter().all(|medium| medium.extinction.is_grey());
        let (name, rr_depth) = if grey { ("volpath", 5) } else { ("volpathmis", NO_ROULETTE) };
        let limits = PathLimits {
            max_depth: self.scene.max_depth.unwrap_or(UNBOUNDED_DEPTH),
            rr_depth,
            hide_emitters: self.scene.hide_emitters,
        };
        let loaded = self.load(Method::Ppt, Emission::Even, effort, 1.0)?;
        let integrator = self.session.integrator(name, limits).map_err(|e| e.to_string())?;
        collect(
            effort,
            |seed| {
                let picture = loaded.render_with(&integrator, 0, first_seed + seed, effort.spp);
                finite(&picture.map_err(|e| e.to_string())?.rgb)
            },
            |pictures| {
                let same: Vec<Image> = vec![mean(pictures.iter()); 2];
                let same: Vec<Picture> = same.into_iter().map(Picture::exact).collect();
                !self.is_noisy(&compare(&same, pictures), 0.5)
            },
        )
    }

    fn hold(
        &self,
        method: Method,
        effort: Effort,
        first_seed: u32,
        expected: &[Image],
    ) -> Result<Judgement, String> {
        let pictures = self.render(method, Emission::Guided, effort, first_seed, expected)?;
        let verdict = compare(&pictures, expected);
        let rejected = self.rejected(&verdict);
        let ruling = if let Some(fault) = rejected {
            Ruling::Disagrees(fault)
        } else if self.is_noisy(&verdict, precision(method)) {
            Ruling::Undecided
        } else {
            Ruling::Agrees
        };
        let deviation = Verdict::worst(&verdict.image).deviation;
        Ok(Judgement { method, ruling, deviation, pictures: pictures.len() })
    }

    fn render(
        &self,
        method: Method,
        emission: Emission,
        effort: Effort,
        first_seed: u32,
        expected: &[Image],
    ) -> Result<Vec<Picture>, String> {
        let mut narrow = self.load(method, emission, effort, 1.0)?;
        let mut wide = self.load(method, emission, effort, 2.0)?;
        let picture = |scene: &mut LoadedScene, seed| {
            scene.render(0, seed, Some(effort.passes), &mut Silent).map_err(|e| e.to_string())?;
            finite(&scene.read_rgb().map_err(|e| e.to_string())?)
        };
        collect(
            effort,
            |seed| {
                let seed = first_seed + seed;
                Ok(Picture::extrapolated(&picture(&mut narrow, seed)?, &picture(&mut wide, seed)?))
            },
            |pictures| !self.is_noisy(&compare(pictures, expected), precision(method)),
        )
    }

    fn load(
        &self,
        method: Method,
        emission: Emission,
        effort: Effort,
        scale: f32,
    ) -> Result<LoadedScene<'a>, String> {
        let settings = [
            ("photons", effort.photons.to_string()),
            ("guided_emission", (emission == Emission::Guided).to_string()),
            ("rr_depth", self.scene.rr_depth.to_string()),
            ("jitter_every", "1".to_owned()),
            ("estimate_error", "false".to_owned()),
            ("surface_radius", (scale * SURFACE_RADIUS).to_string()),
            ("medium_radius", (scale * MEDIUM_RADIUS).to_string()),
        ];
        let file = SceneFile {
            path: self.folder.join("scene.xml"),
            method: Some(method.name().to_owned()),
            settings: settings.map(|(name, value)| (name.to_owned(), value)).into(),
            ..SceneFile::default()
        };
        self.session.load(&file).map_err(|e| e.to_string())
    }

    /// Whether an error that must be seen could hide, in this share of what may.
    fn is_noisy(&self, verdict: &Verdict, share: f64) -> bool {
        verdict.detectable_in_image(self.run.levels.image) > share * DETECTABLE_IMAGE
            || verdict.detectable_in_median_block(self.run.levels.block) > share * DETECTABLE_BLOCK
    }

    fn rejected(&self, verdict: &Verdict) -> Option<String> {
        let image = Verdict::worst(&verdict.image);
        if image.rejected(self.run.levels.image) {
            return Some(format!(
                "the mean is off by {:.1} ± {:.1} %",
                100.0 * image.deviation,
                100.0 * image.error
            ));
        }
        let block = Verdict::worst(&verdict.blocks);
        block.rejected(self.run.levels.block).then(|| {
            format!(
                "a block is off by {:.1} ± {:.1} %",
                100.0 * block.deviation,
                100.0 * block.error
            )
        })
    }
}

/// The share of what may hide that does.
fn precision(method: Method) -> f64 {
    match method {
        Method::PptMetro | Method::PpbtMetro => CHAINS,
        Method::Ppt | Method::Ppbt | Method::Apa | Method::Ppb => 1.0,
    }
}

/// A picture whose bias was extrapolated, and by how much.
struct Picture {
    value: Image,
    correction: Image,
}

impl Picture {
    /// `I(R) = I(0) + a R + b R²` near edges, so `2 I(R) - I(2R) = I(0) - 2 b R²`.
    fn extrapolated(narrow: &Image, wide: &Image) -> Self {
        let combine = |a: f32, b: f32| {
            Image::from_fn(FILM, FILM, |x, y| {
                [0, 1, 2]
                    .map(|c| a * narrow.pixels[y * FILM + x][c] + b * wide.pixels[y * FILM + x][c])
            })
        };
        Picture { value: combine(2.0, -1.0), correction: combine(1.0, -1.0) }
    }

    fn exact(value: Image) -> Self {
        let correction = Image::from_fn(FILM, FILM, |_, _| [0.0; 3]);
        Picture { value, correction }
    }
}

fn collect<T>(
    effort: Effort,
    mut picture: impl FnMut(u32) -> Result<T, String>,
    are_enough: impl Fn(&[T]) -> bool,
) -> Result<Vec<T>, String> {
    let mut pictures = Vec::new();
    let mut wanted = effort.first_seeds;
    loop {
        for seed in pictures.len() as u32..wanted {
            pictures.push(picture(seed)?);
        }
        if wanted >= effort.most_seeds || are_enough(&pictures) {
            return Ok(pictures);
        }
        wanted = (2 * wanted).min(effort.most_seeds);
    }
}

/// What the extrapolation leaves is `2 b R²` of a correction of `a R + 3 b R²`: less than half of it as long
/// as the linear term outweighs the square one, `a > b R`. So much more than the bounds is allowed.
fn compare(actual: &[Picture], expected: &[Image]) -> Verdict {
    let level = mean(expected.iter()).mean();
    let bright = level.into_iter().fold(f64::MIN_POSITIVE, f64::max);
    let values = |region: &dyn Fn(&Image) -> f64| -> (Vec<f64>, f64, Vec<f64>) {
        let corrections = actual.iter().map(|p| region(&p.correction)).sum::<f64>();
        let actual_values = actual.iter().map(|p| region(&p.value)).collect();
        (actual_values, corrections / actual.len() as f64, expected.iter().map(region).collect())
    };
    let comparison = |region: &dyn Fn(&Image) -> f64, channel: usize, bound: f64| {
        let (actual, correction, expected) = values(region);
        let expected = Estimate::from_samples(&expected);
        // A channel or block may be all but black.
        let floor = DARK * level[channel].max(DARK * bright);
        let scale = expected.mean.max(floor);
        let bound = bound + 0.5 * correction.abs() / scale;
        Comparison::new(Estimate::from_samples(&actual), expected, scale, bound)
    };
    let image = (0..3).map(|c| comparison(&|image| image.mean()[c], c, IMAGE_BOUND));
    let blocks = (0..3 * BLOCKS).map(|i| {
        let (block, c) = (i / 3, i % 3);
        comparison(&|image| image.block_means(BLOCK)[block][c], c, BLOCK_BOUND)
    });
    Verdict { image: image.collect(), blocks: blocks.collect() }
}

fn mean<'a>(images: impl ExactSizeIterator<Item = &'a Image>) -> Image {
    let count = images.len() as f32;
    let mut sum = vec![[0.0; 3]; FILM * FILM];
    for image in images {
        for (sum, pixel) in sum.iter_mut().zip(&image.pixels) {
            *sum = [0, 1, 2].map(|c| sum[c] + pixel[c] / count);
        }
    }
    Image { width: FILM, height: FILM, pixels: sum }
}

fn finite(rgb: &[f32]) -> Result<Image, String> {
    if let Some(i) = rgb.iter().position(|value| !value.is_finite()) {
        return Err(format!("pixel {} is {}", i / 3, rgb[i]));
    }
    Ok(Image {
        width: FILM,
        height: FILM,
        pixels: rgb.chunks_exact(3).map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect(),
    })
}
