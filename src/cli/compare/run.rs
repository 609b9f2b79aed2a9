//! Runs a comparison, and tells the user what came of it.

use super::contestants::Preparation;
use super::entry::Entry;
use super::job::CompareJob;
use super::ledger::Ledger;
use super::meaning::{Ground, Meaning};
use super::reference::{self, Subject};
use super::schedule::{take_turns, Lane};
use super::stage::Stage;
use super::{scene_files, settings};
use crate::cli::failure::Failure;
use crate::cli::interrupt::Interrupt;
use crate::cli::{memory, print_result, say, teller, text};
use anyhow::{anyhow, Context, Result};
use std::collections::BTreeMap;
use vpt::method::{Method, Parameters};
use vpt::report::metrics::Judge;
use vpt::report::results::{self, Comparison, Reference};
use vpt::report::summary::{noise_of_reference_matters, summarize};
use vpt::report::table::table;
use vpt::scene::Scene;

/// Everything that a comparison works with once the scene was loaded and checked.
struct Field<'a> {
    job: &'a CompareJob,
    ground: Ground<'a>,
    parameters: Parameters,
    entries: Vec<Entry>,
    scene_hash: u64,
    settings: BTreeMap<String, String>,
    /// An interrupted comparison to go on with.
    earlier: Option<Comparison>,
}

pub fn run(job: &CompareJob) -> Result<(), Failure> {
    let stage = Stage::open(job.variant.as_deref(), job.verbosity, job.quiet)?;
    measure(&stage, job)
}

/// Loads, checks, renders, measures, writes. Nothing is rendered before everything that can be checked was checked.
pub fn measure(stage: &Stage, job: &CompareJob) -> Result<(), Failure> {
    let session = &stage.session;
    let scene = session.load(&job.scene).map_err(Failure::bad_input)?;
    crate::cli::job::check_sensor(job.sensor, scene.sensor_count(), &job.scene.path)
        .map_err(Failure::bad_input)?;
    let size = scene.film_size(job.sensor);
    job.check_reference(size).map_err(Failure::bad_input)?;
    let ground = Ground { session, scene: &scene, sensor: job.sensor, size };
    let parameters = scene.parameters(job.sensor).map_err(Failure::bad_input)?;
    if let Some(name) = &job.reference_method {
        let found = Meaning::find(name, session, &parameters);
        found.context("--reference-method cannot be used").map_err(Failure::bad_input)?;
    }
    let scene_hash = scene_files::hash(&job.scene).context("cannot read the scene's files");
    let scene_hash = scene_hash.map_err(Failure::failed)?;
    let settings = settings::of(job, scene_hash).context("cannot read the reference");
    let settings = settings.map_err(Failure::failed)?;
    let earlier = settings::interrupted(job, &settings).map_err(Failure::bad_input)?;
    let entries = job.entrants.iter().map(|entrant| {
        Entry::find(entrant, &job.scene, &ground, &job.parameters_of(entrant, &parameters))
    });
    let entries = entries.collect::<Result<_>>().map_err(Failure::bad_input)?;
    let field = Field { job, ground, parameters, entries, scene_hash, settings, earlier };
    compete(field, &stage.interrupt)
}

fn compete(mut field: Field, interrupt: &Interrupt) -> Result<(), Failure> {
    let job = field.job;
    job.folder.make().map_err(Failure::failed)?;
    let tell = teller(job.quiet);
    announce(&field, tell);

    let media = field.ground.scene.lend(job.sensor).map_err(Failure::failed)?;
    let media = media.scene().description().media.clone();
    let (ground, scene_hash, parameters) = (field.ground, field.scene_hash, &field.parameters);
    let subject = Subject { ground, scene_hash, media: &media, parameters: parameters.clone() };
    let obtained = reference::obtain(job, &subject, interrupt, tell).map_err(Failure::failed)?;
    let Some((picture, reference)) = obtained else { return Err(nothing_measured()) };
    let judge = Judge::new(picture.clone());

    let earlier = field.earlier.take();
    let goes_on = earlier.is_some();
    let results = blank(&field, reference, !media.is_empty());
    let ledger = Ledger::open(&job.folder, results, picture, earlier);
    let mut ledger = ledger.map_err(Failure::failed)?;
    if goes_on {
        tell(&take_over(&mut ledger, &field));
    }
    for seed in 0..job.seeds {
        race(&field, seed, &judge, interrupt, &mut ledger, tell).map_err(Failure::failed)?;
        if interrupt.requested() {
            break;
        }
        ledger.report().map_err(Failure::failed)?;
    }
    ledger.results.interrupted = interrupt.requested();
    conclude(job, &mut ledger)
}

