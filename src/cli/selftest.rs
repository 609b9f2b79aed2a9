//! `vpt selftest`: extreme scenes whose answer is known, rendered where the program is installed.

use super::arguments::SelftestArguments;
use super::failure::{Failure, FAILED};
use super::job::{check_variant, JobError};
use super::target::{Target, TargetError};
use super::{print_result, say, text};
use anyhow::anyhow;
use serde::Serialize;
use std::sync::Arc;
use vpt::selftest::{self, Bench, Case, Reading, SelftestError, Verdict};

/// A choice of cases that was checked.
pub struct SelftestJob {
    cases: Vec<Case>,
    list: bool,
    json: Option<Target>,
    variant: Option<String>,
    threads: Option<usize>,
    quiet: bool,
}

/// A mistake in the arguments, with the mend.
#[derive(Debug, thiserror::Error)]
pub enum SelftestJobError {
    #[error("there is no case \"{0}\"; vpt selftest --list names them all")]
    UnknownCase(String),
    #[error("the verdicts (--json) cannot be written")]
    Unwritable(#[source] TargetError),
    #[error(transparent)]
    Variant(#[from] JobError),
}

impl SelftestJob {
    pub fn new(arguments: SelftestArguments) -> Result<Self, SelftestJobError> {
        if let Some(variant) = &arguments.variant {
            check_variant(variant)?;
        }
        let json = arguments.json.map(Target::check).transpose();
        Ok(SelftestJob {
            cases: choose(&arguments.names)?,
            list: arguments.list,
            json: json.map_err(SelftestJobError::Unwritable)?,
            variant: arguments.variant,
            threads: arguments.threads,
            quiet: arguments.quiet,
        })
    }
}

/// The cases of these names, or all of them.
fn choose(names: &[String]) -> Result<Vec<Case>, SelftestJobError> {
    let table = selftest::table();
    if names.is_empty() {
        return Ok(table);
    }
    let find = |name: &String| table.iter().find(|case| case.name == name).copied();
    names
        .iter()
        .map(|name| find(name).ok_or_else(|| SelftestJobError::UnknownCase(name.clone())))
        .collect()
}

/// Runs the cases one after the other, and fails if one of them does.
pub fn run(job: &SelftestJob) -> Result<(), Failure> {
    if job.list {
        return job.cases.iter().try_for_each(|case| print_result(&listed(case)));
    }
    let bench = Bench::new(job.variant.clone(), job.threads).map_err(Failure::failed)?;
    let bench = Arc::new(bench);
    if !job.quiet {
        print_result(&heading())?;
    }
    let mut verdicts = Vec::new();
    for case in &job.cases {
        let verdict = match selftest::run(case, &bench) {
            Err(error @ SelftestError::Hangs(_)) => {
                say(&format!("error: {}", broken(case, error).message()));
                vpt::host::leave_at_once(FAILED)
            }
            verdict => verdict.map_err(|error| broken(case, error))?,
        };
        tell(&verdict, job.quiet)?;
        verdicts.push(verdict);
    }
    if let Some(target) = &job.json {
        write(target, &verdicts).map_err(Failure::failed)?;
    }
    let failed = verdicts.iter().filter(|verdict| !verdict.passed()).count();
    match failed {
        0 => Ok(()),
        _ => Err(Failure::failed(anyhow!("{failed} of {} cases failed", verdicts.len()))),
    }
}

fn listed(case: &Case) -> String {
    format!("{:<20} {}", case.name, case.claim)
}

fn broken(case: &Case, error: SelftestError) -> Failure {
    Failure::failed(anyhow::Error::new(error).context(format!("the case \"{}\" failed", case.name)))
}

fn heading() -> String {
    format!(
        "{:<20} {:<28} {:>11} {:>11} {:>6} {:>8} {:>7}",
        "case", "its worst reading", "expected", "measured", "z", "dropped", "seconds"
    )
}

/// One line for a case; where it failed, one for each fault too.
fn tell(verdict: &Verdict, quiet: bool) -> Result<(), Failure> {
    if let (Some(worst), false) = (verdict.worst(), quiet) {
        print_result(&line(verdict, worst))?;
    }
    if !verdict.passed() {
        say(&format!("{}: {}", verdict.name, verdict.claim));
    }
    for reading in verdict.faults() {
        let (what, fault) = (&reading.what, reading.fault.as_deref().unwrap_or_default());
        let Reading { expected, measured, .. } = reading;
        say(&format!("    {what}: {measured:.5e} instead of {expected:.5e}: {fault}"));
    }
    Ok(())
}

fn line(verdict: &Verdict, worst: &Reading) -> String {
    format!(
        "{:<20} {:<28} {:>11.4e} {:>11.4e} {:>6.1} {:>8} {:>7.2} {}",
        verdict.name,
        worst.what,
        worst.expected,
        worst.measured,
        worst.z,
        text::percent(worst.dropped),
        verdict.seconds,
        if verdict.passed() { "ok" } else { "FAILED" }
    )
}

/// Everything that was read, for programs.
fn write(target: &Target, verdicts: &[Verdict]) -> anyhow::Result<()> {
    #[derive(Serialize)]
    struct Report<'a> {
        version: &'a str,
        cases: &'a [Verdict],
    }
    let report = Report { version: env!("CARGO_PKG_VERSION"), cases: verdicts };
    let text = serde_json::to_string_pretty(&report)?;
    target.replace(|aside| Ok(std::fs::write(aside, text)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_choose_cases_and_mistakes_name_the_list() {
        assert_eq!(choose(&[]).unwrap().len(), selftest::table().len());
        let chosen = choose(&["scaled".to_owned()]).unwrap();
        assert_eq!(chosen.iter().map(|case| case.name).collect::<Vec<_>>(), ["scaled"]);
        let Err(error) = choose(&["scale".to_owned()]) else { panic!("it is no case") };
        assert!(error.to_string().contains("--list"), "{error}");
    }
}
