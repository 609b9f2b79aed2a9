//! What a render says before and after its passes.

use super::failure::Failure;
use super::job::RenderJob;
use super::progress::Display;
use super::statistics::Ending;
use super::{print_result, say, text};
use anyhow::anyhow;
use std::io::IsTerminal;
use vpt::host::session::{LoadedScene, Session};
use vpt::method::Stats;

/// A bar where a terminal shows it and Mitsuba's log does not tear it.
pub fn display(job: &RenderJob) -> Display {
    if job.quiet {
        Display::Nothing
    } else if job.verbosity == 0 && std::io::stderr().is_terminal() {
        Display::bar()
    } else {
        Display::Lines
    }
}

/// Says what is about to be rendered.
pub fn announce(job: &RenderJob, session: &Session, scene: &LoadedScene, display: &Display) {
    for note in scene.notes() {
        display.say(&format!("note: {note}"));
    }
    let [width, height] = scene.film_size(job.sensor);
    display.say(&format!(
        "rendering \"{}\" to \"{}\", {width} x {height} pixels, with {}",
        job.scene.path.display(),
        job.picture.path().display(),
        session.variant()
    ));
}

/// What ended a render early.
pub fn cause(ending: Ending) -> Option<&'static str> {
    match ending {
        Ending::Complete | Ending::Accuracy => None,
        Ending::Interrupt => Some("Ctrl-C"),
        Ending::Timeout => Some("the timeout"),
    }
}

/// A render that ended before its first pass was done.
pub fn no_picture(ending: Ending) -> Failure {
    match ending {
        Ending::Interrupt => Failure::aborted(anyhow!(
            "stopped by Ctrl-C before the first pass was done, so there is no picture"
        )),
        _ => Failure::failed(anyhow!(
            "the render ended before its first pass was done, so there is no picture; allow more \
             time with --timeout"
        )),
    }
}

/// Prints the warnings, and the line that sums the render up.
pub fn conclude(job: &RenderJob, stats: &Stats) -> Result<(), Failure> {
    for warning in &stats.warnings {
        say(&format!("warning: {warning}"));
    }
    if job.quiet {
        return Ok(());
    }
    let plural = if stats.passes == 1 { "pass" } else { "passes" };
    print_result(&format!(
        "wrote \"{}\": {} {plural} of {} photons in {}{}",
        job.picture.path().display(),
        stats.passes,
        text::count(stats.parameters.photons as f64),
        text::seconds(stats.seconds),
        stats.estimated_error.map_or(String::new(), |error| {
            format!(", about {} off", text::percent(error.relative))
        })
    ))
}
