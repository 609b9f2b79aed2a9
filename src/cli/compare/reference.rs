//! The picture that errors are measured against: a file, one kept from an earlier comparison, or one that Mitsuba
//! renders now.

use super::job::CompareJob;
use super::own::{Mean, Stream};
use crate::cli::interrupt::Interrupt;
use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::time::Instant;
use vpt::host::session::{LoadedScene, Session};
use vpt::report::metrics::{rmse, Judge};
use vpt::report::picture::Picture;
use vpt::report::results::{Noise, Reference};
use vpt::scene::{Medium, PathLimits, UNBOUNDED_DEPTH};

/// `volpathmis` with Russian roulette is 0.7 to 1.7 % dark in closed rooms (docs/ARCHITECTURE.md): where depth has no
/// bound, the roulette begins late.
const LATE_ROULETTE: u32 = 64;

/// What decides about the reference.
pub struct Subject<'a> {
    pub session: &'a Session,
    pub scene: &'a LoadedScene<'a>,
    pub size: [u32; 2],
    pub media: &'a [Medium],
    pub limits: PathLimits,
}

/// What is kept beside a rendered reference.
#[derive(Debug, Serialize, Deserialize)]
struct Kept {
    integrator: String,
    seconds: f64,
    spp: f64,
    noise: Noise,
}

/// The reference and what is known of it; None where the user stopped it.
pub fn obtain(
    job: &CompareJob,
    subject: &Subject,
    interrupt: &Interrupt,
    say: impl Fn(&str),
) -> Result<Option<(Picture, Reference)>> {
    if let Some((path, picture)) = &job.reference {
        let origin = format!("the file \"{}\"", path.display());
        let reference = Reference { origin, mean: picture.mean(), noise: None };
        return Ok(Some((picture.clone(), reference)));
    }
    let name = format!("reference-{:016x}", fingerprint(job, subject)?);
    let (exr, json) = (job.folder.path().join(format!("{name}.exr")), format!("{name}.json"));
    let json = job.folder.path().join(json);
    if let Some((picture, kept)) = read_kept(&exr, &json) {
        say(&format!("taking the reference from \"{}\"", exr.display()));
        return Ok(Some(described(picture, &kept)));
    }
    let integrator = integrator_for(subject.media);
    say(&format!("rendering the reference with {integrator} for {} s", job.reference_time));
    let Some((picture, kept)) = render(job, subject, integrator, interrupt)? else {
        return Ok(None);
    };
    picture.write_exr(&exr)?;
    std::fs::write(&json, serde_json::to_string_pretty(&kept)? + "\n")
        .with_context(|| format!("cannot write \"{}\"", json.display()))?;
    Ok(Some(described(picture, &kept)))
}

fn described(picture: Picture, kept: &Kept) -> (Picture, Reference) {
    let Kept { integrator, seconds, spp, noise } = kept;
    let origin = format!("rendered by {integrator} in {seconds:.1} s, {spp} samples per pixel");
    let reference = Reference { origin, mean: picture.mean(), noise: Some(*noise) };
    (picture, reference)
}

fn read_kept(exr: &Path, json: &Path) -> Option<(Picture, Kept)> {
    let kept = serde_json::from_str(&std::fs::read_to_string(json).ok()?).ok()?;
    Some((Picture::read_exr(exr).ok()?, kept))
}

/// Mitsuba's integrator that is right for the media: `volpath` has no use where extinction is coloured.
fn integrator_for(media: &[Medium]) -> &'static str {
    match media {
        [] => "path",
        media if media.iter().all(|medium| medium.grey) => "volpath",
        _ => "volpathmis",
    }
}

/// Renders two halves by turns; their difference tells the noise of their mean.
fn render(
    job: &CompareJob,
    subject: &Subject,
    name: &str,
    interrupt: &Interrupt,
) -> Result<Option<(Picture, Kept)>> {
    let Subject { session, scene, size, mut limits, .. } = *subject;
    if name == "volpathmis" {
        limits.rr_depth = match limits.max_depth {
            UNBOUNDED_DEPTH => limits.rr_depth.max(LATE_ROULETTE),
            depth => limits.rr_depth.max(depth.saturating_add(1)),
        };
    }
    let pixels = size[0] as usize * size[1] as usize;
    let clock = Instant::now();
    let mut halves = [0u32, 1].map(|half| -> Result<(Stream, Mean)> {
        let integrator = session.integrator(name, limits)?;
        // Seeds far from those of the contestants.
        let seed = u32::MAX - half;
        let slice = job.reference_time / 100.0;
        Ok((Stream::new(scene, integrator, job.sensor, seed, slice), Mean::new(pixels)))
    });
    loop {
        for half in &mut halves {
            let (stream, mean) = half.as_mut().map_err(|error| anyhow::anyhow!("{error}"))?;
            stream.advance(mean)?;
        }
        if interrupt.requested() {
            return Ok(None);
        }
        if clock.elapsed().as_secs_f64() >= job.reference_time {
            break;
        }
    }
    let [a, b] = halves.map(|half| half.map(|(_, mean)| mean));
    let (a, b) = (a?, b?);
    let both = a.with(&b);
    let picture = both.picture(size);
    let noise = noise(&a.picture(size), &b.picture(size), &picture);
    let (seconds, spp) = (clock.elapsed().as_secs_f64(), both.weight());
    Ok(Some((picture, Kept { integrator: name.to_owned(), seconds, spp, noise })))
}

/// The mean of two independent halves has half of their difference as its standard error.
fn noise(a: &Picture, b: &Picture, mean: &Picture) -> Noise {
    let judge = Judge::new(mean.clone());
    let halved = Picture {
        pixels: (a.pixels.iter().zip(&b.pixels).zip(&mean.pixels))
            .map(|((a, b), m)| [0, 1, 2].map(|c| m[c] + 0.5 * (a[c] - b[c])))
            .collect(),
        ..*mean
    };
    Noise { rmse: rmse(&halved, mean), relative_mse: judge.relative_mse(&halved) }
}

/// Tells references apart: the scene's text and everything that changes its picture. What the scene file includes
/// is not looked at.
fn fingerprint(job: &CompareJob, subject: &Subject) -> Result<u64> {
    let text = std::fs::read(&job.scene.path)?;
    let PathLimits { max_depth, rr_depth, hide_emitters } = subject.limits;
    let rest = format!(
        "{:?} {:?} {} {} {max_depth} {rr_depth} {hide_emitters} {}",
        job.scene.defines,
        subject.size,
        job.sensor,
        subject.session.variant(),
        job.reference_time
    );
    Ok(fnv1a(text.iter().chain(rest.as_bytes())))
}

/// [Fowler, Noll & Vo]
fn fnv1a<'a>(bytes: impl Iterator<Item = &'a u8>) -> u64 {
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, &byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_of_the_mean_is_half_the_difference_of_the_halves() {
        let grey = |value: f32| Picture::from_fn(3, 2, |_, _| [value; 3]);
        let noise = noise(&grey(1.2), &grey(0.8), &grey(1.0));
        assert!((noise.rmse - 0.2).abs() < 1e-6);
        assert!((noise.relative_mse - 0.04 / 1.01).abs() < 1e-6);
    }

    #[test]
    fn hash_is_that_of_the_published_vectors() {
        assert_eq!(fnv1a(b"".iter()), 0xcbf2_9ce4_8422_2325);
        assert_eq!(fnv1a(b"foobar".iter()), 0x8594_4171_f739_67e8);
    }
}
