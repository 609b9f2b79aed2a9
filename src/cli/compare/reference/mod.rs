//! The picture that errors are measured against: a file, one kept from an earlier comparison, or one that is rendered
//! now, by whom a short trial speaks for ([`choice`]), as a [`pair`] of halves that tell its noise.

mod choice;
mod pair;

use super::job::CompareJob;
use super::meaning::{Ground, Meaning};
use super::scene_files::Hash;
use crate::cli::interrupt::Interrupt;
use crate::cli::target::Target;
use anyhow::Result;
use choice::{choose, Chosen, Trial};
use pair::{prepare, Pair};
use std::path::Path;
use vpt::method::{Method, Parameters, Shooting};
use vpt::report::halves::squared_difference;
use vpt::report::picture::Picture;
use vpt::report::results::Reference;
use vpt::scene::{Medium, PathLimits, UNBOUNDED_DEPTH};

/// `volpathmis` with Russian roulette is 0.7 to 1.7 % dark in closed rooms (docs/ARCHITECTURE.md): where depth has no
/// bound, the roulette begins late.
const LATE_ROULETTE: u32 = 64;

/// Share of the reference's time that each candidate is tried for.
const TRIAL: f64 = 0.1;

/// What decides about the reference.
pub struct Subject<'a> {
    pub ground: Ground<'a>,
    /// [`super::scene_files::hash`]
    pub scene_hash: u64,
    pub media: &'a [Medium],
    /// The scene's, for any method.
    pub parameters: Parameters,
}

/// One that may render the reference.
struct Candidate {
    /// As messages and the report have it, with what is not the scene's.
    name: String,
    meaning: Meaning,
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
        let mean = picture.mean();
        let reference = Reference { origin, mean, noise: None, bias: None, estimator: None };
        return Ok(Some((picture.clone(), reference)));
    }
    let name = format!("reference-{:016x}", fingerprint(job, subject));
    let exr = job.folder.path().join(format!("{name}.exr"));
    let json = job.folder.path().join(format!("{name}.json"));
    if let Some(kept) = read_kept(&exr, &json) {
        say(&format!("taking the reference from \"{}\"", exr.display()));
        return Ok(Some(kept));
    }
    let Some((picture, reference)) = render(job, subject, interrupt, say)? else {
        return Ok(None);
    };
    Target::check(exr)?.replace(|aside| Ok(picture.write_exr(aside)?))?;
    let text = serde_json::to_string_pretty(&reference)? + "\n";
    Target::check(json)?.replace(|aside| Ok(std::fs::write(aside, text)?))?;
    Ok(Some((picture, reference)))
}

fn read_kept(exr: &Path, json: &Path) -> Option<(Picture, Reference)> {
    let reference = serde_json::from_str(&std::fs::read_to_string(json).ok()?).ok()?;
    Some((Picture::read_exr(exr).ok()?, reference))
}

fn render(
    job: &CompareJob,
    subject: &Subject,
    interrupt: &Interrupt,
    say: impl Fn(&str),
) -> Result<Option<(Picture, Reference)>> {
    let (named, seconds) = (job.reference_method.as_deref(), job.reference_time);
    let first = match named {
        Some(name) => Candidate::named(name, subject)?,
        None => Candidate::named(integrator_for(subject.media), subject)?,
    };
    let preparations = prepare(&first.meaning, &subject.ground)?;
    let pair = Pair::new(&first.meaning, &subject.ground, &preparations, seconds)?;
    if named.is_some() {
        return finish(&first, pair, String::new(), job, interrupt, say);
    }
    let second = Candidate::photons(subject);
    say(&format!(
        "trying who shall render the reference: {} and {}, {:.1} s each",
        first.name,
        second.name,
        TRIAL * seconds
    ));
    let preparations = prepare(&second.meaning, &subject.ground)?;
    let mut pairs = [pair, Pair::new(&second.meaning, &subject.ground, &preparations, seconds)?];
    let names = [first.name.as_str(), second.name.as_str()];
    let Some((chosen, reason)) = try_out(names, &mut pairs, seconds, interrupt)? else {
        return Ok(None);
    };
    let reason = format!("; chosen by a trial, in which {reason}");
    let [mitsuba, ours] = pairs;
    match chosen {
        Chosen::Mitsuba => finish(&first, mitsuba, reason, job, interrupt, say),
        Chosen::Ours => finish(&second, ours, reason, job, interrupt, say),
    }
}

