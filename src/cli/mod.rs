//! The command line: argv → plain [`arguments`] → a validated job → its run → an exit code.
//!
//! | exit code | meaning |
//! |---|---|
//! | 0 | done; also when Ctrl-C or the timeout ended the work early and what was done is written |
//! | 1 | the work failed: rendering, reading or writing |
//! | 2 | bad usage or bad input: the arguments or the scene must be mended |
//! | 130 | aborted by Ctrl-C: a second one, or one before the first pass was done |
//!
//! Everything that the program has to say goes to stderr, except for results: the line that sums a
//! render up, what a scene calls for, metrics, the table of a comparison, what it says of the paper's claims, the table of the
//! self-test, the folder of `plugin-dir`, and the script of `completions`.

mod arguments;
#[cfg(test)]
mod bench;
mod cache;
mod checkpoint;
mod compare;
mod failure;
mod gather;
mod goal;
mod inspect;
mod interrupt;
mod job;
mod live;
mod manual;
mod memory;
mod merge;
mod metadata;
mod metrics;
mod notices;
mod plugin_dir;
mod progress;
mod reproduce;
mod run;
mod selftest;
mod statistics;
mod target;
mod tev;
mod text;

use arguments::{Arguments, Command};
use clap::Parser;
use compare::CompareJob;
use failure::Failure;
use inspect::InspectJob;
use job::RenderJob;
use reproduce::ReproduceJob;
use selftest::SelftestJob;
use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;

/// Runs the program with the given arguments (the first is its name).
pub fn main(argv: impl Iterator<Item = OsString>) -> ExitCode {
    let arguments = match Arguments::try_parse_from(argv) {
        Ok(arguments) => arguments,
        Err(answer) => return print_usage(&answer),
    };
    match dispatch(arguments.command) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            say(&format!("error: {}", failure.message()));
            failure.exit_code()
        }
    }
}

fn dispatch(command: Command) -> Result<(), Failure> {
    match command {
        Command::Render(arguments) => {
            let job = RenderJob::new(arguments).map_err(Failure::bad_input)?;
            run::render(&job)
        }
        Command::Inspect(arguments) => {
            let job = InspectJob::new(arguments).map_err(Failure::bad_input)?;
            inspect::run(&job)
        }
        Command::Compare(arguments) => {
            let job = CompareJob::new(arguments).map_err(Failure::bad_input)?;
            compare::run(&job)
        }
        Command::Reproduce(arguments) => {
            let job = ReproduceJob::new(arguments).map_err(Failure::bad_input)?;
            reproduce::run(&job)
        }
        Command::Selftest(arguments) => {
            let job = SelftestJob::new(arguments).map_err(Failure::bad_input)?;
            selftest::run(&job)
        }
        Command::Metrics(arguments) => metrics::run(&arguments),
        Command::Contestant => compare::serve(),
        Command::Merge(arguments) => merge::run(&arguments),
        Command::PluginDir(arguments) => plugin_dir::run(&arguments),
        Command::Completions(arguments) => manual::print_completions(&arguments),
        Command::Man(arguments) => manual::write_pages(&arguments),
    }
}

/// Prints what the parser of arguments answers: help and version on stdout, mistakes on stderr.
fn print_usage(answer: &clap::Error) -> ExitCode {
    match answer.print() {
        Ok(()) if !answer.use_stderr() => ExitCode::SUCCESS,
        Ok(()) => ExitCode::from(failure::BAD_INPUT),
        Err(_) => ExitCode::from(failure::FAILED),
    }
}

/// Prints a line on stderr. A stderr that nobody reads is no reason to stop.
fn say(line: &str) {
    let _ = writeln!(std::io::stderr(), "{line}");
}

/// Prints lines on stderr unless the user wants quiet.
fn teller(quiet: bool) -> impl Fn(&str) + Copy {
    move |line| {
        if !quiet {
            say(line);
        }
    }
}

/// Prints a line of results on stdout.
fn print_result(line: &str) -> Result<(), Failure> {
    writeln!(std::io::stdout(), "{line}")
        .map_err(|e| Failure::failed(anyhow::Error::new(e).context("cannot write to stdout")))
}
