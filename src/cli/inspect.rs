//! Says what a scene calls for.

use super::arguments::InspectArguments;
use super::failure::Failure;
use super::job::{
    check_method, check_pairs, check_scene, check_sensor, check_settings, check_variant,
    checked_effects, JobError,
};
use super::{print_result, say, text};
use serde::Serialize;
use vpt::host::session::{SceneFile, Session};
use vpt::method::{self, EffectReport, Inspection, Parameters, Work};
use vpt::plan::Finding;

/// Names of objects that are listed before the others are only counted.
const LISTED: usize = 4;

/// An inspection whose arguments were checked as far as that goes without loading the scene.
pub struct InspectJob {
    scene: SceneFile,
    json: bool,
    variant: Option<String>,
    sensor: usize,
    verbosity: u8,
}

impl InspectJob {
    pub fn new(arguments: InspectArguments) -> Result<Self, JobError> {
        check_scene(&arguments.scene)?;
        check_pairs("-D", &arguments.defines)?;
        check_pairs("--set", &arguments.settings)?;
        check_settings(&arguments.settings)?;
        check_method(arguments.method.as_deref())?;
        if let Some(variant) = &arguments.variant {
            check_variant(variant)?;
        }
        let mut settings = arguments.settings;
        settings.extend(checked_effects(arguments.effects)?);
        Ok(InspectJob {
            scene: SceneFile {
                path: arguments.scene,
                defines: arguments.defines,
                method: arguments.method,
                timeout: None,
                settings,
            },
            json: arguments.json,
            variant: arguments.variant,
            sensor: arguments.sensor,
            verbosity: arguments.verbose,
        })
    }
}

/// Loads the scene, probes it, prints.
pub fn run(job: &InspectJob) -> Result<(), Failure> {
    let session =
        Session::start(job.variant.as_deref(), None, job.verbosity).map_err(Failure::failed)?;
    let scene = session.load(&job.scene).map_err(Failure::bad_input)?;
    check_sensor(job.sensor, scene.sensor_count(), &job.scene.path).map_err(Failure::bad_input)?;
    for note in scene.notes() {
        say(&format!("note: {note}"));
    }
    let parameters = scene.parameters(job.sensor).map_err(Failure::bad_input)?;
    let lent = scene.lend(job.sensor).map_err(Failure::failed)?;
    let inspection = method::inspect(lent.scene(), &parameters).map_err(Failure::bad_input)?;
    let report =
        Report::new(job, session.variant(), scene.film_size(job.sensor), &inspection, parameters);
    for warning in report.warnings {
        say(&format!("warning: {warning}"));
    }
    if job.json {
        let json = serde_json::to_string_pretty(&report).map_err(Failure::failed)?;
        print_result(&json)
    } else {
        report.lines().iter().try_for_each(|line| print_result(line))
    }
}

/// What was found out.
#[derive(Debug, Serialize)]
struct Report<'a> {
    version: &'static str,
    scene: String,
    variant: &'a str,
    film_size: [u32; 2],
    parameters: Parameters,
    effects: Vec<Line<'a>>,
    /// Wall time of the probes [s].
    probe: Probe,
    warnings: &'a [String],
}

#[derive(Debug, Serialize)]
struct Probe {
    photons: u64,
    seconds: f64,
    seconds_with_all_effects: f64,
}

/// An effect, and its work per jitter of the view rays and per pass of photons.
#[derive(Debug, Serialize)]
struct Line<'a> {
    #[serde(flatten)]
    finding: &'a Finding,
    unit: &'static str,
    cost: Cost,
    /// With all effects forced on.
    cost_if_forced: Cost,
}

#[derive(Debug, Clone, Copy, Serialize)]
struct Cost {
    per_jitter: f64,
    per_pass: f64,
}

impl Cost {
    fn new(work: Work, pass_over_probe: f64) -> Self {
        Cost { per_jitter: work.view as f64, per_pass: work.photons as f64 * pass_over_probe }
    }

