//! Runs a comparison, and tells the user what came of it.

use super::contestants::{Contestant, Ours, Own, Preparation};
use super::job::{CompareError, CompareJob, PerPass};
use super::own::Stream;
use super::reference::{self, Subject};
use super::schedule::{take_turns, Lane};
use crate::cli::failure::Failure;
use crate::cli::interrupt::Interrupt;
use crate::cli::{memory, print_result, say, text};
use anyhow::{anyhow, Context, Result};
use vpt::host::session::{LoadedScene, Session};
use vpt::method::{Method, Parameters};
use vpt::report::html::Pictures;
use vpt::report::metrics::Judge;
use vpt::report::results::{self, Comparison, Reference};
use vpt::report::summary::summarize;
use vpt::report::table::table;
use vpt::scene::{PathLimits, Scene};

/// Share of the time that one render of Mitsuba's should take, at least and at most so many seconds.
const SLICE: f64 = 0.01;
const SLICE_BOUNDS: [f64; 2] = [0.05, 2.0];

/// Mitsuba's integrators that light passes through media as if they were not there.
const BLIND_TO_MEDIA: [&str; 4] = ["path", "ptracer", "direct", "depth"];

/// One that takes part.
enum Entry {
    Ours(Parameters),
    Own { name: String, limits: PathLimits },
}

/// Everything that a comparison works with once the scene was loaded and checked.
struct Field<'a> {
    job: &'a CompareJob,
    session: &'a Session,
    scene: &'a LoadedScene<'a>,
    size: [u32; 2],
    entries: Vec<Entry>,
}

pub fn run(job: &CompareJob) -> Result<(), Failure> {
    let session =
        Session::start(job.variant.as_deref(), None, job.verbosity).map_err(Failure::failed)?;
    let quiet = job.quiet;
    let interrupt = Interrupt::listen(move || {
        tell(
            quiet,
            "stopping after this step, to write the report; Ctrl-C again aborts without one",
        );
    });
    let interrupt = interrupt.context("cannot listen for Ctrl-C").map_err(Failure::failed)?;
    measure(&session, job, &interrupt).map(drop)
}

/// Loads, checks, renders, measures, writes. Nothing is rendered before everything that can be checked was checked.
pub fn measure(
    session: &Session,
    job: &CompareJob,
    interrupt: &Interrupt,
) -> Result<Comparison, Failure> {
    let scene = session.load(&job.scene).map_err(Failure::bad_input)?;
    crate::cli::job::check_sensor(job.sensor, scene.sensor_count(), &job.scene.path)
        .map_err(Failure::bad_input)?;
    let size = scene.film_size(job.sensor);
    job.check_reference(size).map_err(Failure::bad_input)?;
    let parameters = scene.parameters(job.sensor).map_err(Failure::bad_input)?;
    let entries = job.methods.iter().map(|name| entry(name, session, &parameters, job.per_pass));
    let entries = entries.collect::<Result<_>>().map_err(Failure::bad_input)?;
    let field = Field { job, session, scene: &scene, size, entries };
    compete(&field, parameters.limits, interrupt)
}

/// Finds out what a name means; a method of vpt takes the scene's parameters, an integrator its limits.
fn entry(
    name: &str,
    session: &Session,
    scene: &Parameters,
    per_pass: Option<PerPass>,
) -> Result<Entry> {
    let Ok(method) = name.parse::<Method>() else {
        if name == "vpt" || !session.knows_integrator(name) {
            return Err(CompareError::unknown_method(name).into());
        }
        let usable = session.integrator(name, scene.limits);
        usable.with_context(|| {
            format!("Mitsuba's integrator \"{name}\" cannot be compared; leave it out of --methods")
        })?;
        return Ok(Entry::Own { name: name.to_owned(), limits: scene.limits });
    };
    // The scene may say how photons are shot for its own method; others shoot as their names have it.
    let shooting = scene.shooting.filter(|_| scene.method == method);
    let photons = per_pass.map_or(scene.photons, |per_pass| per_pass.of(method));
    let parameters = Parameters { method, shooting, photons, timeout: None, ..scene.clone() };
    parameters.validate()?;
    Ok(Entry::Ours(parameters))
}

