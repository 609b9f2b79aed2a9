//! Pictures of a case from independent seeds, rendered in this process.

use std::fs;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};

use vpt::host::session::{LoadedScene, SceneFile, Session};
use vpt::method::Silent;

use super::agreement_folder;
use super::cases::{Case, Method, FIRST_SEEDS, MORE_SEEDS, MOST_SEEDS, PASSES};
use super::image::Image;

/// Mitsuba, which has one variant per process. Tests of one binary run side by side: the lock keeps
/// them apart.
pub fn session(variant: &str) -> Result<MutexGuard<'static, Session>, String> {
    static SESSION: OnceLock<Result<Mutex<Session>, String>> = OnceLock::new();
    let start =
        || Session::start(Some(variant), None, 0).map(Mutex::new).map_err(|e| e.to_string());
    let session = SESSION.get_or_init(start).as_ref().map_err(Clone::clone)?;
    let session = session.lock().unwrap_or_else(PoisonError::into_inner);
    if session.variant() == variant {
        Ok(session)
    } else {
        Err(format!("this process already runs {}, {variant} needs another", session.variant()))
    }
}

/// One picture per seed, until there are enough.
pub fn render(
    session: &Session,
    case: &Case,
    method: &Method,
    folder: &Path,
    are_enough: impl Fn(&[Image]) -> bool,
) -> Result<Vec<Image>, String> {
    if folder.exists() {
        fs::remove_dir_all(folder).map_err(|e| e.to_string())?;
    }
    fs::create_dir_all(folder).map_err(|e| e.to_string())?;
    let file = folder.join("picture.exr");
    let load = |radius_scale| load(session, case, method, radius_scale);
    let mut narrow = load(1.0)?;
    let mut wide = if case.extrapolated { Some(load(2.0)?) } else { None };
    let picture = |scene: &mut LoadedScene, seed: u32| {
        scene.render(0, seed, Some(PASSES), &mut Silent).map_err(|e| e.to_string())?;
        scene.write(&file).map_err(|e| e.to_string())?;
        Image::read_exr(&file, "")
    };
    let mut one = |seed: u32| {
        let narrow = picture(&mut narrow, seed)?;
        Ok(match &mut wide {
            Some(wide) => extrapolate(&narrow, &picture(wide, seed)?),
            None => narrow,
        })
    };
    let mut pictures = Vec::new();
    let mut wanted = FIRST_SEEDS;
    loop {
        for seed in pictures.len() as u32..wanted {
            pictures.push(one(seed).map_err(|e: String| format!("seed {seed}: {e}"))?);
        }
        if wanted >= MOST_SEEDS || are_enough(&pictures) {
            return Ok(pictures);
        }
        wanted += MORE_SEEDS;
    }
}

fn load<'a>(
    session: &'a Session,
    case: &Case,
    method: &Method,
    radius_scale: f32,
) -> Result<LoadedScene<'a>, String> {
    let photons = (f64::from(case.photons) * method.photons).ceil();
    let settings = [
        ("photons", photons.to_string()),
        ("rr_depth", case.rr_depth.to_string()),
        ("surface_radius", (radius_scale * case.surface_radius).to_string()),
        ("medium_radius", (radius_scale * case.medium_radius).to_string()),
    ];
    // A jitter of every pass: with two, the colours of all pixels would be those of six wavelengths.
    let jitters: &[_] =
        if session.variant().ends_with("rgb") { &[] } else { &[("jitter_every", "1")] };
    let own =
        method.settings.iter().filter(|(name, _)| !jitters.iter().any(|(own, _)| own == name));
    let own = own.chain(jitters).map(|&(name, value)| (name.to_owned(), value.to_owned()));
    let file = SceneFile {
        path: agreement_folder("scenes").join(format!("{}.xml", case.scene)),
        method: Some(method.method.to_owned()),
        settings: settings
            .map(|(name, value)| (name.to_owned(), value))
            .into_iter()
            .chain(own)
            .collect(),
        ..SceneFile::default()
    };
    session.load(&file).map_err(|e| e.to_string())
}

/// Twice the picture of the case's radii minus that of twice the radii, from the same photons. Near
/// the edges of surfaces and media the kernel reaches over them, and what it misses grows with the
/// radius `R`: `I(R) = I(0) + a R + O(R²)`, so `2 I(R) - I(2R) = I(0) + O(R²)`.
fn extrapolate(narrow: &Image, wide: &Image) -> Image {
    Image::from_fn(narrow.width, narrow.height, |x, y| {
        let pixel = y * narrow.width + x;
        [0, 1, 2].map(|c| 2.0 * narrow.pixels[pixel][c] - wide.pixels[pixel][c])
    })
}
