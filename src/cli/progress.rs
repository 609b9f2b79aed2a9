//! Shows how a render gets on: a bar on a terminal, a few plain lines elsewhere.

use super::goal::{Goal, OPEN_PASSES};
use super::interrupt::Interrupt;
use super::{say, text};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::ops::ControlFlow;
use std::time::Duration;
use vpt::markov::{FamilyReport, Mode};
use vpt::method::{ErrorEstimate, FilmSoFar, Observer, Progress};

/// What is shown.
#[derive(Debug, Clone)]
pub enum Display {
    /// One line that is drawn again and again.
    Bar(ProgressBar),
    /// A line at the start and about every tenth of the work.
    Lines,
    Nothing,
}

impl Display {
    /// A bar on stderr, which appears with the first progress.
    pub fn bar() -> Self {
        let style = ProgressStyle::with_template("[{bar:16}] {pos}/{len} passes, {elapsed}{msg}")
            .expect("the template is a constant");
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
        bar.set_style(style.progress_chars("=> "));
        Display::Bar(bar)
    }

    /// Of a bar that does not know where it ends.
    fn open_style() -> ProgressStyle {
        ProgressStyle::with_template("{pos} passes, {elapsed}{msg}")
            .expect("the template is a constant")
    }

    /// Prints a line without tearing the bar.
    pub fn say(&self, line: &str) {
        match self {
            Display::Bar(bar) if bar.length().is_some() => bar.suspend(|| say(line)),
            Display::Bar(_) | Display::Lines => say(line),
            Display::Nothing => {}
        }
    }

    /// Prints a line that is told to those who want quiet, too.
    pub fn warn(&self, line: &str) {
        match self {
            Display::Nothing => say(line),
            Display::Bar(_) | Display::Lines => self.say(line),
        }
    }

    /// Takes the bar away.
    pub fn finish(&self) {
        if let Display::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}

/// Shows the progress of a render and ends it when the user asks for that.
pub struct Reporter {
    display: Display,
    interrupt: Interrupt,
    goal: Goal,
    /// Tenths of the work for which a line was printed.
    tenths: u32,
    /// Passes asked for, once the render said so.
    passes: u32,
    error: Option<ErrorEstimate>,
}

impl Reporter {
    pub fn new(display: Display, interrupt: Interrupt, goal: Goal) -> Self {
        Reporter { display, interrupt, goal, tenths: 0, passes: 0, error: None }
    }

    /// Whether the error aimed at was reached.
    pub fn is_accurate(&self) -> bool {
        let target = self.goal.target_error;
        target.is_some_and(|target| self.error.is_some_and(|error| error.reaches(target)))
    }

    /// Passes asked for; 0 before the render began.
    pub fn passes(&self) -> u32 {
        self.passes
    }

    fn show(&mut self, progress: &Progress) {
        if progress.passes_done == 0 {
            let radii = progress.radii;
            self.display.say(&format!(
                "radii of the first pass: {:.3e} on surfaces, {:.3e} in media",
                radii.surface, radii.medium
            ));
        }
        match &self.display {
            Display::Bar(bar) => {
                let first = bar.length().is_none();
                bar.set_message(details(progress, &self.goal));
                if progress.passes != OPEN_PASSES {
                    bar.set_length(progress.passes.into());
                } else if first {
                    bar.set_style(Display::open_style());
                    bar.set_length(0);
                }
                bar.set_position(progress.passes_done.into());
                if first {
                    // A pass can be long: the clock runs on meanwhile.
                    bar.enable_steady_tick(Duration::from_millis(250));
                }
            }
            Display::Lines => {
                let tenths = (self.goal.share_done(progress) * 10.0) as u32;
                if tenths > self.tenths {
                    self.tenths = tenths;
                    say(&line(progress, &self.goal));
                }
            }
            Display::Nothing => {}
        }
    }
}

impl Observer for Reporter {
    fn progress(&mut self, progress: &Progress, _: &dyn FilmSoFar) -> ControlFlow<()> {
        self.passes = progress.passes;
        self.error = progress.error;
        self.show(progress);
        if self.interrupt.requested() {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }
}

/// `, about 2.1 % off, 1 % in about 3 min 0 s, 12 s left, timeout 60 s, 1.20 M photons/s, radii 1.00e-2
/// surface, 2.00e-2 medium`
fn details(progress: &Progress, goal: &Goal) -> String {
    let mut parts = vec![String::new()];
    parts
        .extend(progress.error.map(|error| format!("about {} off", text::percent(error.relative))));
    parts.extend(goal.next_mark(progress).map(|(mark, seconds)| {
        format!("{} in about {}", text::percent(mark), text::about(seconds))
    }));
    if let Some(left) = goal.seconds_left(progress) {
        parts.push(format!("{} left", text::seconds(left)));
    }
    if let Some(timeout) = goal.timeout {
        parts.push(format!("timeout {}", text::seconds(timeout)));
    }
    if progress.seconds > 0.0 && progress.walks > 0 {
        let rate = progress.walks as f64 / progress.seconds;
        parts.push(format!("{} photons/s", text::count(rate)));
    }
    parts.push(format!("radii {} surface", text::length(progress.radii.surface)));
    parts.push(format!("{} medium", text::length(progress.radii.medium)));
    if progress.first_pass > 0 {
        let first = progress.first_pass;
        let end = u64::from(first) + u64::from(progress.passes);
        parts.push(match progress.passes {
            OPEN_PASSES => format!("passes from {first} on"),
            _ => format!("passes {first}..{end}"),
        });
    }
    parts.extend(shooting("surfaces", &progress.shooting.surface));
    parts.extend(shooting("media", &progress.shooting.medium));
    parts.join(", ")
}

/// `media by chains (0.12 % visible, 23 % accepted)`; nothing where a method does not measure.
fn shooting(family: &str, report: &FamilyReport) -> Option<String> {
    let visible = text::percent(report.visible_share);
    match report.mode {
        Mode::Off => None,
        Mode::Uniform => Some(format!("{family} uniformly ({visible} visible)")),
        Mode::Metropolis => {
            let accepted = text::percent(report.acceptance);
            Some(format!("{family} by chains ({visible} visible, {accepted} accepted)"))
        }
    }
}

/// The line of plain progress after a pass.
fn line(progress: &Progress, goal: &Goal) -> String {
    let Progress { passes_done, passes, .. } = *progress;
    let of = if passes != OPEN_PASSES { format!(" of {passes}") } else { String::new() };
    let seconds = text::seconds(progress.seconds);
    format!("pass {passes_done}{of}, {seconds}{}", details(progress, goal))
}

#[cfg(test)]
mod tests {
    use super::*;
    use vpt::density::radius::Radii;
    use vpt::film::FilmSums;
    use vpt::method::RenderError;
    use vpt::transport::photon::PerFamily;