impl Entry {
    fn name(&self) -> &str {
        match self {
            Entry::Ours(parameters) => parameters.method.name(),
            Entry::Own { name, .. } => name,
        }
    }

    /// Why its picture is not that of the scene.
    fn flaw(&self, has_media: bool) -> Option<String> {
        let blind = has_media && BLIND_TO_MEDIA.contains(&self.name());
        blind.then(|| "it does not see the scene's media, so its error never vanishes".to_owned())
    }
}

fn compete(
    field: &Field,
    limits: PathLimits,
    interrupt: &Interrupt,
) -> Result<Comparison, Failure> {
    let job = field.job;
    job.folder.make().map_err(Failure::failed)?;
    let tell = |line: &str| tell(job.quiet, line);
    announce(field, tell);

    let media = field.scene.lend(job.sensor).map_err(Failure::failed)?;
    let media = media.scene().description().media.clone();
    let Field { session, scene, size, .. } = *field;
    let subject = Subject { session, scene, size, media: &media, limits };
    let obtained = reference::obtain(job, &subject, interrupt, tell).map_err(Failure::failed)?;
    let Some((picture, reference)) = obtained else { return Err(nothing_measured()) };
    let judge = Judge::new(picture);

    let mut results = blank(field, reference, !media.is_empty());
    let mut pictures = Vec::new();
    for seed in 0..job.seeds {
        let shown = race(field, seed, &judge, interrupt, &mut results, tell);
        let shown = shown.map_err(Failure::failed)?;
        if seed == 0 {
            pictures = shown;
        }
        if interrupt.requested() {
            break;
        }
    }
    results.interrupted = interrupt.requested();
    results.peak_memory_bytes = results.peak_memory_bytes.max(memory::peak());
    results.notes.extend(slow_steps(&results));
    if results.methods.iter().all(|method| method.runs.is_empty()) {
        return Err(nothing_measured());
    }
    conclude(job, &results, Pictures { reference: judge.reference().clone(), methods: pictures })?;
    Ok(results)
}

/// Says a line unless the user wants quiet.
fn tell(quiet: bool, line: &str) {
    if !quiet {
        say(line);
    }
}

fn nothing_measured() -> Failure {
    Failure::aborted(anyhow!(
        "stopped by Ctrl-C before any method was measured, so there is no report"
    ))
}

fn announce(field: &Field, tell: impl Fn(&str)) {
    let Field { job, size: [width, height], .. } = field;
    for note in field.scene.notes().iter().filter(|_| job.verbosity > 0) {
        tell(&format!("note: {note}"));
    }
    let (methods, seeds) = (job.methods.len(), job.seeds);
    let total = methods as f64 * f64::from(seeds) * job.time;
    tell(&format!(
        "comparing {methods} methods on \"{}\", {width} x {height} pixels, with {}: {} in all, without the \
         reference",
        job.scene.path.display(),
        field.session.variant(),
        text::seconds(total)
    ));
}

/// The results before anything was measured.
fn blank(field: &Field, reference: Reference, has_media: bool) -> Comparison {
    let methods = field.entries.iter().map(|entry| results::Method {
        name: entry.name().to_owned(),
        ours: matches!(entry, Entry::Ours(_)),
        flaw: entry.flaw(has_media),
        runs: Vec::new(),
    });
    Comparison {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        scene: field.job.scene.path.display().to_string(),
        variant: field.session.variant().to_owned(),
        film_size: field.size,
        seconds: field.job.time,
        seeds: field.job.seeds,
        interrupted: false,
        peak_memory_bytes: memory::peak(),
        reference,
        methods: methods.collect(),
        notes: Vec::new(),
    }
}