    /// None where nothing is done.
    fn text(self, unit: &str) -> Option<String> {
        let part = |work: f64, per: &str| {
            (work > 0.0).then(|| format!("{} {unit} per {per}", text::count(work)))
        };
        let parts = [part(self.per_jitter, "jitter"), part(self.per_pass, "pass")];
        let parts: Vec<String> = parts.into_iter().flatten().collect();
        (!parts.is_empty()).then(|| parts.join(" and "))
    }
}

impl<'a> Report<'a> {
    fn new(
        job: &InspectJob,
        variant: &'a str,
        film_size: [u32; 2],
        inspection: &'a Inspection,
        parameters: Parameters,
    ) -> Self {
        let Inspection { called_for, forced, pass_over_probe } = inspection;
        let line = |(report, forced): (&'a EffectReport, &EffectReport)| {
            let cost = |report: &EffectReport| Cost::new(report.work, *pass_over_probe);
            let (finding, unit) = (&report.finding, report.unit);
            Line { finding, unit, cost: cost(report), cost_if_forced: cost(forced) }
        };
        Report {
            version: env!("CARGO_PKG_VERSION"),
            scene: job.scene.path.display().to_string(),
            variant,
            film_size,
            parameters,
            effects: called_for.effects.iter().zip(&forced.effects).map(line).collect(),
            probe: Probe {
                photons: called_for.parameters.photons,
                seconds: called_for.seconds,
                seconds_with_all_effects: forced.seconds,
            },
            warnings: &called_for.warnings,
        }
    }

    /// For people.
    fn lines(&self) -> Vec<String> {
        let [width, height] = self.film_size;
        let Probe { photons, seconds, seconds_with_all_effects } = self.probe;
        let mut lines = vec![format!(
            "{}: method {}, {width} x {height} pixels, {}",
            self.scene,
            self.parameters.method.name(),
            self.variant
        )];
        lines.extend(self.effects.iter().map(Line::text));
        lines.push(format!(
            "A probe with {} photons took {}; with all effects forced on it took {}.",
            text::count(photons as f64),
            text::seconds(seconds),
            text::seconds(seconds_with_all_effects)
        ));
        lines
    }
}

impl Line<'_> {
    fn text(&self) -> String {
        let Line { finding, unit, cost, cost_if_forced } = self;
        let (state, cost) = match (finding.on, finding.forced) {
            (false, _) => {
                let forced = cost_if_forced.text(unit).map(|cost| format!("; forced: {cost}"));
                ("off", forced)
            }
            (true, false) => ("on", cost.text(unit).map(|cost| format!("; {cost}"))),
            (true, true) => ("forced", cost.text(unit).map(|cost| format!("; {cost}"))),
        };
        format!(
            "  {state:<6} {:<21} {}{}{}",
            finding.effect.name(),
            finding.reason,
            listed(&finding.names),
            cost.unwrap_or_default()
        )
    }
}

/// ` (a, b x3, c, d and 3 more)`: objects of the same name are counted.
fn listed(names: &[String]) -> String {
    let mut kinds: Vec<(&str, usize)> = Vec::new();
    for name in names {
        match kinds.iter_mut().find(|(kind, _)| kind == name) {
            Some((_, count)) => *count += 1,
            None => kinds.push((name, 1)),
        }
    }
    let counted = |&(kind, count): &(&str, usize)| match count {
        1 => kind.to_owned(),
        more => format!("{kind} x{more}"),
    };
    let shown: Vec<String> = kinds.iter().take(LISTED).map(counted).collect();
    match (kinds.len(), kinds.len().saturating_sub(LISTED)) {
        (0, _) => String::new(),
        (_, 0) => format!(" ({})", shown.join(", ")),
        (_, more) => format!(" ({} and {more} more)", shown.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_lists_are_cut_and_names_counted() {
        let names: Vec<String> = (0..6).map(|i| format!("s{i}")).collect();
        assert_eq!(listed(&names), " (s0, s1, s2, s3 and 2 more)");
        let names = ["wall", "Cube", "wall"].map(str::to_owned);
        assert_eq!(listed(&names), " (wall x2, Cube)");
        assert_eq!(listed(&[]), "");
    }
}