/// Gives both candidates a short time, Mitsuba's first, and judges them; None where the user stopped it. `seconds` is the
/// time of the whole reference.
fn try_out(
    names: [&str; 2],
    pairs: &mut [Pair; 2],
    seconds: f64,
    interrupt: &Interrupt,
) -> Result<Option<(Chosen, String)>> {
    for pair in pairs.iter_mut() {
        if !pair.go_on(TRIAL * seconds, interrupt)? {
            return Ok(None);
        }
        // One pass tells no bias; a second is worth it unless passes are very long.
        let more = !pair.tells_bias() && pair.seconds < 0.5 * seconds;
        if more && !pair.go_on(0.0, interrupt)? {
            return Ok(None);
        }
    }
    let shown = [pairs[0].show()?, pairs[1].show()?];
    // The smoother picture, so that no weight comes from noise.
    let scale = shown[1].mean();
    let trial = |index: usize| Trial {
        name: names[index].to_owned(),
        noise: shown[index].noise_relative_to(&scale),
        bias: pairs[index].bias(&shown[index], &scale),
        brightness: shown[index].mean().brightness(),
    };
    let apart = squared_difference(&shown[0], &shown[1], &scale);
    Ok(Some(choose(&trial(0), &trial(1), apart)))
}

/// Renders until the time is over; None where the user stopped it.
fn finish(
    candidate: &Candidate,
    mut pair: Pair,
    reason: String,
    job: &CompareJob,
    interrupt: &Interrupt,
    say: impl Fn(&str),
) -> Result<Option<(Picture, Reference)>> {
    say(&format!(
        "rendering the reference with {} for {} s{reason}",
        candidate.name, job.reference_time
    ));
    if !pair.go_on(job.reference_time, interrupt)? {
        return Ok(None);
    }
    let halves = pair.show()?;
    let picture = halves.mean();
    let ours = matches!(candidate.meaning, Meaning::Ours(_));
    let unit = if ours { "passes" } else { "samples per pixel" };
    let (seconds, work) = (pair.seconds, pair.work());
    let reference = Reference {
        origin: format!("rendered by {} in {seconds:.1} s, {work} {unit}{reason}", candidate.name),
        mean: picture.mean(),
        noise: Some(halves.noise()),
        bias: pair.bias(&halves, &picture).filter(|_| ours),
        estimator: Some(candidate.meaning.name().to_owned()),
    };
    Ok(Some((picture, reference)))
}

impl Candidate {
    /// The method or integrator of this name, `volpathmis` with a late roulette.
    fn named(name: &str, subject: &Subject) -> Result<Self> {
        let mut meaning = Meaning::find(name, subject.ground.session, &subject.parameters)?;
        let mut shown = name.to_owned();
        if let Meaning::Own { integrator, limits } = &mut meaning {
            if integrator == "volpathmis" {
                limits.rr_depth = late_roulette(limits);
                shown = format!("volpathmis (rr_depth {})", limits.rr_depth);
            }
        }
        Ok(Candidate { name: shown, meaning })
    }

    /// vpt's own, without a bias in the limit, by chains where light is hard to find.
    fn photons(subject: &Subject) -> Self {
        let parameters = Parameters {
            method: Method::Ppt,
            shooting: Some(Shooting::Auto),
            timeout: None,
            ..subject.parameters.clone()
        };
        Candidate { name: "ppt (shooting auto)".to_owned(), meaning: Meaning::Ours(parameters) }
    }
}

/// Mitsuba's integrator that is right for the media: `volpath` has no use where extinction is coloured.
fn integrator_for(media: &[Medium]) -> &'static str {
    match media {
        [] => "path",
        media if media.iter().all(|medium| medium.grey) => "volpath",
        _ => "volpathmis",
    }
}

fn late_roulette(limits: &PathLimits) -> u32 {
    match limits.max_depth {
        UNBOUNDED_DEPTH => limits.rr_depth.max(LATE_ROULETTE),
        depth => limits.rr_depth.max(depth.saturating_add(1)),
    }
}

/// Tells references apart: the scene's files and everything else that changes the picture or how good it is.
fn fingerprint(job: &CompareJob, subject: &Subject) -> u64 {
    let Subject { ground, scene_hash, parameters, .. } = subject;
    let by = job.reference_method.as_deref().unwrap_or("auto");
    let of_ours = match by.parse::<Method>().is_ok() || by == "auto" {
        true => format!("{} {parameters:?}", env!("CARGO_PKG_VERSION")),
        false => format!("{:?}", parameters.limits),
    };
    let (variant, seconds) = (ground.session.variant(), job.reference_time);
    let all = format!(
        "{scene_hash:x} {:?} {:?} {} {variant} {by} {seconds} {of_ours}",
        job.scene.defines, ground.size, ground.sensor
    );
    let mut hash = Hash::default();
    hash.add(all.as_bytes());
    hash.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roulette_begins_beyond_the_depth() {
        let late = |max_depth, rr_depth| {
            late_roulette(&PathLimits { max_depth, rr_depth, hide_emitters: false })
        };
        assert_eq!((late(8, 5), late(8, 20)), (9, 20));
        assert_eq!(late(UNBOUNDED_DEPTH, 5), LATE_ROULETTE);
    }
}