/// All entries side by side with one seed. Adds their runs to the results and returns their pictures.
fn race(
    field: &Field,
    seed: u32,
    judge: &Judge,
    interrupt: &Interrupt,
    results: &mut Comparison,
    tell: impl Fn(&str),
) -> Result<Vec<Option<vpt::report::picture::Picture>>> {
    let job = field.job;
    let preparations = prepare(field, seed)?;
    let mut lanes = Vec::new();
    for (entry, preparation) in field.entries.iter().zip(&preparations) {
        lanes.push(lane(field, entry, preparation.as_ref(), seed)?);
    }
    let total = job.time * lanes.len() as f64;
    let mut tenths = 0;
    take_turns(&mut lanes, job.time, judge, interrupt, |used| {
        let now = (10.0 * used / total) as u32;
        if now > tenths {
            tenths = now;
            let of = job.seeds;
            tell(&format!(
                "seed {} of {of}: {} of {}",
                seed + 1,
                text::seconds(used),
                text::seconds(total)
            ));
        }
    })?;
    let mut pictures = Vec::new();
    for (lane, method) in lanes.into_iter().zip(&mut results.methods) {
        let (run, picture) = lane.finish()?;
        if picture.is_some() {
            results.peak_memory_bytes = results.peak_memory_bytes.max(run.peak_memory_bytes);
            method.runs.push(run);
        }
        pictures.push(picture);
    }
    Ok(pictures)
}

/// Lends the scene to each of vpt's methods; None for Mitsuba's integrators.
fn prepare<'a>(field: &'a Field, seed: u32) -> Result<Vec<Option<Preparation<'a>>>> {
    let prepared = field.entries.iter().map(|entry| match entry {
        Entry::Ours(parameters) => {
            let parameters = Parameters { seed: seed.into(), ..parameters.clone() };
            Preparation::new(field.scene, field.job.sensor, parameters).map(Some)
        }
        Entry::Own { .. } => Ok(None),
    });
    prepared.collect()
}

fn lane<'a>(
    field: &'a Field,
    entry: &Entry,
    preparation: Option<&'a Preparation<'a>>,
    seed: u32,
) -> Result<Lane<'a>> {
    let (size, sensor) = (field.size, field.job.sensor);
    let (contestant, spent): (Box<dyn Contestant + 'a>, f64) = match (entry, preparation) {
        (_, Some(preparation)) => (Box::new(Ours::new(preparation, size)), preparation.seconds),
        (entry, None) => {
            let [least, most] = SLICE_BOUNDS;
            let slice = (SLICE * field.job.time).clamp(least, most);
            let Entry::Own { name, limits } = entry else {
                unreachable!("vpt's methods are prepared")
            };
            let integrator = field.session.integrator(name, *limits)?;
            let stream = Stream::new(field.scene, integrator, sensor, seed, slice);
            (Box::new(Own::new(stream, size)), 0.0)
        }
    };
    Ok(Lane::new(contestant, seed, spent))
}

/// Methods whose very first step took longer than they had.
fn slow_steps(results: &Comparison) -> Vec<String> {
    let first = |method: &results::Method| Some(method.runs.first()?.snapshots.first()?.seconds);
    let slow = results.methods.iter().filter_map(|method| {
        let seconds = first(method).filter(|&seconds| seconds > results.seconds)?;
        Some(format!(
            "the first pass of {} took {}, more than the {} it had; allow more with --time",
            method.name,
            text::seconds(seconds),
            text::seconds(results.seconds)
        ))
    });
    slow.collect()
}

fn conclude(job: &CompareJob, results: &Comparison, pictures: Pictures) -> Result<(), Failure> {
    job.folder.fill(results, &pictures).map_err(Failure::failed)?;
    for note in &results.notes {
        say(&format!("warning: {note}"));
    }
    if results.interrupted && !job.quiet {
        say("note: stopped by Ctrl-C; the report holds what was measured until then");
    }
    if job.quiet {
        return Ok(());
    }
    print_result(&table(results, &summarize(results)))?;
    print_result(&format!("wrote \"{}\"", job.folder.path().join("report.html").display()))
}