    fn progress(passes_done: u32, seconds: f64) -> Progress {
        let radii = Radii { surface: 0.01, medium: 0.02 };
        let walks = u64::from(passes_done) * 1_000_000;
        let shooting = PerFamily::default();
        Progress {
            first_pass: 0,
            passes_done,
            passes: 20,
            walks,
            radii,
            seconds,
            seconds_before: 0.0,
            shooting,
            error: None,
        }
    }

    #[test]
    fn line_says_everything() {
        assert_eq!(
            line(&progress(5, 2.5), &Goal { timeout: Some(60.0), target_error: None }),
            "pass 5 of 20, 2.50 s, 7.50 s left, timeout 1 min 0 s, 2.00 M photons/s, \
             radii 1.00e-2 surface, 2.00e-2 medium"
        );
    }

    #[test]
    fn line_says_how_accurate_the_picture_is() {
        let error = ErrorEstimate {
            relative: 0.0212,
            noise: 0.0212,
            noise_decay: 1.0,
            jitters: 4,
            ..ErrorEstimate::default()
        };
        let progress = Progress { error: Some(error), passes: OPEN_PASSES, ..progress(5, 50.0) };
        let line = line(&progress, &Goal { timeout: None, target_error: Some(0.01) });
        assert!(
            line.starts_with(
                "pass 5, 50 s, about 2.1 % off, 1.0 % in about 3 min, 2 min 55 s left,"
            ),
            "{line}"
        );
    }

    #[test]
    fn line_says_how_photons_are_shot() {
        let uniform =
            FamilyReport { mode: Mode::Uniform, visible_share: 0.341, ..Default::default() };
        let chains = FamilyReport {
            mode: Mode::Metropolis,
            visible_share: 0.00123,
            acceptance: 0.2345,
            ..Default::default()
        };
        let shooting = PerFamily { surface: uniform, medium: chains };
        let line = line(&Progress { shooting, ..progress(5, 2.5) }, &Goal::default());
        assert!(
            line.ends_with(
                ", surfaces uniformly (34 % visible), media by chains (0.12 % visible, 23 % accepted)"
            ),
            "{line}"
        );
    }

    struct NoFilm;

    impl FilmSoFar for NoFilm {
        fn film(&self) -> Result<FilmSums, RenderError> {
            unreachable!("nobody asks for it")
        }
    }

    #[test]
    fn reporter_ends_the_render_when_asked() {
        let interrupt = Interrupt::default();
        let mut reporter = Reporter::new(Display::Nothing, interrupt.clone(), Goal::default());
        assert_eq!(reporter.progress(&progress(0, 0.0), &NoFilm), ControlFlow::Continue(()));
        assert_eq!(reporter.passes(), 20);
        interrupt.request();
        assert_eq!(reporter.progress(&progress(1, 1.0), &NoFilm), ControlFlow::Break(()));
    }
}