/// Notes that the comparison goes on, and says with what.
fn take_over(ledger: &mut Ledger, field: &Field) -> String {
    let (done, all) = (ledger.complete_runs(), field.entries.len() * field.job.seeds as usize);
    ledger.results.notes.push(
        "the comparison was interrupted and went on; the runs that were under way began again"
            .to_owned(),
    );
    format!(
        "going on with the interrupted comparison in \"{}\": {done} of {all} runs are complete, the others \
         begin again (--restart would forget them all)",
        field.job.folder.path().display()
    )
}

fn nothing_measured() -> Failure {
    Failure::aborted(anyhow!(
        "stopped by Ctrl-C before any method was measured, so there is no report"
    ))
}

fn announce(field: &Field, tell: impl Fn(&str)) {
    let Field { job, ground: Ground { session, scene, size: [width, height], .. }, .. } = field;
    for note in scene.notes().iter().filter(|_| job.verbosity > 0) {
        tell(&format!("note: {note}"));
    }
    let (methods, seeds) = (job.entrants.len(), job.seeds);
    let total = methods as f64 * f64::from(seeds) * job.time;
    tell(&format!(
        "comparing {methods} methods on \"{}\", {width} x {height} pixels, with {}: {} in all, without the \
         reference",
        job.scene.path.display(),
        session.variant(),
        text::seconds(total)
    ));
}

/// The results before anything was measured.
fn blank(field: &Field, reference: Reference, has_media: bool) -> Comparison {
    let methods = field.entries.iter().map(|entry| results::Method {
        name: entry.entrant.name.clone(),
        variant: entry.entrant.variant.clone(),
        ours: entry.ours(),
        flaw: entry.flaw(has_media),
        shares_reference: shares_estimator(entry, &reference),
        runs: Vec::new(),
    });
    Comparison {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        scene: field.job.scene.path.display().to_string(),
        variant: field.ground.session.variant().to_owned(),
        film_size: field.ground.size,
        seconds: field.job.time,
        seeds: field.job.seeds,
        settings: field.settings.clone(),
        interrupted: true,
        peak_memory_bytes: memory::peak(),
        methods: methods.collect(),
        reference,
        notes: Vec::new(),
    }
}

/// Whether the reference was rendered by the same integrator, or both by methods of vpt, which share walks and kernels.
fn shares_estimator(entry: &Entry, reference: &Reference) -> bool {
    reference.estimator.as_ref().is_some_and(|estimator| {
        *estimator == entry.entrant.integrator
            || (entry.ours() && estimator.parse::<Method>().is_ok())
    })
}

/// All entries side by side with one seed, but for those whose run the ledger holds.
fn race<'a>(
    field: &'a Field,
    seed: u32,
    judge: &Judge,
    interrupt: &Interrupt,
    ledger: &mut Ledger<'a>,
    tell: impl Fn(&str) + 'a,
) -> Result<()> {
    let Field { job, ground, .. } = field;
    let due = field.entries.iter().enumerate();
    let due: Vec<(usize, &Entry)> = due.filter(|(index, _)| !ledger.holds(*index, seed)).collect();
    let preparations = due.iter().map(|(_, entry)| entry.prepare(ground, seed));
    let preparations: Vec<Option<Preparation>> = preparations.collect::<Result<_>>()?;
    let mut lanes = Vec::new();
    for (&(index, entry), preparation) in due.iter().zip(&preparations) {
        let (contestant, spent) = entry.contestant(ground, preparation.as_ref(), seed, job.time)?;
        lanes.push(Lane::new(index, contestant, seed, spent));
    }
    let total = job.time * lanes.len() as f64;
    let mut tenths = 0;
    ledger.tell_progress(move |used| {
        let now = (10.0 * used / total) as u32;
        if now > tenths {
            tenths = now;
            let (used, total) = (text::seconds(used), text::seconds(total));
            tell(&format!("seed {} of {}: {used} of {total}", seed + 1, job.seeds));
        }
    });
    take_turns(&mut lanes, job.time, judge, interrupt, ledger)
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

fn conclude(job: &CompareJob, ledger: &mut Ledger) -> Result<(), Failure> {
    if ledger.is_blank() {
        return Err(nothing_measured());
    }
    let results = &mut ledger.results;
    results.peak_memory_bytes = results.peak_memory_bytes.max(memory::peak());
    results.notes.extend(slow_steps(results));
    results.notes.extend(noise_of_reference_matters(results));
    ledger.report().map_err(Failure::failed)?;
    let results = &ledger.results;
    for note in &results.notes {
        say(&format!("warning: {note}"));
    }
    if results.interrupted && !job.quiet {
        say("note: stopped by Ctrl-C; the report holds what was measured until then, and the same command goes on");
    }
    if job.quiet {
        return Ok(());
    }
    print_result(&table(results, &summarize(results)))?;
    print_result(&format!("wrote \"{}\"", job.folder.path().join("report.html").display()))
}
